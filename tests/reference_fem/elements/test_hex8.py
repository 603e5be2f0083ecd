"""The 8-node hexahedron against mathematics: patches, rigid motions, energies, closed forms."""

import numpy as np
import pytest
from skfem import Basis, ElementHex1, ElementVector, MeshHex
from skfem.models.elasticity import lame_parameters, linear_elasticity

from reference_fem.elements import ElementKernel, hex8
from reference_fem.elements.geometry import CORNERS
from tests.reference_fem.elements.bodies import (
    DENSITY,
    POISSON,
    YOUNG,
    force,
    grid,
    kernel,
    rotation,
    tangent,
)

EPS = np.finfo(float).eps


def second_piola(gradient, poisson=POISSON):
    mu = YOUNG / (2 * (1 + poisson))
    lame = YOUNG * poisson / ((1 + poisson) * (1 - 2 * poisson))
    strain = 0.5 * (gradient.T @ gradient - np.eye(3))
    stress = lame * np.trace(strain) * np.eye(3) + 2 * mu * strain
    return stress, 0.5 * np.sum(stress * strain)


def force_noise(points, size=1e-3):
    """Round-off of a force: E h^2 times eps |X|/h, the noise of a strain from positions."""
    return 50 * EPS * YOUNG * size * np.abs(points).max()


@pytest.fixture(scope="module")
def body():
    """60 distorted elements: not a multiple of the lanes of a block."""
    points, cells = grid(5, 4, 3, distortion=0.15)
    return points, cells, kernel(points, cells)


def test_satisfies_the_protocol(body):
    k: ElementKernel = body[2]
    assert (k.n_nodes, k.n_cells, k.dim) == (120, 60, 3)
    assert k.lumped_mass.shape == (120,)
    assert k.cell_volume.shape == (60,)


def test_patch_linear_displacement(body):
    """Any F: one stress everywhere, no net force inside, and the energy W(F) V."""
    points, _, k = body
    gradient = np.eye(3) + np.array([[0.1, 0.2, 0.0], [0.0, -0.1, 0.3], [0.1, 0.0, 0.05]])
    displacement = points @ (gradient - np.eye(3)).T
    stress, energy = second_piola(gradient)
    cauchy = gradient @ stress @ gradient.T / np.linalg.det(gradient)
    expected = cauchy[[0, 1, 2, 0, 1, 0], [0, 1, 2, 1, 2, 2]]
    assert np.allclose(k.cell_stress(displacement), expected, rtol=1e-11, atol=0)
    assert k.strain_energy(displacement) == pytest.approx(energy * k.cell_volume.sum(), rel=1e-12)
    assert k.min_det_F(displacement) == pytest.approx(np.linalg.det(gradient), rel=1e-12)
    f = force(k, displacement)
    inside = np.zeros((6, 5, 4), dtype=bool)
    inside[1:-1, 1:-1, 1:-1] = True
    largest = np.abs(f).max()
    assert np.abs(f[inside.ravel()]).max() < 1e-12 * largest
    deviator = cauchy - np.trace(cauchy) / 3 * np.eye(3)
    assert k.von_mises(displacement)[7] == pytest.approx(np.sqrt(1.5 * np.sum(deviator**2)))


def test_traction_of_a_patch_is_first_piola_times_area():
    points, cells = grid(3, 2, 2, distortion=0.0)
    gradient = np.eye(3) + np.array([[0.1, 0.2, 0.0], [0.0, -0.1, 0.3], [0.1, 0.0, 0.05]])
    f = force(kernel(points, cells), points @ (gradient - np.eye(3)).T)
    face = points[:, 0] > points[:, 0].max() - 1e-9
    traction = gradient @ second_piola(gradient)[0] @ [1.0, 0.0, 0.0]
    assert np.allclose(f[face].sum(axis=0), traction * 4e-6, rtol=1e-11)


@pytest.mark.parametrize("degrees", range(30, 361, 30))
def test_rigid_motion_costs_nothing(body, degrees):
    points, _, k = body
    moved = points @ rotation(np.radians(degrees)).T + [0.003, -0.002, 0.001]
    noise = force_noise(moved)
    assert np.abs(force(k, moved - points)).max() < noise
    assert np.abs(k.cell_stress(moved - points)).max() < noise / 1e-6
    assert k.strain_energy(moved - points) < noise**2 / (YOUNG * 1e-3) * k.n_cells


