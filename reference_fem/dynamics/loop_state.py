"""Where the explicit loop stands between two blocks, and its form in a restart file."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, fields
from typing import Any

import numpy as np
from numpy.typing import NDArray

from reference_fem.dynamics.state import State

Arrays = Mapping[str, NDArray[Any]]


@dataclass(frozen=True)
class Tap:
    """What is known of the first tap so far: absolute times and the pole's velocity."""

    first_touch_s: float | None = None
    last_touch_s: float | None = None
    over: bool = False
    tip_velocity: tuple[float, float] | None = None


@dataclass(frozen=True)
class Position:
    """Where the loop stands between two blocks; with the recorder, all that it needs to go on.

    Attributes
    ----------
    state, tap
    start_s
        Time at which the explicit run began.
    largest_kinetic_J, largest_error_J
        Of the audits so far.
    origin_energy_J
        What the balance is measured from; None until the first audit.
    audits
        Number of audits so far.
    spent_s
        Wall time of the runs that this one continues.
    """

    state: State
    start_s: float
    tap: Tap = Tap()
    largest_kinetic_J: float = 0.0
    largest_error_J: float = 0.0
    origin_energy_J: float | None = 0.0
    audits: int = 0
    spent_s: float = 0.0


def pack(position: Position) -> dict[str, NDArray[Any]]:
    """The position's numbers and arrays by name; what is None is left out."""
    return _packed(position, "")


def unpack(arrays: Arrays) -> Position:
    """The position that `pack` made `arrays` from."""
    position: Position = _unpacked(Position, arrays, "")
    return position


# The dataclasses inside a position.
_NESTED: dict[str, type] = {"state": State, "tap": Tap}


def _packed(value: State | Tap | Position, prefix: str) -> dict[str, NDArray[Any]]:
    arrays: dict[str, NDArray[Any]] = {}
    for field in fields(value):
        item = getattr(value, field.name)
        if field.name in _NESTED:
            arrays |= _packed(item, f"{prefix}{field.name}.")
        elif item is not None:
            arrays[prefix + field.name] = np.asarray(item)
    return arrays


def _unpacked(kind: type, arrays: Arrays, prefix: str) -> Any:
    values: dict[str, Any] = {}
    for field in fields(kind):
        name = prefix + field.name
        if field.name in _NESTED:
            values[field.name] = _unpacked(_NESTED[field.name], arrays, f"{name}.")
        elif name not in arrays:
            values[field.name] = None
        elif arrays[name].ndim == 0:
            values[field.name] = arrays[name].item()
        else:
            values[field.name] = arrays[name]
    if kind is Tap and values["tip_velocity"] is not None:
        values["tip_velocity"] = tuple(values["tip_velocity"].tolist())
    return kind(**values)
