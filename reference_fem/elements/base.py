"""What the explicit loop asks of an element, and what elements of every kind have in common.

Contract for whoever adds an element (its set-up in `kinds`, one file for its compiled kernel; what
else elements share is in `blocks`, `loops` and `threads`):

1. One object per mesh, built once by a function (`hex8`, `quad4_plane_stress`), frozen afterwards.
2. Arrays in, arrays out, SI units, node order of VTK and gmsh.
3. `internal_force` is the exact gradient of the first of `energies`; a rigid motion gives neither.
4. The same input and the same number of threads give the same bits.
5. No call allocates arrays of the size of the mesh except to return them. What a call needs is a
   workspace inside the object, so one object serves one caller at a time (it is not re-entrant).
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numba
import numpy as np

from reference_fem.arrays import Array, Index
from reference_fem.elements import loops
from reference_fem.elements.blocks import Blocks
from reference_fem.elements.stress import damping_stress, field_gradients, von_mises

# (blocks, displacement, gradients, mu, lame, cells, out (n, components) in Pa)
Stresses = Callable[[Blocks, Array, Array, Array, Array, Index, Array], None]


class ElementKind(NamedTuple):
    """A class of `Blocks`, the rows of its kernels' workspace and its compiled stresses."""

    blocks: type[Blocks]
    scratch_rows: int
    stresses: Stresses


@dataclass(frozen=True, eq=False)
class ElementKernel:
    """Elements of one kind on one mesh.

    points : (n_nodes, dim), m
    cells : (n_cells, corners)
    mu, lame : (n_cells,) Lame's constants, Pa; the second one lambda* in plane stress
    cell_volume : (n_cells,) reference volumes, m^3
    lumped_mass : (n_nodes,) row sums, kg, of the body as meshed
    gradients : (n_cells, corners, dim) shape gradients that stresses are taken with, 1/m
    relaxation : (n_cells,) tau of Kelvin-Voigt damping S = C : (E + tau dE/dt), s
    blocks : what the kernels store of each element, and workspaces that calls overwrite
    """

    kind: ElementKind
    points: Array
    cells: Index
    mu: Array
    lame: Array
    cell_volume: Array
    lumped_mass: Array
    gradients: Array
    relaxation: Array
    blocks: Blocks

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
        """Bytes of element data that one evaluation of the force reads, without nodal arrays."""
        return self.blocks.nodes.nbytes + self.blocks.reference.nbytes

    def internal_force(self, displacement: Array, out: Array) -> None:
        """Overwrite `out` (n_nodes, dim) with f_int in N, on numba's current number of threads."""
        u = self._checked(displacement, out)
        loops.internal_force(self.blocks, u, numba.get_num_threads(), out)

    def audited_force(self, displacement: Array, out: Array) -> tuple[float, float]:
        """`internal_force`; returns the stored energy and hourglass control's part of it, J.

        Energies come from the strains at the points, not from force times displacement. They take
        3 % more time for 1-point hexahedra, 10 % for 8-point ones, 20 % for plane quadrilaterals
        (measured).
        """
        u, parts = self._checked(displacement, out), np.empty((numba.get_num_threads(), 2))
        loops.internal_force(self.blocks, u, len(parts), out, parts)
        return _energies(parts)

    @cached_property
    def damped(self) -> bool:
        """Whether any element has a relaxation time."""
        return bool(self.relaxation.any())

    def damped_force(self, displacement: Array, velocity: Array, lag: float, out: Array) -> float:
        """`internal_force` with damping; returns the power that damping dissipates, W.

        velocity : (n_nodes, dim) m/s, at `lag` seconds before the displacement: the dissipation is
            that of this earlier time, and rigid rotations are not damped
        """
        power = np.empty(numba.get_num_threads())
        u, v = self._checked(displacement, out), self._checked(velocity)
        loops.internal_force(self.blocks, u, len(power), out, None, (v, lag, power))
        return float(sum(power.tolist()))

    def audited_damped_force(
        self, displacement: Array, velocity: Array, lag: float, out: Array
    ) -> tuple[float, float, float]:
        """`damped_force`; also returns what `audited_force` does, before the power."""
        parts, power = np.empty((numba.get_num_threads(), 2)), np.empty(numba.get_num_threads())
        u, v = self._checked(displacement, out), self._checked(velocity)
        loops.internal_force(self.blocks, u, len(parts), out, parts, (v, lag, power))
        return *_energies(parts), float(sum(power.tolist()))

    def energies(self, displacement: Array) -> tuple[float, float]:
        """Stored energy and hourglass control's part of it, J."""
        return self.audited_force(displacement, np.empty(self.points.shape))

    def cell_stress(
        self, displacement: Array, cells: Index | None = None, velocity: Array | None = None
    ) -> Array:
        """Cauchy stress at the elements' centres, Pa; without a velocity (m/s), the elastic part.

        (n, 6) as xx, yy, zz, xy, yz, xz in 3D; (n, 3) as xx, yy, xy in 2D. `cells` picks elements
        (None: all), so that a probe only pays for those that it reads.
        """
        chosen = np.arange(self.n_cells) if cells is None else np.asarray(cells, dtype=np.int64)
        stress = np.empty((len(chosen), 6 if self.dim == 3 else 3))
        u = self._checked(displacement)
        self.kind.stresses(self.blocks, u, self.gradients, self.mu, self.lame, chosen, stress)
        relaxing = np.flatnonzero(self.relaxation[chosen])
        if velocity is not None and relaxing.size:
            some = chosen[relaxing]
            of_cells = self.cells, self.gradients, some
            f = field_gradients(self.points + u, *of_cells)
            rate = field_gradients(self._checked(velocity), *of_cells)
            stress[relaxing] += damping_stress(
                f, rate, *(of[some] for of in (self.mu, self.lame, self.relaxation))
            )
        return stress

    def von_mises(self, displacement: Array, velocity: Array | None = None) -> Array:
        """Equivalent stress at the centres, (n_cells,), Pa; see `cell_stress`."""
        return von_mises(self.cell_stress(displacement, velocity=velocity))

    def min_det_F(self, displacement: Array) -> float:
        """Smallest det F over all points, 0 or less for an inverted element; NaN if any is NaN."""
        parts = np.empty(numba.get_num_threads())
        loops.min_dets(self.blocks, self._checked(displacement), parts)
        return float(np.min(parts))

    def _checked(self, field: Array, out: Array | None = None) -> Array:
        """A nodal field as the contiguous float64 array that the kernels take.

        Raises ValueError: its shape is not (n_nodes, dim), or a kernel could not write to `out` in
            place.
        """
        shape = self.points.shape
        field = np.ascontiguousarray(field, dtype=np.float64)
        if field.shape != shape:
            raise ValueError(f"nodal field has shape {field.shape}; {shape} is needed")
        if out is None or (out.shape == shape and out.dtype == float and out.flags.c_contiguous):
            return field
        raise ValueError(f"out is {out.dtype}{out.shape}; a C-contiguous float64{shape} is needed")


def lame_constants(young: Array, poisson: Array) -> tuple[Array, Array]:
    """Shear modulus mu and lambda of Young's modulus and Poisson's ratio, Pa."""
    mu = young / (2.0 * (1.0 + poisson))
    return mu, young * poisson / ((1.0 + poisson) * (1.0 - 2.0 * poisson))


def _energies(parts: Array) -> tuple[float, float]:
    """Stored energy and hourglass control's part, J, from those of the threads (threads, 2)."""
    strain, hourglass = (sum(of_threads) for of_threads in parts.T.tolist())
    return strain + hourglass, hourglass
