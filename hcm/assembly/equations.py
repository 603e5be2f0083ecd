"""Equations of motion of the tapping finger and their tangent (paper, eqs. 15-16).

    M q.. + Phi_q^T lam + K(q) q + D(q) q. = Q + tau(q) + F_c(q, q.),      Phi(q) = Phi_q q = 0,

Phi_q constant: the fixed hinge holds the first node at the origin, each further hinge joins the
positions of two neighbouring nodes. lam_w is the force that hinge w takes from phalanx w.
The constraint is imposed as Phi_q q.. = 0: Phi being linear and zero at the start, the integrator's
updates of q and v turn that into Phi = 0 at every step (to round-off), and unlike Phi/h^2 it keeps
its precision when an event search makes h very short.
"""

from __future__ import annotations

import numpy as np

from hcm.arrays import Floats
from hcm.beam.banded_ldl import HALF_BANDWIDTH
from hcm.beam.chain import Chain, stiffness
from hcm.beam.damping import add_damping_matrix, damping_force, damping_power
from hcm.beam.element import Six, inertia, internal_force, over, shape_of, tangent_stiffness
from hcm.beam.joint_torque import torque_force, torque_tangent
from hcm.compiled import allocating, entry, inlined, kernel
from hcm.contact.contract import (
    Law,
    add_rate,
    add_tangent,
    has_rate_force,
    rate_power,
    subtract_force,
)
from hcm.contact.law import ContactState


@entry
def fill_chords(q: Floats, chain: Chain, out: Floats) -> None:
    """Write each element's chord (r_2 - r_1)/l to `out` (N, 2)."""
    for e in range(chain.first.size):
        a, b, length = chain.first[e], chain.second[e], chain.length[e]
        out[e, 0], out[e, 1] = (q[b] - q[a]) / length, (q[b + 1] - q[a + 1]) / length


@inlined
def move_chords(chords: Floats, moved: Floats, chain: Chain, out: Floats) -> None:
    """Write the chords (N, 2) of nodes that have moved by `moved` (n,) since `chords` to `out`."""
    for e in range(chain.first.size):
        a, length = chain.first[e], chain.length[e]
        change, inverse = moved[a : a + 6], 1.0 / length
        out[e, 0] = chords[e, 0] + over(change[4] - change[0], length, inverse)
        out[e, 1] = chords[e, 1] + over(change[5] - change[1], length, inverse)


@kernel
def shape_with(chord: Floats, qe: Floats) -> Six:
    """`shape_of` an element with a chord (2,) that is known better than its positions."""
    return chord[0], chord[1], qe[2], qe[3], qe[6], qe[7]


@kernel
def mean_shape(a: Six, b: Six) -> Six:
    """(a + b)/2."""
    return (
        0.5 * (a[0] + b[0]),
        0.5 * (a[1] + b[1]),
        0.5 * (a[2] + b[2]),
        0.5 * (a[3] + b[3]),
        0.5 * (a[4] + b[4]),
        0.5 * (a[5] + b[5]),
    )


@kernel
def add_damping(q: Floats, chords: Floats, v: Floats, chain: Chain, out: Floats) -> None:
    """Add D(q) v to `out` (n,); `chords` as in `residual_from_chords`."""
    for e in range(chain.first.size):
        a, length, share = chain.first[e], chain.length[e], stiffness(e, chain.relaxation[e], chain)
        shape, rates = shape_with(chords[e], q[a : a + 8]), shape_of(v[a : a + 8], length)
        fx, fy, f1x, f1y, f2x, f2y = damping_force(shape, rates, share)
        f = out[a : a + 8]
        f[0] -= fx / length
        f[1] -= fy / length
        f[2] += f1x
        f[3] += f1y
        f[4] += fx / length
        f[5] += fy / length
        f[6] += f2x
        f[7] += f2y


@kernel
def depends_on_velocity(chain: Chain, law: Law) -> bool:
    """Whether any force depends on velocities."""
    return chain.damped or has_rate_force(law)


@kernel
def dissipated_power(
    q: Floats, chords: Floats, v: Floats, chain: Chain, contact: ContactState, law: Law
) -> float:
    """Power that the material and a radiating tip dissipate, W."""
    power = rate_power(q, v, chain.tip, contact, law) if has_rate_force(law) else 0.0
    return power + dissipation(q, chords, q, chords, v, chain) if chain.damped else power


