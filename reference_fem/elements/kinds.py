"""The kinds of elements: set-up of each from scikit-fem, and a sheet's thickness."""

from functools import partial

import numpy as np

from reference_fem.arrays import Array, Index
from reference_fem.elements.base import ElementKernel, ElementKind, lame_constants
from reference_fem.elements.blocks import make_blocks
from reference_fem.elements.geometry import by_element, check_mesh, geometries
from reference_fem.elements.hexahedron import eight_point_kernel as eight_point
from reference_fem.elements.hexahedron import neo_hooke, saint_venant
from reference_fem.elements.hexahedron import one_point_kernel as one_point
from reference_fem.elements.quadrilateral import kernel as quad4
from reference_fem.elements.stress import neo_hooke_stress

EIGHT_POINT = ElementKind(
    saint_venant.Hex8Blocks,
    eight_point.SCRATCH_ROWS,
    saint_venant.constants,
    eight_point.pressures,
)
ONE_POINT = ElementKind(one_point.OnePointBlocks, one_point.SCRATCH_ROWS)
# A thin element's highest frequency goes with the inverse of its thickness: twice at half of it.
NEO_HOOKE = ElementKind(
    neo_hooke.NeoHookeBlocks,
    eight_point.SCRATCH_ROWS,
    neo_hooke.constants,
    eight_point.pressures,
    neo_hooke_stress,
    softens=0.0,
    stiffening=2.0,
)
PLANE_STRESS = ElementKind(quad4.Quad4Blocks, quad4.SCRATCH_ROWS)

HOURGLASS = 1.0  # c of 1-point hexahedra: exact bending of a cube


def hex8(
    points: Array, cells: Index, young: Array, poisson: Array, density: Array,
    relaxation: Array | None = None, kind: ElementKind = EIGHT_POINT,
) -> ElementKernel:  # fmt: skip
    """8-node hexahedra with a mean dilatation, St. Venant-Kirchhoff, or of another such kind.

    points : (n_nodes, 3), m. cells : (n_cells, 8) in VTK's node order.
    young (Pa), poisson, density (kg/m^3) : (n_cells,), within the bounds of `Material`.
    relaxation : (n_cells,) tau of the damping, s; None: none.

    Raises ValueError: a shape is wrong or an element is inverted.
    """
    mesh = check_mesh(points, cells, 3)
    return _at_all_points(kind, mesh, lame_constants(young, poisson), density, relaxation)


hex8_neo_hooke = partial(hex8, kind=NEO_HOOKE)
"""8-node hexahedra with a mean volume, of a compressible neo-Hookean material."""


def quad4_plane_stress(
    points: Array, cells: Index, young: Array, poisson: Array, density: Array, thickness: Array,
    relaxation: Array | None = None,
) -> ElementKernel:  # fmt: skip
    """4-node quadrilaterals in plane stress with a given thickness, St. Venant-Kirchhoff.

    Other parameters and errors are those of `hex8`; `ElementKernel.lame` is lambda* of plane
    stress, 2 lambda mu/(lambda + 2 mu).

    points, cells : (n_nodes, 2), m; (n_cells, 4) in VTK's node order.
    thickness : (n_cells, 4), m, above zero, at the points of `quad4_quadrature_points`.
    """
    mesh = check_mesh(points, cells, 2)
    lame = lame_constants(young, poisson)[0], young * poisson / (1.0 - poisson**2)
    return _at_all_points(PLANE_STRESS, mesh, lame, density, relaxation, thickness)


def _at_all_points(
    kind: ElementKind, mesh: tuple[Array, Index], constants: tuple[Array, Array], density: Array,
    relaxation: Array | None, thickness: Array | None = None,
) -> ElementKernel:  # fmt: skip
    """Elements with 2^dim Gauss points each; constants are mu and the second one of the kind."""
    (points, cells), (mu, lame) = mesh, constants
    of_points, volume, corner_volumes, centre_gradients = by_element(
        geometries(points, cells, thickness),
        lambda g: (g.rows_of_points(), g.volume, g.corner_volumes, g.centre_gradients),
    )
    tau = np.zeros(len(cells)) if relaxation is None else relaxation
    rows = [of_points, mu, *kind.constants(lame, volume)]
    if tau.any():  # they are not stored if all are zero
        rows.append(tau)
    masses = density[:, None] * corner_volumes
    return _kernel(
        kind, mesh, constants, (volume, masses, centre_gradients), tau, np.column_stack(rows)
    )


