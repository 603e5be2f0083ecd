"""A self-contained HTML page: styles and pictures inside, nothing loaded from elsewhere."""

import base64
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from validation.harness.files import write_text
from validation.harness.provenance import provenance
from validation.harness.tables import heading, rounded, table_of, write_table
from validation.harness.uncertainty import two_digits, with_error

LARGEST_VECTOR = 1_000_000
"""Largest SVG, in bytes, that a page holds instead of a PNG; larger ones are slow to show."""


def inline(path: Path) -> str:
    """A picture as a data URI: the SVG beside the PNG if that is small, as for lines."""
    drawn = path.with_suffix(".svg")
    vector = drawn.is_file() and drawn.stat().st_size <= LARGEST_VECTOR
    kind, data = ("svg+xml", drawn.read_bytes()) if vector else ("png", path.read_bytes())
    return f"data:image/{kind};base64,{base64.b64encode(data).decode('ascii')}"


def signed(value: float | None, digits: int = 1) -> str:
    """A percentage with its sign; a dash for None."""
    if value is None:
        return "–"
    rounded_value = round(value, digits) + 0.0  # no -0.0
    return f"{rounded_value:+.{digits}f} %".replace("-", "\N{MINUS SIGN}")


def above_or_below(percent: float) -> str:
    """A percentage for a sentence: ``4.0 % above``."""
    return f"{abs(percent):.1f} % {'above' if percent > 0 else 'below'}"


def opening(name: str) -> str:
    """A scene's name with its first letter in upper case, to begin a sentence."""
    return name[:1].upper() + name[1:]


def number(value: Any, column: str = "") -> str:
    """A number as in that column of a table; a dash if there is none."""
    return rounded(value, column) or "–"


def worded(rows: Sequence[Mapping[str, Any]], columns: Sequence[str]) -> list[str]:
    """Columns that hold words: these are aligned left, numbers right."""
    return [name for name in columns if any(str(row.get(name) or "")[:1].isalpha() for row in rows)]


def bar(value: float | None, error: float | None) -> str:
    """A number with its error; rounded as by `number` if no error is stated."""
    if value is None or error is None:
        return number(value)
    return with_error(value, error).replace("+-", "\N{PLUS-MINUS SIGN}")


def section(
    folder: Path,
    title: str,
    name: str = "",
    rows: Sequence[Mapping[str, Any]] = (),
    notes: Sequence[str] = (),
    figures: Sequence[Path] = (),
) -> dict[str, Any]:
    """A section of ``sections.html.j2``; a table with a name is written to files too."""
    if name:
        write_table(folder, name, table_of(rows), title)
    columns = list(dict.fromkeys(column for row in rows for column in row))
    tables = [{"name": name, "rows": rows, "columns": columns}] if rows else []
    return {"title": title, "notes": notes, "figures": figures, "tables": tables}


def write_page(path: Path, template: str, context: Mapping[str, Any]) -> None:
    """Fill a template of ``templates`` and write it atomically.

    It extends ``base.html.j2``, whose blocks are the page's sections; `context` has its variables
    but ``provenance``: versions, machine and date.
    """
    import jinja2

    environment = jinja2.Environment(
        loader=jinja2.PackageLoader("validation.harness"),
        autoescape=True,
        undefined=jinja2.StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.filters |= {"inline": inline, "signed": signed, "number": number}
    environment.filters |= {"with_error": bar, "two_digits": two_digits}
    environment.filters |= {"worded": worded, "heading": heading}
    write_text(path, environment.get_template(template).render(context, provenance=provenance({})))