@kernel
def dissipation(
    q0: Floats, chords0: Floats, q1: Floats, chords1: Floats, v: Floats, chain: Chain
) -> float:
    """v^T D v, W, at the mean of two postures."""
    power = 0.0
    for e in range(chain.first.size):
        a, share = chain.first[e], stiffness(e, chain.relaxation[e], chain)
        begin, end = shape_with(chords0[e], q0[a : a + 8]), shape_with(chords1[e], q1[a : a + 8])
        rates = shape_of(v[a : a + 8], chain.length[e])
        power += damping_power(mean_shape(begin, end), rates, share)
    return power


@inlined
def residual_from_chords(
    q: Floats, chords: Floats, v: Floats, acceleration: Floats, chain: Chain, contact: ContactState,
    law: Law, out: Floats,
) -> None:  # fmt: skip
    """Write M q.. + Phi_q^T lam + K q + D v - Q - tau - F_c (N, N m), Phi_q q.. (m/s^2) to `out`.

    `acceleration` is bordered: q.. in the nodes' places, lam in the hinges'. `chords` (N, 2) are
    the elements' (r_2 - r_1)/l: strains are differences of positions, and an integrator that adds
    up the chords' increments knows them to more digits than the positions hold.
    """
    for i in range(out.size):
        out[i] = -chain.weight[i]
    for e in range(chain.first.size):
        a, length, mass = chain.first[e], chain.length[e], chain.mass[e]
        # an element's two nodes are neighbours: one slice of eight
        x, f = acceleration[a : a + 8], out[a : a + 8]
        shape = shape_with(chords[e], q[a : a + 8])
        fx, fy, f1x, f1y, f2x, f2y = internal_force(shape, stiffness(e, 1.0, chain))
        inverse = 1.0 / length
        fx, fy = over(fx, length, inverse), over(fy, length, inverse)
        p0, p1, p2, p3 = inertia(mass, x[0], x[2], x[4], x[6])
        r0, r1, r2, r3 = inertia(mass, x[1], x[3], x[5], x[7])
        f[0] += p0 - fx
        f[1] += r0 - fy
        f[2] += p1 + f1x
        f[3] += r1 + f1y
        f[4] += p2 + fx
        f[5] += r2 + fy
        f[6] += p3 + f2x
        f[7] += r3 + f2y
    if chain.damped:
        add_damping(q, chords, v, chain, out)
    for t in range(chain.torque.size):
        slope = chain.torque_node[t] + 2
        fx, fy = torque_force(chain.torque[t], q[slope], q[slope + 1])
        out[slope] -= fx
        out[slope + 1] -= fy
    subtract_force(q, v, chain.tip, contact, law, out)
    for w in range(chain.hinge.size):
        lam, inner, outer = chain.hinge[w], chain.hinge_inner[w], chain.hinge_outer[w]
        for c in range(2):
            out[outer + c] += acceleration[lam + c]
            out[lam + c] = acceleration[outer + c]
            if inner >= 0:
                out[inner + c] -= acceleration[lam + c]
                out[lam + c] -= acceleration[inner + c]


@allocating
def residual(
    q: Floats, v: Floats, acceleration: Floats, chain: Chain, contact: ContactState, law: Law,
    out: Floats,
) -> None:  # fmt: skip
    """`residual_from_chords` with the chords of q's own positions."""
    chords = np.empty((chain.first.size, 2))
    fill_chords(q, chain, chords)
    residual_from_chords(q, chords, v, acceleration, chain, contact, law, out)


@kernel
def add_component(
    block: Six, mass: Floats, weight: float, length: float, s1: float, s2: float, rows: Floats
) -> None:
    """Add one component's M + weight K of an element to `rows` (8, w + 1), the element's own.

    `block` is K in (c, r'_1, r'_2) (`tangent_stiffness`), s1 and s2 the slopes' units. The
    component's four coordinates lie two places apart, so that (i, j) is found at w - 2 (i - j).
    """
    w = HALF_BANDWIDTH
    cc, c1, c2, k11, k12, k22 = block
    cc, c1, c2 = weight * cc / (length * length), weight * c1 / length, weight * c2 / length
    rows[0, w] += mass[0, 0] + cc
    rows[2, w - 2] += s1 * (mass[1, 0] - c1)
    rows[2, w] += s1 * s1 * (mass[1, 1] + weight * k11)
    rows[4, w - 4] += mass[2, 0] - cc
    rows[4, w - 2] += s1 * (mass[2, 1] + c1)
    rows[4, w] += mass[2, 2] + cc
    rows[6, w - 6] += s2 * (mass[3, 0] - c2)
    rows[6, w - 4] += s1 * s2 * (mass[3, 1] + weight * k12)
    rows[6, w - 2] += s2 * (mass[3, 2] + c2)
    rows[6, w] += s2 * s2 * (mass[3, 3] + weight * k22)


