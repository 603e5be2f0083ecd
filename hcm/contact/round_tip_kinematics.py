"""A contact at the lowest point of a spherical tip, with the interface of `hcm.contact.point`.

The surface's forces act at the arm R below the sphere's centre C, whose angle is psi:

    F_c = F_t (e_X + R grad psi) + F_n e_Y.

They act on the undeformed sphere, as Hertz's and Mindlin's do. On the deformed one the arm of F_t
is shorter by d, and F_n has the patch's displacement u as its arm, with the opposite effect: with
Mindlin's u, F_n u is 8/9 of F_t d at nu = 0.4. Where the springs are that give them, and the forces
that depend on velocities: `tip_compliance` and `tip_damping`.
"""

import math

from hcm.arrays import Floats
from hcm.beam.banded_ldl import HALF_BANDWIDTH
from hcm.beam.joint_torque import torque_force, torque_tangent
from hcm.compiled import kernel
from hcm.contact.law import FLIGHT, SLIP, STICK, ContactState
from hcm.contact.partial_slip import slip_limit, spring_displacement
from hcm.contact.round_tip import (
    COMPLIANCE_XX,
    COMPLIANCE_XY,
    COMPLIANCE_YY,
    CONTACT_X,
    GAP,
    INDENTATION,
    NORMAL_FORCE,
    SLOPE_X,
    SLOPE_Y,
    SPRING_X,
    TANGENTIAL_FORCE,
    TIP_X,
    RoundTipLaw,
)
from hcm.contact.round_tip_law import force_and_slopes, indentation
from hcm.contact.tip_compliance import ball_radius, spring_position, tip_path, tip_slopes
from hcm.contact.tip_damping import tip_force

# By how much, over mu/eta^-2 d, a spring that slips is kept beyond its limit where the material
# relaxes: at its limit it would count as one that sticks, and add tau times its rate to F_t.
SLIPPED = 1e-9


@kernel
def axis_end(q: Floats, tip: int, law: RoundTipLaw) -> tuple[float, float]:
    """The pole, R beyond C along r', m; with v for q, its velocity, m/s."""
    return q[tip] + ball_radius(law) * q[tip + 2], q[tip + 1] + ball_radius(law) * q[tip + 3]


@kernel
def subtract_force(
    q: Floats, v: Floats, tip: int, contact: ContactState, law: RoundTipLaw, out: Floats
) -> None:
    """Subtract F_c, N and N m, from the residual `out` (n,)."""
    if contact.normal_mode == FLIGHT:
        return
    ft, fn = tip_force(q, v, tip, contact, law)
    mx, my = torque_force(ft * ball_radius(law), q[tip + 2], q[tip + 3])
    out[tip] -= ft
    out[tip + 1] -= fn
    out[tip + 2] -= mx
    out[tip + 3] -= my


@kernel
def add_tangent(
    q: Floats, weight: float, tip: int, scale: Floats, contact: ContactState, law: RoundTipLaw,
    rows: Floats,
) -> float:  # fmt: skip
    """Add -weight dF_c/dq to `rows`; returns the factor of its part that is not symmetric."""
    if contact.normal_mode == FLIGHT:
        return 0.0
    w, unit = HALF_BANDWIDTH, scale[tip + 2]
    ft, tx, _, nx, ng = tip_slopes(1.0, 1.0, q, tip, contact, law)
    h = ball_radius(law)
    px, py = torque_force(h, q[tip + 2], q[tip + 3])
    bx, by = unit * px, unit * py
    dxx, dxy = torque_tangent(ft * h * unit * unit, q[tip + 2], q[tip + 3])
    own = rows[w + tip : w + tip + 4]
    own[0, w] -= weight * tx
    own[1, w - 1] -= weight * nx
    own[1, w] -= weight * ng
    own[2, w - 2] -= weight * tx * bx
    own[2, w - 1] -= weight * nx * bx
    own[2, w] -= weight * (tx * bx * bx + dxx)
    own[3, w - 3] -= weight * tx * by
    own[3, w - 2] -= weight * nx * by
    own[3, w - 1] -= weight * (tx * bx * by + dxy)
    own[3, w] -= weight * (tx * by * by - dxx)
    return -weight


