"""The 4-node quadrilateral in plane stress: set-up from scikit-fem, calls of the kernels."""

from collections.abc import Iterator
from dataclasses import dataclass

import numba
import numpy as np

from reference_fem.elements import quad4_kernel
from reference_fem.elements.blocks import Blocks, lanes, make_blocks
from reference_fem.elements.frequency import element_stiffness, largest_frequency
from reference_fem.elements.geometry import (
    geometries,
    quadrature_points,
    sum_at_nodes,
    triangular_inverse,
)
from reference_fem.elements.protocol import (
    Floats,
    Integers,
    check_displacement,
    check_material,
    check_mesh,
    check_out,
)
from reference_fem.elements.quad4_kernel import POINT_ROWS, ROWS, SCRATCH_ROWS
from reference_fem.elements.stress import von_mises


@dataclass(frozen=True, eq=False)
class Quad4PlaneStress:
    """4-node quadrilaterals on one mesh; see `ElementKernel` for what each member means.

    thickness : (n_cells, 4) at the points of `quad4_quadrature_points`, m
    mu, lame : (n_cells,) Lame's constants, the second one lambda* of plane stress, Pa
    cell_mass : (n_cells, 4) row-sum masses of each element's nodes, kg
    centre_gradients : (n_cells, 4, 2) shape gradients at the centres, 1/m
    blocks : node numbers by block, and workspaces that calls overwrite
    reference : (n_blocks, ROWS*LANES), laid out as `quad4_kernel` says
    """

    points: Floats
    cells: Integers
    thickness: Floats
    mu: Floats
    lame: Floats
    lumped_mass: Floats
    cell_volume: Floats
    cell_mass: Floats
    centre_gradients: Floats
    blocks: Blocks
    reference: Floats
    dim: int = 2

    @property
    def n_nodes(self) -> int:
        """Number of nodes."""
        return len(self.points)

    @property
    def n_cells(self) -> int:
        """Number of elements."""
        return len(self.cells)

    def internal_force(self, displacement: Floats, out: Floats) -> None:
        """Overwrite `out` (n_nodes, 2) with f_int in N, on numba's current number of threads."""
        check_out(out, self.points.shape)
        quad4_kernel.internal_force(
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
        return quad4_kernel.strain_energy(
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
        """Cauchy stress at the centres, (n, 3) as xx, yy, xy, Pa."""
        chosen = np.arange(self.n_cells) if cells is None else np.asarray(cells, dtype=np.int64)
        stress = np.empty((len(chosen), 3))
        quad4_kernel.centre_stress(
            self.points,
            self._checked(displacement),
            self.cells,
            self.centre_gradients,
            self.mu,
            self.lame,
            chosen,
            stress,
        )
        return stress

    def von_mises(self, displacement: Floats, cells: Integers | None = None) -> Floats:
        """Equivalent stress at the centres, (n,), Pa."""
        return von_mises(self.cell_stress(displacement, cells))

    def min_det_F(self, displacement: Floats) -> float:
        """Smallest in-plane det F over all points; NaN if the displacement holds one."""
        return quad4_kernel.min_det(
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
        thickness=thickness,
        mu=mu,
        lame=lame,
        lumped_mass=sum_at_nodes(cells, cell_mass, len(points)),
        cell_volume=volume,
        cell_mass=cell_mass,
        centre_gradients=centre_gradients,
        blocks=make_blocks(points, cells, SCRATCH_ROWS),
        reference=lanes(rows),
    )
