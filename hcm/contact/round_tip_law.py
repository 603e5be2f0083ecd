"""Contact law of a round tip, Hertz's and with partial slip, with the interface of `law`.

Normal: with the elastic indentation d that the loading history leaves (d. = -u_Y. in compression,
-u_Y./e*^2 in restitution; the loop of the lumped law, with d instead of F/k),

    F_n = 4/3 E* sqrt(R) d^(3/2)        or        F_n = k d.

A tip that yields by s d^2, as its patch grows, and by C_YY F_n counts as part of the contact: the
history then gives d + s d^2 + C_YY F_n, not d, and the loss 1 - e*^2 is that of the whole, with
`sheared_way`, whose share is counted with friction's (`shear_work`).

Tangential: the springs of `partial_slip`, of which the middle one slips last, so that the whole
patch slips as one lumped element does: F_t = -s mu F_n until V_P = V_t + s mu (E*/G*) u_Y.
vanishes. Without partial slip a single spring k_t holds the tip.
"""

import math

from hcm.compiled import kernel
from hcm.contact.law import COMPRESSION, FLIGHT, RESTITUTION, SLIP, STICK, ContactState
from hcm.contact.partial_slip import spring_sums, springs_loss
from hcm.contact.patch_shear import shear_share
from hcm.contact.round_tip import (
    COMPLIANCE_XX,
    COMPLIANCE_XY,
    COMPLIANCE_YY,
    SPRING_X,
    RoundTipLaw,
    strain_share,
)

# Most Newton iterations; largest last change of d over d, the square of which is left as an error.
ITERATIONS, SETTLED = 40, 1e-9


@kernel
def normal_force(d: float, law: RoundTipLaw) -> tuple[float, float]:
    """(F_n, dF_n/dd), N and N/m; Hertz's contact does not pull."""
    if not law.hertz:
        return law.k * d, law.k
    root = math.sqrt(max(d, 0.0))
    return law.k * root * max(d, 0.0), 1.5 * law.k * root


@kernel
def indentation(gap: float, contact: ContactState, law: RoundTipLaw) -> tuple[float, float]:
    """(d, -dd/du_Y) at u_Y = gap, m; d is NaN if no depth is found that the tip yields to."""
    yields, taken = law.memory[COMPLIANCE_YY], 0.0
    if contact.force_ref > 0.0:
        start = contact.force_ref / law.k
        if law.hertz:
            start = start ** (2.0 / 3.0)
        taken = start + law.growth * start * start + yields * contact.force_ref
    rate = 1.0 / (law.restitution * law.restitution) if contact.normal_mode == RESTITUTION else 1.0
    taken -= rate * (gap - contact.gap_ref)
    d = 2.0 * taken / (1.0 + math.sqrt(1.0 + 4.0 * law.growth * max(taken, 0.0)))
    slope = 1.0 + 2.0 * law.growth * max(d, 0.0)
    if d > 0.0 and yields != 0.0:
        change = math.inf
        for _ in range(ITERATIONS):
            fn, stiffness = normal_force(d, law)
            slope = 1.0 + 2.0 * law.growth * d + yields * stiffness
            if abs(change) <= SETTLED * d:
                break
            change = (taken - d - law.growth * d * d - yields * fn) / slope
            d += change
        if not (abs(change) <= SETTLED * d and slope > 0.0):
            d = math.nan
    return d, rate / slope


@kernel
def normal_energy(d: float, law: RoundTipLaw) -> float:
    """Work of F_n up to d, J."""
    share = 0.4 + 4.0 / 7.0 * law.growth * d if law.hertz else 0.5
    fn, _ = normal_force(d, law)
    return (share * d + 0.5 * law.memory[COMPLIANCE_YY] * fn) * fn


