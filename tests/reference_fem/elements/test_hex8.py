"""The 8-node hexahedron against mathematics: traction, momentum, locking, bending, mass."""

import numpy as np
import pytest
from skfem import Basis, ElementHex1, ElementVector, MeshHex
from skfem.models.elasticity import lame_parameters, linear_elasticity

from reference_fem import Material
from reference_fem.elements.geometry import CORNERS
from reference_fem.elements.kinds import hex8
from reference_fem.statics.tip import _stiffness
from tests.reference_fem.elements.bodies import (
    DENSITY,
    POISSON,
    YOUNG,
    force,
    grid,
    kernel,
    tangent,
)


def test_traction_of_a_patch_is_first_piola_times_area():
    points, cells = grid(3, 2, 2, distortion=0.0)
    gradient = np.eye(3) + np.array([[0.1, 0.2, 0.0], [0.0, -0.1, 0.3], [0.1, 0.0, 0.05]])
    f = force(kernel(points, cells), points @ (gradient - np.eye(3)).T)
    face = points[:, 0] > points[:, 0].max() - 1e-9
    strain, (lame, mu) = 0.5 * (gradient.T @ gradient - np.eye(3)), lame_parameters(YOUNG, POISSON)
    piola = lame * np.trace(strain) * np.eye(3) + 2 * mu * strain
    traction = gradient @ piola @ [1.0, 0.0, 0.0]
    assert np.allclose(f[face].sum(axis=0), traction * 4e-6, rtol=1e-11)


def test_stiffness_of_statics_is_the_tangent():
    """Against central differences of the force (noise 1e-8), nu large."""
    points, cells = grid(2, 1, 1, distortion=0.2)
    expected = tangent(kernel(points, cells, 0.49), points)
    found = _stiffness(points, cells, Material(YOUNG, 0.49, DENSITY)).toarray()
    assert np.allclose(found, expected, rtol=0, atol=1e-7 * np.abs(expected).max())


def test_momentum_and_moment_of_the_forces_vanish():
    points, cells = grid(5, 4, 3, distortion=0.15)
    displacement = 1e-4 * np.random.default_rng(5).standard_normal(points.shape)
    f = force(kernel(points, cells), displacement)
    assert np.abs(f.sum(axis=0)).max() < 1e-12 * np.abs(f).sum()
    moment = np.cross(points + displacement, f)
    assert np.abs(moment.sum(axis=0)).max() < 1e-12 * np.abs(moment).sum()


def test_small_strain_stiffness_is_scikit_fems():
    """At nu = 0 nothing is reduced, so an independent assembly must agree (FD noise 1e-8)."""
    points, cells = grid(3, 2, 2, distortion=0.15)
    displacement = np.random.default_rng(6).standard_normal(points.shape)
    f = force(kernel(points, cells, 0.0), 1e-10 * displacement) * 1e10
    expected = (full_integration(points, cells, 0.0) @ displacement.ravel()).reshape(f.shape)
    # The strains are 1e-7: E keeps 9 digits and its quadratic part is 1e-7 of it.
    assert np.allclose(f, expected, rtol=0, atol=3e-7 * np.abs(expected).max())


def test_mean_dilatation_does_not_lock():
    """Trilinear bending mode (x y, -x^2/2) of one cube: full integration gives it the energy of
    a pressure lambda y; the mean dilatation is zero, so the energy stays finite as nu -> 1/2.
    """
    points, cells = grid(1, 1, 1, size=2e-3)
    centred = points - points.mean(axis=0)
    mode = np.zeros_like(points)
    mode[:, 0] = 1e-3 * centred[:, 0] * centred[:, 1] / 1e-3
    per_mu = []
    for poisson in (0.0, 0.4, 0.499, 0.49999):
        mu = YOUNG / (2 * (1 + poisson))
        per_mu.append(kernel(points, cells, poisson).energies(mode)[0] / mu)
    # mean tr E is of second order in the displacement (1e-6), squared, times lambda/mu = 5e4
    assert np.allclose(per_mu, per_mu[0], rtol=5e4 * 1e-6)


