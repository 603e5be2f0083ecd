"""A table as CSV (ten digits, for programs), Markdown and LaTeX (rounded, for people)."""

import math
from collections.abc import Iterable, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Any

import pandas as pd

from validation.harness.files import write_text

LATEX = str.maketrans(  # pandas escapes cells alone
    {mark: f"\\{mark}" for mark in "_%#$&{}"}
    | {"\\": r"\textbackslash{}", "^": r"\textasciicircum{}", "~": r"\textasciitilde{}"}
)


ERRORS = ("_error", "uncertainty", "uncertainty_percent")
"""How the names of columns of errors end."""


def rounded(value: Any, column: str = "") -> str:
    """A number with four significant digits, two if it is an error by the name of its column; a
    text as it is, "" if nothing is known.
    """
    if value is None or (isinstance(value, float) and not math.isfinite(value)):
        return ""
    if isinstance(value, bool) or not isinstance(value, int | float):
        return str(value)
    if column.endswith(ERRORS):
        value = float(f"{value:.2g}")
    if isinstance(value, int) or (value == int(value) and abs(value) < 1e6):
        return f"{value:.0f}"
    return f"{value:.0f}" if 1e4 <= abs(value) < 1e7 else f"{value:.4g}"


def heading(column: str) -> str:
    """A column's name in words; a scene's key, which has a dot, is left as it is."""
    return column if "." in column else column.replace("_", " ")


def for_people(table: pd.DataFrame) -> pd.DataFrame:
    """The table rounded, without columns that are empty throughout."""
    shown = table.dropna(axis="columns", how="all")
    return shown.apply(lambda column: column.map(partial(rounded, column=str(column.name))))


def write_table(
    folder: Path, name: str, table: pd.DataFrame, caption: str, shown: pd.DataFrame | None = None
) -> str:
    """Write ``name.csv``, ``name.md`` and ``name.tex``; returns the Markdown.

    shown : what people see in the latter two; None: the table.
    """
    write_text(folder / f"{name}.csv", table.to_csv(index=False, float_format="%.10g"))
    people = for_people(table if shown is None else shown)
    markdown = f"{caption}\n\n{people.to_markdown(index=False, disable_numparse=True)}\n"
    write_text(folder / f"{name}.md", markdown)
    people.columns = [heading(str(column)) for column in people.columns]
    written, label = caption.translate(LATEX), f"tab:{name}"
    latex = people.to_latex(index=False, escape=True, caption=written, label=label)
    write_text(folder / f"{name}.tex", latex)
    return markdown


def table_of(rows: Iterable[Any], columns: Sequence[str] | None = None) -> pd.DataFrame:
    """Rows, mappings or dataclass instances, as a table of these columns (None: all)."""
    mappings = [row if isinstance(row, Mapping) else vars(row) for row in rows]
    return pd.DataFrame(mappings, columns=columns)
