"""The points of a plan: values of the keys that vary, each point a scene."""

import csv
import io
import itertools
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from validation.errors import UserError
from validation.scenes.load import parse_value, read_text
from validation.scenes.messages import check_value, show
from validation.sweep.axis import MOST_POINTS, Axis, check_apart, check_key, clash, frozen
from validation.sweep.plan import Plan, Points, assignment

LARGEST_FILE = 1_000_000_000  # bytes of a file of points


@dataclass(frozen=True)
class PointTable:
    """Values by key: for each key a list over all points."""

    columns: Mapping[str, Sequence[Any]]

    def __len__(self) -> int:
        return len(next(iter(self.columns.values())))

    def overrides(self, index: int) -> tuple[str, ...]:
        """A point as ``KEY=VALUE`` texts."""
        return tuple(assignment(key, values[index]) for key, values in self.columns.items())


def points_of(plan: Plan) -> PointTable:
    """All points of a plan."""
    if plan.points.kind == "file":
        return _from_file(plan)
    if plan.points.kind == "grid":
        return _grid(plan.vary)
    cube = unit_points(plan.points, len(plan.vary))
    return PointTable(
        {
            key: values_of(axis, shares)
            for (key, axis), shares in zip(plan.vary.items(), cube.T, strict=True)
        }
    )


def unit_points(points: Points, size: int) -> NDArray[np.float64]:
    """Points in the unit cube of that many dimensions, (number, size)."""
    from scipy.stats import qmc

    number, rng = points.number or 0, np.random.default_rng(points.seed)
    if points.kind == "sobol":
        # the first points of a power of 2: the same ones whatever the number
        cube = qmc.Sobol(size, rng=rng).random_base2(math.ceil(math.log2(number)))[:number]
    elif points.kind == "latin-hypercube":
        cube = qmc.LatinHypercube(size, rng=rng).random(number)
    else:
        cube = rng.random((number, size))
    return np.asarray(cube)


def values_of(axis: Axis, shares: NDArray[np.float64]) -> list[Any]:
    """An axis' values at shares in [0, 1], (n,): quantiles of its distribution."""
    if axis.values is not None:
        places = np.minimum((shares * len(axis.values)).astype(int), len(axis.values) - 1)
        return [axis.values[place] for place in places]
    if axis.distribution is not None:
        # an unbounded distribution has infinite ends
        return frozen(axis, "").ppf(np.clip(shares, 2.0**-40, 1.0 - 2.0**-40)).tolist()
    low, high = axis.low or 0.0, axis.high or 0.0
    inner = low * (high / low) ** shares if axis.log else low + (high - low) * shares
    # the ends are exactly those in the plan
    return np.where(shares < 1.0, np.clip(inner, low, high), high).tolist()


def _grid(vary: Mapping[str, Axis]) -> PointTable:
    sides = []
    for axis in vary.values():
        count = axis.count if axis.values is None else len(axis.values)
        ends, middles = np.linspace(0.0, 1.0, count), (np.arange(count) + 0.5) / count
        sides.append(values_of(axis, middles if axis.low is None else ends))
    if (number := math.prod(map(len, sides))) > MOST_POINTS:
        raise UserError(f"points.kind = 'grid': gives {number} points: at most {MOST_POINTS}")
    return PointTable(
        dict(zip(vary, map(list, zip(*itertools.product(*sides), strict=True)), strict=True))
    )


def _from_file(plan: Plan) -> PointTable:
    path = plan.folder / str(plan.points.file)
    origin = f"points.file {path}"
    try:
        content = read_text(path, origin, LARGEST_FILE)
        reader = csv.reader(io.StringIO(content), skipinitialspace=True)
        lines = [(reader.line_num, row) for row in reader if row]
    except csv.Error as error:
        raise UserError(f"{origin}: is not CSV: {error}") from error
    names = [name.strip() for name in lines[0][1]] if lines else []
    if other := next((mark for mark in ";\t" if mark in "".join(names)), ""):
        raise UserError(f"{origin}: line 1 has {other!r}: must have commas between its columns")
    wanted = plan.points.columns or names
    settled = [text.partition("=")[0] for text in plan.common]
    settled += [key for solver in plan.solvers for key in solver.set]
    for name in wanted:
        if name not in names:
            has = ", ".join(names) or "none"
            raise UserError(f"{origin}: column {name!r} is missing: it has {has}")
        if names.count(name) > 1:
            raise UserError(f"{origin}: column {name!r} appears twice; leave one out")
        check_key(name, f"{origin}: column {name!r}")
        if other := clash(name, settled):
            part = "" if other == name else f", by {other}"
            raise UserError(
                f"{origin}: column {name!r} is set in the plan too{part}; leave one out"
            )
    check_apart(wanted, f"{origin}: column ")
    columns: dict[str, list[Any]] = {name: [] for name in wanted}
    for number, row in lines[1:]:
        if len(row) != len(names):
            raise UserError(
                f"{origin}: line {number} has {len(row)} values for {len(names)} columns"
            )
        for name, text in zip(names, row, strict=True):
            if name in columns:
                place = f"{origin}: line {number}: {name}"
                if not text.strip():
                    raise UserError(f"{place} is empty: write its value, a list as [1, 2]")
                columns[name].append(value := parse_value(text.strip(), place))
                if isinstance(value, float) and not math.isfinite(value):
                    raise UserError(f"{place} = {show(value)}: must be finite")
                check_value(name, value, place)
    if not columns or not next(iter(columns.values())):
        raise UserError(f"{origin}: has no points: a line of keys, then one of values for each")
    return PointTable(columns)
