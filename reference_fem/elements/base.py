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

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numba
import numpy as np

from reference_fem.arrays import Array, Index
from reference_fem.elements import loops
from reference_fem.elements.blocks import Blocks, Moving
from reference_fem.elements.stress import (
    COMPONENTS,
    cauchy_stress,
    damping_stress,
    field_gradients,
    von_mises,
)

SOFTENS = 1.0 / math.sqrt(3.0)
"""Volume ratio below which St. Venant-Kirchhoff's law softens when confined: d/dλ λ(λ² - 1) = 0."""


class ElementKind(NamedTuple):
    """What the elements of a kind do not share with others.

    blocks, scratch_rows : the class of `Blocks`, and the rows of its kernels' workspace
    constants : what its kernels store of Lame's second one (Pa) and the volumes (m^3), (n_cells,),
        beside mu
    pressures : what fills in the pressure (blocks, displacement, cells, out (n,) in Pa) where it is
        not the lambda tr E of F
    stress : its Cauchy stress, with the parameters of `cauchy_stress`
    softens : volume ratio below which the material softens when confined
    stiffening : ratio of its highest frequency, deformed, to that at rest, which steps allow for
    """

    blocks: type[Blocks]
    scratch_rows: int
    constants: Callable[[Array, Array], tuple[Array, ...]] = lambda lame, volume: (lame,)
    pressures: Callable[[Blocks, Array, Index, Array], None] | None = None
    stress: Callable[..., Array] = cauchy_stress
    softens: float = SOFTENS
    stiffening: float = 1.0


class Forces(NamedTuple):
    """What goes with the elements' forces: the stored energy and hourglass control's part of it, J,
    zero unless audited, and the power that damping dissipates, W.
    """

    stored: float
    hourglass: float
    power: float


def stored_energies(of_threads: Array) -> tuple[float, float]:
    """The stored energy and hourglass control's part of it, J, from `blocks.Stored`."""
    strain, hourglass = (sum(column) for column in of_threads.T.tolist())
    return strain + hourglass, hourglass


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

    @cached_property
    def damped(self) -> bool:
        """Whether any element has a relaxation time."""
        return bool(self.relaxation.any())

    def damping(self, velocity: Array, lag: float) -> Moving:
        """A velocity (n_nodes, dim), m/s, that lags by `lag`, s, as the kernels take it; None if no
        element is damped.
        """
        if not self.damped:
            return None
        return self._checked(velocity), lag, np.empty(numba.get_num_threads())

    def force(
        self, displacement: Array, out: Array, moving: tuple[Array, float] | None = None,
        audited: bool = False,
    ) -> Forces:  # fmt: skip
        """Overwrite `out` (n_nodes, dim) with f_int in N, on numba's current number of threads.

        moving : velocity (n_nodes, dim), m/s, and how long before the displacement it was, s, for
            damping: the dissipation is that of this earlier time, and rigid rotations are not
            damped. None: no damping
        audited : whether energies are wanted. They come from the strains at the points, not from
            force times displacement, and take 3 % more time for 1-point hexahedra, 10 % for
            8-point ones, 20 % for plane quadrilaterals (measured)
        """
        u, threads = self._checked(displacement, out), numba.get_num_threads()
        parts = np.empty((threads, 2)) if audited else None
        damping = None if moving is None else self.damping(*moving)
        loops.internal_force(self.blocks, u, threads, out, parts, damping)
        stored = (0.0, 0.0) if parts is None else stored_energies(parts)
        return Forces(*stored, 0.0 if damping is None else float(sum(damping[2].tolist())))

    def internal_force(self, displacement: Array, out: Array) -> None:
        """`force` without damping and energies."""
        self.force(displacement, out)

    def energies(self, displacement: Array) -> tuple[float, float]:
        """Stored energy and hourglass control's part of it, J."""
        return self.force(displacement, np.empty(self.points.shape), audited=True)[:2]

    def cell_stress(
        self, displacement: Array, cells: Index | None = None, velocity: Array | None = None
    ) -> Array:
        """Cauchy stress at the elements' centres, Pa; without a velocity (m/s), the elastic part.

        (n, 6) as xx, yy, zz, xy, yz, xz in 3D; (n, 3) as xx, yy, xy in 2D. `cells` picks elements
        (None: all), so that a probe only pays for those that it reads.
        """
        chosen = np.arange(self.n_cells) if cells is None else np.asarray(cells, dtype=np.int64)
        u, pressures = self._checked(displacement), None
        if self.kind.pressures is not None:
            pressures = np.empty(len(chosen))
            self.kind.pressures(self.blocks, u, chosen, pressures)
        given, components = (self.cells, self.gradients), COMPONENTS[self.dim]
        stress = self.kind.stress(u, *given, chosen, self.mu, self.lame, pressures, components)
        relaxing = np.flatnonzero(self.relaxation[chosen])
        if velocity is not None and relaxing.size:
            some = chosen[relaxing]
            f = field_gradients(self.points + u, *given, some)
            rate = field_gradients(self._checked(velocity), *given, some)
            constants = (of[some] for of in (self.mu, self.lame, self.relaxation))
            stress[relaxing] += damping_stress(f, rate, *constants)[:, *components]
        return np.asarray(stress)

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
