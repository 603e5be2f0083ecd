"""Where a round tip's springs are: the lowest point of a sphere, and the tip's own compliance.

The beam ends at the sphere's centre C, whose slope r' turns with the rigid end piece. With
g = Y_C + H - R and the angle psi of r', the lowest point moves with X = X_C + R psi; psi is added
up over the accepted steps. Between it and the contact's springs lies the tip's own compliance,

    (X, u_Y)_springs = (X, g + e F_t^2/F_n) + C F(springs),
    C = [[c_tt, -s c_nt], [-s c_nt, 0]],

s = 1 for a phalanx that points along -X (`patch_shear`: e, in restitution and for large F_t/F_n).
C is fixed at the touch, by the phalanx's angle there; its c_nn belongs to the normal law
(`round_tip_law`). Newton's method finds the springs' (X, u_Y), so that the forces on the beams are
functions of (X, g).
"""

import math

from hcm.arrays import Floats
from hcm.beam.joint_torque import turn_rate, turned_angle
from hcm.compiled import kernel
from hcm.contact.law import (
    FLIGHT,
    RESTITUTION,
    STICK,
    ContactState,
    without_history,
)
from hcm.contact.patch_shear import shear_share, sheared_way
from hcm.contact.round_tip import (
    COMPLIANCE_XX,
    COMPLIANCE_XY,
    CONTACT_X,
    NORMAL_FORCE,
    SLOPE_X,
    SLOPE_Y,
    TANGENTIAL_FORCE,
    TIP_X,
    RoundTipLaw,
    strain_share,
)
from hcm.contact.round_tip_law import ITERATIONS, force_and_slopes

# Newton's last change of the springs' position, over the lengths of which it is a difference; the
# convergence is quadratic except where springs begin to slip.
POSITION_TOLERANCE = 1e-13


@kernel
def ball_radius(law: RoundTipLaw) -> float:
    """R where the ball's lowest point touches, else 0, m: the lever arm of F_t about C, and the
    axis' length beyond C.
    """
    return law.radius if law.lowest else 0.0


@kernel
def tip_path(q: Floats, tip: int, law: RoundTipLaw) -> tuple[float, float]:
    """(X, g) at q, m."""
    gap = q[tip + 1] + law.height
    turned = turned_angle(law.memory[SLOPE_X], law.memory[SLOPE_Y], q[tip + 2], q[tip + 3])
    moved = q[tip] - law.memory[TIP_X] + ball_radius(law) * turned
    return law.memory[CONTACT_X] + moved, gap


@kernel
def path_rate(q: Floats, v: Floats, tip: int, law: RoundTipLaw) -> tuple[float, float]:
    """Rates of `tip_path` at velocities v, m/s."""
    turning = turn_rate(q[tip + 2], q[tip + 3], v[tip + 2], v[tip + 3])
    return v[tip] + ball_radius(law) * turning, v[tip + 1]


@kernel
def yielded(
    along: float, gap: float, ft: float, fn: float, contact: ContactState, law: RoundTipLaw
) -> tuple[float, float]:
    """The springs' (X, u_Y), m, of a tip at (along, gap) on which these forces act."""
    cxx, cxn = law.memory[COMPLIANCE_XX], law.memory[COMPLIANCE_XY]
    way = sheared_way(ft, fn, contact, law)[0] + contact.shear_hold * (along - contact.particle)
    return along + cxx * ft + cxn * fn, gap + cxn * ft + way


@kernel
def yielding(
    forces: tuple[float, float, float, float, float], contact: ContactState, law: RoundTipLaw
) -> tuple[float, float, float, float, float]:
    """a, b, c, d of 1 - C t = [[a, b], [c, d]] and its determinant; t : the springs' slopes [[tx,
    ty], [0, ny]], C with the derivatives of `sheared_way`, at `forces` of `force_and_slopes`.
    """
    ft, fn, tx, ty, ny = forces
    cxx, cxn = law.memory[COMPLIANCE_XX], law.memory[COMPLIANCE_XY]
    _, by_ft, by_fn = sheared_way(ft, fn, contact, law)
    cnx = cxn + by_ft
    a, b, c, d = 1.0 - cxx * tx, -cxx * ty - cxn * ny, -cnx * tx, 1.0 - cnx * ty - by_fn * ny
    return a, b, c, d, a * d - b * c


@kernel
def spring_position(
    along: float, gap: float, contact: ContactState, law: RoundTipLaw
) -> tuple[float, float]:
    """The springs' (X, u_Y), m, NaN if not found.

    If the determinant of 1 - C dF/d(X, u_Y) is not positive (NaN too), the tip gives way faster
    than the springs take load, and the forces at (X, g) are not those that grew from the touch.
    """
    x, y = yielded(along, gap, law.memory[TANGENTIAL_FORCE], law.memory[NORMAL_FORCE], contact, law)
    for _ in range(ITERATIONS):
        forces = force_and_slopes(x, y, contact, law)
        x1, y1 = yielded(along, gap, forces[0], forces[1], contact, law)
        rx, ry = x1 - x, y1 - y
        a, b, c, d, det = yielding(forces, contact, law)
        dx, dy = (d * rx - b * ry) / det, (a * ry - c * rx) / det
        x, y = x + dx, y + dy
        # the springs' depth is a difference from that of the last reversal
        way = abs(gap) + abs(contact.gap_ref) + abs(along - law.memory[CONTACT_X])
        if abs(dx) + abs(dy) <= POSITION_TOLERANCE * (way + POSITION_TOLERANCE * law.radius):
            if det > 0.0:
                return x, y
            break
    return math.nan, math.nan


