"""Factors of the bordered matrix, a band of half width w, from its last row to its first.

Row storage: A[i, j - i + w] holds entry (i, j), |i - j| <= w. Rows are eliminated from the tip to
the fixed hinge without exchanges, A = U L with U unit upper triangular, so the factors fill the
band and no more. The order is what makes that possible: a multiplier's row has no diagonal entry,
but the node that it holds is eliminated before it and leaves -Phi A^-1 Phi^T there, and the nodes'
own block is M plus a stiffness, positive where the step is short enough for Newton's method.

SciPy's banded solvers (LAPACK gbtrf, gbtrs) exchange rows, fill a second band, and cannot be called
from compiled code that is to be cached on disk.
"""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

# w: four coordinates a node, neighbours at most seven places apart (hcm.layout).
HALF_BANDWIDTH = 7

Floats = NDArray[np.float64]

# A pivot smaller than this share of its row's largest entry leaves no accuracy: the matrix counts
# as singular.
SMALLEST_PIVOT = 1e-13


@njit(cache=True)
def factorize(band: Floats) -> bool:
    """Overwrite `band` (n, 2 w + 1) with its factors, the diagonal of L inverted.

    Returns False when a pivot is not usable (singular to working accuracy, or not finite).
    """
    w = HALF_BANDWIDTH
    for k in range(band.shape[0] - 1, -1, -1):
        pivot, largest = band[k, w], 0.0
        for j in range(w + 1):
            largest = max(largest, abs(band[k, j]))
        if not abs(pivot) > SMALLEST_PIVOT * largest or not np.isfinite(largest):
            return False
        inverse = 1.0 / pivot
        band[k, w] = inverse
        for i in range(max(0, k - w), k):
            above = k - i
            factor = band[i, above + w] * inverse
            band[i, above + w] = factor
            for j in range(w):  # column k - w + j, in row k and in row i
                band[i, above + j] -= factor * band[k, j]
    return True


@njit(cache=True)
def solve(band: Floats, x: Floats) -> None:
    """Overwrite the right-hand side `x` (n,) with the solution, given `factorize`'s output."""
    w, n = HALF_BANDWIDTH, x.size
    for i in range(n - 2, -1, -1):
        total = x[i]
        for j in range(1, min(w, n - 1 - i) + 1):
            total -= band[i, w + j] * x[i + j]
        x[i] = total
    for i in range(n):
        total = x[i]
        for j in range(1, min(w, i) + 1):
            total -= band[i, w - j] * x[i - j]
        x[i] = total * band[i, w]
