"""The explicit run's state: all that a restart needs."""

from dataclasses import dataclass

from reference_fem.arrays import Array
from reference_fem.contact.law import Memory


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
