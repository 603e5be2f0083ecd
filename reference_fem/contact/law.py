"""What the explicit loop asks of a contact law, and the columns of its log.

Contract for whoever adds a law (one file each, chosen by name in `contact_laws`):

1. A frozen object, built once per mesh; forces and stiffness are those of the mesh as given.
2. `apply` adds the contact forces of t_n to a residual that already holds everything else which
   acts on the surface's nodes, and commits the history: explicit steps accept every evaluation.
3. History lives in the arrays that are handed in (`touching`, `anchor`, `spring_force`), so that
   a saved state restarts to the same bits.
4. `stiffness` and `damping` bound the law's own node by node; they enter the stable step.
5. Energies come from gaps and slips, never from the work of the sum of forces.
"""

from __future__ import annotations

from typing import NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Index = NDArray[np.int64]
Flags = NDArray[np.bool_]

# Columns of one row of the contact log: sums over the mesh as given, but for GAP, the height of
# the lowest node (m), and EXCESS, the largest |f_t| - μ f_n of a site (N). DISSIPATION is that of
# friction, DAMPING what dashpots take; both are increments of one step (J).
NORMAL, TANGENTIAL, GAP, AREA, EXCESS, SPRING_ENERGY, DISSIPATION, DAMPING = range(8)
COLUMNS = 8


class Motion(NamedTuple):
    """Where the surface is and how it moves; compiled kernels take it as it is.

    Attributes
    ----------
    points, displacement, velocity : (n_points, dim)
        X, u at t_n and v at t_n - Δt/2.
    inverse_mass : (n_points,)
    gravity, step
        g along -Y, m/s²; Δt, s.
    height, friction
        H, m, and μ.
    """

    points: Array
    displacement: Array
    velocity: Array
    inverse_mass: Array
    gravity: float
    step: float
    height: float
    friction: float


class Memory(NamedTuple):
    """A law's history, s entries of its own meaning (nodes or quadrature points).

    Attributes
    ----------
    touching : (s,)
    anchor, spring_force : (s, dim - 1)
        Anchors of the tangential springs (m) and the last tangential forces (N).
    """

    touching: Flags
    anchor: Array
    spring_force: Array


class ContactLaw(Protocol):
    """See the module's docstring."""

    @property
    def nodes(self) -> Index:
        """Nodes (k,) that may touch."""

    @property
    def stiffness(self) -> Array:
        """Bound (k,) on the contact stiffness of each node, N/m."""

    @property
    def damping(self) -> Array:
        """Bound (k,) on the contact damping of each node, N s/m."""

    @property
    def area(self) -> Array:
        """Tributary reference area (k,) of each node, m²."""

    @property
    def sites(self) -> int:
        """Number s of entries in the history."""

    def apply(self, motion: Motion, memory: Memory, residual: Array, row: Array) -> None:
        """Subtract the contact forces from the residual (n_points, dim), N.

        `memory` and `row` (COLUMNS,) are overwritten; DISSIPATION and DAMPING are increments.
        """
