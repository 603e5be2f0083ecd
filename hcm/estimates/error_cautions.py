"""What a run says of numbers that its estimated errors leave open."""

import math

import numpy as np

from hcm.arrays import Floats
from hcm.estimates.resolution import CAUTION_ERROR
from hcm.parameters import Settings
from hcm.results.result import Errors, Summary, TapResult

TITLES = {
    "contact_time_s": "time of contact",
    "tip_velocity_at_contact_m_per_s": "tip velocity at contact",
    "peak_normal_force_N": "peak normal force",
    "peak_normal_force_time_s": "time of the peak",
    "peak_tangential_force_N": "peak tangential force",
    "contact_duration_s": "contact duration",
    "normal_impulse_N_s": "normal impulse",
    "peak_stress_R_Pa": "peak stress at R",
}
"""Numbers with an estimated error: the summary's field, and the name in messages."""


def relative_errors(summary: Summary, errors: Errors) -> dict[str, float]:
    """Errors over their numbers; a velocity's over the speed."""
    shares = {}
    for name, error in errors.items():
        value = getattr(summary, name)
        largest, size = error, value
        if isinstance(error, tuple):
            largest, size = max(error), math.hypot(*value)
        shares[name] = largest / max(abs(size), 1e-300)
    return shares


def caution(shares: dict[str, float], settings: Settings, remedy: str = "") -> tuple[str, ...]:
    """One line that names what is known to less than `CAUTION_ERROR`, and the remedy.

    remedy : another one than smaller tolerances or steps and more elements.
    """
    poor = sorted((name for name in shares if shares[name] > CAUTION_ERROR), key=shares.__getitem__)
    if not poor:
        return ()
    known = ", ".join(f"{TITLES[name]} {percent(shares[name])}" for name in reversed(poor))
    controlled = settings.flight_tolerance > 0.0 and settings.contact_tolerance > 0.0
    kind = "tolerance" if controlled else "step"
    smaller = f"solver.hcm.flight_{kind} and solver.hcm.contact_{kind}"
    remedy = remedy or f"reduce {smaller}, or raise finger.elements"
    return (f"estimated errors beyond {percent(CAUTION_ERROR)}: {known}; {remedy}",)


def tap_peaks(result: TapResult) -> Floats:
    """Largest F_n of each tap that ended, N."""
    time, force = result.history.time_s, result.history.normal_force_N
    ended = [tap for tap in result.taps if tap[1] < math.inf]
    rows = [(time.searchsorted(a), time.searchsorted(b, side="right")) for a, b in ended]
    return np.array([force[begin:end].max() for begin, end in rows])


def later_taps(own: Floats, other: Floats) -> tuple[str, ...]:
    """Caution about the peaks of later taps, which the estimates leave out: two runs may agree by
    chance, and what follows a tap that differs is no better known.
    """
    if own.size < 2:
        return ()
    common = min(own.size, other.size)
    shares = np.full(own.size, math.inf)
    shares[:common] = np.abs(other[:common] - own[:common]) / np.maximum(own[:common], 1e-300)
    differs = 1 + np.flatnonzero(shares[1:] > CAUTION_ERROR)
    if differs.size:
        first = int(differs[0])
        share, apart = float(shares[first]), "a second run has no such tap"
        if share < math.inf:
            far = f"a factor of {1.0 + share:.0f}" if share >= 10.0 else percent(share)
            apart = f"{far} apart in two runs"
        follows = ", and what follows is as unknown" * (first + 1 < own.size)
        found = f"peak normal force of tap {first + 1}: {apart}{follows}"
    else:
        most = percent(float(shares[1:].max()))
        found = f"peak normal forces at most {most} apart in two runs, which may agree by chance"
    return (
        "estimated errors cover the first tap only: later taps depend on the vibration it leaves"
        f" ({found})",
    )


def percent(share: float) -> str:
    """A share as text, in per cent with two digits; "unknown" if infinite."""
    if share == math.inf:
        return "unknown"
    if share > 10.0:
        return "more than 1000 %"
    return f"{100 * share:.2g} %" if share < 0.995 else f"{100 * share:.0f} %"
