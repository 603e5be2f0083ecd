"""Contact without a penalty: nodes are stopped at the surface by forward-increment multipliers."""

from typing import NamedTuple

import numpy as np

from reference_fem.arrays import Array, Index
from reference_fem.compiled import inner, use_for
from reference_fem.contact import law
from reference_fem.contact.law import ContactLaw, Memory, Motion, contact_forces


class Stops(NamedTuple):
    """Nodes that are stopped, (k,), and their areas, (k,) m²."""

    nodes: Index
    area: Array


def impulse_contact(nodes: Index, area: Array) -> ContactLaw:
    """Nodes (k,), of tributary areas (k,), may not be below the surface at the end of a step.

    Its stiffness is zero: the method leaves the stable step as it is.
    """
    none = np.zeros(nodes.size)
    return ContactLaw(nodes, area, none, none, Stops(nodes, area))


@inner()
def impulse_forces(
    stops: Stops, motion: Motion, memory: Memory, residual: Array, row: Array
) -> None:
    """Forward-increment Lagrange multipliers (Carpenter, Taylor, Katona 1991, IJNME 32).

    The constraint is that of the NEXT configuration, which the explicit step makes linear in
    the forces of this one, and a lumped mass makes diagonal. With everything but contact,

        v* = v(t - Δt/2) + Δt (-r/m + f),   g* = g(t) + Δt v*_y
        f_n = max(0, -g*) m/Δt²                 so that g(t + Δt) = 0 where f_n > 0
        f_t = -m v*_t/Δt, shortened to μ f_n    sticking nodes stop, others slide

    Nothing penetrates, and the stable step stays that of the body. A node that arrives loses its
    normal kinetic energy, m v²/2, as in a plastic impact; that is a share of order h of the energy
    under the contact patch, and the energy balance shows it (1e-5 on the finger). That loss is all
    the damping that friction's flutter needs (see `surface`). On the finger's meshes
    impulse and duration agree to 0.2 %, the peak force to 0.5 %, with "surface" of factor 1000, in
    half the steps.

    motion, memory : see `law`; one site per node, without an anchor.
    residual : (n_points, dim), all forces on the surface's nodes but contact, internal minus
        external, without gravity.
    row : (COLUMNS,), dissipation by the trapezoid rule over the motion of the last step; what a
        node that turns round within it gives back is not friction's and is left to the balance.
    """
    nodes, area = stops
    points, displacement, velocity = motion.points, motion.displacement, motion.velocity
    height, friction, step, g = motion.height, motion.friction, motion.step, motion.gravity_vector
    inverse_mass = motion.inverse_mass
    touching, spring_force = memory.touching, memory.spring_force
    planar = points.shape[1] == 2
    row[:] = 0.0
    lowest = np.inf
    for j in range(nodes.size):
        i = nodes[j]
        gap = points[i, 1] + displacement[i, 1] + height
        lowest = min(lowest, gap)
        inverse = inverse_mass[i]
        ahead = gap + step * (velocity[i, 1] - step * (inverse * residual[i, 1] - g[1]))
        if ahead >= 0.0 and not touching[j]:
            continue
        normal = max(0.0, -ahead) / (step * step * inverse)
        force_x = residual[i, 0] - velocity[i, 0] / (step * inverse) - g[0] / inverse
        force_z = 0.0 if planar else residual[i, 2] - velocity[i, 2] / (step * inverse)
        size = np.sqrt(force_x * force_x + force_z * force_z)
        limit = friction * normal
        if size > limit:
            force_x *= limit / size
            force_z *= limit / size
            size = limit
        power = (spring_force[j, 0] + force_x) * velocity[i, 0]
        spring_force[j, 0] = force_x
        if not planar:
            power += (spring_force[j, 1] + force_z) * velocity[i, 2]
            spring_force[j, 1] = force_z
        row[law.DISSIPATION] += max(0.0, -0.5 * step * power)
        touching[j] = normal > 0.0
        if normal == 0.0:
            continue
        residual[i, 0] -= force_x
        residual[i, 1] -= normal
        if not planar:
            residual[i, 2] -= force_z
        row[law.NORMAL] += normal
        row[law.TANGENTIAL] += force_x
        row[law.AREA] += area[j]
        row[law.EXCESS] = max(row[law.EXCESS], size - limit)
    row[law.GAP] = lowest


use_for(contact_forces, Stops, lambda *args: impulse_forces(*args))
