"""How a run ends, and what to do about it."""

from enum import Enum


class Status(Enum):
    """How a run ended; `advice` says what to do about it."""

    COMPLETED = "completed"
    NOT_REACHED = "not reached"
    STILL_IN_CONTACT = "still in contact"
    NEWTON_FAILED = "Newton's method failed"
    WORK_LIMIT = "work limit"
    INTERRUPTED = "interrupted"
    BODY_TOUCHES = "the body touches the surface"
    UNRESOLVED = "the steps do not resolve the tap"
    UNBALANCED = "the energy audit does not close"
    UNREPEATABLE = "too sensitive to rely on"
    TOO_FLEXIBLE = "too flexible for its flight"
    LOSES_HOLD = "the contact loses its hold"

    @property
    def advice(self) -> str:
        """One sentence for the user; empty when there is nothing to do."""
        return _ADVICE[self]

    def at(self, time_s: float, steps: int) -> str:
        """How a run ended, when and after how many steps."""
        return f"{self.value} at t = {time_s:.9g} s after {steps} steps"


_ADVICE = {
    Status.COMPLETED: "",
    Status.NOT_REACHED: "lower surface.height, turn the torques (drive.torques) towards the"
    " surface, or raise solver.hcm.max_flight_time",
    Status.STILL_IN_CONTACT: "raise solver.hcm.end_time or solver.hcm.max_contact_time, or reduce"
    " the torques that press the tip on the surface",
    Status.NEWTON_FAILED: "reduce solver.hcm.flight_step and solver.hcm.contact_step, or raise"
    " finger.elements",
    Status.WORK_LIMIT: "raise solver.hcm.max_steps or the step sizes",
    Status.INTERRUPTED: "run again, from the beginning; what was computed so far is in the result",
    Status.BODY_TOUCHES: "in this model only the tip can touch: try another surface.height, mostly"
    " a larger one, or torques (drive.torques; the last phalanx's first) that keep the tip lowest",
    Status.UNRESOLVED: "reduce solver.accuracy or, if that is not set, reduce"
    " solver.hcm.contact_step, or let solver.hcm.contact_tolerance control"
    " the steps (1e-11 does by default)",
    Status.UNREPEATABLE: "the finger folds up and multiplies every error, or its tap barely ends:"
    " reduce solver.accuracy or, if that is not set, solver.hcm.flight_tolerance and"
    " solver.hcm.contact_tolerance, or reduce drive.torques or the flight (surface.height)",
    Status.TOO_FLEXIBLE: "set solver.hcm.flight to 'elastic': the finger's bending on its way to"
    " the surface matters",
    Status.LOSES_HOLD: "friction moves the yielding tip further than so small a restitution"
    " returns it: raise tip.restitution or lower surface.friction",
    Status.UNBALANCED: "the steps are too long for this motion: reduce"
    " solver.accuracy or, if that is not set, reduce solver.hcm.flight_tolerance and"
    " solver.hcm.contact_tolerance (0 keeps the steps fixed), or solver.hcm.flight_step and"
    " solver.hcm.contact_step; where hardly anything but vibration moves, and"
    " solver.hcm.flight_integrator is 'generalized-alpha', set solver.hcm.spectral_radius to 1",
}
