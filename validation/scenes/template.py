"""A new scene as commented TOML, every key of it from the schema."""

import textwrap
from collections.abc import Iterator
from typing import Any

import tomli_w

from validation.scenes.schema import scene_schema

WIDTH = 100


def scene_text(values: dict[str, Any]) -> str:
    """A scene's text: keys with their values, and as comments the others with their defaults.

    Parameters
    ----------
    values : tables of the scene that the new one starts from.
    """
    schema = scene_schema()
    head = (
        "A scene for fingertap, in SI units. A number of finger or material may be a list with one "
        "number per phalanx. A line that starts with # is a key's default, or an example; what "
        "each means for an editor: fingertap schema > scene.schema.json."
    )
    return "\n".join([*_comment(head), *_table("", schema, schema["$defs"], values), ""])


def _table(
    name: str, table: dict[str, Any], tables: dict[str, Any], values: dict[str, Any]
) -> Iterator[str]:
    inner = []
    if name:
        yield from ("", *_comment(table["description"].split("\n")[0]), f"[{name}]")
    for key, entry in table["properties"].items():
        reference = entry.get("$ref") or (entry.get("allOf") or [{}])[0].get("$ref")
        if reference is not None:
            inner.append((key, tables[reference.rsplit("/", 1)[-1]]))
            continue
        yield from _comment(_explained(entry))
        if key in values:
            yield _written(key, values[key])
        elif "default" in entry:
            yield "# " + tomli_w.dumps({key: entry["default"]}).strip()
        else:
            yield f"# {key} ="
    for key, one in inner:
        yield from _table(f"{name}.{key}".lstrip("."), one, tables, values.get(key, {}))


def _written(key: str, value: Any) -> str:
    """A key and its value; a table in the place of a number in one line, for it has no header."""
    if isinstance(value, dict):
        return f"{key} = {{ {', '.join(_written(*item) for item in value.items())} }}"
    return tomli_w.dumps({key: value}).strip()


def _explained(entry: dict[str, Any]) -> str:
    """What a key is, and what it may be."""
    choices = [one for one in (entry, *entry.get("anyOf", ())) if "enum" in one or "const" in one]
    names = [str(name) for one in choices for name in one.get("enum", [one.get("const")])]
    allowed = f" One of {', '.join(names)}." if len(names) > 1 else ""
    return entry.get("description", "") + allowed


def _comment(text: str) -> list[str]:
    return textwrap.wrap(text, WIDTH, initial_indent="# ", subsequent_indent="# ")
