"""Numbering of the finger's unknowns, so that the bordered matrix is a narrow band.

Walking from the fixed hinge to the tip, phalanx w contributes its hinge's two multipliers and then,
node by node, the four nodal coordinates (X, Y, r'_X, r'_Y):

    [lam_1 | node 1.1 | node 1.2 | ... | lam_2 | node 2.1 | ... ]

Neighbouring nodes lie at most seven places apart, and lam_w couples the last node of phalanx w-1
(four places before) with the first of phalanx w (two places after), so the half bandwidth is 7
whatever the number of elements. Vectors of this length are called *bordered*: nodal coordinates
in the nodes' places and, in the accelerations, the multipliers in the hinges' places.
"""

from __future__ import annotations

import sys
from typing import NamedTuple

import numpy as np

from hcm.arrays import Floats, Ints
from hcm.beam.drive import acting_joints, piece_at, torques_on_nodes
from hcm.beam.element import UNIT_MASS, Three, fill_matrices
from hcm.compiled import ByKind, entry_with, kernel
from hcm.parameters import Drive, Finger, Phalanx


class Chain(NamedTuple):
    """The finger as arrays; N elements, P phalanges, n bordered unknowns.

    first, second : (N,) place of the element's first and second node, second = first + 4.
    length, axial_stiffness : (N,) l (m) and E A (N).
    mass, bending : (N, 4, 4) one component's mass (kg, kg m, kg m^2) and bending stiffness.
    hinge : (P,) place of hinge w's first multiplier.
    hinge_inner, hinge_outer : (P,) place of the node before (-1 at the fixed hinge) and after it.
    weight : (n,) generalized gravity force Q (N, N m).
    torque, torque_node : (T,) tau (N m) at the time that is solved for, set by the integrators, and
        the place of the node that it acts on.
    scale : (n,) D, the unit of each unknown: 1 for positions, 1/l for slopes, an element's mass for
        multipliers. x = D y makes y an acceleration throughout, and D A D of one magnitude.
    tip : place of the tip node C.
    roundoff : m/s^2, largest acceleration that one rounding of a slope or chord can cause through
        an element's stiffness; an iteration that stalls below it has nothing left to gain.
    place_roundoff : m, by which an iteration that stalls may still move a node.
    relaxation : (N,) tau, s. damped : whether any tau is not 0.
    """

    first: Ints
    second: Ints
    length: Floats
    axial_stiffness: Floats
    mass: Floats
    bending: Floats
    hinge: Ints
    hinge_inner: Ints
    hinge_outer: Ints
    weight: Floats
    torque: Floats
    torque_node: Ints
    scale: Floats
    tip: int
    roundoff: float
    place_roundoff: float
    relaxation: Floats
    damped: bool


@kernel
def stiffness(e: int, share: float, chain: Chain) -> Three:
    """`share` of E A l, 4 E I/l and 2 E I/l of element e, N m."""
    bending = chain.bending[e]
    axial = share * chain.axial_stiffness[e] * chain.length[e]
    return axial, share * bending[1, 1], share * bending[1, 3]


def build_chain(finger: Finger, drive: Drive) -> tuple[Chain, Floats]:
    """Number the unknowns and evaluate the constant element matrices.

    Returns the finger as arrays, and nodal coordinates (n,) at rest along -X: positions (-s, 0),
    slopes (-1, 0).
    """
    phalanges = finger.phalanges
    counts = [p.elements for p in phalanges]
    section_properties = [_section(p) for p in phalanges]
    # each phalanx takes its hinge's two multipliers, then its nodes' four coordinates each
    links, elements = len(counts), sum(counts)
    n = 4 * elements + 6 * links
    first, second = np.empty((2, elements), dtype=np.int64)
    length, axial, relaxation = np.empty((3, elements))
    mass, bending = np.empty((2, elements, 4, 4))
    hinge, inner, outer = np.empty((3, links), dtype=np.int64)
    weight, scale, rest = np.zeros((3, n))
    chain = Chain(
        first, second, length, axial, mass, bending, hinge, inner, outer, weight,
        np.empty(0), np.empty(0, dtype=np.int64), scale, n - 4,
        _roundoff(section_properties), ROUNDINGS * sum(p.length for p in phalanges), relaxation,
        any(p.relaxation_time for p in phalanges),
    )  # fmt: skip
    fill_chain_by_kind(
        None, np.array(counts), np.array(section_properties), drive.gravity_vector, chain, rest
    )
    joint, sign = acting_joints(drive, links)
    if joint.size:
        torque = piece_at(torques_on_nodes(drive, links), 0.0).torques[0].copy()
        torque_node = np.where(sign > 0, outer[joint], inner[joint])
        chain = chain._replace(torque=torque, torque_node=torque_node)
    return chain, rest


