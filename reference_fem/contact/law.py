"""What the explicit loop asks of a contact law, and the columns of its log.

Contract for whoever adds a law (one file each, chosen by name in `laws`):

1. A frozen object, built once per mesh; forces and stiffness are those of the mesh as given.
2. `parts` is a named tuple of the law's own, for which its file registers a kernel for
   `contact_forces` (`compiled.use_for`). The kernel adds the contact forces of t_n to a residual
   that already holds everything else which acts on the surface's nodes, and commits the history:
   explicit steps accept every evaluation.
3. History lives in the arrays that are handed in (`Memory`), so that a saved state restarts to the
   same bits.
4. `stiffness`, `damping` and `coupled_eigenvalue` are upper bounds; they enter the stable step.
5. Energies come from gaps and slips, never from the work of the sum of forces.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from reference_fem.arrays import Array, Flags, Index

# Columns of one row of the contact log: sums over the mesh as given, but for GAP, the height of
# the lowest node (m), and EXCESS, the largest |f_t| - μ f_n of a site (N). DISSIPATION is that of
# friction, DAMPING what dashpots and hysteresis of the normal force take; both are increments of
# one step (J).
NORMAL, TANGENTIAL, GAP, AREA, EXCESS, SPRING_ENERGY, DISSIPATION, DAMPING = range(8)
COLUMNS = 8


class Motion(NamedTuple):
    """Where the surface is and how it moves; compiled kernels take it as it is.

    points, displacement, velocity : (n_points, dim), X, u at t_n and v at t_n - Δt/2
    inverse_mass : (n_points,)
    gravity_vector, step : acceleration of gravity in the plane of motion, m/s²; Δt, s.
    height, friction : H, m, and μ
    """

    points: Array
    displacement: Array
    velocity: Array
    inverse_mass: Array
    gravity_vector: tuple[float, float]
    step: float
    height: float
    friction: float


class Memory(NamedTuple):
    """A law's history at s sites (nodes or quadrature points, as the law has it).

    touching : (s,)
    anchor, spring_force : (s, dim - 1), anchors of the tangential springs (m) and the last
        tangential forces (N)
    """

    touching: Flags
    anchor: Array
    spring_force: Array

    def copy(self) -> Memory:
        """A copy with arrays of its own."""
        return Memory(self.touching.copy(), self.anchor.copy(), self.spring_force.copy())


@dataclass(frozen=True)
class ContactLaw:
    """What the contact laws have in common; the module's docstring has the contract.

    nodes : (k,), nodes that may touch
    area : (k,), tributary reference area of each node, m²; infinite where no pressure is defined.
    stiffness, damping : (k,), bounds on the contact stiffness, N/m, and damping, N s/m, of each
        node
    parts : what the law's kernel takes
    """

    nodes: Index
    area: Array
    stiffness: Array
    damping: Array
    parts: tuple[Any, ...]

    @property
    def coupled_eigenvalue(self) -> float:
        """Largest eigenvalue of M⁻¹K_c of springs that tie nodes to each other, rad²/s²."""
        return 0.0

    @property
    def sites(self) -> int:
        """Number s of entries in the history: here one per node."""
        return self.nodes.size

    def new_memory(self, displacement: Array, _angle: float) -> Memory:
        """History of a surface that has not touched yet.

        displacement : (n_points, dim).
        _angle : rotation of the last phalanx so far, to within half a turn, rad.
        """
        shape = self.sites, displacement.shape[1] - 1
        return Memory(np.zeros(self.sites, dtype=np.bool_), np.zeros(shape), np.zeros(shape))

    def touching_points(self, position: Array) -> Array:
        """Points (n, 2 | 3) whose height is the gap, from positions (k, 2 | 3) of `nodes`, m."""
        return position

    def separation_s(self, times: Array, _forces: Array) -> float:
        """When contact ended, s, from times and F_n of the last two steps with F_n > 0."""
        return float(times[-1])


def contact_forces(
    parts: tuple[Any, ...], motion: Motion, memory: Memory, residual: Array, row: Array
) -> None:
    """Subtract the contact forces from the residual (n_points, dim), N.

    `memory` and `row` (COLUMNS,) are overwritten; DISSIPATION and DAMPING are increments.
    """
    raise NotImplementedError(f"{type(parts).__name__} has no overload of contact_forces")
