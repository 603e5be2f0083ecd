"""The explicit run's state: all that a restart needs."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True)
class State:
    """Accepted state before the forces at t_n are evaluated.

    Sums are over the mesh as given (a half model's are half).

    Attributes
    ----------
    step
        n, counted from the start of the explicit run.
    time_s
        t_n.
    displacement : (n_points, dim)
        u at t_n.
    velocity : (n_points, dim)
        v at t_n - Δt/2.
    touching : (s,)
        Sites of the contact law in contact at the last evaluation.
    anchor, spring_force : (s, dim - 1)
        Friction history: anchors (m) and tangential forces (N) of the last evaluation.
    dissipation_J
        Friction dissipation up to the last evaluation.
    damping_J
        What the contact's dashpots took up to the last evaluation.
    face_angles : (n_couples,)
        Rotation of the driven faces, rad: keeps the branch of full turns.
    """

    step: int
    time_s: float
    displacement: Array
    velocity: Array
    touching: NDArray[np.bool_]
    anchor: Array
    spring_force: Array
    dissipation_J: float
    damping_J: float
    face_angles: Array
