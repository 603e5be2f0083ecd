"""Lumped-parameter contact of the fingertip (paper, section 2.2.2, eqs. 18-20, figs. 2b and 4).

The tip node C meets the surface through a bilinear normal element and a linear tangential element
that hangs on a massless particle P. With u_Y = Y_C + H (negative in compression):

    F_n = F_ref - k_n (u_Y - u_ref),   k_n = k while compressing, k/e*^2 while restituting,

(F_ref, u_ref) being the values at the last reversal, so that F_n is continuous there and the
hysteresis loops of eq. 19 follow, however many. With the spring's extension u_X = X_C - X_P:

    stick:  F_t = -k eta^-2 u_X, P at rest;      slip:  F_t = -s mu F_n, s = sgn(V_P).

While slipping u_X = -F_t eta^2/k, so V_P = V_t - du_X/dt = V_t - s mu (eta^2/k) dF_n/dt.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from hcm.compiled import kernel
from hcm.parameters import Surface, Tip

FLIGHT, COMPRESSION, RESTITUTION = 0, 1, 2
FREE, STICK, SLIP = 0, 1, 2


class ContactState(NamedTuple):
    """Modes and history of the contact; committed only when a step is accepted.

    normal_mode : FLIGHT, COMPRESSION or RESTITUTION. tangential_mode : FREE (no tangential
    element), STICK or SLIP. slip_sign : s. force_ref, gap_ref : F_ref (N) and u_ref (m) of the
    branch; in flight gap_ref is where contact begins: zero, or the residual deformation that an
    unloaded e* < 1 loop left, until the tip has risen above the surface. particle : X_P in stick,
    m. Of a round tip alone, for a mode that continues another's: shear_ref, the constant, m, and
    shear_hold, h, of `patch_shear`; stick_share, the factor of dF/dX in `tip_damping`.
    """

    normal_mode: int
    tangential_mode: int
    slip_sign: float
    force_ref: float
    gap_ref: float
    particle: float
    shear_ref: float = 0.0
    shear_hold: float = 0.0
    stick_share: float = 1.0


# Before the first touch, wherever the tip is.
IN_FLIGHT = ContactState(FLIGHT, FREE, 0.0, 0.0, 0.0, 0.0)


@kernel
def without_history(
    normal_mode: int, tangential_mode: int, slip_sign: float, gap_ref: float, particle: float
) -> ContactState:
    """A mode that continues no other's forces; compiled code knows no default values."""
    return ContactState(
        normal_mode, tangential_mode, slip_sign, 0.0, gap_ref, particle, 0.0, 0.0, 1.0
    )


class ContactLaw(NamedTuple):
    """Constants of the law: k (N/m), e*, eta^-2, mu and the surface's H (m)."""

    k: float
    restitution: float
    tangential_ratio: float
    mu: float
    height: float


def contact_law(surface: Surface, tip: Tip) -> ContactLaw:
    """Gather the contact's constants from the surface and the tip; k = 0 for one without spring."""
    return ContactLaw(
        float(tip.normal_stiffness or 0.0),
        float(tip.restitution),
        float(tip.tangential_ratio),
        float(surface.friction),
        float(surface.height),
    )


@kernel
def normal_slope(gap: float, contact: ContactState, law: ContactLaw) -> float:
    """k_n = -dF_n/du_Y of the current branch, N/m; it does not depend on u_Y = gap."""
    if contact.normal_mode == COMPRESSION:
        return law.k
    if contact.normal_mode == RESTITUTION:
        return law.k / (law.restitution * law.restitution)
    return 0.0


@kernel
def has_tangential_element(law: ContactLaw) -> bool:
    """Whether a tangential force can arise at all: mu > 0 and eta^-2 > 0."""
    return law.mu > 0.0 and law.tangential_ratio > 0.0


@kernel
def sticks_first(vt: float, vn: float, law: ContactLaw) -> bool:
    """Whether a touch at these velocities, m/s, begins in stick: |V_t/V_n| < mu eta^2, eq. 21."""
    return abs(vt) * law.tangential_ratio < law.mu * abs(vn)


@kernel
def contact_force(
    x: float, gap: float, contact: ContactState, law: ContactLaw
) -> tuple[float, float]:
    """(F_t, F_n) on the tip, N, at X_C = x and u_Y = gap."""
    if contact.normal_mode == FLIGHT:
        return 0.0, 0.0
    fn = contact.force_ref - normal_slope(gap, contact, law) * (gap - contact.gap_ref)
    if contact.tangential_mode == STICK:
        return -law.k * law.tangential_ratio * (x - contact.particle), fn
    if contact.tangential_mode == SLIP:
        return -contact.slip_sign * law.mu * fn, fn
    return 0.0, fn


