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

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from hcm.ancf_element import bending_matrix, mass_matrix
from hcm.parameters import Drive, Finger, Surface, Tip

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]


class Chain(NamedTuple):
    """The finger as arrays; N elements, P phalanges, n bordered unknowns.

    first, second : (N,) place of the element's first and second node, second = first + 4.
    length, axial_stiffness : (N,) l (m) and E A (N).
    mass, bending : (N, 4, 4) one component's mass (kg, kg m, kg m^2) and bending stiffness.
    hinge : (P,) place of hinge w's first multiplier.
    hinge_inner, hinge_outer : (P,) place of the node before (-1 at the fixed hinge) and after it.
    weight : (n,) generalized gravity force Q (N, N m).
    torque, torque_node : (T,) tau (N m) and the place of the node that it acts on.
    scale : (n,) D, the unit of each unknown: 1 for positions, 1/l for slopes, an element's mass for
        multipliers. x = D y makes y an acceleration throughout, and D A D of one magnitude.
    tip : place of the tip node C.
    roundoff : m/s^2, largest acceleration that one rounding of a slope or chord can cause through
        an element's stiffness; an iteration that stalls below it has nothing left to gain.
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


class Probe(NamedTuple):
    """Section R, mid-length of the last phalanx: one element, or the two that meet there.

    elements : (2,) indices of the elements; abscissa : (2,) x/l in each.
    youngs_modulus : Pa; radius : d/2, m.
    """

    elements: Ints
    abscissa: Floats
    youngs_modulus: float
    radius: float


class Law(NamedTuple):
    """Constants of the lumped contact: k (N/m), e*, eta^-2, mu and H (m)."""

    k: float
    restitution: float
    tangential_ratio: float
    mu: float
    height: float


def contact_law(surface: Surface, tip: Tip) -> Law:
    """Gather the contact's constants from the surface and the tip."""
    return Law(
        float(tip.normal_stiffness),
        float(tip.restitution),
        float(tip.tangential_ratio),
        float(surface.friction),
        float(surface.height),
    )


def build_chain(finger: Finger, drive: Drive) -> tuple[Chain, Floats]:
    """Number the unknowns and evaluate the constant element matrices.

    Returns
    -------
    chain : the finger as arrays.
    rest : (n,) nodal coordinates at rest along -X: positions (-s, 0), slopes (-1, 0).
    """
    phalanges = finger.phalanges
    counts = np.array([p.elements for p in phalanges])
    size = [p.length / p.elements for p in phalanges]
    per_length = [p.density * p.area for p in phalanges]
    mass = [mass_matrix(m, el) for m, el in zip(per_length, size, strict=True)]
    bending = [
        bending_matrix(p.youngs_modulus * p.second_moment, el)
        for p, el in zip(phalanges, size, strict=True)
    ]
    # -w int S dx = -w (l/2, l^2/12, l/2, -l^2/12) on the Y components of each element's nodes
    force = [m * drive.gravity * el / 2 for m, el in zip(per_length, size, strict=True)]
    moment = [m * drive.gravity * el**2 / 12 for m, el in zip(per_length, size, strict=True)]
    # phalanx w takes its hinge's two multipliers, then its nodes' four coordinates each
    ends = (2 + 4 * (counts + 1)).cumsum()
    hinge, n = ends - (2 + 4 * (counts + 1)), int(ends[-1])
    outer, inner = hinge + 2, hinge - 4
    inner[0] = -1
    phalanx = np.arange(counts.size)
    # the phalanx of each element and of each node; w hinges and w last nodes lie before phalanx w's
    on, at = phalanx.repeat(counts), phalanx.repeat(counts + 1)
    first, node = 4 * np.arange(on.size) + (2 + 6 * on), 4 * np.arange(at.size) + (2 + 2 * at)
    el = np.array(size)
    rest, scale, weight = np.zeros(n), np.ones(n), np.zeros(n)
    begin = np.array([0.0, *(p.length for p in phalanges[:-1])]).cumsum()
    rest[node] = -(begin[at] + el[at] * ((node - outer[at]) // 4))
    rest[node + 2] = -1.0
    scale[hinge] = scale[hinge + 1] = np.array(per_length) * el
    scale[node + 2] = scale[node + 3] = (1.0 / el)[at]
    weight[first + 1] -= np.array(force)[on]
    weight[first + 5] -= np.array(force)[on]
    weight[outer + 3] -= moment
    weight[ends - 1] += moment
    torque, torque_node = _torques(drive, inner.tolist(), outer.tolist())
    chain = Chain(
        first,
        first + 4,
        el[on],
        np.array([p.youngs_modulus * p.area for p in phalanges])[on],
        np.array(mass)[on],
        np.array(bending)[on],
        hinge,
        inner,
        outer,
        weight,
        torque,
        torque_node,
        scale,
        n - 4,
        _roundoff(finger),
    )
    return chain, rest


# Smallest eigenvalue of an element mass matrix over the mass, in units of 1 and 1/l.
SOFTEST_MASS = float(np.linalg.eigvalsh(mass_matrix(1.0, 1.0))[0])


def _roundoff(finger: Finger) -> float:
    # slopes and chords are of size 1: one rounding of theirs bends and stretches an element by eps
    largest = 0.0
    for phalanx in finger.phalanges:
        el = phalanx.length / phalanx.elements
        bending = 12 * phalanx.youngs_modulus * phalanx.second_moment / el**2
        axial = phalanx.youngs_modulus * phalanx.area
        element_mass = phalanx.density * phalanx.area * el
        largest = max(largest, (bending + axial) / (SOFTEST_MASS * element_mass))
    return float(np.finfo(float).eps) * largest


def _torques(drive: Drive, inner: list[int], outer: list[int]) -> tuple[Floats, Ints]:
    torque: list[float] = []
    node: list[int] = []
    for w, tau in enumerate(drive.torques):
        if tau != 0.0:
            torque.append(float(tau))
            node.append(outer[w])
            if drive.reaction and w > 0:
                torque.append(-float(tau))
                node.append(inner[w])
    return np.array(torque), np.array(node, dtype=np.int64)


def build_probe(finger: Finger) -> Probe:
    """Locate section R at mid-length of the last phalanx."""
    last = finger.phalanges[-1]
    offset = sum(p.elements for p in finger.phalanges[:-1])
    middle = last.elements // 2
    if last.elements % 2:
        elements, abscissa = [offset + middle] * 2, [0.5, 0.5]
    else:  # r'' jumps at a node: the two sides are averaged
        elements, abscissa = [offset + middle - 1, offset + middle], [1.0, 0.0]
    return Probe(
        np.array(elements, dtype=np.int64),
        np.array(abscissa),
        float(last.youngs_modulus),
        last.diameter / 2,
    )
