"""Errors of one tap against a truth, which the benchmark draws over run time."""

from dataclasses import dataclass


@dataclass(frozen=True)
class TapQuantities:
    """The quantities of a tap whose errors are taken.

    contact_time_s : since the start of the motion. turn_s, duration_s : end of compression, and
    separation, both since first contact. Peak and impulse are those of F_n.
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
    times = ("contact_time_s", "turn_s", "duration_s")
    return TapErrors(
        peak=abs(found.peak_normal_force_N / truth.peak_normal_force_N - 1.0),
        impulse=abs(found.normal_impulse_N_s / truth.normal_impulse_N_s - 1.0),
        duration=abs(found.duration_s / truth.duration_s - 1.0),
        event_s=max(abs(getattr(found, name) - getattr(truth, name)) for name in times),
    )
