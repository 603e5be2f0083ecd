"""Equations of motion of a planar chain of rigid rods, which approximate falling phalanges.

With theta_j the angle of rod j from -X, counter-clockwise, mu_jk the mass that both rods j and k
carry about (m_k/2 of the outer one of them, k, and the mass beyond it; m_j/3 and the mass beyond
for j = k: thin rods' first and second moments about their hinge, over L and L^2), and
t_j = (-cos theta_j, -sin theta_j), Lagrange's equations are

    sum_k mu_jk L_j L_k [cos(theta_j - theta_k) theta..k + sin(theta_j - theta_k) theta.k^2]
        = tau_j + mu_jj' L_j (f_x sin theta_j - f_y cos theta_j),

with mu_jj' = m_j/2 + the mass beyond and f the acceleration by gravity,
which are those of ANCF elements (sections without rotary inertia, torques on a phalanx's first
slope) that neither bend nor stretch.
"""

import math
from typing import NamedTuple

import numpy as np

from hcm.arrays import Floats
from hcm.assumptions import PAPER, Assumptions
from hcm.beam.drive import Piece, torques_on_rods
from hcm.beam.refinement import beams_of, moments, touching_height
from hcm.compiled import entry, kernel
from hcm.parameters import Drive, Finger, Surface

# A moment M at one of its two hinges bends a beam by M L^2/(E I) over this.
SAG_OF_MOMENT = 9.0 * math.sqrt(3.0)


class Rods(NamedTuple):
    """P rods: length (P,), m; mass, beyond (P,), own and of the rods further out, kg.

    torque : (2, P) N m at the time `since`, s, and its rate, N m/s.
    first, second : (P,) moments of a rod's mass about its hinge, over m L and m L^2.
    bending, axial : (P,) E I (N m^2) and E A (N) of the beams that they stand for. moment : (P,)
    the largest torques at a rod's two ends by `acting_between`, N m: they bend it even if they
    cancel. reaction : whether a joint's torque acts on the rod before it too. gravity_vector : f,
    m/s^2. height : H, m. inertia (P, P), along (2, P) : scratch. between (2 P,) : scratch for
    angles, then zeros.
    """

    length: Floats
    mass: Floats
    beyond: Floats
    torque: Floats
    since: float
    first: Floats
    second: Floats
    bending: Floats
    axial: Floats
    moment: Floats
    reaction: bool
    gravity_vector: tuple[float, float]
    height: float
    inertia: Floats
    along: Floats
    between: Floats


def build_rods(
    finger: Finger, surface: Surface, drive: Drive, assumptions: Assumptions = PAPER
) -> tuple[Rods, tuple[Piece, ...]]:
    """The finger's phalanges as rods, in the first piece of their drive, and all pieces of it."""
    phalanges = beams_of(finger, assumptions).phalanges
    links = len(phalanges)
    length, bending, axial = np.array([
        [p.length for p in phalanges],
        [p.bending_stiffness for p in phalanges],
        [p.youngs_modulus * p.area for p in phalanges],
    ])  # fmt: skip
    mass, first, second = moments(finger, assumptions)
    pieces = torques_on_rods(drive, links)
    rods = Rods(
        length, mass, mass[::-1].cumsum()[::-1] - mass, pieces[0].torques, pieces[0].begin_s, first,
        second, bending, axial, np.zeros(links), drive.reaction, drive.gravity_vector,
        touching_height(finger, surface, assumptions), np.empty((links, links)),
        np.empty((2, links)), np.zeros(2 * links),
    )  # fmt: skip
    return rods, pieces


