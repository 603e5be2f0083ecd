"""Forces of a round tip that radiates, and of one whose material relaxes.

Along the normal a tip that radiates yields by c_nn F_n - D F_n.: to first order in D, and without
friction's part in k,

    F_n += -D k^2 g.,      k of `round_tip_law.normal_slope`,

times e*^2 in restitution, where this yield is part of the contact too. It dissipates D (k g.)^2, in
restitution e*^2 times that; it is limited so that the whole F_n does not become negative. F_t of
springs that stick is at most mu times the whole F_n. At a reversal D k^2 becomes e*^-2 times as
large, and where the tip sticks F_n jumps by as much, as u_Y. vanishes there and g. need not (0.07 %
of the peak where a soft finger of four phalanges with e* = 0.5 and mu = 0.7 turns back).

A material with Kelvin-Voigt damping, stress E (strain + tau strain rate), multiplies each elastic
field by 1 + tau d/dt, and so Hertz's force on the patch that it has (Brilliantov, Spahn, Hertzsch
and Poeschel 1996, eq. 17), Mindlin's, and what the tip's own compliance takes:

    F += tau dF/dt,      dF/dt = dF/d(X, g) (X., g.) = dF/d(X, u_Y) (X., u_Y.) of the springs.

In restitution d falls at the rate u_Y./e*^2, but the material is strained at the rate u_Y.: dF/du_Y
is taken times e*^2 there (`strain_share`), which leaves no jump at the reversal. The limits of
springs that slip follow d. Where they begin to stick in restitution dF/dX is therefore taken times
e*^2 too, for as long as they stick (`stick_share`): without it F_t would fall below its limit with
a jump, upon which the tip is faster and the springs slip again. The tip leaves where the whole F_n
vanishes; what its springs still hold then is lost as the surface relaxes (`unrecovered_energy`).
"""

from hcm.arrays import Floats
from hcm.beam.banded_ldl import HALF_BANDWIDTH
from hcm.compiled import kernel
from hcm.contact.law import FLIGHT, SLIP, ContactState
from hcm.contact.round_tip import RoundTipLaw, strain_share
from hcm.contact.round_tip_law import (
    contact_force,
    normal_slope,
    particle_velocity,
    stored_energy,
)
from hcm.contact.tip_compliance import contact_position, contact_velocity, path_rate, tip_slopes


@kernel
def has_rate_force(law: RoundTipLaw) -> bool:
    """Whether `tip_force` depends on v."""
    return law.radiation > 0.0 or law.relaxation > 0.0


@kernel
def strained_slopes(
    q: Floats, tip: int, contact: ContactState, law: RoundTipLaw
) -> tuple[float, float, float, float, float]:
    """`tip_slopes` of the material's strain."""
    return tip_slopes(contact.stick_share, strain_share(contact, law), q, tip, contact, law)


@kernel
def radiation_damping(gap: float, contact: ContactState, law: RoundTipLaw) -> float:
    """D k^2, N s/m, where the springs are at u_Y = gap."""
    k = normal_slope(gap, contact, law)
    return strain_share(contact, law) * law.radiation * k * k


@kernel
def rate_force(
    gap: float, ft: float, fn: float, q: Floats, v: Floats, tip: int, contact: ContactState,
    law: RoundTipLaw,
) -> tuple[float, float]:  # fmt: skip
    """(F_t, F_n), N, that a tip which radiates or relaxes adds to the force (ft, fn) of its springs
    at u_Y = gap.
    """
    if contact.normal_mode == FLIGHT or not has_rate_force(law):
        return 0.0, 0.0
    more, along = -radiation_damping(gap, contact, law) * v[tip + 1], 0.0
    if law.relaxation > 0.0:
        _, tx, tg, nx, ng = strained_slopes(q, tip, contact, law)
        vt, vn = path_rate(q, v, tip, law)
        more += law.relaxation * (nx * vt + ng * vn)
        along = law.relaxation * (tx * vt + tg * vn)
    more = max(more, -fn)
    if contact.tangential_mode == SLIP:
        return -contact.slip_sign * law.mu * more, more
    held = law.mu * (fn + more)
    return min(max(ft + along, -held), held) - ft, more


@kernel
def tip_force(
    q: Floats, v: Floats, tip: int, contact: ContactState, law: RoundTipLaw
) -> tuple[float, float]:
    """(F_t, F_n) of the surface on the tip, N."""
    x, y = contact_position(q, tip, contact, law)
    ft, fn = contact_force(x, y, contact, law)
    more_t, more_n = rate_force(y, ft, fn, q, v, tip, contact, law)
    return ft + more_t, fn + more_n


@kernel
def rate_power(q: Floats, v: Floats, tip: int, contact: ContactState, law: RoundTipLaw) -> float:
    """Power that the tip radiates and its material dissipates, W, without friction's, F_t V_P.

    Sticking springs that are stretched on, while F_t is limited below their force, store more than
    the tip gives them. If the tip radiates, this stays in the energy balance instead of counting as
    a negative loss; if it relaxes, `unrecovered_energy` counts it in the end.
    """
    x, y = contact_position(q, tip, contact, law)
    ft, fn = contact_force(x, y, contact, law)
    more_t, more_n = rate_force(y, ft, fn, q, v, tip, contact, law)
    power = -more_n * v[tip + 1]
    if more_t != 0.0:
        vt, vn = contact_velocity(q, v, tip, contact, law)
        along, _ = path_rate(q, v, tip, law)
        slid = -more_t * (along - particle_velocity(y, vt, vn, contact, law))
        power += slid if law.relaxation > 0.0 else max(slid, 0.0)
    return power


@kernel
def unrecovered_energy(x: float, gap: float, contact: ContactState, law: RoundTipLaw) -> float:
    """What the springs of a tip that relaxes hold as it leaves the surface, J."""
    return stored_energy(x, gap, contact, law) if law.relaxation > 0.0 else 0.0


@kernel
def add_rate(
    q: Floats, weight: float, tip: int, contact: ContactState, law: RoundTipLaw, rows: Floats
) -> None:
    """Add -weight dF_n/dg. and -weight dF_t/dX. to `rows`."""
    if contact.normal_mode == FLIGHT or not has_rate_force(law):
        return
    w, (_, y) = HALF_BANDWIDTH, contact_position(q, tip, contact, law)
    damping = radiation_damping(y, contact, law)
    if law.relaxation > 0.0:
        _, tx, _, _, ng = strained_slopes(q, tip, contact, law)
        damping -= law.relaxation * ng
        rows[w + tip, w] -= weight * law.relaxation * tx
    rows[w + tip + 1, w] += weight * damping
