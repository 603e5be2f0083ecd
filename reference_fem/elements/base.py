"""What the explicit loop asks of an element, and what elements of every kind have in common.

Contract for whoever adds an element (one file for the set-up, one for its compiled kernel; what
else elements share is in `blocks`, `loops` and `threads`):

1. One object per mesh, built once by a function (`hex8`, `quad4_plane_stress`), frozen afterwards.
2. Arrays in, arrays out, SI units, node order of VTK and gmsh.
3. `internal_force` is the exact gradient of `strain_energy`; a rigid motion gives neither.
4. The same input and the same number of threads give the same bits.
5. No call allocates arrays of the size of the mesh except to return them. What a call needs is a
   workspace inside the object, so one object serves one caller at a time (it is not re-entrant).
"""

import copy
from collections.abc import Callable, Iterator
from dataclasses import InitVar, dataclass, field
from functools import cached_property
from typing import ClassVar, Self

import numba
import numpy as np

from reference_fem.arrays import Array, Index
from reference_fem.elements import loops
from reference_fem.elements.blocks import Blocks, make_blocks
from reference_fem.elements.checks import check_displacement, check_out
from reference_fem.elements.frequency import element_stiffness, largest_frequency
from reference_fem.elements.geometry import Geometry, geometries
from reference_fem.elements.stress import damping_stress, von_mises

# (blocks, displacement, gradients, mu, lame, cells, out (n, components) in Pa)
Stresses = Callable[[Blocks, Array, Array, Array, Array, Index, Array], None]


