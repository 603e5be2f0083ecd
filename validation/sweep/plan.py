"""A sweep's plan: a base scene, what varies, how points are chosen, which models solve them.

The keys of the tables are explained at their fields; `read_plan` refuses whatever can't be meant.
"""

import json
import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import Field, ValidationError
from pydantic_core import PydanticCustomError

from validation.errors import UserError
from validation.models import adapter
from validation.scenes.load import load_scene, read_toml
from validation.scenes.messages import known_keys, nearest_key, one_line, show
from validation.scenes.quantity import Quantity
from validation.scenes.scene import Scene
from validation.scenes.solver_tables import SOLVER_TABLES, SolverTable
from validation.scenes.tables import Table

MOST_POINTS = 10_000_000
Kind = Literal["sobol", "latin-hypercube", "random", "grid", "file"]


class Axis(Table):
    """How a key varies: a range, a list, or a distribution of scipy.stats."""

    low: float | None = None
    """Of a range, with `high`."""
    high: float | None = None
    """Of a range, with `low`."""
    log: bool = False
    """Whether the range is even in the logarithm."""
    values: list[Any] | None = None
    """A list, of anything that the key may be."""
    distribution: str | None = None
    """Name in scipy.stats, for example norm."""
    parameters: dict[str, float] = Field({})
    """Of the distribution, by its names: loc, scale, and its shapes."""
    count: Annotated[int, Quantity(integer=True, at_least=1, at_most=MOST_POINTS)] = 5
    """Points of a range or a distribution on a grid."""


class Points(Table):
    """How points are chosen."""

    kind: Kind = "sobol"
    """Sobol's sequence, scrambled; a Latin hypercube; independent; all combinations; a file's."""
    number: Annotated[int | None, Quantity(integer=True, at_least=1, at_most=MOST_POINTS)] = None
    """How many; of a grid and of a file the numbers follow. The first points of a longer Sobol
    sequence, or of more random points, are those of a shorter one: their results serve again."""
    seed: Annotated[int, Quantity(integer=True, at_least=0, at_most=2**32)] = 0
    """Of the choice: the same plan gives the same points."""
    file: str | None = None
    """CSV whose columns are keys of a scene, relative to the plan; a list is written [1, 2]."""
    columns: list[str] | None = None
    """The file's columns to take; left out: all."""


class Solver(Table):
    """A model that solves every scene."""

    model: str
    """hcm, fem3d, fem2d, or a plug-in's name."""
    variant: str = ""
    """What this one is called beside others of the same model."""
    set: dict[str, Any] = Field({})
    """Keys of the scene that are different for it."""

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

    name, folder : of its file. source, common : of the base scene and what is set in all scenes.
    scene, document : name and tables of that scene.
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
    """A value as TOML writes it; but for tables JSON writes alike."""
    if isinstance(value, dict):
        parts = (f"{json.dumps(name)} = {_on_one_line(part)}" for name, part in value.items())
        return f"{{{', '.join(parts)}}}"
    return json.dumps(value, ensure_ascii=False)


def quantity_of(key: str) -> Quantity | None:
    """The bounds of a scene's key, None of one that is no number."""
    table: Any = Scene
    *path, name = key.split(".")
    for part in path:
        solver = table is SolverTable
        table = SOLVER_TABLES[part]() if solver else table.model_fields[part].annotation
    found = [q for q in table.model_fields[name].metadata if isinstance(q, Quantity)]
    return found[0] if found else None


def check_key(key: str, origin: str) -> None:
    """Refuse a key that no scene has.

    Raises
    ------
    UserError
        Naming the nearest one.
    """
    if key not in set(known_keys()):
        raise UserError(f"{origin}: unknown key of a scene; {nearest_key(key)}")


def check_value(key: str, value: Any, origin: str) -> None:
    """Refuse a value that its key can't have in any scene.

    Raises
    ------
    UserError
        With what is allowed.
    """
    quantity = quantity_of(key)
    if quantity is None:
        return
    try:
        quantity.check(value)
    except PydanticCustomError as error:
        text = (error.context or {})["text"]
        raise UserError(f"{origin} = {show(value)}: {text}") from None