def _section(p: Phalanx) -> tuple[float, ...]:
    length, density, axial = p.length / p.elements, p.line_density, p.youngs_modulus * p.area
    return length, density, axial, p.bending_stiffness, p.length, p.relaxation_time


@entry_with()
def fill_chain(
    counts: Ints, section_properties: Floats, f: tuple[float, float], chain: Chain, rest: Floats
) -> None:
    """Fill the arrays of `build_chain`'s chain, and its rest (n,), from zeros.

    counts : (P,) elements. section_properties : (P, 6) l (m), rho A (kg/m), E A (N), E I (N m^2),
    the phalanx's length (m), tau (s). f : acceleration by gravity, m/s^2.
    """
    element, place, arc = 0, 0, 0.0
    for w in range(counts.size):
        el, per_length = section_properties[w, 0], section_properties[w, 1]
        chain.hinge[w], chain.hinge_outer[w] = place, place + 2
        chain.hinge_inner[w] = place - 4 if w else -1
        chain.scale[place] = chain.scale[place + 1] = per_length * el
        # w int S dx = w (l/2, l^2/12, l/2, -l^2/12), w = rho A f, on each element's nodes
        force_x, force_y = per_length * f[0] * el / 2.0, per_length * f[1] * el / 2.0
        moment_x, moment_y = per_length * f[0] * el**2 / 12.0, per_length * f[1] * el**2 / 12.0
        for i in range(counts[w] + 1):
            node = place + 2 + 4 * i
            rest[node], rest[node + 2] = -(arc + el * i), -1.0
            chain.scale[node] = chain.scale[node + 1] = 1.0
            chain.scale[node + 2] = chain.scale[node + 3] = 1.0 / el
            if i == counts[w]:
                break
            chain.first[element], chain.second[element] = node, node + 4
            chain.length[element], chain.axial_stiffness[element] = el, section_properties[w, 2]
            chain.relaxation[element] = section_properties[w, 5]
            fill_matrices(
                per_length, section_properties[w, 3], el, chain.mass[element],
                chain.bending[element],
            )  # fmt: skip
            for end in (node, node + 4):
                chain.weight[end] += force_x
                chain.weight[end + 1] += force_y
            element += 1
        chain.weight[place + 4] += moment_x
        chain.weight[place + 5] += moment_y
        place += 4 * counts[w] + 6
        chain.weight[place - 2] -= moment_x
        chain.weight[place - 1] -= moment_y
        arc += section_properties[w, 4]


fill_chain_by_kind = ByKind(fill_chain)

# Smallest eigenvalue of an element mass matrix over the mass, in units of 1 and 1/l.
SOFTEST_MASS = float(np.linalg.eigvalsh(UNIT_MASS / 420.0)[0])
# m/s; roundings of velocities up to it, over an element, count as roundings of strain rates.
FASTEST = 10.0
# Share of the finger's length that is a place's round-off: 1e-14 and more, far above the noise of
# an iteration in a long step.
ROUNDINGS = 100.0 * sys.float_info.epsilon


def _roundoff(section_properties: list[tuple[float, ...]]) -> float:
    # slopes and chords are of size 1: one rounding of theirs bends and stretches an element by eps
    largest = 0.0
    for el, per_length, axial, bending, _, tau in section_properties:
        force = (12 * bending / el**2 + axial) * (1.0 + tau * FASTEST / el)
        largest = max(largest, force / (SOFTEST_MASS * per_length * el))
    return sys.float_info.epsilon * largest
