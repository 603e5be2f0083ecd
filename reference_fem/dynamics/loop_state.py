"""State of the explicit loop between two blocks, and its form in a restart file."""

from dataclasses import dataclass
from typing import Any, get_type_hints

import numpy as np
from numpy.typing import NDArray

from reference_fem.arrays import Array
from reference_fem.contact.law import Memory
from reference_fem.dynamics.restart import Arrays
from reference_fem.dynamics.state import State
from reference_fem.dynamics.step import start_state
from reference_fem.dynamics.tap import Tap
from reference_fem.model import Model


@dataclass(frozen=True)
class LoopState:
    """State of the loop between two blocks; with the recorder, all that it needs to continue.

    start_s : time at which the explicit run began
    largest_kinetic_J, largest_error_J : of the audits so far
    origin_energy_J : energy from which the balance is measured: 0 for a body that started at rest
        in the mesh's rest position; None takes the first audit of the run.
    audits : number of audits so far
    spent_s : wall time of the runs that this one continues
    coarse : whether it is on the mesh of a `CoarseFlight`
    """

    state: State
    start_s: float
    tap: Tap
    largest_kinetic_J: float = 0.0
    largest_error_J: float = 0.0
    origin_energy_J: float | None = 0.0
    audits: int = 0
    spent_s: float = 0.0
    coarse: bool = False


def first_loop_state(
    model: Model,
    displacement: Array,
    velocity: Array,
    time_s: float,
    origin_energy_J: float | None = 0.0,
    angles: Array | None = None,
    torque_change_work_J: float = 0.0,
) -> LoopState:
    """State before the first block, from u and v (n_points, dim) at `time_s`; see `start_state`."""
    state = start_state(model, displacement, velocity, time_s, angles, torque_change_work_J)
    return LoopState(state, time_s, Tap(), origin_energy_J=origin_energy_J)


# Members of a loop state that have members of their own.
_NESTED: dict[str, type] = {"state": State, "tap": Tap, "memory": Memory}


def pack(value: object, prefix: str = "") -> dict[str, NDArray[Any]]:
    """The numbers and arrays of a loop state, or of a part of it, by name; None is left out."""
    arrays: dict[str, NDArray[Any]] = {}
    for name in get_type_hints(type(value)):
        item = getattr(value, name)
        if name in _NESTED:
            arrays |= pack(item, f"{prefix}{name}.")
        elif item is not None:
            arrays[prefix + name] = np.asarray(item)
    return arrays


def unpack(arrays: Arrays, kind: type = LoopState, prefix: str = "") -> Any:
    """The loop state, or the part of it, that `pack` made `arrays` from."""
    values: dict[str, Any] = {}
    for field in get_type_hints(kind):
        name = prefix + field
        if field in _NESTED:
            values[field] = unpack(arrays, _NESTED[field], f"{name}.")
        elif name not in arrays:
            values[field] = None
        elif arrays[name].ndim == 0:
            values[field] = arrays[name].item()
        else:
            values[field] = arrays[name]
    if kind is Tap and values["tip_velocity"] is not None:
        values["tip_velocity"] = tuple(values["tip_velocity"].tolist())
    return kind(**values)