def test_bending_of_a_nearly_incompressible_bar():
    """Timoshenko's deflection at nu = 0.3 and 0.499; scikit-fem's full integration locks there.

    Four elements over the height miss 1/16 or less (parasitic shear of a trilinear element is of
    order (h/H)^2), and the clamp's Poisson effect is a few per cent.
    """
    points, cells = grid(12, 4, 2)
    free = np.flatnonzero(np.repeat(points[:, 0] > 1e-9, 3))
    end = points[:, 0] > points[:, 0].max() - 1e-9
    load = np.zeros(points.shape)
    load[end, 1] = 1.0 / end.sum()
    length, area, inertia = 12e-3, 8e-6, 2e-3 * 4e-3**3 / 12
    for poisson in (0.3, 0.499):
        shear = 5 / 6 * YOUNG / (2 * (1 + poisson)) * area
        theory = length**3 / (3 * YOUNG * inertia) + length / shear
        stiffness = tangent(kernel(points, cells, poisson), points)
        deflection = solve_bar(stiffness, free, load.ravel())
        assert deflection == pytest.approx(theory, rel=1 / 16 + 0.04)
    assert solve_bar(full_integration(points, cells, 0.499), free, load.ravel()) < 0.5 * theory


def solve_bar(stiffness, free, load):
    return np.linalg.solve(stiffness[np.ix_(free, free)], load[free]) @ load[free]


def full_integration(points, cells, poisson):
    """scikit-fem's own linear elasticity, rows and columns node by node."""
    place = [int(np.flatnonzero((CORNERS[3] == c).all(1))[0]) for c in ElementHex1().doflocs]
    mesh = MeshHex(np.ascontiguousarray(points.T), np.ascontiguousarray(cells[:, place].T))
    basis = Basis(mesh, ElementVector(ElementHex1()), intorder=3)
    stiffness = linear_elasticity(*lame_parameters(YOUNG, poisson)).assemble(basis)
    dofs = basis.nodal_dofs.T.ravel()
    return stiffness.toarray()[np.ix_(dofs, dofs)]


def test_mass_and_volume():
    points, cells = grid(4, 3, 2, distortion=0.1)
    n = len(cells)
    density = np.linspace(1000, 2000, n)
    k = hex8(points, cells, np.full(n, YOUNG), np.full(n, POISSON), density)
    assert k.lumped_mass.sum() == pytest.approx(np.sum(density * k.cell_volume), rel=1e-13)
    assert (k.lumped_mass > 0).all()
    # Row sums keep the first moment, int rho X dV: move inner nodes only, so that it is a box's.
    points, cells = grid(4, 3, 2)
    size = points.max(axis=0)
    inside = ((points > 1e-9) & (points < size - 1e-9)).all(axis=1)
    points[inside] += 2e-4 * np.random.default_rng(2).uniform(-1, 1, (inside.sum(), 3))
    moment = kernel(points, cells).lumped_mass @ points
    assert moment == pytest.approx(DENSITY * size.prod() * size / 2, rel=1e-13)
    box = kernel(*grid(4, 3, 2))
    assert box.cell_volume == pytest.approx(np.full(24, 1e-9), rel=1e-12)
    assert box.lumped_mass.min() == pytest.approx(DENSITY * 1e-9 / 8, rel=1e-12)


def test_refuses_what_it_cannot_use():
    points, cells = grid(2, 1, 1)
    with pytest.raises(ValueError, match=r"1 elements \(the first is cell 1\)"):
        kernel(points, np.vstack((cells[0], np.roll(cells[1], 4))))
    with pytest.raises(ValueError, match=r"only 0\.\.11 exist"):
        kernel(points, cells + 1)


def test_refuses_arrays_of_another_layout():
    k = kernel(*grid(2, 1, 1))
    with pytest.raises(ValueError, match="nodal field has shape"):
        k.energies(np.zeros((3, 3)))
    with pytest.raises(ValueError, match="C-contiguous"):
        k.internal_force(np.zeros((12, 3)), np.zeros((3, 12)).T)
