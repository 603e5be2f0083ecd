"""Coulomb friction with a tangential penalty, by return mapping."""

import math

from reference_fem.compiled import inner
from reference_fem.contact.law import Memory


@inner(forceinline=True)
def return_map(
    stiffness: float, offset_x: float, offset_z: float, limit: float
) -> tuple[float, float, float, float]:
    """Tangential force and the anchor's slip for one node.

    The node hangs on a spring k whose other end, the anchor a, slides when Coulomb's cone is
    reached (Wriggers, Computational Contact Mechanics, 2006, ch. 5.2):

        trial    f* = -k (x - a)
        stick    |f*| <= μ f_n:  f = f*,              a unchanged
        slip     otherwise:      f = μ f_n f*/|f*|,   a <- x + f/k

    stiffness : k, N/m. offset_x, offset_z : x - a, m; a planar problem has no z component.
    limit : μ f_n, N.

    Returns force_x, force_z: f on the node, N, and slip_x, slip_z: motion of the anchor, m.
    """
    # hypot, exact below 1e-154 m, where squares vanish, took a quarter of the contact's time
    length = math.sqrt(offset_x * offset_x + offset_z * offset_z)
    if stiffness * length <= limit:
        return -stiffness * offset_x, -stiffness * offset_z, 0.0, 0.0
    unit_x = offset_x / length
    unit_z = offset_z / length
    slip = length - limit / stiffness
    return -limit * unit_x, -limit * unit_z, slip * unit_x, slip * unit_z


@inner(forceinline=True)
def slip_loss(
    old_x: float, old_z: float, force_x: float, force_z: float, slip_x: float, slip_z: float
) -> float:
    """Energy that a step's slip Δa dissipates, J, at least 0; f and f' before and after, N.

    -½(f + f')·Δa (trapezoid). Where f points along Δa the site has turned round within the step: f
    was unloaded without slip, and f' opposes all of Δa: -f'·Δa. The trapezoid would subtract the
    energy that is given back from what friction dissipates: 0.6 % of the kinetic energy where stiff
    springs chatter.
    """
    if old_x * slip_x + old_z * slip_z > 0.0:
        return -(force_x * slip_x + force_z * slip_z)
    return -0.5 * ((old_x + force_x) * slip_x + (old_z + force_z) * slip_z)


@inner(forceinline=True)
def first_touch(
    memory: Memory, j: int, gap: float, x: float, z: float, v_x: float, v_y: float, v_z: float
) -> None:
    """Anchor site j where it crossed the surface, found from its last velocity."""
    since = gap / v_y if v_y < 0.0 else 0.0
    memory.anchor[j, 0] = x - since * v_x
    if memory.anchor.shape[1] == 2:
        memory.anchor[j, 1] = z - since * v_z
    memory.spring_force[j] = 0.0


@inner(forceinline=True)
def drag(
    memory: Memory, j: int, stiffness: float, x: float, z: float, limit: float
) -> tuple[float, float, float]:
    """Tangential force on site j at (x, z), N, and what its slip dissipates, J; commits both."""
    solid = memory.anchor.shape[1] == 2
    old_x = memory.spring_force[j, 0]
    old_z = memory.spring_force[j, 1] if solid else 0.0
    offset_z = z - memory.anchor[j, 1] if solid else 0.0
    force_x, force_z, slip_x, slip_z = return_map(
        stiffness, x - memory.anchor[j, 0], offset_z, limit
    )
    memory.anchor[j, 0] += slip_x
    memory.spring_force[j, 0] = force_x
    if solid:
        memory.anchor[j, 1] += slip_z
        memory.spring_force[j, 1] = force_z
    loss = slip_loss(old_x, old_z, force_x, force_z, slip_x, slip_z)
    return force_x, force_z, loss
