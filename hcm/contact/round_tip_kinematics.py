"""A contact at the lowest point of a spherical tip, with the interface of `hcm.contact.point`.

The beam ends at the sphere's centre C, whose slope r' turns with the rigid end piece. With
g = Y_C + H - R and the angle psi of r', the surface's forces act at the arm R below C:

    X = X_C + R psi,      F_c = F_t (e_X + R grad psi) + F_n e_Y.

They act on the undeformed sphere, as Hertz's and Mindlin's do. On the deformed one the arm of F_t
is shorter by d, and F_n has the patch's displacement u as its arm, with the opposite effect: with
Mindlin's u, F_n u is 8/9 of F_t d at nu = 0.4. psi is added up over the accepted steps.

Between C and the contact's springs lies the tip's own compliance,

    (X, u_Y)_springs = (X, g + e F_t^2/F_n) + C F(springs),
    C = [[c_tt, -s c_nt], [-s c_nt, 0]],

s = 1 for a phalanx that points along -X (`sheared_way` has e in restitution and for large F_t/F_n).
C is fixed at the touch, by the phalanx's angle there; its c_nn belongs to the normal law
(`round_tip_law`). Newton's method finds the springs' (X, u_Y), so that the forces on the beams are
functions of (X, g). Along the normal a tip that radiates yields by c_nn F_n - D F_n.: to first
order in D, and without friction's part in k,

    F_n += -D k^2 g.,      k of `round_tip_law.normal_slope`,

times e*^2 in restitution, where this yield is part of the contact too. It dissipates D (k g.)^2, in
restitution e*^2 times that; it is limited so that the whole F_n does not become negative. F_t of
springs that stick is at most mu times the whole F_n.

A material with Kelvin-Voigt damping, stress E (strain + tau strain rate), multiplies each elastic
field by 1 + tau d/dt, and so Hertz's force on the patch that it has (Brilliantov, Spahn, Hertzsch
and Poeschel 1996, eq. 17), Mindlin's, and what the tip's own compliance takes:

    F += tau dF/dt,      dF/dt = dF/d(X, g) (X., g.) = dF/d(X, u_Y) (X., u_Y.) of the springs.

In restitution d falls at the rate u_Y./e*^2, but the material is strained at the rate u_Y.: dF/du_Y
is taken times e*^2 there (`strain_share`), which leaves no jump at the reversal. The tip leaves
where the whole F_n vanishes; what its springs still hold then is lost as the surface relaxes
(`unrecovered_energy`).
"""

import math

from hcm.arrays import Floats
from hcm.beam.banded_ldl import HALF_BANDWIDTH
from hcm.beam.joint_torque import torque_force, torque_tangent, turn_rate, turned_angle
from hcm.compiled import kernel
from hcm.contact.law import FLIGHT, SLIP, STICK, ContactState
from hcm.contact.round_tip_law import (
    COMPLIANCE_XX,
    COMPLIANCE_XY,
    COMPLIANCE_YY,
    CONTACT_X,
    GAP,
    INDENTATION,
    ITERATIONS,
    NORMAL_FORCE,
    SHEARED,
    SLOPE_X,
    SLOPE_Y,
    SPRING_X,
    TANGENTIAL_FORCE,
    TIP_X,
    RoundTipLaw,
    contact_force,
    force_and_slopes,
    indentation,
    normal_slope,
    particle_velocity,
    sheared_way,
    slip_limit,
    spring_displacement,
    stored_energy,
    strain_share,
)

# Newton's last change of the springs' position, over the lengths of which it is a difference; the
# convergence is quadratic except where springs begin to slip.
POSITION_TOLERANCE = 1e-13

