"""LU factors of a banded matrix with partial pivoting (Golub and Van Loan, section 4.3).

Row storage: A[i, j - i + w] holds entry (i, j), w the half bandwidth; each row has 3 w + 1 places,
the last w for the fill that row exchanges bring. SciPy's banded solvers (LAPACK gbtrf, gbtrs) do
the same but cannot be called from compiled code that is to be cached on disk.
"""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]


@njit(cache=True)
def factorize(band: Floats, pivots: Ints) -> bool:
    """Overwrite `band` (n, 3 w + 1) with its factors and fill `pivots` (n,).

    Returns False when a column has no usable pivot (singular, or not finite).
    """
    n, width = band.shape
    w = (width - 1) // 3
    for k in range(n):
        last_row = min(n, k + w + 1)
        p, largest = k, abs(band[k, w])
        for i in range(k + 1, last_row):
            size = abs(band[i, k - i + w])
            if size > largest:
                p, largest = i, size
        pivots[k] = p
        if not largest > 0.0 or not np.isfinite(largest):
            return False
        columns = min(n - k, 2 * w + 1)
        if p != k:
            shift = k - p + w
            for j in range(columns):
                swap = band[k, w + j]
                band[k, w + j] = band[p, shift + j]
                band[p, shift + j] = swap
        inverse = 1.0 / band[k, w]
        for i in range(k + 1, last_row):
            start = k - i + w
            factor = band[i, start] * inverse
            band[i, start] = factor
            if factor != 0.0:
                for j in range(1, columns):
                    band[i, start + j] -= factor * band[k, w + j]
    return True


@njit(cache=True)
def solve(band: Floats, pivots: Ints, x: Floats) -> None:
    """Overwrite the right-hand side `x` (n,) with the solution, given `factorize`'s output."""
    n, width = band.shape
    w = (width - 1) // 3
    for k in range(n):
        p = pivots[k]
        if p != k:
            swap = x[k]
            x[k] = x[p]
            x[p] = swap
        for i in range(k + 1, min(n, k + w + 1)):
            x[i] -= band[i, k - i + w] * x[k]
    for k in range(n - 1, -1, -1):
        total = x[k]
        for j in range(1, min(n - k, 2 * w + 1)):
            total -= band[k, w + j] * x[k + j]
        x[k] = total / band[k, w]