@kernel
def contact_position(
    q: Floats, tip: int, contact: ContactState, law: RoundTipLaw
) -> tuple[float, float]:
    """The springs' (X, u_Y), m; X is zero in flight."""
    if contact.normal_mode == FLIGHT:
        return 0.0, q[tip + 1] + law.height
    along, gap = tip_path(q, tip, law)
    return spring_position(along, gap, contact, law)


@kernel
def contact_velocity(
    q: Floats, v: Floats, tip: int, contact: ContactState, law: RoundTipLaw
) -> tuple[float, float]:
    """The springs' velocity, m/s; with accelerations for v, their acceleration without products of
    velocities.
    """
    vt, vn = path_rate(q, v, tip, law)
    if contact.normal_mode == FLIGHT:
        return vt, vn
    x, y = contact_position(q, tip, contact, law)
    a, b, c, d, det = yielding(force_and_slopes(x, y, contact, law), contact, law)
    vn += contact.shear_hold * vt
    return (d * vt - b * vn) / det, (a * vn - c * vt) / det


@kernel
def shear_history(
    normal_mode: int, tangential_mode: int, x: float, gap: float, vt: float,
    contact: ContactState, law: RoundTipLaw,
) -> tuple[float, float]:  # fmt: skip
    """(shear_ref, shear_hold), m and -, of the mode that follows `contact` at the springs' (X, u_Y)
    of the last accepted step and their V_t, m/s: u_Y is continuous. Where a tip that sticks turns
    back u_Y. would change by -h X., h of a continuous rate: that h is taken if the tip would turn
    again at once.
    """
    ft, fn, tx, _, _ = force_and_slopes(x, gap, contact, law)
    after, hold = without_history(normal_mode, tangential_mode, 0.0, 0.0, 0.0), 0.0
    if normal_mode != contact.normal_mode and tangential_mode == STICK and fn > 0.0:
        change = strain_share(contact, law) - strain_share(after, law)
        slope = tx / (1.0 - law.memory[COMPLIANCE_XX] * tx)
        hold = contact.shear_hold + change * law.softening * shear_share(ft / fn)[1] * slope
        turns_again = hold * vt > 0.0 if normal_mode == RESTITUTION else hold * vt < 0.0
        hold = hold if turns_again else 0.0
    moved = law.memory[CONTACT_X] - contact.particle
    way = sheared_way(ft, fn, contact, law)[0] + contact.shear_hold * moved
    return way - sheared_way(ft, fn, after, law)[0] - hold * moved, hold


@kernel
def shear_work(
    q: Floats, tip: int, after: tuple[float, float], contact: ContactState, law: RoundTipLaw
) -> float:
    """Work of F_n on `sheared_way` and h X that is not stored, from the last accepted step to q and
    the springs' forces `after`, J, by the trapezoid rule.

    int F_n d(e p F_n) = e p F_n^2/2 + e/2 int F_n^2 dp, whose last term is zero while the patch
    slides and of either sign while it sticks, as h int F_n dX is. e*^2 e p F_n^2/2 is stored: in
    compression the rest of it is lost.
    """
    ft, fn = law.memory[TANGENTIAL_FORCE], law.memory[NORMAL_FORCE]
    if not after[1] > 0.0:
        return 0.0
    p = shear_share(after[0] / after[1])[0]
    p0 = shear_share(ft / fn)[0] if fn > 0.0 else p
    half, share = 0.5 * law.softening, strain_share(contact, law)
    turned = 0.5 * half * (fn * fn + after[1] ** 2) * (p - p0)
    stored = half * (p * after[1] ** 2 - p0 * fn * fn)
    moved = tip_path(q, tip, law)[0] - law.memory[CONTACT_X]
    held = 0.5 * contact.shear_hold * (fn + after[1]) * moved
    return share * turned + held + (share - law.restitution**2) * stored


@kernel
def tip_slopes(
    stick: float, strain: float, q: Floats, tip: int, contact: ContactState, law: RoundTipLaw
) -> tuple[float, float, float, float, float]:
    """F_t (N), and dF_t/dX, dF_t/dg, dF_n/dX, dF_n/dg of the tip (N/m), t diag(stick, strain)
    (1 - C t)^-1 [[1, 0], [h, 1]], h of `patch_shear`; stick, strain : factors of the springs' dF/dX
    and dF/du_Y, 1 but in `tip_damping`.
    """
    x, y = contact_position(q, tip, contact, law)
    forces = force_and_slopes(x, y, contact, law)
    a, b, c, d, det = yielding(forces, contact, law)
    ft, _, tx, ty, ny = forces
    tx, ty, ny = stick * tx, strain * ty, strain * ny
    tg, ng = (ty * a - tx * b) / det, ny * a / det
    hold = contact.shear_hold
    return ft, (tx * d - ty * c) / det + hold * tg, tg, -ny * c / det + hold * ng, ng