def test_force_is_the_gradient_of_the_energy(body):
    """Central differences of the energy: truncation O(step^2), round-off eps W/step."""
    points, _, k = body
    rng = np.random.default_rng(3)
    displacement = 1e-4 * rng.standard_normal(points.shape)
    f = force(k, displacement)
    step = 1e-8
    for direction in rng.standard_normal((5, *points.shape)):
        up = k.strain_energy(displacement + step * direction)
        down = k.strain_energy(displacement - step * direction)
        assert np.sum(f * direction) == pytest.approx((up - down) / (2 * step), rel=1e-6)
    for node, axis in ((0, 0), (57, 1), (119, 2)):
        direction = np.zeros(points.shape)
        direction[node, axis] = step
        up, down = (k.strain_energy(displacement + s * direction) for s in (1, -1))
        assert f[node, axis] == pytest.approx((up - down) / (2 * step), rel=1e-5)


def test_frame_invariance(body):
    points, _, k = body
    displacement = 1e-4 * np.random.default_rng(4).standard_normal(points.shape)
    turn = rotation(2.0)
    turned = (points + displacement) @ turn.T - points
    f = force(k, displacement)
    assert np.allclose(force(k, turned), f @ turn.T, rtol=0, atol=1e-11 * np.abs(f).max())
    assert k.strain_energy(turned) == pytest.approx(k.strain_energy(displacement), rel=1e-11)
    assert np.allclose(k.von_mises(turned), k.von_mises(displacement), rtol=1e-10)


def test_momentum_and_moment_of_the_forces_vanish(body):
    points, _, k = body
    displacement = 1e-4 * np.random.default_rng(5).standard_normal(points.shape)
    f = force(k, displacement)
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
        per_mu.append(kernel(points, cells, poisson).strain_energy(mode) / mu)
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


def test_uniaxial_tension_of_st_venant_kirchhoff():
    """Lateral stretch from S_yy = 0: E_yy = -nu E_xx; then S_xx = E E_xx, N = stretch S_xx A."""
    points, cells = grid(4, 2, 2)
    stretch = 1.2
    axial = 0.5 * (stretch**2 - 1)
    lateral = np.sqrt(1 - 2 * POISSON * axial)
    displacement = points * ([stretch - 1, lateral - 1, lateral - 1])
    k = kernel(points, cells)
    f = force(k, displacement)
    face = points[:, 0] > points[:, 0].max() - 1e-9
    assert f[face, 0].sum() == pytest.approx(stretch * YOUNG * axial * 4e-6, rel=1e-12)
    assert np.abs(f[:, 1:]).max() < 1e-11 * f[face, 0].sum()
    expected = stretch * stretch * YOUNG * axial / (stretch * lateral**2)
    assert k.cell_stress(displacement)[0, 0] == pytest.approx(expected, rel=1e-12)
    assert k.von_mises(displacement)[0] == pytest.approx(expected, rel=1e-12)


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


def test_stress_of_chosen_cells(body):
    points, _, k = body
    displacement = 1e-5 * np.random.default_rng(11).standard_normal(points.shape)
    chosen = np.array([59, 3, 3, 17])
    everything = k.cell_stress(displacement)
    assert np.array_equal(k.cell_stress(displacement, chosen), everything[chosen])
    assert np.array_equal(k.von_mises(displacement, chosen), k.von_mises(displacement)[chosen])


def test_refuses_what_it_cannot_use():
    points, cells = grid(2, 1, 1)
    e, nu, rho = np.full(2, YOUNG), np.full(2, POISSON), np.full(2, DENSITY)
    with pytest.raises(ValueError, match=r"1 elements \(the first is cell 1\)"):
        hex8(points, np.vstack((cells[0], np.roll(cells[1], 4))), e, nu, rho)
    with pytest.raises(ValueError, match=r"poisson is 0\.5"):
        hex8(points, cells, e, np.full(2, 0.5), rho)
    with pytest.raises(ValueError, match="density is nan"):
        hex8(points, cells, e, nu, np.full(2, np.nan))
    with pytest.raises(ValueError, match="young has shape"):
        hex8(points, cells, e[:1], nu, rho)
    with pytest.raises(ValueError, match=r"only 0\.\.11 exist"):
        hex8(points, cells + 1, e, nu, rho)
    k = hex8(points, cells, e, nu, rho)
    with pytest.raises(ValueError, match="displacement has shape"):
        k.strain_energy(np.zeros((3, 3)))
    with pytest.raises(ValueError, match="C-contiguous"):
        k.internal_force(np.zeros((12, 3)), np.zeros((3, 12)).T)