def hex8_one_point(
    points: Array, cells: Index, young: Array, poisson: Array, density: Array,
    relaxation: Array | None = None,
) -> ElementKernel:  # fmt: skip
    """8-node hexahedra with one point and hourglass stiffness, St. Venant-Kirchhoff.

    Parameters and errors are those of `hex8`; a relaxation time is an error too.
    `ElementKernel.gradients` are the mean ones.
    """
    mesh = check_mesh(points, cells, 3)
    if relaxation is not None and relaxation.any():
        raise ValueError(
            f"relaxation_time = {relaxation.max():g}: one point damps no hourglass modes (part of "
            "bending): use element = 'hex8-sri', or leave relaxation_time out"
        )
    constants = mu, lame = lame_constants(young, poisson)
    volume, corner_volumes, integrals = by_element(
        geometries(*mesh),
        lambda g: (g.volume, g.corner_volumes, np.einsum("nq,nqai->nai", g.weights, g.gradients)),
    )
    gradients = integrals / volume[:, None, None]
    squares = np.einsum("nai,nai->n", gradients, gradients)
    control = HOURGLASS * young * volume * squares / 72.0
    rows = np.stack((volume * mu, volume * lame, control), axis=1)
    masses, tau = density[:, None] * corner_volumes, np.zeros(len(volume))
    return _kernel(ONE_POINT, mesh, constants, (volume, masses, gradients), tau, rows)


def _kernel(
    kind: ElementKind, mesh: tuple[Array, Index], constants: tuple[Array, Array],
    integrals: tuple[Array, Array, Array], relaxation: Array, rows: Array,
) -> ElementKernel:  # fmt: skip
    """Volumes (n_cells,), the corners' masses (n_cells, a) and gradients; `rows` of the blocks."""
    (points, cells), (mu, lame), (volume, masses, gradients) = mesh, constants, integrals
    return ElementKernel(
        kind=kind,
        points=points,
        cells=cells,
        mu=mu,
        lame=lame,
        cell_volume=volume,
        lumped_mass=np.bincount(cells.ravel(), masses.ravel(), len(points)).astype(np.float64),
        gradients=gradients,
        relaxation=relaxation,
        blocks=make_blocks(kind.blocks, points, cells, rows, kind.scratch_rows),
    )


def quad4_quadrature_points(points: Array, cells: Index) -> Array:
    """The 4 Gauss points, where the thickness is needed, (n_cells, 4, 2), m.

    Point q of a cell is the one nearest to its corner q.
    """
    points, cells = check_mesh(points, cells, 2)
    return np.einsum("qa,nai->nqi", next(geometries(points, cells[:1])).shape, points[cells])


def chord_thickness(points: Array, cells: Index, radius: Array) -> Array:
    """Chord 2 sqrt(R^2 - y^2) of the round section at the points of each cell, (n_cells, 4), m.

    With it area, second moment and mass of a section are those of the round beam, up to the
    quadrature error of the square root near the outline. The round end keeps the chord of the
    section: it is half a cylinder across Z cut to that thickness, not half a ball.

    points : (n_points, 2), m. cells : (n_cells, 4).
    radius : (n_cells,) R of the phalanx that the cell belongs to, m.
    """
    return chord(quad4_quadrature_points(points, cells)[..., 1], radius[:, None])


def chord(height: Array, radius: Array) -> Array:
    """2 sqrt(R^2 - y^2), m, of heights y (m) over the axis; 0 beyond the outline."""
    return np.asarray(2.0 * np.sqrt(np.maximum(radius**2 - height**2, 0.0)))