@kernel
def force_and_slopes(
    x: float, gap: float, contact: ContactState, law: RoundTipLaw
) -> tuple[float, float, float, float, float]:
    """(F_t, F_n, dF_t/dX, dF_t/dY, dF_n/dY), N and N/m, at the springs' (X, u_Y)."""
    if contact.normal_mode == FLIGHT:
        return 0.0, 0.0, 0.0, 0.0, 0.0
    d, rate = indentation(gap, contact, law)
    fn, slope = normal_force(d, law)
    if contact.tangential_mode == SLIP:
        share = contact.slip_sign * law.mu
        return -share * fn, fn, 0.0, share * slope * rate, -slope * rate
    if contact.tangential_mode == STICK and law.springs.size == 0:
        kt = law.tangential_stiffness
        return -kt * (x - contact.particle), fn, -kt, 0.0, -slope * rate
    if contact.tangential_mode == STICK:
        total, by_way, by_depth, _ = spring_sums(x - law.memory[SPRING_X], d, law)
        size = 2.0 * law.effective_shear_modulus
        return -size * total, fn, -size * by_way, size * rate * by_depth, -slope * rate
    return 0.0, fn, 0.0, 0.0, -slope * rate


@kernel
def sticks_first(vt: float, vn: float, law: RoundTipLaw) -> bool:
    """Whether a touch at these velocities, m/s, begins in stick: by eq. 21, but a single tangential
    spring beside Hertz's force slips, as F_t/F_n ~ d^(-1/2).
    """
    if law.hertz and law.springs.size == 0:
        return vt == 0.0
    return abs(vt) * law.tangential_ratio < law.mu * abs(vn)


@kernel
def contact_force(
    x: float, gap: float, contact: ContactState, law: RoundTipLaw
) -> tuple[float, float]:
    """(F_t, F_n) on the tip, N."""
    ft, fn, _, _, _ = force_and_slopes(x, gap, contact, law)
    return ft, fn


@kernel
def normal_slope(gap: float, contact: ContactState, law: RoundTipLaw) -> float:
    """k_n = -dF_n/du_Y, N/m."""
    if contact.normal_mode == FLIGHT:
        return 0.0
    d, rate = indentation(gap, contact, law)
    return normal_force(d, law)[1] * rate


@kernel
def particle_position(x: float, gap: float, contact: ContactState, law: RoundTipLaw) -> float:
    """X_P = X - u_X of the spring that slips last, m."""
    if contact.tangential_mode == STICK:
        return contact.particle
    if contact.tangential_mode == SLIP and law.springs.size == 0:
        return x + contact_force(x, gap, contact, law)[0] / law.tangential_stiffness
    if contact.tangential_mode == SLIP:
        d, _ = indentation(gap, contact, law)
        return x - contact.slip_sign * law.mu / law.tangential_ratio * d
    return x


@kernel
def particle_velocity(
    gap: float, vt: float, vn: float, contact: ContactState, law: RoundTipLaw
) -> float:
    """V_P, m/s."""
    if contact.tangential_mode == STICK:
        return 0.0
    if contact.tangential_mode == SLIP:
        d, rate = indentation(gap, contact, law)
        share = rate / law.tangential_ratio
        if law.springs.size == 0:
            share = rate * normal_force(d, law)[1] / law.tangential_stiffness
        return vt + contact.slip_sign * law.mu * share * vn
    return vt


@kernel
def push_unit(law: RoundTipLaw) -> float:
    """Factor of d in `margins`, N/m: at separation d has a slope, Hertz's F_n does not."""
    return law.plane_strain_modulus * law.radius if law.hertz else law.k


@kernel
def relaxing_share(contact: ContactState, law: RoundTipLaw) -> float:
    """The exponent of F_n over d times tau and the `strain_share`, s."""
    return (1.5 if law.hertz else 1.0) * law.relaxation * strain_share(contact, law)


@kernel
def grip_unit(law: RoundTipLaw) -> float:
    """2 G* a of a patch of a = R, by which `margins` makes forces of springs' displacements, N/m.
    With the patch's own radius the margin would vanish where the tip leaves, and not pass 0.
    """
    return 2.0 * law.effective_shear_modulus * law.radius


