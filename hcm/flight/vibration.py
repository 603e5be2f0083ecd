"""The vibration that a start at rest excites, carried to the touch as modes of the chain.

Released straight and at rest, a finger vibrates about the slightly bent shape q_s that its weight
and its inertia hold. While its joints turn, which takes many periods, the energy of each mode stays
in proportion to its frequency (an adiabatic invariant: Landau and Lifshitz, Mechanics, par. 49):

    q(t) = q_s(t) + sum_i A_i (w_i(0)/w_i(t))^(1/2) phi_i(t) cos(int_0^t w_i dt'),
    K phi_i = w_i^2 M phi_i,    phi_i^T M phi_k = delta_ik,    A_i = phi_i^T M (q - q_s) at t = 0,

K at q_s, where the rods of a rigid flight are, bent by their weight and inertia. So a dozen
eigenproblems give what a thousand steps would. This holds for modes that keep their identity: to
leading order mode i takes a share phi_k^T M phi_i./(w_k - w_i) from mode k.
"""

from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.polynomial import legendre
from numpy.typing import NDArray
from scipy.interpolate import CubicHermiteSpline

from hcm.arrays import Floats, Ints
from hcm.assembly.normal_coordinates import (
    NormalCoordinates,
    fill_residuals,
    mass_and_stiffness,
    normal_coordinates,
)
from hcm.beam.chain import Chain
from hcm.compiled import entry
from hcm.contact.contract import Law
from hcm.flight.rigid_flight import RigidFlight
from hcm.model import fill_rigid_motion

# Gauss's times at which modes are computed. Every other one gives int w dt less exactly, by d_1,
# and of these every other one by d_2 more: errors that fall geometrically leave less than
# d_1^2/d_2.
# In the soft finger's fall d_1 is 2 rad, d_1^2/d_2 0.1, the error 0.003 (of 10^4).
NODES = 13
# s, over which accelerations are differences of velocities, and a change of K one of K, which is
# quadratic in q.
BRIEF, STEP = 1e-6, 1e-4
# Newton's iterations for the bent shape.
BENDING_ITERATIONS = 2
# A bending w of speed v stretches a beam by w'^2/2, which excites lengthwise waves of some
# c w'^2/2 = v^2/(2 w_i r), r the section's radius of gyration: 12 times that on a limp phalanx.
STRETCHED = 6.0
# Modes that move the tip at less than this share of the fastest one's speed are left out.
LEAST = 1e-3
# A mode has lost its identity if less than this of it is left from one time to the next.
LEAST_OVERLAP = 0.7


class Vibration(NamedTuple):
    """The modes of a vibration near the touch.

    bent : (n,) q_s - q at the start, bordered. time : s. frequency, phase : (k,) w_i, rad/s, and
    int w_i dt up to `time`, rad. modes : (k, n) bordered, phi_i times the amplitude at `time`.
    unknown : m/s, root of the summed squares of the parts of the tip's speed that are not known.
    """

    bent: Floats
    time: float
    frequency: Floats
    phase: Floats
    modes: Floats
    unknown: float

    def at(self, time: Floats | float) -> tuple[Floats, Floats]:
        """What the vibration adds to q and v (..., n) at times (...), s, near its own."""
        turn = self.phase + np.multiply.outer(time - self.time, self.frequency)
        return np.cos(turn) @ self.modes, -(self.frequency * np.sin(turn)) @ self.modes


