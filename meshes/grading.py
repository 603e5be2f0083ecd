"""Geometric progressions of edge lengths along one curve."""

from __future__ import annotations

import math

from scipy.optimize import brentq


def count_even(length: float, size: float, least: int = 1) -> int:
    """Number of even edges of about `size` on a curve of `length`, at least `least`."""
    return max(least, round(length / size))


def count_graded(length: float, size: float, growth: float) -> int:
    """Fewest edges h, hg, hg^2, ... with h <= `size` and g = `growth` that fill `length`.

    The sum of n edges is ``h (g^n - 1)/(g - 1)``.
    """
    return math.ceil(math.log1p(length * (growth - 1.0) / size) / math.log(growth) - 1e-9)


def progression(length: float, size: float, count: int) -> float:
    """Ratio q >= 1 of neighbouring edges so that `count` edges starting at `size` fill `length`.

    Solves ``size (q^n - 1)/(q - 1) = length``; 1 if even edges are already as short as `size`.
    """
    if count < 2 or length / count <= size:
        return 1.0

    def excess(q: float) -> float:
        return size * math.fsum(q**k for k in range(count)) - length

    # The last edge alone is shorter than the curve, which bounds q.
    largest = (length / size) ** (1.0 / (count - 1))
    return float(brentq(excess, 1.0, largest, xtol=1e-14, rtol=1e-14))
