"""The plane-stress quadrilateral against mathematics: patches, rigid motions, closed forms."""

import numpy as np
import pytest
from scipy.linalg import eigh
from skfem import Basis, ElementQuad1, ElementVector, MeshQuad
from skfem.models.elasticity import linear_elasticity

from reference_fem.elements import ElementKernel, quad4_plane_stress, quad4_quadrature_points
from tests.reference_fem.elements.bodies import (
    DENSITY,
    POISSON,
    YOUNG,
    force,
    grid,
    material,
    tangent,
)

EPS = np.finfo(float).eps
MU = YOUNG / (2 * (1 + POISSON))
LAME = YOUNG * POISSON / (1 - POISSON**2)  # lambda* of plane stress


def kernel(points, cells, thickness=5e-3):
    values = np.broadcast_to(thickness, cells.shape)
    return quad4_plane_stress(points, cells, *material(len(cells)), values)


@pytest.fixture(scope="module")
def body():
    """35 distorted elements of uneven thickness."""
    points, cells = grid(7, 5, distortion=0.15)
    thickness = np.random.default_rng(1).uniform(4e-3, 6e-3, cells.shape)
    return points, cells, kernel(points, cells, thickness)


def test_satisfies_the_protocol(body):
    k: ElementKernel = body[2]
    assert (k.n_nodes, k.n_cells, k.dim) == (48, 35, 2)


def test_patch_linear_displacement():
    points, cells = grid(7, 5, distortion=0.15)
    k = kernel(points, cells)
    gradient = np.eye(2) + np.array([[0.1, 0.2], [-0.05, -0.1]])
    strain = 0.5 * (gradient.T @ gradient - np.eye(2))
    stress = LAME * np.trace(strain) * np.eye(2) + 2 * MU * strain
    through = np.sqrt(1 - 2 * POISSON / (1 - POISSON) * np.trace(strain))
    cauchy = gradient @ stress @ gradient.T / (np.linalg.det(gradient) * through)
    displacement = points @ (gradient - np.eye(2)).T
    expected = cauchy[[0, 1, 0], [0, 1, 1]]
    assert np.allclose(k.cell_stress(displacement), expected, rtol=1e-11, atol=0)
    energy = 0.5 * np.sum(stress * strain) * k.cell_volume.sum()
    assert k.strain_energy(displacement) == pytest.approx(energy, rel=1e-12)
    assert k.min_det_F(displacement) == pytest.approx(np.linalg.det(gradient), rel=1e-12)
    f = force(k, displacement).reshape(8, 6, 2)
    assert np.abs(f[1:-1, 1:-1]).max() < 1e-12 * np.abs(f).max()
    full = np.zeros((3, 3))
    full[:2, :2] = cauchy
    deviator = full - np.trace(full) / 3 * np.eye(3)
    assert k.von_mises(displacement)[3] == pytest.approx(np.sqrt(1.5 * np.sum(deviator**2)))


@pytest.mark.parametrize("degrees", range(30, 361, 30))
def test_rigid_motion_costs_nothing(body, degrees):
    points, _, k = body
    angle = np.radians(degrees)
    turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    moved = points @ turn.T + [0.003, -0.002]
    # noise of a strain from positions, times E h t
    noise = 50 * EPS * np.abs(moved).max() / 1e-3
    assert np.abs(force(k, moved - points)).max() < noise * YOUNG * 1e-3 * 6e-3
    assert np.abs(k.cell_stress(moved - points)).max() < noise * YOUNG
    assert k.strain_energy(moved - points) < noise**2 * YOUNG * k.cell_volume.sum()


def test_force_is_the_gradient_of_the_energy(body):
    points, _, k = body
    rng = np.random.default_rng(3)
    displacement = 1e-4 * rng.standard_normal(points.shape)
    f = force(k, displacement)
    step = 1e-8
    for direction in rng.standard_normal((5, *points.shape)):
        up = k.strain_energy(displacement + step * direction)
        down = k.strain_energy(displacement - step * direction)
        assert np.sum(f * direction) == pytest.approx((up - down) / (2 * step), rel=1e-6)


def test_frame_invariance(body):
    points, _, k = body
    displacement = 1e-4 * np.random.default_rng(4).standard_normal(points.shape)
    turn = np.array([[np.cos(2.0), -np.sin(2.0)], [np.sin(2.0), np.cos(2.0)]])
    turned = (points + displacement) @ turn.T - points
    f = force(k, displacement)
    assert np.allclose(force(k, turned), f @ turn.T, rtol=0, atol=1e-11 * np.abs(f).max())
    assert np.allclose(k.von_mises(turned), k.von_mises(displacement), rtol=1e-10)


