"""Scalar differences between a reduced and a reference run."""

from collections.abc import Callable
from dataclasses import dataclass

from validation.harness.record import RunRecord


@dataclass(frozen=True)
class Quantity:
    """A compared scalar: what it is called, its unit in tables, how to read it from a run."""

    key: str
    title: str
    unit: str
    read: Callable[[RunRecord], float | None]


def _scaled(key: str, factor: float = 1.0) -> Callable[[RunRecord], float | None]:
    def read(record: RunRecord) -> float | None:
        value = record.value(key)
        return None if value is None else factor * value

    return read


def _velocity(axis: int) -> Callable[[RunRecord], float | None]:
    def read(record: RunRecord) -> float | None:
        velocity = record.summary.get("tip_velocity_at_contact_m_per_s")
        return None if velocity is None else float(velocity[axis])

    return read


QUANTITIES = (
    Quantity("peak_normal_force_N", "peak Fn", "N", _scaled("peak_normal_force_N")),
    Quantity("peak_tangential_force_N", "peak Ft", "N", _scaled("peak_tangential_force_N")),
    Quantity("normal_impulse_N_s", "normal impulse", "mN s", _scaled("normal_impulse_N_s", 1e3)),
    Quantity("contact_duration_s", "contact duration", "us", _scaled("contact_duration_s", 1e6)),
    Quantity(
        "peak_normal_force_time_s",
        "time of peak Fn after contact",
        "us",
        _scaled("peak_normal_force_time_s", 1e6),
    ),
    Quantity("contact_time_s", "time of first contact", "ms", _scaled("contact_time_s", 1e3)),
    Quantity("tip_velocity_x", "tip velocity vx at contact", "m/s", _velocity(0)),
    Quantity("tip_velocity_y", "tip velocity vy at contact", "m/s", _velocity(1)),
    Quantity("peak_stress_R_Pa", "peak stress at R", "MPa", _scaled("peak_stress_R_Pa", 1e-6)),
)
HEADLINE = ("peak_normal_force_N", "contact_duration_s", "normal_impulse_N_s")


def quantity(key: str) -> Quantity:
    """The compared scalar of that key."""
    return next(entry for entry in QUANTITIES if entry.key == key)


def error_percent(reduced: float | None, reference: float | None) -> float | None:
    """100 (reduced - reference) / reference; None where it has no meaning.

    Negative means smaller in magnitude, for negative quantities (Ft, vy) as for positive ones.
    """
    if reduced is None or reference is None or reference == 0:
        return None
    return 100 * (reduced - reference) / reference


@dataclass(frozen=True)
class Spread:
    """How far runs that should agree lie apart. Not a convergence study.

    Attributes
    ----------
    low, high : smallest and largest value.
    count : number of runs.
    """

    low: float
    high: float
    count: int

    def percent_of(self, value: float) -> float:
        """The whole spread as a share of a value, percent."""
        return 100 * (self.high - self.low) / abs(value)


def spread(runs: list[RunRecord], key: str) -> Spread | None:
    """Spread of one quantity over completed runs; None below two values."""
    read = quantity(key).read
    values = [value for run in runs if run.ok and (value := read(run)) is not None]
    if len(values) < 2:
        return None
    return Spread(min(values), max(values), len(values))
