"""Pydantic's errors as one line each: key, value, what is allowed, what to do."""

import difflib
import re
from datetime import date, time
from functools import cache
from typing import Annotated, Any, get_args

from pydantic import BaseModel, TypeAdapter, ValidationError
from pydantic.fields import FieldInfo

from validation.errors import UserError
from validation.scenes.scene import Scene
from validation.scenes.scene_number import SceneNumber
from validation.scenes.solver_tables import BASES, AccuracyTable, SolverTable, solver_table
from validation.scenes.tables import Table


@cache
def known_keys(table: type[BaseModel] = Scene, prefix: str = "") -> dict[str, FieldInfo]:
    """All dotted keys of a scene, and the declaration of each."""
    found: dict[str, FieldInfo] = {}
    if table is SolverTable:
        for name in BASES:
            found |= known_keys(solver_table(name), f"{prefix}{name}.")
        table = AccuracyTable
    for name, field in table.model_fields.items():
        kinds = (field.annotation, *get_args(field.annotation))
        inner = [k for k in kinds if isinstance(k, type) and issubclass(k, BaseModel)]
        if not inner or inner[0] is not kinds[0]:
            found[prefix + name] = field
        for kind in inner:
            found |= known_keys(kind, f"{prefix}{name}.")
    return found


def nearest_key(key: str, of: type[BaseModel] = Scene) -> str:
    """The remedy for an unknown key: the nearest known key, or the list of those in its table."""
    keys = list(known_keys(of))
    whole = re.sub(r"(\[-?\d+\]|\.\d+)+$", "", key)
    if whole != key and whole in keys:
        return f"{whole} has no parts: a list is given whole"
    table, _, last = key.rpartition(".")
    siblings = [known for known in keys if known.rpartition(".")[0] == table]
    same = [known for known in keys if known.rpartition(".")[2] == last]
    near = _nearest(last, siblings) or same or _nearest(last, keys)
    if near:
        return f"did you mean {near[0]}?"
    inside = [known for known in keys if known.startswith(f"{table}.")]
    known = inside or sorted({known.split(".")[0] for known in keys})
    return "known are " + ", ".join(known)


def _nearest(last: str, keys: list[str]) -> list[str]:
    by_name = {known.rpartition(".")[2]: known for known in keys}
    return [by_name[name] for name in difflib.get_close_matches(last, by_name, n=1)]


def show(value: object) -> str:
    """A value as TOML would write it, shortened."""
    if isinstance(value, date | time):  # a datetime is a date
        text = value.isoformat()
    else:
        try:
            text = str(value).lower() if isinstance(value, bool) else repr(value)
        except ValueError:  # Python writes no more than some thousand digits
            text = "a number of thousands of digits"
    text = " ".join(text.split())
    return text if len(text) <= 60 else text[:57] + "..."


def check_value(key: str, value: object, origin: str) -> None:
    """Refuse a value that its key can't have in any scene.

    origin : what the message names instead of the key.

    Raises UserError: the value is not allowed; says what is.
    """
    try:
        _check_of(key).validate_python(value)
    except ValidationError as error:
        first = error.errors(include_url=False)[0]
        text = _one(first | {"loc": (key, *first["loc"])}, Scene).removeprefix(key)
        raise UserError(origin + text) from error


@cache  # a file of points has many values of one key
def _check_of(key: str) -> TypeAdapter[Any]:
    field = known_keys()[key]
    kind: Any = Annotated[field.annotation, *field.metadata] if field.metadata else field.annotation
    return TypeAdapter(kind, config=Table.model_config)


def _one(error: Any, of: type[BaseModel]) -> str:
    key = ".".join(str(part) for part in error["loc"])
    value = error["input"]
    kind = error["type"]
    context = error.get("ctx", {})
    if kind == "quantity":
        return f"{key} = {show(value)}: {context['text']}"
    if kind == "scene":
        return f"{context['key']} = {show(context['value'])}: {context['text']}"
    if kind == "extra_forbidden":
        while isinstance(value, dict) and value:  # an unknown table: name its first key
            name, value = next(iter(value.items()))
            key = f"{key}.{name}"
        return f"{key} = {show(value)}: unknown key; {nearest_key(key, of)}"
    if kind == "missing":
        return f"{key} is missing: {_missing(key)}"
    if kind == "literal_error":
        return f"{key} = {show(value)}: must be {context['expected']}"
    if kind == "string_type":
        return f"{key} = {show(value)}: must be a text, in quotes"
    if kind == "bool_type":
        return f"{key} = {show(value)}: must be true or false"
    if kind in ("model_type", "model_attributes_type", "dict_type"):
        return f"{key} = {show(value)}: must be a table; write [{key}] and its keys below it"
    return f"{key} = {show(value)}: {error['msg']}"


def _missing(key: str) -> str:
    known = known_keys()
    inside = [k for k, field in known.items() if k.startswith(f"{key}.") and field.is_required()]
    if inside:
        names = ", ".join(k.removeprefix(f"{key}.") for k in inside)
        return f"add a table [{key}] with {names}"
    table, _, name = key.rpartition(".")
    declared = known[key].metadata if key in known else []
    advice = [of.advice for of in declared if isinstance(of, SceneNumber) and of.advice]
    return "; ".join([f"add {name} = ... under [{table}]", *advice])


def one_line(error: ValidationError, of: type[BaseModel] = Scene) -> str:
    """The first problem of a table in full, and how many more there are."""
    problems = error.errors(include_url=False)
    more = len(problems) - 1
    return _one(problems[0], of) + (f" (and {more} more problem{'s' * (more > 1)})" if more else "")
