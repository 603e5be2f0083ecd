"""Factors of the symmetric bordered matrix, a band of half width w, from last row to first.

Row storage, the lower half only: R[w + i, w - i + j] holds entry (i, j), i - w <= j <= i. Rows are
eliminated from the tip to the fixed hinge without exchanges, A = L^T D L with L unit lower
triangular, so the factors fill the band and no more. The order is what makes that possible: a
multiplier's row has no diagonal entry, but the node that it holds is eliminated before it and
leaves -Phi A^-1 Phi^T there, and the nodes' own block is M plus a stiffness, positive where the
step is short enough for Newton's method.

The w rows and entries in front are zero and stay so: every row then has w neighbours, loops have
constant lengths and are unrolled by the compiler.

SciPy's banded solvers (LAPACK pbtrf needs a definite matrix, gbtrf exchanges rows and fills a
second band) can't be called from compiled code that is to be cached on disk.
"""

from __future__ import annotations

import math

import numpy as np

from hcm.arrays import Complexes, Floats
from hcm.compiled import entry, kernel

# w: four coordinates a node, neighbours at most seven places apart (hcm.beam.chain).
HALF_BANDWIDTH = 7


# A pivot smaller than this share of the sum of its row's entries leaves no accuracy: the matrix
# counts as singular.
SMALLEST_PIVOT = 1e-13


def storage(n: int) -> Floats:
    """Zeros for a matrix of n rows, (w + n, w + 1)."""
    return np.zeros((HALF_BANDWIDTH + n, HALF_BANDWIDTH + 1))


@entry
def factorize(rows: Floats) -> bool:
    """Overwrite `rows` (w + n, w + 1) with its factors: L below the diagonal, 1/D on it.

    Returns False when a pivot is not usable (singular to working accuracy, or not finite).
    """
    w = HALF_BANDWIDTH
    for k in range(rows.shape[0] - 1, w - 1, -1):
        row = rows[k]
        # numba's complex division raises instead of giving infinity
        if row[w] == 0.0:
            return False
        inverse = 1.0 / row[w]
        size = 0.0
        for j in range(w):
            share = row[j] * inverse
            # |Re| + |Im| will do, without a complex number's square root
            size += abs(share.real) + abs(share.imag)
        # written so that NaN and infinity fail
        if not (size < 1.0 / SMALLEST_PIVOT and abs(row[w]) < math.inf):
            return False
        for above in range(1, w + 1):
            target = rows[k - above]
            factor = row[w - above] * inverse
            for j in range(w + 1 - above):
                target[j + above] -= factor * row[j]
        for j in range(w):
            row[j] *= inverse
        row[w] = inverse
    return True


@entry
def solve(rows: Floats, x: Floats) -> None:
    """Overwrite the right-hand side in x[w:] with the solution, given `factorize`'s output.

    x is (w + n,), its first w entries zero. The w unknowns that a row couples to stay in registers,
    x_i being i places away, so that only one subtraction waits for a row's result.
    """
    w, last = HALF_BANDWIDTH, x.size - 1
    x0, x1, x2, x3 = x[last], x[last - 1], x[last - 2], x[last - 3]
    x4, x5, x6 = x[last - 4], x[last - 5], x[last - 6]
    for k in range(last, w - 1, -1):
        row, x7 = rows[k], x[k - 7]
        x[k] = x0 * row[7]
        following = x1 - row[6] * x0
        x1, x2, x3 = x2 - row[5] * x0, x3 - row[4] * x0, x4 - row[3] * x0
        x4, x5, x6 = x5 - row[2] * x0, x6 - row[1] * x0, x7 - row[0] * x0
        x0 = following
    x1 = x2 = x3 = x4 = x5 = x6 = x7 = 0.0
    for k in range(w, last + 1):
        row = rows[k]
        older = (row[0] * x7 + row[1] * x6) + (row[2] * x5 + row[3] * x4)
        x0 = x[k] - older - (row[4] * x3 + row[5] * x2) - row[6] * x1
        x[k] = x0
        x7, x6, x5, x4, x3, x2, x1 = x6, x5, x4, x3, x2, x1, x0


@kernel
def factorize_rank_one(
    rows: Floats | Complexes, unsymmetric_factor: complex, y: int, column: Floats,
    rank_one: Floats | Complexes,
) -> bool:  # fmt: skip
    """Overwrite S by its factors and fill rank_one with S^-1 c; return whether S + u c e_y^T, u the
    unsymmetric factor, is regular. u = 0: there is no such part.

    column : c, which may be the same array as rank_one.
    """
    if not factorize(rows):
        return False
    if unsymmetric_factor == 0.0:
        return True
    for i in range(column.size):
        rank_one[i] = column[i]
    solve(rows, rank_one)
    return abs(1.0 + unsymmetric_factor * rank_one[y]) > SMALLEST_PIVOT


@kernel
def solve_rank_one(
    rows: Floats | Complexes, unsymmetric_factor: complex, y: int, rank_one: Floats | Complexes,
    x: Floats | Complexes,
) -> None:  # fmt: skip
    """`solve` with S + u c e_y^T, given the outputs of `factorize_rank_one`.

    With z = S^-1 b it is z - S^-1 c u z_y/(1 + u (S^-1 c)_y) (Sherman and Morrison).
    """
    solve(rows, x)
    if unsymmetric_factor != 0.0:
        share = unsymmetric_factor * x[y] / (1.0 + unsymmetric_factor * rank_one[y])
        for i in range(HALF_BANDWIDTH, x.size):
            x[i] -= share * rank_one[i]