def read_plan(path: Path) -> Plan:
    """Read and check a plan.

    Raises
    ------
    UserError
        One line naming the key, its value, what is allowed and what to do.
    """
    origin = f"plan {path}"
    document = read_toml(path, origin)
    try:
        given = _Plan.model_validate(document)
    except ValidationError as error:
        raise UserError(f"{origin}: {_one_line(error)}") from error
    for key, axis in given.vary.items():
        check_key(key, f"{origin}: vary.{key}")
        _check_axis(key, axis, given.points.kind, f"{origin}: vary.{key}")
    _check_points(given, origin)
    solvers = _solvers(given, origin)
    folder = path.parent
    scene = given.scene
    if not Path(scene).is_absolute() and (folder / scene).is_file():
        scene = str(folder / scene)
    for key in given.set:
        check_key(key, f"{origin}: set.{key}")
        if key in given.vary:
            raise UserError(f"{origin}: set.{key} is varied too; leave one of both out")
    common = tuple(assignment(key, value) for key, value in given.set.items())
    named = load_scene(scene, common)
    return Plan(
        path.stem, folder, scene, common, named.name, named.document, solvers, given.points,
        given.vary,
    )  # fmt: skip


def _one_line(error: ValidationError) -> str:
    first = error.errors(include_url=False)[0]
    place = [str(part) for part in first["loc"]]
    if first["type"] == "extra_forbidden":
        inner: Any = {"points": Points, "vary": Axis}.get(place[0], _Plan)
        names = ", ".join((inner if len(place) > 1 else _Plan).model_fields)
        return f"{'.'.join(place)} = {show(first['input'])}: unknown key; known are {names}"
    if first["type"] == "missing" and place[0] in _Plan.model_fields:
        example = {"scene": 'scene = "soft"', "models": 'models = ["hcm", "fem3d"]'}
        return f"{place[0]} is missing: add {example.get(place[0], place[0])}"
    return one_line(error, _Plan)


def _check_axis(key: str, axis: Axis, kind: Kind, origin: str) -> None:
    """Refuse an axis that is no range, list or distribution, or more than one of them."""
    ways = [axis.low is not None or axis.high is not None, axis.values is not None,
            axis.distribution is not None]  # fmt: skip
    if sum(ways) != 1:
        raise UserError(
            f"{origin}: must have low and high, or values, or distribution; give one of the three"
        )
    if axis.values is not None:
        if not axis.values:
            raise UserError(f"{origin}.values = []: must hold at least one value")
        for value in axis.values:
            check_value(key, value, f"{origin}.values")
        return
    quantity = quantity_of(key)
    if quantity is None or quantity.only_list or quantity.integer:
        raise UserError(f"{origin}: is no continuous number; give its values as a list, values =")
    if axis.distribution is not None:
        frozen(axis, origin)
        return
    for name, bound in (("low", axis.low), ("high", axis.high)):
        if bound is None:
            raise UserError(f"{origin}: {name} is missing; a range has low and high")
        check_value(key, bound, f"{origin}.{name}")
    assert axis.low is not None
    assert axis.high is not None
    if not axis.low < axis.high:
        raise UserError(f"{origin}.low = {axis.low}: must be below high = {axis.high}")
    if axis.log and axis.low <= 0:
        raise UserError(f"{origin}.low = {axis.low}: must be above 0 where log = true")


def frozen(axis: Axis, origin: str) -> Any:
    """The axis' distribution, from scipy.stats."""
    from scipy import stats

    found = getattr(stats, str(axis.distribution), None)
    if not isinstance(found, stats.rv_continuous):
        raise UserError(
            f"{origin}.distribution = {axis.distribution!r}: must name a continuous distribution"
            " of scipy.stats, for example norm, truncnorm, lognorm or beta"
        )
    try:
        frozen = found(**axis.parameters)
        middle = float(frozen.ppf(0.5))
    except TypeError as error:
        raise UserError(f"{origin}.parameters: {error}") from error
    if not math.isfinite(middle):
        raise UserError(
            f"{origin}.parameters = {show(axis.parameters)}: give no distribution; see"
            f" scipy.stats.{axis.distribution}"
        )
    return frozen


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
    if points.kind in ("grid", "file") and points.number is not None:
        raise UserError(
            f"{origin}: points.number = {points.number}: follows from the"
            f" {points.kind}; leave it out"
        )


def _solvers(given: _Plan, origin: str) -> tuple[Solver, ...]:
    if not given.models:
        raise UserError(f"{origin}: models = []: name one at least, for example hcm")
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
        adapter(solver.model)
        for key in solver.set:
            check_key(key, f"{origin}: models.set.{key}")
            if key in given.vary:
                raise UserError(f"{origin}: models.set.{key} is varied too; leave one of both out")
    labels = [solver.label for solver in solvers]
    for label in labels:
        if labels.count(label) > 1:
            raise UserError(f"{origin}: models: {label!r} is there twice; give each a variant")
    return solvers
