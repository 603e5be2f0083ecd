"""What the judges of both solvers share: a tap's scalars, and how much two taps differ."""

from collections.abc import Iterable, Iterator
from typing import Any

import numpy as np
from scipy.integrate import cumulative_trapezoid

# A run whose contact steps are at most this share of what was asked counts as at a smaller step.
SMALLER_STEP = 0.5
# Share of the impulse after which a tap counts as over: round-off decides when a tip or a node that
# lingers at zero force separates, and no other number depends on that.
DELIVERED = 0.99


def judged_scalars(summary: Any, forces: Any) -> tuple[float, ...] | None:
    """Peak F_n (N), impulse (N s) and time to deliver `DELIVERED` of it (s); None without a tap.

    summary, forces : a result's scalars, and its columns ``time_s`` and ``normal_force_N``, whose
    rows after the tap are ignored.
    """
    start, duration = summary.contact_time_s, summary.contact_duration_s
    if start is None or duration is None or not summary.normal_impulse_N_s:
        return None
    rows = forces.time_s <= (start + duration) * (1.0 + 1e-12)
    time = forces.time_s[rows]
    impulse = cumulative_trapezoid(forces.normal_force_N[rows], time, initial=0.0)
    delivered = float(np.interp(DELIVERED * impulse[-1], impulse, time)) - start
    return float(summary.peak_normal_force_N), float(summary.normal_impulse_N_s), delivered


def largest_difference(
    found: tuple[float, ...] | None, truth: tuple[float, ...] | None
) -> float | None:
    """Largest relative difference of scalars, None where there is no tap to compare."""
    if found is None or truth is None:
        return None
    return max(abs(a / b - 1.0) for a, b in zip(found, truth, strict=True))


def not_finite(parts: Iterable[Any]) -> Iterator[str]:
    """Sentences on arrays and numbers of a result's parts that are not finite; None is skipped."""
    for part in parts:
        for name, value in vars(part).items():
            if value is not None and not np.isfinite(np.asarray(value, dtype=float)).all():
                yield f"{name} is not finite"