@kernel
def margins(
    x: float, gap: float, vn: float, contact: ContactState, law: RoundTipLaw
) -> tuple[float, float]:
    """Margins to separation, of d, and to slip, of the spring that slips last, as forces, N.

    Of a material that relaxes the whole F_n vanishes sooner, where d = 1.5 tau u_Y. (Hertz).
    """
    d, rate = indentation(gap, contact, law)
    push = push_unit(law) * (d - relaxing_share(contact, law) * rate * vn)
    if law.springs.size == 0:
        ft, fn = contact_force(x, gap, contact, law)
        return push, law.mu * fn - abs(ft)
    return push, grip_unit(law) * (law.mu / law.tangential_ratio * d - abs(x - contact.particle))


@kernel
def margin_rates(
    x: float, gap: float, vt: float, vn: float, an: float, contact: ContactState, law: RoundTipLaw
) -> tuple[float, float]:
    """Time derivatives of `margins`, N/s, without the growth of -dd/du_Y."""
    _, rate = indentation(gap, contact, law)
    pull = math.copysign(vt, vt * (x - contact.particle)) if x != contact.particle else abs(vt)
    if law.springs.size == 0:
        grip = -law.mu * normal_slope(gap, contact, law) * vn - law.tangential_stiffness * pull
    else:
        grip = -grip_unit(law) * (law.mu / law.tangential_ratio * rate * vn + pull)
    return -push_unit(law) * rate * (vn + relaxing_share(contact, law) * an), grip


@kernel
def friction_loss(
    loss: float, x0: float, gap0: float, x1: float, gap1: float, contact: ContactState,
    law: RoundTipLaw,
) -> float:  # fmt: skip
    """`loss` plus what slipping springs dissipate from the last accepted step to (x1, gap1), J."""
    if contact.tangential_mode != STICK or law.springs.size == 0:
        ft0, _ = contact_force(x0, gap0, contact, law)
        ft1, _ = contact_force(x1, gap1, contact, law)
        slid = particle_position(x1, gap1, contact, law) - particle_position(x0, gap0, contact, law)
        return loss - 0.5 * (ft0 + ft1) * slid
    d0, d1 = indentation(gap0, contact, law)[0], indentation(gap1, contact, law)[0]
    return loss + springs_loss(x1 - x0, d0, d1, law)


@kernel
def stored_energy(x: float, gap: float, contact: ContactState, law: RoundTipLaw) -> float:
    """Recoverable energy of the contact's springs and of the tip's compliance, J."""
    if contact.normal_mode == FLIGHT:
        return 0.0
    d, _ = indentation(gap, contact, law)
    ft, fn = contact_force(x, gap, contact, law)
    energy = law.restitution**2 * normal_energy(d, law)
    if law.springs.size > 0 and contact.tangential_mode == STICK:
        energy += law.effective_shear_modulus * spring_sums(x - law.memory[SPRING_X], d, law)[3]
    elif law.springs.size > 0 and contact.tangential_mode == SLIP:
        energy += law.effective_shear_modulus * spring_sums(math.inf, d, law)[3]
    elif contact.tangential_mode != 0:
        energy += 0.5 * ft * ft / law.tangential_stiffness
    if fn > 0.0:
        energy += 0.5 * law.restitution**2 * law.softening * shear_share(ft / fn)[0] * fn * fn
    return energy + (0.5 * law.memory[COMPLIANCE_XX] * ft + law.memory[COMPLIANCE_XY] * fn) * ft


@kernel
def hysteresis_loss(gap0: float, gap1: float, contact: ContactState, law: RoundTipLaw) -> float:
    """Energy that the normal element can't give back: the share 1 - e*^2 of compression's work."""
    if contact.normal_mode != COMPRESSION:
        return 0.0
    d0, d1 = indentation(gap0, contact, law)[0], indentation(gap1, contact, law)[0]
    return (1.0 - law.restitution**2) * (normal_energy(d1, law) - normal_energy(d0, law))