def acting_between(rods: Rods, pieces: tuple[Piece, ...], begin_s: float, end_s: float) -> Rods:
    """The rods with the `moment` of torques between these times, s; later ones bend nothing.

    A torque that began a time t before the end makes a beam vibrate at sin(w t) of its full speed,
    w being that of its first shape on two hinges, and counts by min(w t, 1). Vibrations of several
    changes may be in phase: those of jumps add up, and of changes of rate, over w.
    pieces : of `build_rods`, the torques on each rod, M_w - M_(w+1) where joints react.
    """
    if len(pieces) == 1 and not pieces[0].torques.any():  # saves a twentieth of a tap
        return rods

    def at_ends(torques: Floats) -> Floats:
        if not rods.reaction:
            return np.abs(torques)
        ends = np.abs(torques[:, ::-1].cumsum(axis=1)[:, ::-1])
        ends[:, :-1] += ends[:, 1:].copy()
        return ends

    shaken, found = np.zeros(rods.length.size), [np.zeros(rods.length.size)]
    torque = rate = np.zeros((1, rods.length.size))
    first_frequency = (math.pi / rods.length) ** 2 * np.sqrt(rods.bending * rods.length / rods.mass)
    for piece in pieces:
        first, last = max(piece.begin_s, begin_s), min(piece.end_s, end_s)
        if first < last:
            passed = np.array([[first], [last]]) - piece.begin_s
            ends = piece.torques[0] + passed * piece.torques[1]
            turned = np.minimum(first_frequency * (end_s - first), 1.0)
            found.append(at_ends(ends).max(axis=0) * turned)
            changed = (
                at_ends(ends[:1] - torque) + at_ends(piece.torques[1:] - rate) / first_frequency
            )
            shaken += changed[0] * turned
            torque, rate = ends[1:], piece.torques[1:]
    return rods._replace(moment=np.maximum.reduce([*found, shaken]))


@entry
def rates(time: float, state: Floats, rods: Rods, out: Floats) -> None:
    """Write d/dt (theta, theta.) of `state` (2 P,) at `time`, s, to `out` (2 P,)."""
    length, mass, beyond, torque, since, first, second, _, _, _, _, f, _, inertia, along, _ = rods
    n = length.size
    for j in range(n):
        along[0, j], along[1, j] = math.cos(state[j]), math.sin(state[j])
    for j in range(n):
        tau = torque[0, j] + (time - since) * torque[1, j]
        load = tau - f[1] * (first[j] * mass[j] + beyond[j]) * length[j] * along[0, j]
        load += f[0] * (first[j] * mass[j] + beyond[j]) * length[j] * along[1, j]
        for k in range(n):
            outer = max(j, k)
            share = first[outer] if j != k else second[j]
            size = (share * mass[outer] + beyond[outer]) * length[j] * length[k]
            inertia[j, k] = size * (along[0, j] * along[0, k] + along[1, j] * along[1, k])
            sine = along[1, j] * along[0, k] - along[0, j] * along[1, k]
            load -= size * sine * state[n + k] ** 2
        out[j], out[n + j] = state[n + j], load
    # Gauss's elimination without pivots: the inertia is symmetric and positive definite
    for j in range(n):
        for i in range(j + 1, n):
            factor = inertia[i, j] / inertia[j, j]
            for k in range(j + 1, n):
                inertia[i, k] -= factor * inertia[j, k]
            out[n + i] -= factor * out[n + j]
    for j in range(n - 1, -1, -1):
        for k in range(j + 1, n):
            out[n + j] -= inertia[j, k] * out[n + k]
        out[n + j] /= inertia[j, j]


@entry
def clearance(state: Floats, rods: Rods) -> tuple[float, float]:
    """The tip's height above the surface, m, and its velocity, m/s, along +Y."""
    gap, speed = rods.height, 0.0
    for j in range(rods.length.size):
        gap -= rods.length[j] * math.sin(state[j])
        speed -= rods.length[j] * math.cos(state[j]) * state[rods.length.size + j]
    return gap, speed


