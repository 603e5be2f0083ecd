"""The compiled banded factorization against LAPACK's."""

import numpy as np
import pytest
from scipy.linalg import solve_banded

import hcm
from hcm.banded_lu import HALF_BANDWIDTH, factorize, solve
from hcm.equations import tangent
from hcm.layout import Law, build_chain
from hcm.lumped_contact import COMPRESSION, STICK, Contact

W = HALF_BANDWIDTH


def row_storage(dense: np.ndarray) -> np.ndarray:
    n = len(dense)
    band = np.zeros((n, 2 * W + 1))
    for i in range(n):
        for j in range(max(0, i - W), min(n, i + W + 1)):
            band[i, j - i + W] = dense[i, j]
    return band


def dense_of(band: np.ndarray) -> np.ndarray:
    n = len(band)
    dense = np.zeros((n, n))
    for i in range(n):
        for j in range(max(0, i - W), min(n, i + W + 1)):
            dense[i, j] = band[i, j - i + W]
    return dense


def lapack(dense: np.ndarray, b: np.ndarray) -> np.ndarray:
    n = len(dense)
    w = min(W, n - 1)
    diagonals = np.zeros((2 * w + 1, n))
    for i in range(n):
        for j in range(max(0, i - w), min(n, i + w + 1)):
            diagonals[w + i - j, j] = dense[i, j]
    return solve_banded((w, w), diagonals, b)


def random_band(n: int, seed: int) -> np.ndarray:
    """Unsymmetric, with a dominant diagonal: no exchanges are called for."""
    dense = np.random.default_rng(seed).standard_normal((n, n))
    dense = np.where(np.abs(np.subtract.outer(np.arange(n), np.arange(n))) <= W, dense, 0.0)
    return dense + 2 * W * np.eye(n)


@pytest.mark.parametrize("n", [1, 5, 8, 30, 80])
def test_random_matrices(n: int) -> None:
    dense = random_band(n, n)
    b = np.random.default_rng(1).standard_normal(n)
    band, x = row_storage(dense), b.copy()
    assert factorize(band)
    solve(band, x)
    # both are backward stable: they differ by the condition number times round-off
    bound = 100 * np.finfo(float).eps * np.linalg.cond(dense)
    expected = lapack(dense, b)
    assert np.abs(x - expected).max() <= bound * np.abs(expected).max()


@pytest.mark.parametrize("elements", [1, 4, 40])
@pytest.mark.parametrize("phalanges", [1, 3])
@pytest.mark.parametrize("weight", [0.0, 1e-14, 1e-9, 1e-6])
def test_bordered_matrix_of_a_finger(elements: int, phalanges: int, weight: float) -> None:
    """The hinges' rows have a zero diagonal, which elimination from the tip fills in time."""
    body = hcm.Finger((hcm.Phalanx(0.04, 0.015, 1e9, 1400.0, elements),) * phalanges)
    chain, q = build_chain(body, hcm.Drive())
    contact = Contact(COMPRESSION, STICK, 0.0, 0.0, 0.0, 0.0)
    band = np.empty((q.size, 2 * W + 1))
    tangent(q, weight, chain, contact, Law(1e6, 1.0, 0.75, 0.5, 0.1), band)
    dense = dense_of(band)
    assert np.all(np.diag(dense)[chain.hinge] == 0)
    np.testing.assert_allclose(dense, dense.T, atol=1e-14 * np.abs(dense).max())
    b = np.random.default_rng(2).standard_normal(q.size)
    x = b.copy()
    assert factorize(band)
    solve(band, x)
    # eliminating without exchanges costs no digits: the residual is LAPACK's up to a factor
    mine = np.abs(dense @ x - b).max()
    theirs = np.abs(dense @ np.linalg.solve(dense, b) - b).max()
    assert mine < 100 * max(theirs, np.finfo(float).eps * np.abs(dense).max() * np.abs(x).max())


@pytest.mark.parametrize("spoil", ["zero column", "not a number", "infinite"])
def test_singular_matrices_are_refused(spoil: str) -> None:
    dense = random_band(20, 5)
    if spoil == "zero column":
        dense[:, 11] = 0.0
    else:
        dense[11, 11] = np.nan if spoil == "not a number" else np.inf
    assert not factorize(row_storage(dense))
