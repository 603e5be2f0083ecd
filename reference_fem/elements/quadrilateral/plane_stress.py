"""The 4-node quadrilateral in plane stress: set-up from scikit-fem."""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from reference_fem.elements.base import BlockElement, Stresses
from reference_fem.elements.blocks import make_blocks
from reference_fem.elements.frequency import element_stiffness
from reference_fem.elements.geometry import (
    geometries,
    quadrature_points,
    sum_at_nodes,
    triangular_inverse,
)
from reference_fem.elements.protocol import Floats, Integers, check_material, check_mesh
from reference_fem.elements.quadrilateral import kernel as kernel
from reference_fem.elements.quadrilateral.kernel import POINT_ROWS, ROWS, SCRATCH_ROWS


@dataclass(frozen=True, eq=False)
class Quad4PlaneStress(BlockElement):
    """4-node quadrilaterals on one mesh; `lame` is lambda* of plane stress.

    thickness : (n_cells, 4) at the points of `quad4_quadrature_points`, m
    """

    thickness: Floats

    stresses: ClassVar[Stresses] = kernel.stresses

    def _stiffness_and_mass(self) -> Iterator[tuple[Floats, Floats]]:
        for g in geometries(self.points, self.cells):
            weights, mu, lame = g.weights * self.thickness[g.cells], self.mu[g.cells], self.lame
            stiffness = element_stiffness(
                g.gradients, weights, mu, lame[g.cells], mean_dilatation=False
            )
            yield stiffness, self.cell_mass[g.cells]


def quad4_quadrature_points(points: Floats, cells: Integers) -> Floats:
    """Where the thickness is asked for: the 4 Gauss points, (n_cells, 4, 2), m.

    Point q of a cell is the one nearest to its corner q.
    """
    points, cells = check_mesh(points, cells, 2, 4)
    return quadrature_points(points, cells)


def quad4_plane_stress(
    points: Floats,
    cells: Integers,
    young: Floats,
    poisson: Floats,
    density: Floats,
    thickness_at_points: Floats,
) -> Quad4PlaneStress:
    """4-node quadrilaterals in plane stress with a given thickness, St. Venant-Kirchhoff.

    Parameters
    ----------
    points : (n_nodes, 2), m
    cells : (n_cells, 4) in VTK's node order
    young, poisson, density : (n_cells,) Young's modulus (Pa), Poisson's ratio, density (kg/m^3)
    thickness_at_points : (n_cells, 4), m, at the points of `quad4_quadrature_points`

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
    mu = young / (2.0 * (1.0 + poisson))
    lame = young * poisson / (1.0 - poisson**2)  # = 2 lambda mu/(lambda + 2 mu)
    rows = np.empty((len(cells), ROWS))
    volume = np.empty(len(cells))
    cell_mass = np.empty(cells.shape)
    centre_gradients = np.empty((*cells.shape, 2))
    for g in geometries(points, cells):
        weights = g.weights * thickness[g.cells]
        at_points = np.dstack((triangular_inverse(g.jacobian), weights))
        rows[g.cells, : 4 * POINT_ROWS] = at_points.reshape(len(at_points), -1)
        volume[g.cells] = weights.sum(axis=1)
        cell_mass[g.cells] = density[g.cells, None] * (weights @ g.shape)
        centre_gradients[g.cells] = g.centre_gradients
    rows[:, 4 * POINT_ROWS] = mu
    rows[:, 4 * POINT_ROWS + 1] = lame
    return Quad4PlaneStress(
        points=points,
        cells=cells,
        mu=mu,
        lame=lame,
        lumped_mass=sum_at_nodes(cells, cell_mass, len(points)),
        cell_volume=volume,
        cell_mass=cell_mass,
        gradients=centre_gradients,
        blocks=make_blocks(kernel.Quad4Blocks, points, cells, rows, SCRATCH_ROWS),
        thickness=thickness,
    )