def vibration(chain: Chain, law: Law, lengths: Floats, flight: RigidFlight) -> Vibration:
    """The vibration of a chain that is released at rest and falls as `flight`'s rods do.

    lengths : (P,) of the phalanges, m.
    """
    begin, end = float(flight.time[0]), float(flight.time[-1])
    nodes, weights = legendre.leggauss(NODES)
    times = np.array([begin, *(begin + 0.5 * (end - begin) * (1.0 + nodes)), end])
    links, of = lengths.size, normal_coordinates(chain, law)
    path = CubicHermiteSpline(flight.time, flight.states[:, :links], flight.states[:, links:])
    states = np.concatenate([path(times), path(times, 1)], axis=1)
    q, v, bent = _bent(states, lengths, of)
    inverse = of.inverse
    squares, shapes = np.linalg.eigh(inverse @ mass_and_stiffness(of, q) @ inverse.T)
    # M + K has 1 + w^2; the first P modes turn the rods at their joints, without a frequency
    frequency = np.sqrt(np.maximum(squares - 1.0, 1.0))
    static, tip = bent[0] @ shapes[0], of.to_places[:, chain.tip : chain.tip + 2]
    speeds = np.abs(static) * frequency[0] * np.linalg.norm(shapes[0].T @ tip, axis=1)
    kept = np.flatnonzero(speeds > LEAST * speeds[links:].max())
    kept = kept[kept >= links]
    number, sign, followed = _followed(kept - links, shapes[:, :, links:])
    number += links
    own = np.take_along_axis(shapes, number[:, None], axis=2)
    growth = mass_and_stiffness(of, q + STEP * v) - mass_and_stiffness(of, q - STEP * v)
    growth = np.swapaxes(shapes, 1, 2) @ (inverse @ (growth @ (inverse.T @ own))) / (2.0 * STEP)
    rate, shift, lost = _coupled(number, frequency, growth)
    half = 0.5 * (end - begin) * (rate + shift)[1:-1]
    phase = weights @ half
    lost += _phase_error(nodes, half, phase)
    amplitude = -static[kept] * sign * np.sqrt(rate[0] / rate[-1])
    modes = amplitude[:, None] * (np.swapaxes(own[-1], 0, 1) @ of.to_places)
    bending = chain.bending[:, 0, 0] * chain.length**3 / 12.0
    gyration = np.sqrt((bending / chain.axial_stiffness).min())
    stretching = STRETCHED * (speeds[kept] ** 2 / (frequency[0, kept] * gyration)).sum()
    speeds[kept] *= np.where(followed, np.minimum(lost, 2.0), 2.0)
    unknown = float(np.hypot(np.linalg.norm(speeds[links:]), stretching))
    return Vibration(bent[0] @ of.to_places, end, rate[-1], phase, modes, unknown)


def _bent(states: Floats, lengths: Floats, of: NormalCoordinates) -> tuple[Floats, Floats, Floats]:
    """The shapes q_s (K, n), bordered, in which weight and inertia hold moving rods, the rods'
    velocities (K, n), and what the shapes add to the rods', y (K, c), without turning these.

    states : (K, 2 P) angles and rates.
    """
    links, scale, place = lengths.size, of.chain.scale, of.place
    q, a = np.zeros((2, len(states), scale.size))
    turns = np.zeros((len(states), links, scale.size))
    work = np.zeros((3, scale.size)), np.empty(2 * links)
    fill_rods(states, lengths, of.chain, *work, q, a, turns)
    v = (states[:, None, links:] @ turns)[:, 0]
    turns, _ = np.linalg.qr(np.swapaxes((turns / scale)[..., place] @ of.lower, 1, 2))

    def across(y: Floats) -> Floats:
        """What of y (K, c) turns no rod."""
        along = turns @ (np.swapaxes(turns, 1, 2) @ y[..., None])
        return y - along[..., 0]

    # of the accelerations those by turning faster are left out: their loads turn the rods
    inertia, stiff = (a / scale)[:, place] @ of.lower, mass_and_stiffness(of, q)
    y, out = np.zeros(inertia.shape), np.empty(q.shape)
    still, chords = np.zeros(scale.size), np.empty((of.chain.first.size, 2))
    for _ in range(BENDING_ITERATIONS):
        fill_residuals(q + y @ of.to_places, of.chain, of.law, still, chords, out)
        push = across(-(out @ of.to_places.T) - inertia)
        more = np.linalg.solve(stiff, (push @ of.lower.T)[..., None])[..., 0]
        y += across(more @ of.lower)
    return q + y @ of.to_places, v, y