@dataclass(frozen=True, eq=False)
class ElementKernel:
    """Elements of one kind on one mesh.

    points : (n_nodes, dim), m
    cells : (n_cells, corners)
    mu, lame : (n_cells,) Lame's constants, Pa; the second one lambda* in plane stress
    cell_volume : (n_cells,) reference volumes, m^3
    cell_mass : (n_cells, corners) row-sum masses of each element's nodes, kg
    gradients : (n_cells, corners, dim) shape gradients that stresses are taken with, 1/m
    relaxation : (n_cells,) tau of Kelvin and Voigt's damping S = C : (E + tau dE/dt), s
    rows : (n_cells, rows) what the kernels store of each element
    lumped_mass : (n_nodes,) sums of the row-sum masses, kg, of the body as meshed
    blocks : that in blocks, and workspaces that calls overwrite

    Of a kind: its class of `Blocks`, the rows of its kernels' workspace, its compiled function of
    stresses in the order of `Stresses`, and whether its volumetric term is reduced.
    """

    points: Array
    cells: Index
    mu: Array
    lame: Array
    cell_volume: Array
    cell_mass: Array
    gradients: Array
    relaxation: Array
    rows: InitVar[Array]
    lumped_mass: Array = field(init=False)
    blocks: Blocks = field(init=False)

    blocks_of_kind: ClassVar[type[Blocks]]
    scratch_rows: ClassVar[int]
    stresses: ClassVar[Stresses]
    mean_dilatation: ClassVar[bool] = False

    def __post_init__(self, rows: Array) -> None:
        mass = np.bincount(self.cells.ravel(), self.cell_mass.ravel(), len(self.points))
        kind, scratch_rows = type(self).blocks_of_kind, type(self).scratch_rows
        blocks = make_blocks(kind, self.points, self.cells, rows, scratch_rows)
        object.__setattr__(self, "lumped_mass", mass)
        object.__setattr__(self, "blocks", blocks)

    def with_masses(self, factors: Array, lumped_mass: Array) -> Self:
        """The same elements, the mass of each of their nodes by these factors (n_nodes,).

        lumped_mass : (n_nodes,), what hanging nodes handed on in its place, kg; before the factors
        """
        heavier = copy.copy(self)
        object.__setattr__(heavier, "cell_mass", self.cell_mass * factors[self.cells])
        object.__setattr__(heavier, "lumped_mass", lumped_mass * factors)
        return heavier

    @property
    def n_nodes(self) -> int:
        """Number of nodes."""
        return len(self.points)

    @property
    def n_cells(self) -> int:
        """Number of elements."""
        return len(self.cells)

    @property
    def dim(self) -> int:
        """Number of space dimensions."""
        return self.points.shape[1]

    @property
    def loop_bytes(self) -> int:
        """What one evaluation of the force reads of the elements, nodal arrays excepted, bytes."""
        return self.blocks.nodes.nbytes + self.blocks.reference.nbytes

    def internal_force(self, displacement: Array, out: Array) -> None:
        """Overwrite `out` (n_nodes, dim) with f_int in N, on numba's current number of threads."""
        check_out(out, self.points.shape)
        u = self._checked(displacement)
        loops.internal_force(self.blocks, u, numba.get_num_threads(), out)

    def audited_force(self, displacement: Array, out: Array) -> tuple[float, float]:
        """`internal_force` and `energies` in one pass over the elements.

        It takes 3 % more than the force of 1-point hexahedra, 10 % of 8-point ones, 20 % of plane
        quadrilaterals (measured); a pass for the energies alone, half of it or more.
        """
        check_out(out, self.points.shape)
        parts = np.empty((numba.get_num_threads(), 2))
        loops.audited_force(self.blocks, self._checked(displacement), out, parts)
        return _energies(parts)

    @cached_property
    def damped(self) -> bool:
        """Whether any element has a relaxation time."""
        return bool(self.relaxation.any())

    def damped_force(
        self, displacement: Array, velocity: Array, lag: float, out: Array
    ) -> tuple[float, float, float]:
        """`audited_force` with damping, and what it dissipates, W.

        velocity : (n_nodes, dim) m/s, of `lag` seconds before the displacement: the dissipation is
            that of then, and zero damps no rotation
        """
        check_out(out, self.points.shape)
        parts = np.empty((numba.get_num_threads(), 3))
        u, v = self._checked(displacement), self._checked(velocity)
        loops.damped_force(self.blocks, u, v, lag, out, parts)
        return *_energies(parts[:, :2]), float(sum(parts[:, 2].tolist()))

    def energies(self, displacement: Array) -> tuple[float, float]:
        """All that is stored, J, and what hourglass control holds of it (0 without such control).

        From the strains at the points, not from force times displacement.
        """
        parts = np.empty((numba.get_num_threads(), 2))
        loops.energies(self.blocks, self._checked(displacement), parts)
        return _energies(parts)

    def strain_energy(self, displacement: Array) -> float:
        """The first of `energies`, J."""
        return self.energies(displacement)[0]

    def cell_stress(
        self, displacement: Array, cells: Index | None = None, velocity: Array | None = None
    ) -> Array:
        """Cauchy stress at the elements' centres, Pa; without a velocity (m/s), the elastic part.

        (n, 6) as xx, yy, zz, xy, yz, xz in 3D; (n, 3) as xx, yy, xy in 2D. `cells` picks elements
        (all of them when None), so that a probe costs what it looks at.
        """
        chosen = np.arange(self.n_cells) if cells is None else np.asarray(cells, dtype=np.int64)
        stress = np.empty((len(chosen), 6 if self.dim == 3 else 3))
        u = self._checked(displacement)
        type(self).stresses(self.blocks, u, self.gradients, self.mu, self.lame, chosen, stress)
        if self.damped and velocity is not None:
            nodes, gradients = self.cells[chosen], self.gradients[chosen]
            f, rate = (
                np.einsum("nai,naj->nij", field[nodes], gradients)
                for field in (self.points + u, self._checked(velocity))
            )
            stress += damping_stress(
                f, rate, *(tau[chosen] for tau in (self.mu, self.lame, self.relaxation))
            )
        return stress

    def von_mises(self, displacement: Array, velocity: Array | None = None) -> Array:
        """Equivalent stress at the centres, (n_cells,), Pa; see `cell_stress`."""
        return von_mises(self.cell_stress(displacement, velocity=velocity))

    def min_det_F(self, displacement: Array) -> float:
        """Smallest det F over all points, not above 0 for an inverted element; NaN of NaNs."""
        parts = np.empty(numba.get_num_threads())
        loops.min_dets(self.blocks, self._checked(displacement), parts)
        return float(np.min(parts))

    def max_frequency(self) -> float:
        """Upper bound in rad/s on the largest eigenfrequency at the reference configuration.

        Irons' theorem over the elements with their row-sum masses; see `frequency`.
        """
        return largest_frequency(self._stiffness_and_mass())

    def _checked(self, displacement: Array) -> Array:
        return check_displacement(displacement, self.points.shape)

    def _geometries(self) -> Iterator[Geometry]:
        return geometries(self.points, self.cells)

    def _stiffness_and_mass(self) -> Iterator[tuple[Array, Array]]:
        """Stiffness (n, a*dim, a*dim) and row-sum mass (n, a) of all elements, in chunks."""
        for g in self._geometries():
            mu, lame = self.mu[g.cells], self.lame[g.cells]
            yield (
                element_stiffness(g.gradients, g.weights, mu, lame, self.mean_dilatation),
                self.cell_mass[g.cells],
            )


def lame_constants(young: Array, poisson: Array) -> tuple[Array, Array]:
    """Shear modulus mu and lambda of Young's modulus and Poisson's ratio, Pa."""
    mu = young / (2.0 * (1.0 + poisson))
    return mu, young * poisson / ((1.0 + poisson) * (1.0 - 2.0 * poisson))


def _energies(parts: Array) -> tuple[float, float]:
    """All that is stored and hourglass control's share, J, from the threads' (threads, 2)."""
    strain, hourglass = (sum(of_threads) for of_threads in parts.T.tolist())
    return strain + hourglass, hourglass