@kernel
def reactions(state: Floats, acceleration: Floats, rods: Rods, out: Floats) -> tuple[float, float]:
    """Write lam (2 P,), N: the force that hinge w takes from rod w, sum_{i >= w} m_i (f - r..i).

    Returns the speed that rods leave out and what stretches of it, m/s: their loads
    p = rho A (f - r..), the larger of both ends', the force F of the rods beyond and the torques M
    at the ends would bend a beam on two hinges and stretch a beam held at one; these deflections,
    each times its first frequency, are

        (5 p_n L^4/384 + M L^2/(9 sqrt 3))/(E I) pi^2/L^2 sqrt(E I/rho A),
        (p_t L^2/2 + F_t L)/(E A) pi/(2 L) sqrt(E A/rho A),

    of which the largest sum of any rod counts, and the largest of the second. Beams vibrate at it
    if the loads come suddenly.
    """
    n, fastest, stretching = rods.length.size, 0.0, 0.0
    gx, gy = -rods.gravity_vector[0], -rods.gravity_vector[1]
    ax, ay = 0.0, 0.0
    for w in range(n):
        cos, sin, spin = math.cos(state[w]), math.sin(state[w]), state[n + w] ** 2
        # r.. of the rod's centre is that of its hinge and a share of what the rod adds at its end
        dx = rods.length[w] * (acceleration[w] * sin + spin * cos)
        dy = rods.length[w] * (-acceleration[w] * cos + spin * sin)
        out[2 * w] = -rods.mass[w] * (gx + ax + rods.first[w] * dx)
        out[2 * w + 1] = -rods.mass[w] * (gy + ay + rods.first[w] * dy)
        ax, ay = ax + dx, ay + dy
    fx, fy = 0.0, 0.0
    for w in range(n - 1, -1, -1):
        cos, sin, spin = math.cos(state[w]), math.sin(state[w]), state[n + w] ** 2
        length = rods.length[w]
        dx = length * (acceleration[w] * sin + spin * cos)
        dy = length * (-acceleration[w] * cos + spin * sin)
        per_length = rods.mass[w] / length
        across, stretch = 0.0, 0.0
        for _ in range(2):  # the outer end, then the hinge
            across = max(across, abs(cos * (gy + ay) - sin * (gx + ax)))
            stretch = max(stretch, abs(cos * (gx + ax) + sin * (gy + ay)))
            ax, ay = ax - dx, ay - dy
        ax, ay = ax + dx, ay + dy
        sag = per_length * across * length**4 * (5.0 / 384.0)
        sag += rods.moment[w] * length**2 / SAG_OF_MOMENT
        pulled = per_length * stretch * 0.5 * length**2 + abs(cos * fx + sin * fy) * length
        bent = sag * (math.pi / length) ** 2 / math.sqrt(rods.bending[w] * per_length)
        drawn = pulled * 0.5 * math.pi / length / math.sqrt(rods.axial[w] * per_length)
        fastest, stretching = max(fastest, bent + drawn), max(stretching, drawn)
        fx, fy = fx + out[2 * w], fy + out[2 * w + 1]
        out[2 * w], out[2 * w + 1] = fx, fy
    return fastest, stretching


@kernel
def body_depth(state: Floats, radius: Floats, height: float, rods: Rods) -> float:
    """How far the lowest section of radius (P,) at a hinge lies below the surface, m.

    height : of the surface below the fixed hinge, m; that of `rods` is where a round tip touches.
    """
    y, deepest, n = height, -math.inf, rods.length.size
    for w in range(n):
        reach = radius[w] * abs(math.cos(state[w]))
        deepest = max(deepest, reach - y)
        y -= rods.length[w] * math.sin(state[w])
        if w + 1 < n:
            deepest = max(deepest, reach - y)
    return deepest


@entry
def survey(
    states: Floats, accelerations: Floats, radius: Floats, height: float, rods: Rods, out: Floats
) -> tuple[float, float, float, float, float]:
    """Speeds that rods leave out (`reactions`): first, what stretches of that, last and largest,
    m/s; the depth below the surface, m, that sections reach while the tip is as far above it.

    states (m, 2 P), accelerations (m, P) : of a flight. out : (2 P,) scratch.
    """
    first, stretching, speed, largest, sunk = 0.0, 0.0, 0.0, 0.0, 0.0
    for m in range(states.shape[0]):
        speed, stretched = reactions(states[m], accelerations[m], rods, out)
        if m == 0:
            first, stretching = speed, stretched
        largest = max(largest, speed)
        depth = body_depth(states[m], radius, height, rods)
        sunk = max(sunk, min(depth, clearance(states[m], rods)[0]))
    return first, stretching, speed, largest, sunk
