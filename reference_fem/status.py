"""How a run ended, each outcome with its advice."""

from __future__ import annotations

from enum import Enum


class Status(Enum):
    """Outcome of a run; `advice` says what a user can do about it."""

    COMPLETED = "completed"
    NOT_REACHED = "not reached"
    STILL_IN_CONTACT = "still in contact"
    UNSTABLE = "unstable"
    ENERGY_LOST = "energy lost"
    INVERTED_ELEMENT = "inverted element"
    PASSED_THROUGH = "passed through"
    WORK_LIMIT = "work limit"
    INTERRUPTED = "interrupted"

    @property
    def advice(self) -> str:
        """What to do next; empty for a completed run."""
        return _ADVICE[self]


_ADVICE = {
    Status.COMPLETED: "",
    Status.NOT_REACHED: (
        "the tip never came down to the surface: lower surface.height, drive it harder, or "
        "allow a longer max_flight_time_s or end_time_s"
    ),
    Status.STILL_IN_CONTACT: (
        "the window ended before the finger left the surface: allow a longer "
        "max_contact_time_s or end_time_s"
    ),
    Status.UNSTABLE: (
        "the energy balance is lost: use a step_factor of 0.9 or less, a smaller penalty_factor, "
        "or a mesh without slivers"
    ),
    Status.ENERGY_LOST: (
        "contact = 'impulse' stops every node that arrives as in a plastic impact: refine the mesh "
        "where it touches, or use contact = 'surface'"
    ),
    Status.INVERTED_ELEMENT: (
        "an element turned inside out: refine the mesh where it is crushed, lower the "
        "penalty_factor, or use a stiffer material"
    ),
    Status.PASSED_THROUGH: (
        "this model lets only the last phalanx touch: raise the finger above the surface or drive "
        "it another way"
    ),
    Status.WORK_LIMIT: (
        "the run is longer than it was meant to be: shorten end_time_s, coarsen the mesh, or allow "
        "more max_steps"
    ),
    Status.INTERRUPTED: "stopped by the user: what was computed up to there is in the result",
}
