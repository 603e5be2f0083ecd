"""The 4-node quadrilateral in plane stress: set-up from scikit-fem."""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from reference_fem.arrays import Array, Index
from reference_fem.elements.base import ElementKernel, Stresses
from reference_fem.elements.blocks import Blocks
from reference_fem.elements.checks import (
    check_material,
    check_mesh,
    check_relaxation,
    damping_rows,
)
from reference_fem.elements.geometry import Geometry, by_element, geometries
from reference_fem.elements.quadrilateral import kernel


@dataclass(frozen=True, eq=False)
class Quad4PlaneStress(ElementKernel):
    """4-node quadrilaterals on one mesh; `lame` is lambda* of plane stress.

    thickness : (n_cells, 4) at the points of `quad4_quadrature_points`, m
    """

    thickness: Array

    blocks_of_kind: ClassVar[type[Blocks]] = kernel.Quad4Blocks
    scratch_rows: ClassVar[int] = kernel.SCRATCH_ROWS
    stresses: ClassVar[Stresses] = kernel.stresses

    def _geometries(self) -> Iterator[Geometry]:
        return geometries(self.points, self.cells, self.thickness)


def quad4_quadrature_points(points: Array, cells: Index) -> Array:
    """Where the thickness is asked for: the 4 Gauss points, (n_cells, 4, 2), m.

    Point q of a cell is the one nearest to its corner q.
    """
    points, cells = check_mesh(points, cells, 2, 4)
    return np.einsum("qa,nai->nqi", next(geometries(points, cells[:1])).shape, points[cells])


def quad4_plane_stress(
    points: Array,
    cells: Index,
    young: Array,
    poisson: Array,
    density: Array,
    thickness_at_points: Array,
    relaxation: Array | None = None,
) -> Quad4PlaneStress:
    """4-node quadrilaterals in plane stress with a given thickness, St. Venant-Kirchhoff.

    Parameters
    ----------
    points : (n_nodes, 2), m
    cells : (n_cells, 4) in VTK's node order
    young, poisson, density : (n_cells,) Young's modulus (Pa), Poisson's ratio, density (kg/m^3)
    thickness_at_points : (n_cells, 4), m, at the points of `quad4_quadrature_points`
    relaxation : (n_cells,) tau of the damping, s; None: none

    Raises
    ------
    ValueError
        If a shape, a material value or a thickness is wrong, or an element is inverted.
    """
    points, cells = check_mesh(points, cells, 2, 4)
    young, poisson, density = check_material(young, poisson, density, len(cells))
    thickness = np.array(thickness_at_points, dtype=np.float64)
    if thickness.shape != cells.shape:
        raise ValueError(f"thickness_at_points has shape {thickness.shape}; {cells.shape} needed")
    if not (np.isfinite(thickness) & (thickness > 0.0)).all():
        raise ValueError(f"thickness_at_points is {thickness.min()} m at a point; it must be > 0")
    tau = check_relaxation(relaxation, len(cells))
    mu = young / (2.0 * (1.0 + poisson))
    lame = young * poisson / (1.0 - poisson**2)  # = 2 lambda mu/(lambda + 2 mu)
    of_points, volume, corner_volumes, centre_gradients = by_element(
        geometries(points, cells, thickness),
        lambda g: (g.rows_of_points(), g.volume, g.corner_volumes, g.centre_gradients),
    )
    return Quad4PlaneStress(
        points=points,
        cells=cells,
        mu=mu,
        lame=lame,
        cell_volume=volume,
        cell_mass=density[:, None] * corner_volumes,
        gradients=centre_gradients,
        relaxation=tau,
        rows=np.column_stack((of_points, mu, lame, *damping_rows(tau))),
        thickness=thickness,
    )


def chord_thickness(points: Array, cells: Index, radius: Array) -> Array:
    """Chord 2 sqrt(R^2 - y^2) of the round section at the points of each cell, (n_cells, 4), m.

    With it area, second moment and mass of a section are those of the round beam, up to the
    quadrature error of the square root next to the outline. The round end keeps the chord of the
    section: it is half a cylinder across Z cut to that thickness, not half a ball.

    Parameters
    ----------
    points : (n_points, 2), m
    cells : (n_cells, 4)
    radius : (n_cells,) R of the phalanx that the cell belongs to, m
    """
    return chord(quad4_quadrature_points(points, cells)[..., 1], radius[:, None])


def chord(height: Array, radius: Array) -> Array:
    """2 sqrt(R^2 - y^2), m, of heights y (m) over the axis; 0 beyond the outline."""
    return np.asarray(2.0 * np.sqrt(np.maximum(radius**2 - height**2, 0.0)))
