"""Springs and dashpots between points of a body and the surface.

The laws "penalty" and "surface" differ in where these points lie and how stiff their springs are.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from reference_fem.arrays import Array, Index
from reference_fem.compiled import inner, use_for
from reference_fem.contact import law
from reference_fem.contact.friction import drag, first_touch
from reference_fem.contact.law import ContactLaw, Memory, Motion, contact_forces


class Springs(NamedTuple):
    """Points of facets and their springs.

    facets : (n_facets, n), nodes
    shape : (q, n), N_i at the points of a facet
    area : (n_facets, q), reference area of each point, m²
    out : (n_facets, q), s, how far the body's true surface stands out of the facets, m
    stiffness, damping : (n_facets, q), k, N/m, and c, N s/m
    """

    facets: Index
    shape: Array
    area: Array
    out: Array
    stiffness: Array
    damping: Array


@dataclass(frozen=True)
class SpringContact(ContactLaw):
    """A law of springs; one entry of history per point."""

    parts: Springs

    @property
    def sites(self) -> int:
        """Number of points."""
        return self.parts.area.size

    def touching_points(self, position: Array) -> Array:
        """The springs' points, each lowered to the true surface."""
        if self.parts.facets.shape[1] == 1:  # they are the nodes
            return position
        facets = np.searchsorted(self.nodes, self.parts.facets)
        points = np.einsum("qa,fad->fqd", self.parts.shape, position[facets])
        points[..., 1] -= self.parts.out
        return points.reshape(-1, position.shape[1])


@inner()
def spring_forces(
    springs: Springs, motion: Motion, memory: Memory, residual: Array, row: Array
) -> None:
    """Subtract the contact forces of all facets and commit the friction history.

        x_q = Σ_i N_i(q) (X_i + u_i),   g_q = y_q - s_q + H
        f_n = max(0, -k_q g_q - c_q g_q')  where g_q < 0,   f_i = Σ_q N_i(q) f_q

    f_t by return mapping in the plane (X, Z) with the same k_q, one anchor per point (see
    `friction`); an anchor starts where the point crossed the surface, found from its last velocity.
    The springs' energy, Σ (k_q² g_q² + |f_t|²)/2k_q, and the dissipation (`friction.slip_loss`)
    come from gaps and slips, not from the work of the sum of forces.

    A bilinear facet lies between its nodes, so one with all nodes higher above the surface than
    any point stands out is passed over.

    motion, memory : see `law`.
    residual : (n_points, dim), internal minus external force, N; changed in place.
    row : (COLUMNS,), filled with this evaluation's totals; see `law.contact_forces`.
    """
    points, displacement, velocity = motion.points, motion.displacement, motion.velocity
    height, friction, step = motion.height, motion.friction, motion.step
    facets, shape, area, out, stiffness, damping = springs
    touching = memory.touching
    planar = points.shape[1] == 2
    n_q, n = shape.shape
    row[:] = 0.0
    lowest, reach = np.inf, out.max()
    for f in range(facets.shape[0]):
        low = np.inf
        for a in range(n):
            i = facets[f, a]
            low = min(low, points[i, 1] + displacement[i, 1] + height)
        if low >= reach:
            lowest = min(lowest, low)
            held = False
            for q in range(n_q):
                held = held or touching[f * n_q + q]
            if not held:
                continue
        for q in range(n_q):
            j = f * n_q + q
            gap, x, z = height - out[f, q], 0.0, 0.0
            for a in range(n):
                i = facets[f, a]
                gap += shape[q, a] * (points[i, 1] + displacement[i, 1])
                x += shape[q, a] * (points[i, 0] + displacement[i, 0])
                if not planar:
                    z += shape[q, a] * (points[i, 2] + displacement[i, 2])
            lowest = min(lowest, gap)
            if gap >= 0.0 and not touching[j]:
                continue
            v_x, v_y, v_z = 0.0, 0.0, 0.0
            for a in range(n):
                i = facets[f, a]
                v_x += shape[q, a] * velocity[i, 0]
                v_y += shape[q, a] * velocity[i, 1]
                if not planar:
                    v_z += shape[q, a] * velocity[i, 2]
            if not touching[j]:
                first_touch(memory, j, gap, x, z, v_x, v_y, v_z)
            k = stiffness[f, q]
            spring = max(0.0, -k * gap)
            normal = max(0.0, spring - damping[f, q] * v_y) if spring > 0.0 else 0.0
            force_x, force_z, loss = drag(memory, j, k, x, z, friction * normal)
            row[law.DISSIPATION] += loss
            touching[j] = gap < 0.0
            if gap >= 0.0:
                continue
            for a in range(n):
                i = facets[f, a]
                residual[i, 0] -= shape[q, a] * force_x
                residual[i, 1] -= shape[q, a] * normal
                if not planar:
                    residual[i, 2] -= shape[q, a] * force_z
            size = np.sqrt(force_x * force_x + force_z * force_z)
            row[law.NORMAL] += normal
            row[law.TANGENTIAL] += force_x
            row[law.AREA] += area[f, q]
            row[law.EXCESS] = max(row[law.EXCESS], size - friction * normal)
            row[law.SPRING_ENERGY] += 0.5 * (spring * spring + size * size) / k
            row[law.DAMPING] -= (normal - spring) * v_y * step
    row[law.GAP] = lowest


use_for(contact_forces, Springs, lambda *args: spring_forces(*args))
