"""The bound on the largest eigenfrequency of 8-node hexahedra: above it, and not far."""

import numpy as np
import pytest
from scipy.linalg import eigh

from reference_fem.elements.frequency import largest_eigenvalue
from tests.reference_fem.elements.bodies import grid, kernel, tangent


def test_stiffness_behind_the_frequency_is_the_tangent():
    """Element stiffness against central differences of the force (noise 1e-8), nu large."""
    points, cells = grid(1, 1, 1, distortion=0.2)
    k = kernel(points, cells, 0.49)
    stiffness, mass = (part[0] for part in next(k._stiffness_and_mass()))
    assert mass == pytest.approx(k.lumped_mass[cells[0]], rel=1e-13)
    dofs = (3 * cells[0][:, None] + np.arange(3)).ravel()
    expected = tangent(k, points)[np.ix_(dofs, dofs)]
    assert np.allclose(stiffness, expected, rtol=0, atol=1e-7 * np.abs(expected).max())


def test_bound_is_tight_where_all_eigenvalues_agree():
    """The worst case of the Frobenius norm, 24^(1/2p) with p = 64, among lesser matrices."""
    matrices = np.array([0.5, 2.0, 1.9])[:, None, None] * np.eye(24)
    assert largest_eigenvalue(matrices, 0.0) == pytest.approx(2.0 * 24 ** (1 / 128), rel=1e-12)
    assert largest_eigenvalue(matrices, 3.0) == 3.0


def test_max_frequency_of_one_element_is_its_own():
    """On one element the theorem's bound is the eigenvalue itself, up to the norm's 1.2 %."""
    points, cells = grid(1, 1, 1, distortion=0.1)
    k = kernel(points, cells)
    mass = np.diag(np.repeat(k.lumped_mass, 3))
    true = np.sqrt(eigh(tangent(k, points), mass, eigvals_only=True)[-1])
    assert true * (1 - 1e-7) <= k.max_frequency() <= 24 ** (1 / 256) * true


def test_max_frequency_is_that_of_the_worst_element():
    points, cells = grid(6, 2, 2)
    flat = points.copy()
    flat[points[:, 0] > 5.5e-3, 0] -= 0.8e-3  # the last layer is 0.2 mm thick
    worst = np.flatnonzero(cells.max(axis=1) == len(points) - 1)
    alone = kernel(flat, cells[worst]).max_frequency()
    assert kernel(flat, cells).max_frequency() == pytest.approx(alone, rel=1e-9)
