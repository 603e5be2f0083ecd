"""The 1-point hexahedron with hourglass stiffness: set-up from scikit-fem, calls of the kernels."""

from collections.abc import Iterator
from dataclasses import dataclass

import numba
import numpy as np

from reference_fem.elements import hex8_one_point_kernel as kernel
from reference_fem.elements.blocks import Blocks, lanes, make_blocks
from reference_fem.elements.frequency import element_stiffness, largest_frequency
from reference_fem.elements.geometry import CHUNK, CORNERS, geometries, sum_at_nodes
from reference_fem.elements.protocol import (
    Floats,
    Integers,
    check_displacement,
    check_material,
    check_mesh,
    check_out,
)
from reference_fem.elements.stress import von_mises

HOURGLASS = 1.0  # c: exact bending of a cube


def hourglass_signs() -> Floats:
    """Hourglass vectors h^n, (4, 8): xi eta, eta zeta, xi zeta, xi eta zeta at the corners."""
    x, y, z = (2.0 * CORNERS[3] - 1.0).T
    return np.ascontiguousarray([x * y, y * z, x * z, x * y * z])


@dataclass(frozen=True, eq=False)
class Hex8OnePoint:
    """Hexahedra with one point on one mesh; see `ElementKernel` for what each member means.

    mu, lame : (n_cells,) Lame's constants, Pa
    cell_mass : (n_cells, 8) row-sum masses of each element's nodes, kg
    gradients : (n_cells, 8, 3) mean shape gradients, 1/m
    shapes : (n_cells, 4, 3) G^n, sums of the corners with the signs of each hourglass mode, m
    moduli : (n_cells, 3) V mu and V lambda in J, and the hourglass stiffness k in N/m
    blocks : node numbers by block, and workspaces that calls overwrite
    reference : (n_blocks, ROWS*LANES), laid out as `hex8_one_point_kernel` says
    """

    points: Floats
    cells: Integers
    mu: Floats
    lame: Floats
    lumped_mass: Floats
    cell_volume: Floats
    cell_mass: Floats
    gradients: Floats
    shapes: Floats
    moduli: Floats
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
        kernel.internal_force(
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
        """Stored energy in J, that of the hourglass modes included."""
        return sum(self._energies(displacement))

    def hourglass_energy(self, displacement: Floats) -> float:
        """The hourglass modes' share of the stored energy, J."""
        return self._energies(displacement)[1]

    def cell_stress(self, displacement: Floats, cells: Integers | None = None) -> Floats:
        """Cauchy stress of the elements, (n, 6) as xx, yy, zz, xy, yz, xz, Pa."""
        chosen = np.arange(self.n_cells) if cells is None else np.asarray(cells, dtype=np.int64)
        stress = np.empty((len(chosen), 6))
        kernel.stresses(
            self.points,
            self._checked(displacement),
            self.cells,
            self.gradients,
            self.mu,
            self.lame,
            chosen,
            stress,
        )
        return stress

    def von_mises(self, displacement: Floats, cells: Integers | None = None) -> Floats:
        """Equivalent stress of the elements, (n,), Pa."""
        return von_mises(self.cell_stress(displacement, cells))

    def min_det_F(self, displacement: Floats) -> float:
        """Smallest det F over the elements; NaN if the displacement holds one."""
        return kernel.min_det(self.points, self._checked(displacement), self.cells, self.gradients)

    def max_frequency(self) -> float:
        """Bound in rad/s on the largest eigenfrequency (Irons' theorem; see `frequency`)."""
        return largest_frequency(self._stiffness_and_mass())

    def _checked(self, displacement: Floats) -> Floats:
        return check_displacement(displacement, self.points.shape)

    def _energies(self, displacement: Floats) -> tuple[float, float]:
        u = self._checked(displacement)
        strain, hourglass = kernel.energies(
            self.points, u, self.cells, self.gradients, hourglass_signs(), self.shapes, self.moduli
        )
        return float(strain), float(hourglass)

    def _stiffness_and_mass(self) -> Iterator[tuple[Floats, Floats]]:
        signs = hourglass_signs()
        for start in range(0, self.n_cells, CHUNK):
            some = slice(start, start + CHUNK)
            b = self.gradients[some]
            stiffness = element_stiffness(
                b[:, None], self.cell_volume[some, None], self.mu[some], self.lame[some], False
            )
            g = signs - np.einsum("enj,eaj->ena", self.shapes[some], b)
            control = np.einsum("e,ena,enb,ij->eaibj", self.moduli[some, 2], g, g, np.eye(3))
            yield stiffness + control.reshape(stiffness.shape), self.cell_mass[some]


def hex8_one_point(
    points: Floats, cells: Integers, young: Floats, poisson: Floats, density: Floats
) -> Hex8OnePoint:
    """8-node hexahedra with one point and hourglass stiffness, St. Venant-Kirchhoff.

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
    volume = np.empty(len(cells))
    cell_mass = np.empty(cells.shape)
    gradients = np.empty((*cells.shape, 3))
    for g in geometries(points, cells):
        volume[g.cells] = g.weights.sum(axis=1)
        cell_mass[g.cells] = density[g.cells, None] * (g.weights @ g.shape)
        integral = np.einsum("nq,nqai->nai", g.weights, g.gradients)
        gradients[g.cells] = integral / volume[g.cells, None, None]
    squares = np.einsum("nai,nai->n", gradients, gradients)
    stiffness = HOURGLASS * young * volume * squares / 72.0
    moduli = np.stack((volume * mu, volume * lame, stiffness), axis=1)
    shapes = np.einsum("na,eaj->enj", hourglass_signs(), points[cells])
    by_direction = gradients.transpose(0, 2, 1)
    rows = np.hstack((by_direction.reshape(-1, 24), shapes.reshape(-1, 12), moduli))
    return Hex8OnePoint(
        points=points,
        cells=cells,
        mu=mu,
        lame=lame,
        lumped_mass=sum_at_nodes(cells, cell_mass, len(points)),
        cell_volume=volume,
        cell_mass=cell_mass,
        gradients=gradients,
        shapes=shapes,
        moduli=moduli,
        blocks=make_blocks(points, cells, kernel.SCRATCH_ROWS),
        reference=lanes(rows),
    )
