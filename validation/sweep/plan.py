"""A sweep's plan: a base scene, what varies, how points are chosen, which models solve them.

The keys of the tables are explained at their fields; `read_plan` refuses plans that make no sense.
"""

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import Field, ValidationError

from validation.errors import UserError
from validation.harness.record_schema import Text
from validation.models import adapter
from validation.scenes.load import file_name, load_scene, read_toml
from validation.scenes.messages import check_value, one_line, show
from validation.scenes.scene_number import SceneNumber
from validation.scenes.tables import Table
from validation.sweep.axis import MOST_POINTS, Axis, check_apart, check_axis, check_key, clash

Sampling = Literal["sobol", "latin-hypercube", "random", "grid", "file"]


class Points(Table):
    """How points are chosen."""

    kind: Sampling = "sobol"
    """Scrambled Sobol sequence; Latin hypercube; independent; all combinations; a file's points."""
    number: Annotated[int | None, SceneNumber(integer=True, at_least=1, at_most=MOST_POINTS)] = None
    """How many points; not given for a grid or a file. A longer Sobol sequence, or one of more
    random points, begins with the points of a shorter one, whose results are used again."""
    seed: Annotated[int, SceneNumber(integer=True, at_least=0, at_most=2**32)] = 0
    """Seed of the random choice: the same plan gives the same points."""
    file: str | None = None
    """CSV whose columns are keys of a scene, relative to the plan; a list is written [1, 2]."""
    columns: list[str] | None = None
    """The file's columns to take; left out: all."""


class Solver(Table):
    """A model that solves every scene."""

    model: str
    """hcm, hcm-refined, fem3d, fem2d, or a plug-in's name."""
    variant: Text = ""
    """Name that tells it from other entries of the same model."""
    set: dict[str, Any] = Field({})
    """Keys of the scene that differ for it, with their values."""

    @property
    def label(self) -> str:
        """Model and variant."""
        return f"{self.model} {self.variant}".strip()


class _Plan(Table):
    scene: str
    models: list[Any]
    set: dict[str, Any] = Field({})
    points: Points = Points()
    vary: dict[str, Axis] = Field({})


@dataclass(frozen=True)
class Plan:
    """A checked plan.

    name, folder : of its file. source, common : where the base scene is read from, and the
    overrides of all scenes. scene, document : name and tables of the scene with these overrides.
    """

    name: str
    folder: Path
    source: str
    common: tuple[str, ...]
    scene: str
    document: dict[str, Any]
    solvers: tuple[Solver, ...]
    points: Points
    vary: Mapping[str, Axis]


def assignment(key: str, value: Any) -> str:
    """The override ``KEY=VALUE`` that gives a key this value, the value as TOML writes it."""
    return f"{key}={_on_one_line(value)}"


def _on_one_line(value: Any) -> str:
    """A value as TOML writes it: as JSON, but for tables. A date, which no key takes, is text."""
    if isinstance(value, dict):
        parts = (f"{json.dumps(name)} = {_on_one_line(part)}" for name, part in value.items())
        return f"{{{', '.join(parts)}}}"
    return json.dumps(value, ensure_ascii=False, default=str)


def read_plan(path: Path) -> Plan:
    """Read and check a plan.

    Raises UserError: one line naming the key, its value, what is allowed and what to do.
    """
    origin = f"plan {path}"
    document = read_toml(path, origin)
    try:
        given = _Plan.model_validate(document)
    except ValidationError as error:
        raise UserError(f"{origin}: {_one_line(error)}") from error
    for key, axis in given.vary.items():
        check_key(key, f"{origin}: vary.{key}")
        check_axis(key, axis, f"{origin}: vary.{key}")
    check_apart(given.vary, f"{origin}: vary.")
    _check_points(given, origin)
    solvers = _solvers(given, origin)
    folder = path.parent
    scene = given.scene
    if not Path(scene).is_absolute() and (folder / scene).is_file():
        scene = str(folder / scene)
    _check_set(given.set, given.vary, f"{origin}: set.")
    common = tuple(assignment(key, value) for key, value in given.set.items())
    named = load_scene(scene, common)
    name = file_name(path.stem)
    return Plan(
        name, folder, scene, common, named.name, named.document, solvers, given.points, given.vary
    )