def test_small_strain_stiffness_is_scikit_fems():
    """An independent assembly with lambda* in lambda's place, all four points."""
    points, cells = grid(4, 3, distortion=0.15)
    displacement = np.random.default_rng(6).standard_normal(points.shape)
    f = force(kernel(points, cells), 1e-10 * displacement) * 1e10
    mesh = MeshQuad(np.ascontiguousarray(points.T), np.ascontiguousarray(cells.T))
    basis = Basis(mesh, ElementVector(ElementQuad1()), intorder=3)
    u = basis.zeros()
    u[basis.nodal_dofs] = displacement.T
    expected = 5e-3 * (linear_elasticity(LAME, MU).assemble(basis) @ u)[basis.nodal_dofs].T
    # The strains are 1e-7: E keeps 9 digits and its quadratic part is 1e-7 of it.
    assert np.allclose(f, expected, rtol=0, atol=3e-7 * np.abs(expected).max())


def test_uniaxial_tension_of_st_venant_kirchhoff():
    points, cells = grid(4, 2)
    stretch = 1.2
    axial = 0.5 * (stretch**2 - 1)
    lateral = np.sqrt(1 - 2 * POISSON * axial)
    displacement = points * ([stretch - 1, lateral - 1])
    k = kernel(points, cells)
    f = force(k, displacement)
    face = points[:, 0] > points[:, 0].max() - 1e-9
    assert f[face, 0].sum() == pytest.approx(stretch * YOUNG * axial * 2e-3 * 5e-3, rel=1e-12)
    assert np.abs(f[:, 1]).max() < 1e-11 * f[face, 0].sum()
    # the sheet thins as much as it narrows: the true stress of the 3D bar
    expected = stretch * stretch * YOUNG * axial / (stretch * lateral**2)
    assert k.cell_stress(displacement)[0] == pytest.approx([expected, 0, 0], abs=1e-11 * expected)


def test_thickness_sits_at_its_points():
    """Mass and axial stiffness of a sheet whose thickness varies linearly with y."""
    points, cells = grid(3, 4, distortion=0.0)
    y = quad4_quadrature_points(points, cells)[..., 1]
    k = kernel(points, cells, 1e-3 + 2.0 * y)
    height = 4e-3
    assert k.cell_volume.sum() == pytest.approx(3e-3 * (1e-3 * height + height**2), rel=1e-13)
    # first moment of the mass: int rho t y dA; row sums keep it because y is in the element
    moment = DENSITY * 3e-3 * (1e-3 * height**2 / 2 + 2 * height**3 / 3)
    assert k.lumped_mass @ points[:, 1] == pytest.approx(moment, rel=1e-13)
    # u_x = scale x: E_xx = scale + scale^2/2 alone, energy (lambda* + 2 mu) E_xx^2 V/2
    scale = 1e-6
    x = points[:, 0]
    field = scale * np.column_stack((x, np.zeros_like(x)))
    modulus = LAME + 2 * MU
    expected = 0.5 * modulus * (scale + scale**2 / 2) ** 2 * k.cell_volume.sum()
    assert k.strain_energy(field) == pytest.approx(expected, rel=1e-9)


def test_quadrature_points_are_next_to_their_corners():
    points, cells = grid(1, 1, size=1.0)
    inset = 0.5 - 0.5 / np.sqrt(3)
    expected = inset + (1 - 2 * inset) * points[cells]
    assert np.allclose(quad4_quadrature_points(points, cells), expected, atol=1e-15)


def test_each_point_has_its_own_thickness():
    """Thickness at one corner's point only: that corner carries most of the mass."""
    points, cells = grid(1, 1)
    for corner in range(4):
        thickness = np.full((1, 4), 1e-9)
        thickness[0, corner] = 1e-3
        k = kernel(points, cells, thickness)
        assert np.argmax(k.lumped_mass[cells[0]]) == corner
        # an equal biaxial stretch pulls most at the corner next to the thick point
        pull = np.linalg.norm(force(k, 1e-3 * points), axis=1)
        assert np.argmax(pull[cells[0]]) == corner


@pytest.mark.parametrize("distortion", [0.0, 0.2])
def test_max_frequency_bounds_the_spectrum(distortion):
    points, cells = grid(5, 4, distortion=distortion)
    k = kernel(points, cells)
    mass = np.diag(np.repeat(k.lumped_mass, 2))
    true = np.sqrt(eigh(tangent(k, points), mass, eigvals_only=True)[-1])
    assert true < k.max_frequency() < (1.5 if distortion == 0.0 else 2.5) * true


def test_refuses_what_it_cannot_use():
    points, cells = grid(2, 1)
    with pytest.raises(ValueError, match="not positive"):
        kernel(points, cells[:, ::-1])
    with pytest.raises(ValueError, match="thickness_at_points is 0"):
        kernel(points, cells, 0.0)
