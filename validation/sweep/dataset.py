"""The results of a sweep as one dataset: points, numbers of every model, what they differ by."""

import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import xarray

from validation.harness.files import write_dataset, write_text
from validation.harness.provenance import provenance
from validation.harness.quantities import QUANTITIES, Quantity, unit_of
from validation.harness.record_schema import stated_errors
from validation.sweep.axis import scene_number_of
from validation.sweep.plan import Plan
from validation.sweep.points import PointTable
from validation.sweep.runs import NOT_SHARED
from validation.sweep.sensitivity import Floats

DATASET, TABLE = "sweep.nc", "sweep.csv"
NOT_SOLVED = "NOT_SOLVED"
WORDS = ("status", "message", "processor")
NUMBERS = tuple(
    entry for quantity in QUANTITIES for entry in quantity.parts if quantity.key not in NOT_SHARED
)


@dataclass(frozen=True)
class SweepResult:
    """A kept row, in the form that quantities read."""

    status: str = NOT_SOLVED
    message: str = ""
    processor: str = ""
    spent_s: float = math.nan
    summary: Mapping[str, Any] = field(default_factory=dict)
    errors: Mapping[str, Any] = field(default_factory=dict)


def solved(row: Mapping[str, Any] | None) -> SweepResult:
    """The result in a row of the store; None: not solved."""
    if row is None:
        return SweepResult()
    return SweepResult(**{**row, "errors": stated_errors(row["errors"])})


def build(plan: Plan, points: PointTable, rows: Sequence[Sequence[SweepResult]]) -> xarray.Dataset:
    """The dataset of `rows`, which hold the results of all solvers for each point."""
    data: dict[str, Any] = {}
    for key, values in points.columns.items():
        number = scene_number_of(key)
        plain = all(isinstance(value, int | float | str) for value in values)
        column = np.array(values if plain else [json.dumps(value) for value in values])
        data[key] = ("scene", column, {"units": (number and number.unit) or "1"})
    both = ("scene", "model")
    for entry in NUMBERS:
        units = {"units": unit_of(entry.key), "long_name": entry.title}
        numbers = [[entry.value(r) for r in row] for row in rows]
        data[entry.key] = (both, np.array(numbers, dtype=float), units)
        errors = np.array([[entry.stated(r) for r in row] for row in rows], dtype=float)
        if not np.isnan(errors).all():
            data[f"{entry.key}_error"] = (both, errors, units)
    data["spent_s"] = (both, np.array([[r.spent_s for r in row] for row in rows]), {"units": "s"})
    for name in WORDS:
        data[name] = (both, np.array([[getattr(r, name) for r in row] for row in rows], dtype=str))
    labels = [solver.label for solver in plan.solvers]
    attributes = {
        "title": f"fingertap sweep: {plan.name}",
        "solvers_json": json.dumps([solver.model_dump() for solver in plan.solvers]),
        "provenance_json": json.dumps(provenance(plan.document)),
    }
    coordinates = {"scene": np.arange(len(points)), "model": labels}
    return xarray.Dataset(data, coordinates, attributes)


def write(folder: Path, dataset: xarray.Dataset) -> None:
    """Write ``sweep.nc``, and ``sweep.csv`` with a line for each scene and model."""
    write_dataset(folder / DATASET, dataset)
    table = dataset.to_dataframe().reset_index()
    write_text(folder / TABLE, table.to_csv(index=False))


@dataclass(frozen=True)
class Pair:
    """A model and the one that it is compared with, by their places in the plan."""

    own: int
    base: int
    title: str


@dataclass(frozen=True)
class Output:
    """What is mapped over the variables: (n,) numbers, NaN where there are none."""

    title: str
    short: str
    values: Floats
    signed: bool


def numbers(data: xarray.Dataset, entry: Quantity, place: int, error: bool = False) -> Floats:
    """A quantity of one model in its shown unit, NaN where its run did not complete."""
    name = f"{entry.key}_error" if error else entry.key
    if name not in data:
        return np.full(data.sizes["scene"], np.nan)
    values = entry.factor * data[name].values[:, place]
    return np.where(data["status"].values[:, place] == "COMPLETED", values, np.nan)


def differences(data: xarray.Dataset, entry: Quantity, pair: Pair) -> Floats:
    """Relative differences (own - base)/base; NaN where base is 0 or a number is missing.

    Negative where own is smaller in magnitude, below -1 where its sign is the other one
    (`compare.differences.error_percent`).
    """
    own, base = (numbers(data, entry, place) for place in (pair.own, pair.base))
    return np.asarray((own - base) / np.where(base == 0.0, np.nan, base))
