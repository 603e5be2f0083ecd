"""What a sweep's models differ by, scene by scene."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from validation.harness.quantities import OF_A_TAP, Quantity, quantities
from validation.sweep.sensitivity import Floats

if TYPE_CHECKING:
    import xarray

COMPARED = (*OF_A_TAP, *quantities("peak_stress_R_Pa"))


@dataclass(frozen=True)
class Pair:
    """A model beside the one that it is compared with, by their places."""

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
    """(own - base)/|base|."""
    own, base = (numbers(data, entry, place) for place in (pair.own, pair.base))
    return np.asarray((own - base) / np.where(base == 0.0, np.nan, np.abs(base)))