@kernel
def contact_tangent(contact: ContactState, law: ContactLaw) -> tuple[float, float, float]:
    """(dF_t/dX, dF_t/dY, dF_n/dY), N/m, constant within a mode."""
    slope = normal_slope(0.0, contact, law)
    if contact.tangential_mode == STICK:
        return -law.k * law.tangential_ratio, 0.0, -slope
    if contact.tangential_mode == SLIP:
        return 0.0, contact.slip_sign * law.mu * slope, -slope
    return 0.0, 0.0, -slope


@kernel
def particle_position(x: float, gap: float, contact: ContactState, law: ContactLaw) -> float:
    """X_P = X_C - u_X, m; X_C itself where there is no tangential element."""
    if contact.tangential_mode == STICK:
        return contact.particle
    if contact.tangential_mode == SLIP:
        ft, _ = contact_force(x, gap, contact, law)
        return x + ft / (law.k * law.tangential_ratio)
    return x


@kernel
def particle_velocity(
    gap: float, vt: float, vn: float, contact: ContactState, law: ContactLaw
) -> float:
    """V_P, m/s, from the tip's velocity (vt, vn) at u_Y = gap."""
    if contact.tangential_mode == STICK:
        return 0.0
    if contact.tangential_mode == SLIP:
        ft_rate = contact.slip_sign * law.mu * normal_slope(gap, contact, law) * vn
        return vt + ft_rate / (law.k * law.tangential_ratio)
    return vt


@kernel
def margins(
    x: float, gap: float, vn: float, contact: ContactState, law: ContactLaw
) -> tuple[float, float]:
    """Margins to separation, F_n, and to slip, mu F_n - |F_t|, N."""
    ft, fn = contact_force(x, gap, contact, law)
    return fn, law.mu * fn - abs(ft)


@kernel
def margin_rates(
    x: float, gap: float, vt: float, vn: float, an: float, contact: ContactState, law: ContactLaw
) -> tuple[float, float]:
    """Time derivatives of `margins`, N/s."""
    ft, _ = contact_force(x, gap, contact, law)
    fn_rate = -normal_slope(gap, contact, law) * vn
    ft_rate = -law.k * law.tangential_ratio * vt
    pull = abs(ft_rate) if ft == 0.0 else math.copysign(1.0, ft) * ft_rate
    return fn_rate, law.mu * fn_rate - pull


@kernel
def friction_loss(
    loss: float, x0: float, gap0: float, x1: float, gap1: float, contact: ContactState,
    law: ContactLaw,
) -> float:  # fmt: skip
    """`loss` plus -int F_t dX_P between two places of the tip within a mode (trapezoidal), J."""
    ft0, _ = contact_force(x0, gap0, contact, law)
    ft1, _ = contact_force(x1, gap1, contact, law)
    slid = particle_position(x1, gap1, contact, law) - particle_position(x0, gap0, contact, law)
    return loss - 0.5 * (ft0 + ft1) * slid


@kernel
def stored_energy(x: float, gap: float, contact: ContactState, law: ContactLaw) -> float:
    """Recoverable energy of both elements, F_n^2 e*^2/(2 k) + F_t^2 eta^2/(2 k), J."""
    ft, fn = contact_force(x, gap, contact, law)
    energy = 0.5 * fn * fn * law.restitution**2 / law.k
    if has_tangential_element(law):
        energy += 0.5 * ft * ft / (law.k * law.tangential_ratio)
    return energy


@kernel
def hysteresis_loss(gap0: float, gap1: float, contact: ContactState, law: ContactLaw) -> float:
    """Energy that the normal element can't give back, between two gaps of one branch, J.

    Compression stores (F1^2 - F0^2)/(2 k), of which the share e*^2 is recoverable; restitution
    follows the slope k/e*^2 and loses nothing.
    """
    if contact.normal_mode != COMPRESSION:
        return 0.0
    _, f0 = contact_force(0.0, gap0, contact, law)
    _, f1 = contact_force(0.0, gap1, contact, law)
    return 0.5 * (1.0 - law.restitution**2) * (f1 * f1 - f0 * f0) / law.k
