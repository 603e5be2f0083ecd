"""Reference pages whose facts the code states: commands, scene keys, results, shortcuts.

Each is Markdown under ``reference/generated/``, which no commit holds.
"""

from collections.abc import Iterator
from pathlib import Path
from typing import Any


def cell(text: object) -> str:
    """A table's cell: one line, no bars of its own."""
    return " ".join(str(text).split()).replace("|", r"\|")


def table(head: tuple[str, ...], rows: list[tuple[object, ...]]) -> str:
    """A Markdown table."""
    lines = [head, ("---",) * len(head), *rows]
    return "\n".join("| " + " | ".join(map(cell, line)) + " |" for line in lines)


def commands() -> str:
    """Every command's help, as cyclopts makes it from signatures and docstrings."""
    from validation.cli import app

    text = app.generate_docs(output_format="markdown", recursive=True)
    _, first, rest = text.partition("## fingertap run")
    return first + rest


def allowed(schema: dict[str, Any]) -> str:
    """What a key may hold: its type or choices, and its bounds."""
    if "enum" in schema:
        return ", ".join(f"`{choice}`" for choice in schema["enum"])
    if "anyOf" in schema:
        return " or ".join(filter(None, map(allowed, schema["anyOf"])))
    if schema.get("type") == "array":
        return f"a list: {allowed(schema['items'])}"
    if schema.get("type") == "object":
        return "a table"
    signs = {"minimum": "≥", "exclusiveMinimum": ">", "maximum": "≤", "exclusiveMaximum": "<"}
    bounds = [f"{sign} {schema[name]:g}" for name, sign in signs.items() if name in schema]
    return ", ".join([schema.get("type", ""), *bounds])


def scene_keys() -> str:
    """Every key of a scene, from the schema by which editors check it."""
    from validation.scenes.schema import scene_schema

    schema = scene_schema()

    def tables(node: dict[str, Any], name: str) -> Iterator[str]:
        found = schema["$defs"][node["$ref"].rpartition("/")[2]] if "$ref" in node else node
        own, inner = [], []
        for key, value in found["properties"].items():
            if "$ref" in value:
                inner.append((value, f"{name}.{key}".strip(".")))
                continue
            default = value.get("default")
            shown = "–" if default is None else f"`{default}`".replace("True", "true")
            text = value.get("description", "")
            own.append((f"`{key}`", text, shown.replace("False", "false"), allowed(value)))
        if own:
            head = ("key", "what it means", "default", "allowed")
            yield f"## [{name}]\n\n{found.get('description', '')}\n\n{table(head, own)}\n"
        for value, path in inner:
            yield from tables(value, path)

    return "\n".join(tables(schema, ""))


def results() -> str:
    """The scalars of a run, as summary.json and tables name them."""
    from validation.harness.quantities import ESTIMATED, QUANTITIES

    rows = [
        (f"`{q.key}`", q.title, q.unit or "–", "yes" if q.key in ESTIMATED else "–")
        for q in QUANTITIES
    ]
    return table(("key (SI units)", "title", "shown in", "error estimated"), rows)


def history() -> str:
    """The curves of a run, as history.nc and the results' `history` name them."""
    import hcm
    from reference_fem.results.result import Sampled
    from validation.harness.quantities import unit_of
    from validation.scenes.schema import attribute_docstrings

    beams, solids = attribute_docstrings(hcm.History), attribute_docstrings(Sampled)
    rows = [
        (f"`{name}`", unit_of(name), beams.get(name, "–"), solids.get(name, "–"))
        for name in {**beams, **solids}
    ]
    return table(("name", "unit", "hcm, hcm-refined", "fem3d, fem2d"), rows)


def statuses() -> str:
    """How runs end, and what to do about it."""
    import hcm
    import reference_fem

    rows = [
        (f"`{status.name}`", models, status.value, status.advice)
        for models, kind in (
            ("hcm, hcm-refined", hcm.Status), ("fem3d, fem2d", reference_fem.Status)
        )
        for status in kind
    ]  # fmt: skip
    return table(("status", "models", "in words", "what to do"), rows)


def shortcuts() -> str:
    """What a run may skip, and the keys that do without."""
    from validation.studies.bench.shortcuts import HCM, SOLID, SOLID_FULL

    found = {(s.name, s.model): s for s in (*HCM, *SOLID, *SOLID_FULL)}
    rows = [
        (s.name, s.model, " ".join(f"`{key}`" for key in s.switched_off_by), s.note)
        for s in found.values()
    ]
    return table(("shortcut", "model", "without it", "note"), rows)


def write_all(folder: Path) -> None:
    """Write every page that has changed."""
    folder.mkdir(exist_ok=True)
    for make in (commands, scene_keys, results, history, statuses, shortcuts):
        path, text = folder / f"{make.__name__}.md", make() + "\n"
        if not path.exists() or path.read_text(encoding="utf-8") != text:
            path.write_text(text, encoding="utf-8")
