"""Errors of one tap against a truth: what the benchmark draws over time."""

from dataclasses import dataclass


@dataclass(frozen=True)
class TapQuantities:
    """What errors are taken of. Event times count from first contact, s; an impact's are all of it.

    contact_time_s : since the start of the motion. turn_s : compression to restitution.
    """

    contact_time_s: float
    turn_s: float
    duration_s: float
    peak_normal_force_N: float
    normal_impulse_N_s: float


@dataclass(frozen=True)
class TapErrors:
    """Relative errors of peak, impulse and duration; largest error of an event's time, s."""

    peak: float
    impulse: float
    duration: float
    event_s: float

    @property
    def largest(self) -> float:
        """The largest relative error."""
        return max(self.peak, self.impulse, self.duration)


def tap_errors(found: TapQuantities, truth: TapQuantities) -> TapErrors:
    """How far `found` is from `truth`."""

    def relative(name: str) -> float:
        exact: float = getattr(truth, name)
        return abs(getattr(found, name) / exact - 1.0)

    times = ("contact_time_s", "turn_s", "duration_s")
    return TapErrors(
        peak=relative("peak_normal_force_N"),
        impulse=relative("normal_impulse_N_s"),
        duration=relative("duration_s"),
        event_s=max(abs(getattr(found, name) - getattr(truth, name)) for name in times),
    )
