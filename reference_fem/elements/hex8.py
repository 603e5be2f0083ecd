"""The 8-node hexahedron with a mean dilatation: set-up from scikit-fem, calls of the kernels."""

from collections.abc import Iterator
from dataclasses import dataclass

import numba
import numpy as np

from reference_fem.elements import hex8_fields, hex8_kernel
from reference_fem.elements.blocks import Blocks, lanes, make_blocks
from reference_fem.elements.frequency import element_stiffness, largest_frequency
from reference_fem.elements.geometry import geometries, sum_at_nodes, triangular_inverse
from reference_fem.elements.hex8_kernel import POINT_ROWS, ROWS, SCRATCH_ROWS
from reference_fem.elements.protocol import (
    Floats,
    Integers,
    check_displacement,
    check_material,
    check_mesh,
    check_out,
)
from reference_fem.elements.stress import von_mises


@dataclass(frozen=True, eq=False)
class Hex8:
    """8-node hexahedra on one mesh; see `ElementKernel` for what each member means.

    mu, lame : (n_cells,) Lame's constants, Pa
    cell_mass : (n_cells, 8) row-sum masses of each element's nodes, kg
    centre_gradients : (n_cells, 8, 3) shape gradients at the centres, 1/m
    blocks : node numbers by block, and workspaces that calls overwrite
    reference : (n_blocks, ROWS*LANES), laid out as `hex8_kernel` says
    """

    points: Floats
    cells: Integers
    mu: Floats
    lame: Floats
    lumped_mass: Floats
    cell_volume: Floats
    cell_mass: Floats
    centre_gradients: Floats
    blocks: Blocks
    reference: Floats
    dim: int = 3

    @property
    def n_nodes(self) -> int:
        """Number of nodes."""
        return len(self.points)

    @property
    def n_cells(self) -> int:
        """Number of elements."""
        return len(self.cells)

    def internal_force(self, displacement: Floats, out: Floats) -> None:
        """Overwrite `out` (n_nodes, 3) with f_int in N, on numba's current number of threads."""
        check_out(out, self.points.shape)
        hex8_kernel.internal_force(
            self.points,
            self._checked(displacement),
            self.blocks.nodes,
            self.reference,
            self.blocks.node_range,
            numba.get_num_threads(),
            self.blocks.scratch,
            self.blocks.buffers,
            out,
        )

    def strain_energy(self, displacement: Floats) -> float:
        """Stored energy in J, from the strains at the points."""
        return hex8_fields.strain_energy(
            self.points,
            self._checked(displacement),
            self.blocks.nodes,
            self.reference,
            self.blocks.scratch[0],
        )

    def hourglass_energy(self, displacement: Floats) -> float:
        """Nothing, J: the element has no hourglass modes to control."""
        return 0.0

    def cell_stress(self, displacement: Floats, cells: Integers | None = None) -> Floats:
        """Cauchy stress at the centres, (n, 6) as xx, yy, zz, xy, yz, xz, Pa."""
        chosen = np.arange(self.n_cells) if cells is None else np.asarray(cells, dtype=np.int64)
        stress = np.empty((len(chosen), 6))
        hex8_fields.centre_stress(
            self.points,
            self._checked(displacement),
            self.blocks.nodes,
            self.reference,
            self.centre_gradients,
            chosen,
            self.blocks.scratch[0],
            stress,
        )
        return stress

    def von_mises(self, displacement: Floats, cells: Integers | None = None) -> Floats:
        """Equivalent stress at the centres, (n,), Pa."""
        return von_mises(self.cell_stress(displacement, cells))

    def min_det_F(self, displacement: Floats) -> float:
        """Smallest det F over the 8 points of all elements; NaN if the displacement holds one."""
        return hex8_fields.min_det(
            self.points,
            self._checked(displacement),
            self.blocks.nodes,
            self.reference,
            self.n_cells,
            self.blocks.scratch[0],
        )

    def max_frequency(self) -> float:
        """Bound in rad/s on the largest eigenfrequency (Irons' theorem; see `frequency`)."""
        return largest_frequency(self._stiffness_and_mass())

    def _checked(self, displacement: Floats) -> Floats:
        return check_displacement(displacement, self.points.shape)

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
        centre_gradients=centre_gradients,
        blocks=make_blocks(points, cells, SCRATCH_ROWS),
        reference=lanes(rows),
    )
