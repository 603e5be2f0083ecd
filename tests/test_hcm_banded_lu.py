"""The compiled banded factorization against LAPACK's."""

import numpy as np
import pytest
from scipy.linalg import solve_banded

import hcm
from hcm.banded_lu import factorize, solve
from hcm.equations import tangent
from hcm.layout import HALF_BANDWIDTH, Law, build_chain
from hcm.lumped_contact import COMPRESSION, STICK, Contact


def row_storage(dense: np.ndarray, w: int) -> np.ndarray:
    n = len(dense)
    band = np.zeros((n, 3 * w + 1))
    for i in range(n):
        for j in range(max(0, i - w), min(n, i + w + 1)):
            band[i, j - i + w] = dense[i, j]
    return band


def dense_of(band: np.ndarray, w: int) -> np.ndarray:
    n = len(band)
    dense = np.zeros((n, n))
    for i in range(n):
        for j in range(max(0, i - w), min(n, i + w + 1)):
            dense[i, j] = band[i, j - i + w]
    return dense


def lapack(dense: np.ndarray, w: int, b: np.ndarray) -> np.ndarray:
    n = len(dense)
    diagonals = np.zeros((2 * w + 1, n))
    for i in range(n):
        for j in range(max(0, i - w), min(n, i + w + 1)):
            diagonals[w + i - j, j] = dense[i, j]
    return solve_banded((w, w), diagonals, b)


def random_band(n: int, w: int, seed: int) -> np.ndarray:
    dense = np.random.default_rng(seed).standard_normal((n, n))
    return np.where(np.abs(np.subtract.outer(np.arange(n), np.arange(n))) <= w, dense, 0.0)


@pytest.mark.parametrize(("n", "w"), [(1, 1), (5, 7), (30, 1), (60, 3), (80, 7)])
def test_random_matrices(n: int, w: int) -> None:
    dense = random_band(n, w, n)
    b = np.random.default_rng(1).standard_normal(n)
    band, pivots, x = row_storage(dense, w), np.empty(n, dtype=np.int64), b.copy()
    assert factorize(band, pivots)
    solve(band, pivots, x)
    # both are backward stable: they differ by the condition number times round-off
    bound = 100 * np.finfo(float).eps * np.linalg.cond(dense)
    expected = lapack(dense, w, b)
    assert np.abs(x - expected).max() <= bound * np.abs(expected).max()


def test_needs_pivots() -> None:
    """A zero diagonal, as in the hinges' rows: elimination without exchanges would divide by it."""
    dense = random_band(40, 4, 0)
    np.fill_diagonal(dense, 0.0)
    b = np.ones(40)
    band, pivots, x = row_storage(dense, 4), np.empty(40, dtype=np.int64), b.copy()
    assert factorize(band, pivots)
    solve(band, pivots, x)
    assert np.abs(dense @ x - b).max() < 1e-10


def test_bordered_matrix_of_a_finger() -> None:
    body = hcm.Finger((hcm.Phalanx(0.04, 0.015, 1e9, 1400.0, 4),) * 3)
    chain, q = build_chain(body, hcm.Drive())
    contact = Contact(COMPRESSION, STICK, 0.0, 0.0, 0.0, 0.0)
    band = np.empty((q.size, 3 * HALF_BANDWIDTH + 1))
    tangent(q, 1e-14, chain, contact, Law(1e6, 1.0, 0.75, 0.5, 0.1), band)
    dense = dense_of(band, HALF_BANDWIDTH)
    np.testing.assert_allclose(dense, dense.T, atol=1e-14 * np.abs(dense).max())
    b = np.random.default_rng(2).standard_normal(q.size)
    pivots, x = np.empty(q.size, dtype=np.int64), b.copy()
    assert factorize(band, pivots)
    solve(band, pivots, x)
    expected = np.linalg.solve(dense, b)
    assert np.abs(x - expected).max() < 1e-10 * np.abs(expected).max()


@pytest.mark.parametrize("spoil", ["zero column", "not a number", "infinite"])
def test_singular_matrices_are_refused(spoil: str) -> None:
    dense = random_band(20, 3, 5)
    if spoil == "zero column":
        dense[:, 11] = 0.0
    else:
        dense[11, 11] = np.nan if spoil == "not a number" else np.inf
    assert not factorize(row_storage(dense, 3), np.empty(20, dtype=np.int64))
