"""Equations of motion of the tapping finger and their tangent (paper, eqs. 15-16).

    M q.. + Phi_q^T lam + K(q) q = Q + tau(q) + F_c(q),      Phi(q) = Phi_q q = 0,

Phi_q constant: the fixed hinge holds the first node at the origin, each further hinge joins the
positions of two neighbouring nodes. lam_w is the force that hinge w takes from phalanx w.
The constraint is imposed as Phi_q q.. = 0: Phi being linear and zero at the start, the integrator's
updates of q and v turn that into Phi = 0 at every step (to round-off), and unlike Phi/h^2 it keeps
its precision when an event search makes h very short.
"""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

from hcm.ancf_element import add_inertia, add_internal_force, axial_tangent, chord
from hcm.banded_lu import HALF_BANDWIDTH
from hcm.joint_torque import torque_force, torque_tangent
from hcm.layout import Chain, Law
from hcm.lumped_contact import Contact, contact_force, contact_tangent

Floats = NDArray[np.float64]


@njit(cache=True)
def fill_chords(q: Floats, chain: Chain, out: Floats) -> None:
    """Write each element's chord (r_2 - r_1)/l to `out` (N, 2)."""
    for e in range(chain.first.size):
        out[e, 0], out[e, 1] = chord(q, chain.first[e], chain.second[e], chain.length[e])


@njit(cache=True)
def residual_from_chords(
    q: Floats,
    chords: Floats,
    acceleration: Floats,
    chain: Chain,
    contact: Contact,
    law: Law,
    out: Floats,
) -> None:
    """Write M q.. + Phi_q^T lam + K q - Q - tau - F_c (N, N m) and Phi_q q.. (m/s^2) to `out` (n,).

    `acceleration` is bordered: q.. in the nodes' places, lam in the hinges'. `chords` (N, 2) are
    the elements' (r_2 - r_1)/l: strains are differences of positions, and an integrator that adds
    up the chords' increments knows them to more digits than the positions hold.
    """
    for i in range(out.size):
        out[i] = -chain.weight[i]
    for e in range(chain.first.size):
        a, b = chain.first[e], chain.second[e]
        add_inertia(chain.mass[e], acceleration, a, b, out)
        along = (chords[e, 0], chords[e, 1])
        add_internal_force(
            q, along, a, b, chain.length[e], chain.axial_stiffness[e], chain.bending[e], out
        )
    for t in range(chain.torque.size):
        slope = chain.torque_node[t] + 2
        fx, fy = torque_force(chain.torque[t], q[slope], q[slope + 1])
        out[slope] -= fx
        out[slope + 1] -= fy
    tip = chain.tip
    ft, fn = contact_force(q[tip], q[tip + 1] + law.height, contact, law)
    out[tip] -= ft
    out[tip + 1] -= fn
    for w in range(chain.hinge.size):
        lam, inner, outer = chain.hinge[w], chain.hinge_inner[w], chain.hinge_outer[w]
        for c in range(2):
            out[outer + c] += acceleration[lam + c]
            out[lam + c] = acceleration[outer + c]
            if inner >= 0:
                out[inner + c] -= acceleration[lam + c]
                out[lam + c] -= acceleration[inner + c]


@njit(cache=True)
def residual(
    q: Floats, acceleration: Floats, chain: Chain, contact: Contact, law: Law, out: Floats
) -> None:
    """`residual_from_chords` with the chords of q's own positions."""
    chords = np.empty((chain.first.size, 2))
    fill_chords(q, chain, chords)
    residual_from_chords(q, chords, acceleration, chain, contact, law, out)


@njit(cache=True)
def tangent(
    q: Floats, weight: float, chain: Chain, contact: Contact, law: Law, band: Floats
) -> None:
    """Write the bordered matrix [M + weight d(K q - tau - F_c)/dq, Phi_q^T; Phi_q, 0] to `band`.

    `weight` is dq/dq.. of the integrator, s^2 (0 leaves M); `band` is (n, 2 w + 1) in
    `banded_lu`'s storage, scaled by D on both sides.
    """
    w = HALF_BANDWIDTH
    band[:] = 0.0
    axial = np.empty((8, 8))
    for e in range(chain.first.size):
        a, b = chain.first[e], chain.second[e]
        if weight != 0.0:
            axial_tangent(q, a, b, chain.length[e], chain.axial_stiffness[e], axial)
        else:
            axial[:] = 0.0
        mass, bending = chain.mass[e], chain.bending[e]
        place = (a, a + 2, b, b + 2)
        for i in range(4):
            for j in range(4):
                both = mass[i, j] + weight * bending[i, j]
                at = place[j] - place[i] + w
                for c in range(2):
                    row = place[i] + c
                    band[row, at] += both
                    for d in range(2):
                        band[row, at + d - c] += weight * axial[2 * i + c, 2 * j + d]
    for t in range(chain.torque.size):
        s = chain.torque_node[t] + 2
        dxx, dxy = torque_tangent(chain.torque[t], q[s], q[s + 1])
        band[s, w] -= weight * dxx
        band[s, w + 1] -= weight * dxy
        band[s + 1, w - 1] -= weight * dxy
        band[s + 1, w] += weight * dxx
    dtx, dty, dny = contact_tangent(contact, law)
    tip = chain.tip
    band[tip, w] -= weight * dtx
    band[tip, w + 1] -= weight * dty
    band[tip + 1, w] -= weight * dny
    for hinge in range(chain.hinge.size):
        lam, inner, outer = (
            chain.hinge[hinge],
            chain.hinge_inner[hinge],
            chain.hinge_outer[hinge],
        )
        for c in range(2):
            band[outer + c, lam - outer + w] += 1.0
            band[lam + c, outer - lam + w] += 1.0
            if inner >= 0:
                band[inner + c, lam - inner + w] -= 1.0
                band[lam + c, inner - lam + w] -= 1.0
    n = q.size
    for i in range(n):
        for j in range(max(0, i - w), min(n, i + w + 1)):
            band[i, j - i + w] *= chain.scale[i] * chain.scale[j]
