"""The explicit run's state, all that a restart needs, and its form in a restart file."""

from dataclasses import dataclass
from typing import Any, get_type_hints

import numpy as np
from numpy.typing import NDArray

from reference_fem.arrays import Array
from reference_fem.contact.law import Memory
from reference_fem.dynamics.restart import Arrays


@dataclass(frozen=True)
class State:
    """Accepted state before the forces at t_n are evaluated.

    Sums are over the mesh as given (a half model's are half).

    step : n, counted from the start of the explicit run
    time_s : t_n
    displacement : (n_points, dim), u at t_n
    velocity : (n_points, dim), v at t_n - Δt/2
    memory : history of the contact law after the last evaluation
    dissipation_J : friction dissipation up to the last evaluation
    damping_J : dissipation of the contact's dashpots up to the last evaluation
    material_J : dissipation of the material's damping up to the last evaluation
    face_angles : (n_couples,), rotation of the driven faces, rad: keeps the branch of full turns
    torque_change_work_J : ∫ θ dT over the changes of the joints' torques T: their work is T θ
        less this
    """

    step: int
    time_s: float
    displacement: Array
    velocity: Array
    memory: Memory
    dissipation_J: float
    damping_J: float
    material_J: float
    face_angles: Array
    torque_change_work_J: float


@dataclass(frozen=True)
class Tap:
    """What is known of the first tap so far: absolute times and the pole's velocity."""

    first_touch_s: float | None = None
    last_touch_s: float | None = None
    over: bool = False
    tip_velocity: tuple[float, float] | None = None


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
    flight_steps : steps that it took on that mesh before
    """

    state: State
    start_s: float
    tap: Tap = Tap()
    largest_kinetic_J: float = 0.0
    largest_error_J: float = 0.0
    origin_energy_J: float | None = 0.0
    audits: int = 0
    spent_s: float = 0.0
    coarse: bool = False
    flight_steps: int = 0

    @property
    def steps(self) -> int:
        """Steps of the explicit run so far."""
        return self.flight_steps + self.state.step


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