# By how much, over mu/eta^-2 d, a spring that slips is kept beyond its limit where the material
# relaxes: at its limit it would count as one that sticks, and add tau times its rate to F_t.
SLIPPED = 1e-9


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
    cxx, cxn = law.memory[COMPLIANCE_XX], law.memory[COMPLIANCE_XY]
    ft, fn = law.memory[TANGENTIAL_FORCE], law.memory[NORMAL_FORCE]
    x, y = along + cxx * ft + cxn * fn, gap + cxn * ft + sheared_way(ft, fn, contact, law)[0]
    for _ in range(ITERATIONS):
        forces = force_and_slopes(x, y, contact, law)
        ft, fn = forces[:2]
        rx = along + cxx * ft + cxn * fn - x
        ry = gap + cxn * ft + sheared_way(ft, fn, contact, law)[0] - y
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
    return (d * vt - b * vn) / det, (a * vn - c * vt) / det


@kernel
def tip_slopes(
    strain: float, q: Floats, tip: int, contact: ContactState, law: RoundTipLaw
) -> tuple[float, float, float, float, float]:
    """F_t (N), and dF_t/dX, dF_t/dg, dF_n/dX, dF_n/dg of the tip (N/m), t diag(1, strain)
    (1 - C t)^-1; strain : factor of the springs' dF/du_Y, 1 but for `strain_share`.
    """
    x, y = contact_position(q, tip, contact, law)
    ft, fn, tx, ty, ny = force_and_slopes(x, y, contact, law)
    a, b, c, d, det = yielding((ft, fn, tx, ty, ny), contact, law)
    ty, ny = strain * ty, strain * ny
    return ft, (tx * d - ty * c) / det, (ty * a - tx * b) / det, -ny * c / det, ny * a / det


@kernel
def axis_end(q: Floats, tip: int, law: RoundTipLaw) -> tuple[float, float]:
    """The pole, R beyond C along r', m; with v for q, its velocity, m/s."""
    return q[tip] + ball_radius(law) * q[tip + 2], q[tip + 1] + ball_radius(law) * q[tip + 3]


@kernel
def has_rate_force(law: RoundTipLaw) -> bool:
    """Whether `tip_force` depends on v."""
    return law.radiation > 0.0 or law.relaxation > 0.0


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
        _, tx, tg, nx, ng = tip_slopes(strain_share(contact, law), q, tip, contact, law)
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
def add_rate(
    q: Floats, weight: float, tip: int, contact: ContactState, law: RoundTipLaw, rows: Floats
) -> None:
    """Add -weight dF_n/dg. and -weight dF_t/dX. to `rows`."""
    if contact.normal_mode == FLIGHT or not has_rate_force(law):
        return
    w, (_, y) = HALF_BANDWIDTH, contact_position(q, tip, contact, law)
    damping = radiation_damping(y, contact, law)
    if law.relaxation > 0.0:
        _, tx, _, _, ng = tip_slopes(strain_share(contact, law), q, tip, contact, law)
        damping -= law.relaxation * ng
        rows[w + tip, w] -= weight * law.relaxation * tx
    rows[w + tip + 1, w] += weight * damping


@kernel
def add_tangent(
    q: Floats, weight: float, tip: int, scale: Floats, contact: ContactState, law: RoundTipLaw,
    rows: Floats,
) -> float:  # fmt: skip
    """Add -weight dF_c/dq to `rows`; returns the factor of its part that is not symmetric."""
    if contact.normal_mode == FLIGHT:
        return 0.0
    w, unit = HALF_BANDWIDTH, scale[tip + 2]
    ft, tx, _, nx, ng = tip_slopes(1.0, q, tip, contact, law)
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
    _, _, tg, nx, _ = tip_slopes(1.0, q, tip, contact, law)
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
    if before.normal_mode != contact.normal_mode:
        ft, fn = memory[TANGENTIAL_FORCE], memory[NORMAL_FORCE]
        way = sheared_way(ft, fn, before, law)[0]
        memory[SHEARED] += way - sheared_way(ft, fn, contact, law)[0]
    if before.tangential_mode == SLIP and contact.tangential_mode == STICK:
        _, gap = spring_position(memory[CONTACT_X], memory[GAP], before, law)
        d, _ = indentation(gap, before, law)
        for i in range(law.springs.size):
            law.springs[i] = before.slip_sign * slip_limit(i, d, law)