@entry
def fill_rods(
    states: Floats, lengths: Floats, chain: Chain, work: Floats, state: Floats, q: Floats,
    a: Floats, turns: Floats,
) -> None:  # fmt: skip
    """Write nodes q (K, n) of rods, their accelerations a (K, n) at constant rates, m/s^2, and
    their velocities if one rod turns, (K, P, n), m.

    states : (K, 2 P) angles and rates. work, state : (3, n) zeros and (2 P,).
    """
    links, other, before, after = lengths.size, work[0], work[1], work[2]
    for k in range(states.shape[0]):
        for i in range(links):
            state[links + i] = states[k, links + i]
            state[i] = states[k, i] - BRIEF * states[k, links + i]
        fill_rigid_motion(state, lengths, chain, other, before)
        for i in range(links):
            state[i] = states[k, i] + BRIEF * states[k, links + i]
        fill_rigid_motion(state, lengths, chain, other, after)
        for m in range(other.size):
            a[k, m] = (after[m] - before[m]) / (2.0 * BRIEF)
        for w in range(links):
            for i in range(links):
                state[i], state[links + i] = states[k, i], 1.0 if i == w else 0.0
            fill_rigid_motion(state, lengths, chain, q[k], turns[k, w])


def _followed(kept: Ints, shapes: Floats) -> tuple[Ints, Floats, NDArray[np.bool_]]:
    """Numbers (K, k) of the modes into which `kept` (k,) turn, the signs (k,) of their last shapes,
    and whether they keep their identity, (k,).

    shapes : (K, c, m), orthonormal.
    """
    number, sign, followed = [kept], np.ones(kept.size), np.ones(kept.size, dtype=bool)
    for before, after in pairwise(shapes):
        overlap = before[:, number[-1]].T @ after
        number.append(np.abs(overlap).argmax(axis=1))
        own = np.take_along_axis(overlap, number[-1][:, None], axis=1)[:, 0]
        sign *= np.sign(own)
        followed &= np.abs(own) > LEAST_OVERLAP
    return np.array(number), sign, followed


def _coupled(number: Ints, frequency: Floats, growth: Floats) -> tuple[Floats, Floats, Floats]:
    """Frequencies w_i (K, k) of these modes, rad/s, what turning adds to them, and the largest
    share (k,) that each takes from another one.

    With G_ij = phi_i^T M phi_j. = phi_i^T K. phi_j/(w_j^2 - w_i^2) the modes' amplitudes follow

        c_i.. + 2 sum_j G_ij c_j. + w_i^2 c_i - sum_j G_ij^2 c_i + .. = 0,

    so that w_i^2 grows by sum_j G_ij^2 (4 w_i^2/(w_i^2 - w_j^2) - 1), and c_i takes a share
    2 w_i G_ij/(w_i^2 - w_j^2) from c_j.

    frequency : (K, c), w_j. growth : (K, c, k) phi_j^T K. phi_i, 1/s^3.
    """
    rate = np.take_along_axis(frequency, number, axis=1)
    apart = rate[:, None] ** 2 - frequency[..., None] ** 2
    np.put_along_axis(apart, number[:, None], np.inf, axis=1)
    apart[apart == 0.0] = np.inf
    turning = growth / apart
    shift = (turning**2 * (4.0 * rate[:, None] ** 2 / apart - 1.0)).sum(axis=1) / (2.0 * rate)
    share = np.abs(2.0 * rate[:, None] * turning / apart).max(axis=1)
    return rate, shift, share.max(axis=0)


def _phase_error(nodes: Floats, rate: Floats, phase: Floats) -> Floats:
    """Error (k,) of the integral `phase` over [-1, 1] by Gauss's rule of `rate` (NODES, k)."""

    def by_every(step: int) -> Floats:
        few = nodes[::step]
        moments = np.zeros(few.size)
        moments[0] = 2.0
        weights = np.linalg.solve(legendre.legvander(few, few.size - 1).T, moments)
        return np.asarray(weights @ rate[::step], dtype=float)

    half, quarter = by_every(2), by_every(4)
    once: Floats = np.abs(phase - half)
    twice = np.maximum(np.abs(half - quarter), 1e-300)
    return once * np.minimum(once / twice, 1.0)
