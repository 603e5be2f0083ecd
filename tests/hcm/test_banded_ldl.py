"""The compiled banded factorization against LAPACK's."""

import numpy as np
import pytest

import hcm
from hcm.assembly.equations import residual, tangent
from hcm.beam.banded_ldl import HALF_BANDWIDTH, factorize, solve, storage
from hcm.beam.chain import build_chain
from hcm.contact.law import COMPRESSION, RESTITUTION, SLIP, STICK, ContactLaw, ContactState
from hcm.integrators.generalized_alpha import solve_linear
from hcm.integrators.workspace import Integrator, coefficients, workspace
from tests.hcm.cases import SOFT, dense_of, finger

W = HALF_BANDWIDTH
LAW = ContactLaw(1e6, 0.8, 0.75, 0.5, 0.1)


def rows_of(dense: np.ndarray) -> np.ndarray:
    n = len(dense)
    rows = storage(n)
    for i in range(n):
        for j in range(max(0, i - W), i + 1):
            rows[W + i, W - i + j] = dense[i, j]
    return rows


def random_band(n: int, seed: int) -> np.ndarray:
    """Symmetric, with a dominant diagonal of either sign: no exchanges are called for."""
    rng = np.random.default_rng(seed)
    dense = rng.standard_normal((n, n))
    dense = np.where(np.abs(np.subtract.outer(np.arange(n), np.arange(n))) <= W, dense, 0.0)
    return dense + dense.T + 4 * W * np.diag(rng.choice([-1.0, 1.0], n))


def solved(dense: np.ndarray, b: np.ndarray) -> np.ndarray:
    rows, x = rows_of(dense), np.concatenate([np.zeros(W), b])
    assert factorize(rows)
    solve(rows, x)
    assert not rows[:W].any()  # the zeros in front stay zero
    assert not x[:W].any()
    return x[W:]


@pytest.mark.parametrize("n", [1, 5, 8, 30, 80])
def test_random_matrices(n: int) -> None:
    dense = random_band(n, n)
    b = np.random.default_rng(1).standard_normal(n)
    # both are backward stable: they differ by the condition number times round-off
    bound = 100 * np.finfo(float).eps * np.linalg.cond(dense)
    expected = np.linalg.solve(dense, b)
    assert np.abs(solved(dense, b) - expected).max() <= bound * np.abs(expected).max()


@pytest.mark.parametrize("elements", [1, 4, 40])
@pytest.mark.parametrize("phalanges", [1, 3])
@pytest.mark.parametrize("weight", [0.0, 1e-14, 1e-9, 1e-6])
def test_bordered_matrix_of_a_finger(elements: int, phalanges: int, weight: float) -> None:
    """The hinges' rows have a zero diagonal, which elimination from the tip fills in time."""
    chain, q = build_chain(finger(SOFT, phalanges, elements=elements), hcm.Drive())
    contact = ContactState(COMPRESSION, STICK, 0.0, 0.0, 0.0, 0.0)
    rows = storage(q.size)
    assert tangent(q, weight, weight**0.5, chain, contact, LAW, rows) == 0.0
    dense = dense_of(rows)
    assert np.all(np.diag(dense)[chain.hinge] == 0)
    b = np.random.default_rng(2).standard_normal(q.size)
    x = solved(dense, b)
    # eliminating without exchanges costs no digits: the residual is LAPACK's up to a factor
    mine = np.abs(dense @ x - b).max()
    theirs = np.abs(dense @ np.linalg.solve(dense, b) - b).max()
    assert mine < 100 * max(theirs, np.finfo(float).eps * np.abs(dense).max() * np.abs(x).max())


@pytest.mark.parametrize("contact", [
    ContactState(COMPRESSION, STICK, 0.0, 3.0, -1e-6, 0.0),
    ContactState(COMPRESSION, SLIP, 1.0, 3.0, -1e-6, 0.0),
    ContactState(RESTITUTION, SLIP, -1.0, 3.0, -1e-6, 0.0),
])  # fmt: skip
@pytest.mark.parametrize("tau", [0.0, 1e-5])
def test_solution_is_newtons_step_for_the_residual(contact: ContactState, tau: float) -> None:
    """A bent, driven finger in contact: differences of the residual, friction's row included.

    At rest, where what the tangent leaves out of the damping is zero.
    """
    drive = hcm.Drive(torques=(2e-3, 1e-3), reaction=True)
    chain, q = build_chain(finger(SOFT, 2, elements=3, relaxation_time=tau), drive)
    rng, n, weight, rate_weight = np.random.default_rng(3), q.size, 1e-10, 2e-5
    q = q + 1e-3 * rng.standard_normal(n) * chain.scale
    integrator = Integrator(coefficients(0.8, 1e-9), chain, LAW, workspace(n))

    def balance(y: np.ndarray) -> np.ndarray:
        out = np.empty(n)
        change = chain.scale * y
        freely = np.where(lam, 0.0, change)
        residual(q + weight * freely, rate_weight * freely, change, chain, contact, LAW, out)
        return chain.scale * out

    lam = np.zeros(n, dtype=bool)
    lam[np.add.outer(chain.hinge, [0, 1])] = True
    # positions of 0.1 m move by 1e-10 * 1e3 = 1e-7 m, slopes by 1e-5: central differences
    jacobian = np.array([balance(u) - balance(-u) for u in 1e3 * np.eye(n)]).T / 2e3
    b = rng.standard_normal(n)
    integrator.work.right[W:] = b
    assert solve_linear(q, weight, rate_weight, contact, integrator)
    error = np.abs(jacobian @ integrator.work.right[W:] - b).max()
    # the differences lose what E A strains lose to round-off: 1e-16 of the residual over its change
    assert error < 1e-5 * np.abs(b).max()


@pytest.mark.parametrize("spoil", ["zero column", "not a number", "infinite"])
def test_singular_matrices_are_refused(spoil: str) -> None:
    dense = random_band(20, 5)
    if spoil == "zero column":
        dense[:, 11] = dense[11, :] = 0.0
    else:
        dense[11, 11] = np.nan if spoil == "not a number" else np.inf
    assert not factorize(rows_of(dense))
