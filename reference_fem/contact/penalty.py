"""Node-to-plane penalty contact with Coulomb friction: one evaluation at one time."""

from dataclasses import dataclass

import numpy as np

from reference_fem.arrays import Array, Index
from reference_fem.compiled import njit
from reference_fem.contact import law
from reference_fem.contact.friction import drag, first_touch
from reference_fem.contact.law import ContactLaw, Memory, Motion


@dataclass(frozen=True)
class PenaltyContact(ContactLaw):
    """Springs k_i between nodes and the surface, stuck or sliding on it (see `stiffness`)."""

    def apply(self, motion: Motion, memory: Memory, residual: Array, row: Array) -> None:
        """See `contact_forces`."""
        contact_forces(motion, memory, self.nodes, self.stiffness, self.area, residual, row)


@njit(cache=True)
def contact_forces(
    motion: Motion,
    memory: Memory,
    nodes: Index,
    stiffness: Array,
    area: Array,
    residual: Array,
    row: Array,
) -> None:
    """Subtract the contact forces from the residual and commit the friction history.

        gap     g_i = Y_i + u_yi + H
        normal  f_ni = k_i max(0, -g_i)
        friction: return mapping in the plane (X, Z) with the same k_i (see `friction`)

    A node's anchor starts where it crossed the surface, found from its last velocity. The energy
    of the springs, Σ (f_n² + |f_t|²)/2k, and the dissipation (`friction.slip_loss`) come from gaps
    and slips, not from the work of the sum of forces.

    Explicit steps accept every evaluation, so the history is committed here, in place.

    motion, memory : see `law`; one site per node. nodes, stiffness, area : (k,).
    residual : (n_points, dim), internal minus external force, N; changed in place.
    row : (COLUMNS,), filled with this evaluation's totals; DISSIPATION holds the increment.
    """
    points, displacement, velocity = motion.points, motion.displacement, motion.velocity
    height, friction, touching = motion.height, motion.friction, memory.touching
    planar = points.shape[1] == 2
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
            v_z = 0.0 if planar else velocity[i, 2]
            first_touch(memory, j, gap, x, z, velocity[i, 0], velocity[i, 1], v_z)
        normal = max(0.0, -k * gap)
        force_x, force_z, loss = drag(memory, j, k, x, z, friction * normal)
        row[law.DISSIPATION] += loss
        touching[j] = gap < 0.0
        if gap >= 0.0:
            continue
        residual[i, 0] -= force_x
        residual[i, 1] -= normal
        if not planar:
            residual[i, 2] -= force_z
        size = np.sqrt(force_x * force_x + force_z * force_z)
        row[law.NORMAL] += normal
        row[law.TANGENTIAL] += force_x
        row[law.AREA] += area[j]
        row[law.EXCESS] = max(row[law.EXCESS], size - friction * normal)
        row[law.SPRING_ENERGY] += 0.5 * (normal * normal + size * size) / k
    row[law.GAP] = lowest
