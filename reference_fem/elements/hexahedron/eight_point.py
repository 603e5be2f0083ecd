"""The 8-node hexahedron with a mean dilatation: set-up from scikit-fem."""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from reference_fem.elements.base import BlockElement, Stresses
from reference_fem.elements.blocks import make_blocks
from reference_fem.elements.frequency import element_stiffness
from reference_fem.elements.geometry import geometries, sum_at_nodes, triangular_inverse
from reference_fem.elements.hexahedron import eight_point_outputs as outputs
from reference_fem.elements.hexahedron.eight_point_kernel import ROWS, SCRATCH_ROWS
from reference_fem.elements.hexahedron.point import POINT_ROWS
from reference_fem.elements.protocol import Floats, Integers, check_material, check_mesh


@dataclass(frozen=True, eq=False)
class Hex8(BlockElement):
    """8-node hexahedra on one mesh; `gradients` are those at the centres."""

    stresses: ClassVar[Stresses] = outputs.stresses

    def _stiffness_and_mass(self) -> Iterator[tuple[Floats, Floats]]:
        for g in geometries(self.points, self.cells):
            mu, lame = self.mu[g.cells], self.lame[g.cells]
            stiffness = element_stiffness(g.gradients, g.weights, mu, lame, mean_dilatation=True)
            yield stiffness, self.cell_mass[g.cells]


def hex8(points: Floats, cells: Integers, young: Floats, poisson: Floats, density: Floats) -> Hex8:
    """8-node hexahedra with a mean dilatation, St. Venant-Kirchhoff.

    Parameters
    ----------
    points : (n_nodes, 3), m
    cells : (n_cells, 8) in VTK's node order
    young, poisson, density : (n_cells,) Young's modulus (Pa), Poisson's ratio, density (kg/m^3)

    Raises
    ------
    ValueError
        If a shape or a material value is wrong, or an element is inverted.
    """
    points, cells = check_mesh(points, cells, 3, 8)
    young, poisson, density = check_material(young, poisson, density, len(cells))
    mu = young / (2.0 * (1.0 + poisson))
    lame = young * poisson / ((1.0 + poisson) * (1.0 - 2.0 * poisson))
    rows = np.empty((len(cells), ROWS))
    volume = np.empty(len(cells))
    cell_mass = np.empty(cells.shape)
    centre_gradients = np.empty((*cells.shape, 3))
    for g in geometries(points, cells):
        at_points = np.dstack((triangular_inverse(g.jacobian), g.weights))
        rows[g.cells, : 8 * POINT_ROWS] = at_points.reshape(len(at_points), -1)
        volume[g.cells] = g.weights.sum(axis=1)
        cell_mass[g.cells] = density[g.cells, None] * (g.weights @ g.shape)
        centre_gradients[g.cells] = g.centre_gradients
    rows[:, 8 * POINT_ROWS] = mu
    rows[:, 8 * POINT_ROWS + 1] = lame / volume
    return Hex8(
        points=points,
        cells=cells,
        mu=mu,
        lame=lame,
        lumped_mass=sum_at_nodes(cells, cell_mass, len(points)),
        cell_volume=volume,
        cell_mass=cell_mass,
        gradients=centre_gradients,
        blocks=make_blocks(outputs.Hex8Blocks, points, cells, rows, SCRATCH_ROWS),
    )