@kernel
def add_coupling(
    block: Six, weight: float, length: float, s1: float, s2: float, rows: Floats
) -> None:
    """Add weight K_XY of an element, symmetric in the coordinates too, to its `rows` (8, w + 1).

    Entry (Y of i, X of j) lies one place left of where (i, j) of one component is, and
    (X of i, Y of j), i > j, one place right of it in the row before.
    """
    w = HALF_BANDWIDTH
    cc, c1, c2, k11, k12, k22 = block
    cc, c1, c2 = weight * cc / (length * length), weight * c1 / length, weight * c2 / length
    k11, k12, k22 = s1 * s1 * weight * k11, s1 * s2 * weight * k12, s2 * s2 * weight * k22
    rows[1, w - 1] += cc
    rows[3, w - 1] += k11
    rows[5, w - 1] += cc
    rows[7, w - 1] += k22
    rows[3, w - 3] -= s1 * c1
    rows[2, w - 1] -= s1 * c1
    rows[5, w - 5] -= cc
    rows[4, w - 3] -= cc
    rows[5, w - 3] += s1 * c1
    rows[4, w - 1] += s1 * c1
    rows[7, w - 7] -= s2 * c2
    rows[6, w - 5] -= s2 * c2
    rows[7, w - 5] += k12
    rows[6, w - 3] += k12
    rows[7, w - 3] += s2 * c2
    rows[6, w - 1] += s2 * c2


@entry
def tangent(
    q: Floats, weight: float, rate_weight: float, chain: Chain, contact: ContactState, law: Law,
    rows: Floats,
) -> float:  # fmt: skip
    """Write [M + weight d(K q - tau - F_c)/dq + rate_weight D, Phi_q^T; Phi_q, 0] to `rows`.

    The weights are dq/dq.. (s^2) and dv/dq.. (s) of the integrator (0 leaves M); `rows` is
    (w + n, w + 1) in `banded_ldl`'s storage, scaled by the units on both sides. Returns the factor
    s of a sliding tip's unsymmetric part s c e_Y^T, which the rows leave out (`hcm.contact.point`).

    weight d(D v)/dq is left out too. Its main effect is to turn the second factor of every
    grad s (grad s)^T in D, s a strain, by about half the step's angle phi: without it some phi^2 of
    each change in Newton's iteration is left for the next. Its symmetric part would leave more.
    """
    w = HALF_BANDWIDTH
    rows[:] = 0.0
    for e in range(chain.first.size):
        a, length, mass = chain.first[e], chain.length[e], chain.mass[e]
        s1, s2, own = chain.scale[a + 2], chain.scale[a + 6], rows[w + a : w + a + 8]
        shape = shape_of(q[a : a + 8], length)
        xx, xy, yy = tangent_stiffness(shape, stiffness(e, 1.0, chain))
        add_component(xx, mass, weight, length, s1, s2, own)
        add_component(yy, mass, weight, length, s1, s2, own[1:])
        add_coupling(xy, weight, length, s1, s2, own)
        if chain.damped and rate_weight > 0.0:
            share = stiffness(e, rate_weight * chain.relaxation[e], chain)
            add_damping_matrix(shape, share, length, s1, s2, own)
    for t in range(chain.torque.size):
        s = chain.torque_node[t] + 2
        dxx, dxy = torque_tangent(chain.torque[t], q[s], q[s + 1])
        unit = weight * chain.scale[s] * chain.scale[s]
        rows[w + s, w] -= unit * dxx
        rows[w + s + 1, w - 1] -= unit * dxy
        rows[w + s + 1, w] += unit * dxx
    if rate_weight > 0.0:
        add_rate(q, rate_weight, chain.tip, contact, law, rows)
    unsymmetric_factor = add_tangent(q, weight, chain.tip, chain.scale, contact, law, rows)
    for hinge in range(chain.hinge.size):
        lam, inner, outer = chain.hinge[hinge], chain.hinge_inner[hinge], chain.hinge_outer[hinge]
        for c in range(2):
            rows[w + outer + c, lam - outer + w] += chain.scale[lam]
            if inner >= 0:
                rows[w + lam + c, inner - lam + w] -= chain.scale[lam]
    return float(unsymmetric_factor)
