"""The JSON Schema of a scene, from the tables and the solvers' settings; a new scene from it."""

import ast
import dataclasses
import inspect
import textwrap
from collections.abc import Iterator
from typing import Any

import tomli_w

from validation.scenes.scene import Scene
from validation.scenes.solver_tables import BASES, SIZES, SolverTable, settings_of, solver_table
from validation.scenes.tables import state_key

WIDTH = 100  # width of a new scene's lines
BY_PRESET = (*SIZES, "contact")
DIALECT = "https://json-schema.org/draft/2020-12/schema"


def scene_schema() -> dict[str, Any]:
    """JSON Schema (draft 2020-12) of a scene: keys, units, bounds, defaults, descriptions.

    A schema cannot express what depends on several keys, such as a list's length on
    ``finger.phalanges``; that is checked when the scene is read.
    """
    schema = Scene.model_json_schema()
    tables = schema["$defs"]
    tables[SolverTable.__name__]["description"] = "Settings of each solver; all are optional."
    solver = tables[SolverTable.__name__]["properties"]
    for name in BASES:
        solver_schema = solver_table(name).model_json_schema()
        tables |= solver_schema.pop("$defs", {})
        solver_schema["description"] = f"How {name} solves the scene."
        for settings in settings_of(name):
            _describe(solver_schema["properties"], settings)
        tables[solver_schema["title"]] = solver_schema
        solver[name] = {"$ref": f"#/$defs/{solver_schema['title']}"}
    return _as_toml({"$schema": DIALECT, **schema, "title": "Fingertap scene"})


def _describe(properties: dict[str, Any], settings: type) -> None:
    """Add the docstrings and defaults of a solver's settings to the keys that state them."""
    texts = attribute_docstrings(settings)
    for field in dataclasses.fields(settings):
        entry = properties.get(state_key(field.name))
        if entry is None:
            continue
        words = [texts.get(field.name, ""), entry.pop("description", "")]
        if field.name in BY_PRESET:
            words.append("By default the preset's.")
        elif isinstance(field.default, bool | int | float | str):
            entry["default"] = field.default
        entry["description"] = _sentence(*words)


def attribute_docstrings(owner: type) -> dict[str, str]:
    """The docstring below each attribute of a class, read from its source."""
    (body,) = ast.parse(textwrap.dedent(inspect.getsource(owner))).body
    assert isinstance(body, ast.ClassDef)
    texts = {}
    for attribute, below in zip(body.body, body.body[1:], strict=False):
        if isinstance(attribute, ast.AnnAssign) and isinstance(attribute.target, ast.Name):
            match below:
                case ast.Expr(value=ast.Constant(value=str(text))):
                    texts[attribute.target.id] = inspect.cleandoc(text)
    return texts


def _sentence(*parts: str) -> str:
    return " ".join(" ".join(filter(None, parts)).split())


def _as_toml(node: Any) -> Any:
    """Remove null, which TOML does not have; add units to descriptions, all that editors show."""
    if isinstance(node, list):
        return [_as_toml(item) for item in node if item != {"type": "null"}]
    if not isinstance(node, dict):
        return node
    result = {k: _as_toml(v) for k, v in node.items() if not (k == "default" and v is None)}
    if len(result.get("anyOf", ())) == 1:
        (only,) = result.pop("anyOf")
        result = only | result
    if "unit" in result:
        result["description"] = _sentence(result.get("description", ""), f"In {result['unit']}.")
    return result


def scene_text(values: dict[str, Any]) -> str:
    """A scene's text: keys with their values, and the other keys as comments with their defaults.

    values : tables of the scene on which the new one is based.
    """
    schema = scene_schema()
    head = (
        "A scene for fingertap, in SI units. A number of finger or material may be a list with one "
        "number per phalanx. A line that starts with # is a key's default, or an example; "
        "explanations for an editor: fingertap schema > scene.schema.json."
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
    """A key and its value; a table instead of a number goes on one line, as it has no header."""
    if isinstance(value, dict):
        return f"{key} = {{ {', '.join(_written(*item) for item in value.items())} }}"
    return tomli_w.dumps({key: value}).strip()


def _explained(entry: dict[str, Any]) -> str:
    """A key's description, and the values that it may have."""
    choices = [one for one in (entry, *entry.get("anyOf", ())) if "enum" in one or "const" in one]
    names = [str(name) for one in choices for name in one.get("enum", [one.get("const")])]
    allowed = f" One of {', '.join(names)}." if len(names) > 1 else ""
    return entry.get("description", "") + allowed


def _comment(text: str) -> list[str]:
    return textwrap.wrap(
        text, WIDTH, initial_indent="# ", subsequent_indent="# ", break_on_hyphens=False
    )