def lists_replaced(plan: Plan, columns: Mapping[str, Sequence[Any]]) -> list[str]:
    """A line for each varied key that gives all phalanges the same where the scene does not.

    columns : the points' values by key.
    """
    found = []
    for key, values in columns.items():
        value: Any = plan.document
        for part in key.split("."):
            value = value.get(part) if isinstance(value, dict) else None
        alike = any(isinstance(one, int | float) for one in values)
        if isinstance(value, list) and alike and len({*map(str, value)}) > 1:
            found.append(
                f"{key} varies as one value of all phalanges, for the scene's {show(value)}; lists"
                " are given whole: values = [[...], [...]], or a file of points with lists"
            )
    return found


def _check_set(keys: Mapping[str, Any], vary: Mapping[str, Axis], origin: str) -> None:
    """Refuse keys that are unknown, that vary, or of which one sets another too."""
    for key in keys:
        check_key(key, origin + key)
        if other := clash(key, vary):
            part = "" if other == key else f", by vary.{other}"
            raise UserError(f"{origin}{key} is varied too{part}; leave one out")
    check_apart(keys, origin)


def _one_line(error: ValidationError) -> str:
    first = error.errors(include_url=False)[0]
    place = [str(part) for part in first["loc"]]
    if first["type"] == "extra_forbidden":
        if place[0] == "vary":
            check_key(place[1], f"vary.{place[1]}")
        inner: Any = {"points": Points, "vary": Axis}.get(place[0], _Plan)
        names = ", ".join((inner if len(place) > 1 else _Plan).model_fields)
        moved = place[0] == "points" and place[-1] in Axis.model_fields
        known = f"belongs to an axis: [vary] KEY = {{ ..., {place[-1]} = ... }}" if moved else (
            f"unknown key; known are {names}"
        )  # fmt: skip
        return f"{'.'.join(place)} = {show(first['input'])}: {known}"
    if first["type"] == "missing" and place[0] in _Plan.model_fields:
        example = {"scene": 'scene = "soft"', "models": 'models = ["hcm", "fem3d"]'}
        return f"{place[0]} is missing: add {example.get(place[0], place[0])}"
    return one_line(error, _Plan)


def _check_points(given: _Plan, origin: str) -> None:
    points, varied = given.points, bool(given.vary)
    if points.kind == "file":
        if points.file is None:
            raise UserError(f"{origin}: points.file is missing: name a CSV file of points")
        if varied:
            raise UserError(f"{origin}: vary: the points of a file say what varies; leave it out")
    elif points.file is not None:
        raise UserError(f"{origin}: points.file = {points.file!r}: write kind = 'file' beside it")
    elif not varied:
        raise UserError(f"{origin}: vary is missing: nothing varies; add a table [vary]")
    elif points.kind != "grid" and points.number is None:
        raise UserError(f"{origin}: points.number is missing: say how many points")
    if points.kind != "file" and "columns" in points.model_fields_set:
        raise UserError(f"{origin}: points.columns: are for a file; write kind = 'file' beside it")
    if points.kind in ("grid", "file") and points.number is not None:
        raise UserError(
            f"{origin}: points.number = {points.number}: follows from the"
            f" {points.kind}; leave it out"
        )
    if points.kind in ("grid", "file") and "seed" in points.model_fields_set:
        raise UserError(
            f"{origin}: points.seed: nothing is random in a {points.kind}; leave it out"
        )
    counted = [key for key, axis in given.vary.items() if "count" in axis.model_fields_set]
    if points.kind != "grid" and counted:
        raise UserError(f"{origin}: vary.{counted[0]}.count: is for a grid; leave it out")


def _solvers(given: _Plan, origin: str) -> tuple[Solver, ...]:
    if not given.models:
        raise UserError(f"{origin}: models = []: name at least one, for example hcm")
    try:
        solvers = tuple(
            Solver.model_validate({"model": m} if isinstance(m, str) else m) for m in given.models
        )
    except ValidationError as error:
        names = ", ".join(Solver.model_fields)
        raise UserError(
            f"{origin}: models = {show(given.models)}: must be names of models or tables of"
            f" {names} ({error.errors()[0]['msg'].lower()})"
        ) from error
    for solver in solvers:
        adapter(solver.model, f"{origin}: models:")
        _check_set(solver.set, given.vary, f"{origin}: models.set.")
        for key, value in solver.set.items():
            check_value(key, value, f"{origin}: models.set.{key}")
    labels = [solver.label for solver in solvers]
    for label in labels:
        if labels.count(label) > 1:
            raise UserError(f"{origin}: models: {label!r} appears twice; give each a variant")
    return solvers
