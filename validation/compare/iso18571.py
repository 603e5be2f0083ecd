"""ISO/TS 18571 rating of a computed curve against a reference: corridor, phase, magnitude, slope.

Two curves t (reference) and c (computed) of N equally spaced samples, T = max |t|:

    corridor   Z   mean of ((δ_o - |t - c|)/(δ_o - δ_i))², cut to 0..1, δ_i = 0.05 T, δ_o = 0.5 T
    phase      E_P = (0.2 N - n)/(0.2 N), n the shift of c (at most 0.2 N samples) with the highest
                     correlation coefficient; both curves are cut to where they then overlap
    magnitude  E_M = (0.5 - ε)/0.5, ε = Σ|c_w - t_w|/Σ|t_w|, the shifted curves warped onto each
                     other (dynamic time warping within 10 % of their length, squared differences)
    slope      E_S = (2 - ε)/2, ε = Σ|c' - t'|/Σ|t'|, slopes of the shifted curves by central
                     differences, averaged over nine samples (fewer at the ends)
    rating     R = 0.4 Z + 0.2 E_P + 0.2 E_M + 0.2 E_S

all cut to 0..1; identical curves give 1. Grades: excellent above 0.94, good above 0.80, fair above
0.58, else poor.

Source: ISO/TS 18571:2014, Road vehicles - Objective rating metric for non-ambiguous signals.
"""

from typing import NamedTuple

import numpy as np

from validation.compare.force_curves import first_tap
from validation.harness.record import Floats, RunRecord

INNER, OUTER = 0.05, 0.5
LARGEST_SHIFT = 0.2
LARGEST_MAGNITUDE = 0.5
LARGEST_SLOPE = 2.0
WARP = 0.1
WEIGHTS = (0.4, 0.2, 0.2, 0.2)
GRADES = ((0.94, "excellent"), (0.80, "good"), (0.58, "fair"))
SAMPLES = 501  # per contact window; more change R by less than 0.001, and warping costs N^2


class Rating(NamedTuple):
    """Scores in 0..1; 1 for identical curves."""

    corridor: float
    phase: float
    magnitude: float
    slope: float

    @property
    def overall(self) -> float:
        """The rating R."""
        return float(np.dot(WEIGHTS, self))

    @property
    def grade(self) -> str:
        """The standard's word for R."""
        return next((word for limit, word in GRADES if self.overall > limit), "poor")


def iso18571(computed: Floats, reference: Floats) -> Rating:
    """Rate a curve.

    computed, reference : (n,), equally spaced samples at the same times, n at least 20.

    Raises ValueError: the curves differ in length, are too short, not finite, or one is constant.
    """
    c, t = (np.asarray(curve, dtype=float) for curve in (computed, reference))
    if c.shape != t.shape or c.ndim != 1 or c.size < 20:
        raise ValueError(
            f"ISO 18571: curves of shapes {c.shape} and {t.shape}: must be equal, at least 20 "
            "samples"
        )
    if not (np.isfinite(c).all() and np.isfinite(t).all()) or np.ptp(c) == 0 or np.ptp(t) == 0:
        raise ValueError("ISO 18571: a curve is constant or not finite; nothing to correlate")
    shift, c_s, t_s = _shifted(c, t)
    allowed = LARGEST_SHIFT * c.size
    return Rating(
        _corridor(c, t),
        max(0.0, (allowed - shift) / allowed),
        max(0.0, 1 - _magnitude(c_s, t_s) / LARGEST_MAGNITUDE),
        max(0.0, 1 - _slope(c_s, t_s) / LARGEST_SLOPE),
    )


def rate_forces(
    computed: RunRecord, reference: RunRecord, name: str = "normal_force_N"
) -> Rating | None:
    """Rate a contact force from first contact (t = t_c in both runs) to the later separation.

    None where a run has no finished contact or a curve is constant (no friction).
    """
    found = first_tap((computed, reference), name, SAMPLES)
    if found is None or any(np.ptp(curve) == 0 for curve in found[1]):
        return None
    return iso18571(*found[1])


def _corridor(c: Floats, t: Floats) -> float:
    largest = np.abs(t).max()
    inner, outer = INNER * largest, OUTER * largest
    inside = np.clip((outer - np.abs(t - c)) / (outer - inner), 0, 1)
    return float(np.mean(inside**2))


def _shifted(c: Floats, t: Floats) -> tuple[int, Floats, Floats]:
    """Shift with the highest correlation (if equal, the smallest, then left); both curves."""
    best, shift = np.corrcoef(t, c)[0, 1], 0
    result = (c, t)
    for n in range(1, int(LARGEST_SHIFT * c.size) + 1):
        for moved in ((c[n:], t[:-n]), (c[:-n], t[n:])):
            if np.ptp(moved[0]) == 0 or np.ptp(moved[1]) == 0:
                continue
            correlation = np.corrcoef(*moved)[0, 1]
            if correlation > best:
                best, shift, result = correlation, n, moved
    return shift, *result


def _magnitude(c: Floats, t: Floats) -> float:
    """Σ|c_w - t_w|/Σ|t_w| along the cheapest warping path."""
    n = c.size
    window = int(np.ceil(WARP * n)) - 1
    cost = np.full((n + 1, n + 1), np.inf)
    cost[0, 0] = 0.0
    step = np.zeros((n + 1, n + 1), dtype=np.int8)
    for i in range(1, n + 1):
        for j in range(max(1, i - window), min(n, i + window) + 1):
            before = (cost[i - 1, j], cost[i, j - 1], cost[i - 1, j - 1])
            least = min(before)
            step[i, j] = before.index(least)
            cost[i, j] = least + (c[i - 1] - t[j - 1]) ** 2
    i = j = n
    difference = size = 0.0
    while i > 0 and j > 0:
        difference += abs(c[i - 1] - t[j - 1])
        size += abs(t[j - 1])
        way = step[i, j]
        i, j = i - (way != 1), j - (way != 0)
    return difference / size


def _slope(c: Floats, t: Floats) -> float:
    """Σ|c' - t'|/Σ|t'|."""
    c_s, t_s = (_smooth(np.gradient(curve)) for curve in (c, t))
    return float(np.abs(c_s - t_s).sum() / np.abs(t_s).sum())


def _smooth(slope: Floats) -> Floats:
    """Mean over nine samples; of 1, 3, 5, 7 at the four ends on either side."""
    result = np.empty_like(slope)
    for i, count in enumerate((1, 3, 5, 7)):
        result[i], result[-1 - i] = slope[:count].mean(), slope[-count:].mean()
    result[4:-4] = np.convolve(slope, np.full(9, 1 / 9), mode="valid")
    return result
