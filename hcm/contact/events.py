"""Event functions of the contact (paper, section 3.1, eqs. 21-26, fig. 5).

Three slots, each positive inside the mode and zero at the event:

    slot NORMAL      flight: u_Y - u_ref | compression: -v_n | restitution: v_n
    slot SEPARATION  restitution: F_n, or what vanishes with it (the law's `margins`)
    slot TANGENTIAL  stick: mu F_n - |F_t|, or what vanishes with it | slip: s V_P

A slot that the mode does not have is +inf. Rates are exact within the mode, except that a round
tip's leave out products of velocities and the growth of its patch. With the rates at both ends of a
step a double crossing inside it can be suspected, and a crossing located on a cubic.
"""

from __future__ import annotations

import math

from hcm.compiled import kernel
from hcm.contact.contract import (
    Law,
    contact_force,
    margin_rates,
    margins,
    particle_position,
    particle_velocity,
    shear_history,
    sticks_first,
    strain_share,
)
from hcm.contact.law import (
    COMPRESSION,
    FLIGHT,
    FREE,
    RESTITUTION,
    SLIP,
    STICK,
    ContactState,
    has_tangential_element,
    without_history,
)

NORMAL, SEPARATION, TANGENTIAL = 0, 1, 2

# Kinds of located events.
TOUCH, TO_RESTITUTION, TO_COMPRESSION, TO_SLIP, TO_STICK, LIFT_OFF = 0, 1, 2, 3, 4, 5

SlotValues = tuple[float, float, float]


@kernel
def event_values(
    x: float, gap: float, vt: float, vn: float, contact: ContactState, law: Law
) -> SlotValues:
    """Event functions at the tip's position (x, gap), m, and velocity (vt, vn), m/s."""
    if contact.normal_mode == FLIGHT:
        return gap - contact.gap_ref, math.inf, math.inf
    push, grip = margins(x, gap, vn, contact, law)
    tangential = math.inf
    if contact.tangential_mode == STICK:
        tangential = grip
    elif contact.tangential_mode == SLIP:
        tangential = contact.slip_sign * particle_velocity(gap, vt, vn, contact, law)
    if contact.normal_mode == COMPRESSION:
        return -vn, math.inf, tangential
    return vn, push, tangential


@kernel
def event_rates(
    x: float, gap: float, vt: float, vn: float, at: float, an: float, contact: ContactState,
    law: Law,
) -> SlotValues:  # fmt: skip
    """Time derivatives of `event_values`, with the tip's acceleration (at, an), m/s^2."""
    if contact.normal_mode == FLIGHT:
        return vn, 0.0, 0.0
    push, grip = margin_rates(x, gap, vt, vn, an, contact, law)
    tangential = 0.0
    if contact.tangential_mode == STICK:
        tangential = grip
    elif contact.tangential_mode == SLIP:
        tangential = contact.slip_sign * particle_velocity(gap, at, an, contact, law)
    if contact.normal_mode == COMPRESSION:
        return -an, 0.0, tangential
    return an, push, tangential


@kernel
def transition(
    slot: int, x: float, gap: float, vt: float, vn: float, contact: ContactState, law: Law
) -> tuple[ContactState, int]:
    """The contact's next mode at an event, and the event's kind. Forces are continuous."""
    if slot == NORMAL and contact.normal_mode == FLIGHT:
        # the branch starts where the tip is: a repeated step ends on the surface to Newton's
        # tolerance only, and F_n would start with k times that difference
        if not has_tangential_element(law):
            return without_history(COMPRESSION, FREE, 0.0, gap, x), TOUCH
        if sticks_first(vt, vn, law):
            return without_history(COMPRESSION, STICK, 0.0, gap, x), TOUCH
        sign = math.copysign(1.0, vt)
        return without_history(COMPRESSION, SLIP, sign, gap, x), TOUCH
    if slot == SEPARATION:
        return without_history(FLIGHT, FREE, 0.0, min(gap, 0.0), x), LIFT_OFF
    _, fn = contact_force(x, gap, contact, law)
    normal, force, begun = contact.normal_mode, contact.force_ref, contact.gap_ref
    mode, sign, particle = contact.tangential_mode, contact.slip_sign, contact.particle
    share = contact.stick_share
    if slot == NORMAL and normal == COMPRESSION:
        kind, normal, force, begun = TO_RESTITUTION, RESTITUTION, fn, gap
    elif slot == NORMAL:
        kind, normal, force, begun = TO_COMPRESSION, COMPRESSION, fn, gap
    elif mode == STICK:
        kind, mode, sign, particle = TO_SLIP, SLIP, math.copysign(1.0, x - particle), x
    else:
        kind, mode, sign, particle = TO_STICK, STICK, 0.0, particle_position(x, gap, contact, law)
        share = strain_share(contact, law)
    way, hold = shear_history(normal, mode, x, gap, vt, contact, law)
    return ContactState(normal, mode, sign, force, begun, particle, way, hold, share), kind
