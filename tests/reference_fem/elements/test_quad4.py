"""The plane-stress quadrilateral against mathematics: stiffness, thickness at its points."""

import numpy as np
import pytest
from skfem import Basis, ElementQuad1, ElementVector, MeshQuad
from skfem.models.elasticity import linear_elasticity

from reference_fem.elements.kinds import quad4_quadrature_points
from tests.reference_fem.elements.bodies import (
    DENSITY,
    POISSON,
    YOUNG,
    force,
    grid,
    sheet,
)

MU = YOUNG / (2 * (1 + POISSON))
LAME = YOUNG * POISSON / (1 - POISSON**2)  # lambda* of plane stress


def test_small_strain_stiffness_is_scikit_fems():
    """An independent assembly with lambda* in lambda's place, all four points."""
    points, cells = grid(4, 3, distortion=0.15)
    displacement = np.random.default_rng(6).standard_normal(points.shape)
    f = force(sheet(points, cells), 1e-10 * displacement) * 1e10
    mesh = MeshQuad(np.ascontiguousarray(points.T), np.ascontiguousarray(cells.T))
    basis = Basis(mesh, ElementVector(ElementQuad1()), intorder=3)
    u = basis.zeros()
    u[basis.nodal_dofs] = displacement.T
    expected = 5e-3 * (linear_elasticity(LAME, MU).assemble(basis) @ u)[basis.nodal_dofs].T
    # The strains are 1e-7: E keeps 9 digits and its quadratic part is 1e-7 of it.
    assert np.allclose(f, expected, rtol=0, atol=3e-7 * np.abs(expected).max())


def test_thickness_sits_at_its_points():
    """Mass and axial stiffness of a sheet whose thickness varies linearly with y."""
    points, cells = grid(3, 4, distortion=0.0)
    y = quad4_quadrature_points(points, cells)[..., 1]
    k = sheet(points, cells, thickness=1e-3 + 2.0 * y)
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
    assert k.energies(field)[0] == pytest.approx(expected, rel=1e-9)


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
        k = sheet(points, cells, thickness=thickness)
        assert np.argmax(k.lumped_mass[cells[0]]) == corner
        # an equal biaxial stretch pulls most at the corner next to the thick point
        pull = np.linalg.norm(force(k, 1e-3 * points), axis=1)
        assert np.argmax(pull[cells[0]]) == corner


def test_refuses_what_it_cannot_use():
    points, cells = grid(2, 1)
    with pytest.raises(ValueError, match="not positive"):
        sheet(points, cells[:, ::-1])
