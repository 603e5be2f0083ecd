"""What the judges of both solvers share: a tap's scalars, and how much two taps differ."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import cumulative_trapezoid

# A run whose contact steps are this share of what was asked, or less, has a step of its own.
SMALLER_STEP = 0.5
# Share of the impulse after which a tap counts as over: a tip or a node that lingers at zero force
# decides on its separation by round-off, and no other number depends on when.
DELIVERED = 0.99

Floats = NDArray[np.float64]
Scalars = tuple[float, float, float]


def tap_scalars(
    peak_N: float, impulse_N_s: float, start_s: float, time_s: Floats, force_N: Floats
) -> Scalars:
    """Peak F_n (N), impulse (N s) and time to deliver `DELIVERED` of it (s).

    time_s, force_N : the tap's normal force, the tap's end being the last row.
    """
    impulse = cumulative_trapezoid(force_N, time_s, initial=0.0)
    delivered = float(np.interp(DELIVERED * impulse[-1], impulse, time_s)) - start_s
    return peak_N, impulse_N_s, delivered


def largest_difference(found: tuple[float, ...], truth: tuple[float, ...]) -> float:
    """Largest relative difference of scalars."""
    return max(abs(a / b - 1.0) for a, b in zip(found, truth, strict=True))
