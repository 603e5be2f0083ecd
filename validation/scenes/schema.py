"""The JSON Schema of a scene, from the tables and the solvers' settings themselves."""

import ast
import dataclasses
import inspect
import textwrap
from typing import Any

from validation.scenes.scene import Scene
from validation.scenes.solver_tables import SOLVER_TABLES, SolverTable, settings_of
from validation.scenes.tables import state_key

DIALECT = "https://json-schema.org/draft/2020-12/schema"


def scene_schema() -> dict[str, Any]:
    """JSON Schema (draft 2020-12) of a scene: keys, units, bounds, defaults, descriptions.

    What more than one key decides, such as a list's length by ``finger.phalanges``, a schema
    cannot say; reading the scene does.
    """
    schema = Scene.model_json_schema()
    tables = schema["$defs"]
    tables[SolverTable.__name__]["description"] = "What each solver is told; all of it optional."
    solver = tables[SolverTable.__name__]["properties"]
    for name, table in SOLVER_TABLES.items():
        solver_schema = table().model_json_schema()
        tables |= solver_schema.pop("$defs", {})
        solver_schema["description"] = f"How {name} solves the scene."
        for settings in settings_of(name):
            _describe(solver_schema["properties"], settings)
        tables[solver_schema["title"]] = solver_schema
        solver[name] = {"$ref": f"#/$defs/{solver_schema['title']}"}
    written: dict[str, Any] = _as_toml({"$schema": DIALECT, **schema, "title": "Fingertap scene"})
    return written


def _describe(properties: dict[str, Any], settings: type) -> None:
    """Put the docstrings and defaults of a solver's settings beside the keys that state them."""
    texts = attribute_docstrings(settings)
    for field in dataclasses.fields(settings):
        entry = properties.get(state_key(field.name))
        if entry is None:
            continue
        entry["description"] = _sentence(texts.get(field.name, ""), entry.pop("description", ""))
        if isinstance(field.default, bool | int | float | str):
            entry["default"] = field.default


def attribute_docstrings(owner: type) -> dict[str, str]:
    """The text below each attribute of a class, as its source has it."""
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
    """Without what TOML has not, null; units among the words, for editors show nothing else."""
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