@kernel
def fill_column(
    q: Floats, tip: int, scale: Floats, contact: ContactState, law: RoundTipLaw, column: Floats
) -> None:
    """Write c = (dF_t/dg - dF_n/dX) (e_X + R grad psi) of the unsymmetric part s c e_Y^T."""
    _, _, tg, nx, _ = tip_slopes(1.0, 1.0, q, tip, contact, law)
    turning = (tg - nx) * ball_radius(law)
    px, py = torque_force(turning * scale[tip + 2], q[tip + 2], q[tip + 3])
    column[tip], column[tip + 2], column[tip + 3] = tg - nx, px, py


@kernel
def stiffness_key(contact: ContactState, law: RoundTipLaw) -> tuple[float, float, float]:
    """The mode; in it the stiffness changes smoothly, and Newton's method says when to refactor."""
    return float(contact.normal_mode), float(contact.tangential_mode), contact.slip_sign


@kernel
def commit_history(q: Floats, tip: int, contact: ContactState, law: RoundTipLaw) -> None:
    """Commit the path, the forces and the springs of an accepted step that ends at q."""
    if contact.normal_mode == FLIGHT:
        return
    memory = law.memory
    along, gap = tip_path(q, tip, law)
    x, y = spring_position(along, gap, contact, law)
    ft, fn, _, _, _ = force_and_slopes(x, y, contact, law)
    d, _ = indentation(y, contact, law)
    if contact.tangential_mode == STICK:
        for i in range(law.springs.size):
            limit, u = slip_limit(i, d, law), 0.0
            if limit > 0.0:
                u = spring_displacement(i, x - memory[SPRING_X], d, law)[0]
            mark = SLIPPED * law.mu / law.tangential_ratio * d if law.relaxation > 0.0 else 0.0
            law.springs[i] = min(max(u, -limit - mark), limit + mark)
    memory[TIP_X], memory[GAP], memory[CONTACT_X], memory[SPRING_X] = q[tip], gap, along, x
    memory[SLOPE_X], memory[SLOPE_Y] = q[tip + 2], q[tip + 3]
    memory[TANGENTIAL_FORCE], memory[NORMAL_FORCE], memory[INDENTATION] = ft, fn, d


@kernel
def begin_mode(
    q: Floats, tip: int, before: ContactState, contact: ContactState, law: RoundTipLaw
) -> None:
    """Set the memory for the mode that an event at q begins: a tap forgets the one before, a stick
    starts from the springs' limits.
    """
    memory = law.memory
    if before.normal_mode == FLIGHT:
        size = math.hypot(q[tip + 2], q[tip + 3])
        along = -q[tip + 2] / size
        memory[:] = 0.0
        memory[TIP_X], memory[GAP] = q[tip], q[tip + 1] + law.height
        memory[SLOPE_X], memory[SLOPE_Y] = q[tip + 2], q[tip + 3]
        # alpha from the vertical: cos alpha = -r'_Y/|r'|
        steep = -q[tip + 3] / size
        memory[COMPLIANCE_XX] = law.compliance[2] * steep
        crossed = law.compliance[1] + law.compliance[4] * steep
        memory[COMPLIANCE_XY] = -math.copysign(1.0, along) * crossed
        memory[COMPLIANCE_YY] = law.compliance[0] + law.compliance[3] * steep * steep
        law.springs[:] = 0.0
        return
    if before.tangential_mode == SLIP and contact.tangential_mode == STICK:
        _, gap = spring_position(memory[CONTACT_X], memory[GAP], before, law)
        d, _ = indentation(gap, before, law)
        for i in range(law.springs.size):
            law.springs[i] = before.slip_sign * slip_limit(i, d, law)
