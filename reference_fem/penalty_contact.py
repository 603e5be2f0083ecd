"""Node-to-plane penalty contact with Coulomb friction: one evaluation at one time."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numba import njit
from numpy.typing import NDArray

from reference_fem.contact_law import (
    AREA,
    DISSIPATION,
    EXCESS,
    GAP,
    NORMAL,
    SPRING_ENERGY,
    TANGENTIAL,
    Memory,
    Motion,
)
from reference_fem.friction import return_map

Array = NDArray[np.float64]
Index = NDArray[np.int64]
Flags = NDArray[np.bool_]


@dataclass(frozen=True)
class PenaltyContact:
    """Springs between nodes and the surface; its stiffness: `contact_stiffness`.

    Attributes
    ----------
    nodes : (k,)
    stiffness : (k,)
        Penalty stiffness k_i of the mesh as given (a half model's is half), N/m.
    area : (k,)
        Tributary reference area A_i of the mesh as given, m².
    """

    nodes: Index
    stiffness: Array
    area: Array

    @property
    def damping(self) -> Array:
        """None."""
        return np.zeros(self.nodes.size)

    @property
    def sites(self) -> int:
        """One entry of history per node."""
        return self.nodes.size

    def apply(self, motion: Motion, memory: Memory, residual: Array, row: Array) -> None:
        """See `contact_forces`."""
        contact_forces(
            motion.points,
            motion.displacement,
            motion.velocity,
            self.nodes,
            self.stiffness,
            self.area,
            motion.height,
            motion.friction,
            memory.touching,
            memory.anchor,
            memory.spring_force,
            residual,
            row,
        )


@njit(cache=True)
def contact_forces(
    points: Array,
    displacement: Array,
    velocity: Array,
    nodes: Index,
    stiffness: Array,
    area: Array,
    height: float,
    friction: float,
    touching: Flags,
    anchor: Array,
    spring_force: Array,
    residual: Array,
    row: Array,
) -> None:
    """Subtract the contact forces from the residual and commit the friction history.

        gap     g_i = Y_i + u_yi + H
        normal  f_ni = k_i max(0, -g_i)
        friction: return mapping in the plane (X, Z) with the same k_i (see `friction`)

    A node's anchor starts where it crossed the surface, found from its last velocity. The energy
    of the springs, Σ (f_n² + |f_t|²)/2k, and the dissipation, -Σ ½(f_t + f_t')·Δa (trapezoid
    over the slip increment), come from gaps and slips, not from the work of the sum of forces.

    Explicit steps accept every evaluation, so the history is committed here: `touching` (k,),
    `anchor` (k, dim-1) and `spring_force` (k, dim-1) are updated in place, once per step.

    Parameters
    ----------
    points, displacement, velocity : (n_points, dim)
        Velocity of the half step that led to this displacement.
    nodes, stiffness, area : (k,)
    height, friction
        H, m, and μ.
    residual : (n_points, dim)
        Internal minus external force, N; changed in place.
    row : (COLUMNS,)
        Filled with this evaluation's totals; DISSIPATION holds the increment.
    """
    dim = points.shape[1]
    planar = dim == 2
    row[:] = 0.0
    lowest = np.inf
    for j in range(nodes.size):
        i = nodes[j]
        gap = points[i, 1] + displacement[i, 1] + height
        lowest = min(lowest, gap)
        if gap >= 0.0 and not touching[j]:
            continue
        k = stiffness[j]
        x = points[i, 0] + displacement[i, 0]
        z = 0.0 if planar else points[i, 2] + displacement[i, 2]
        if not touching[j]:
            speed = velocity[i, 1]
            since = gap / speed if speed < 0.0 else 0.0
            anchor[j, 0] = x - since * velocity[i, 0]
            if not planar:
                anchor[j, 1] = z - since * velocity[i, 2]
            spring_force[j] = 0.0
        old_x = spring_force[j, 0]
        old_z = 0.0 if planar else spring_force[j, 1]
        offset_x = x - anchor[j, 0]
        offset_z = 0.0 if planar else z - anchor[j, 1]
        normal = max(0.0, -k * gap)
        force_x, force_z, slip_x, slip_z = return_map(k, offset_x, offset_z, friction * normal)
        anchor[j, 0] += slip_x
        spring_force[j, 0] = force_x
        if not planar:
            anchor[j, 1] += slip_z
            spring_force[j, 1] = force_z
        row[DISSIPATION] -= 0.5 * ((old_x + force_x) * slip_x + (old_z + force_z) * slip_z)
        touching[j] = gap < 0.0
        if gap >= 0.0:
            continue
        residual[i, 0] -= force_x
        residual[i, 1] -= normal
        if not planar:
            residual[i, 2] -= force_z
        size = np.sqrt(force_x * force_x + force_z * force_z)
        row[NORMAL] += normal
        row[TANGENTIAL] += force_x
        row[AREA] += area[j]
        row[EXCESS] = max(row[EXCESS], size - friction * normal)
        row[SPRING_ENERGY] += 0.5 * (normal * normal + size * size) / k
    row[GAP] = lowest
