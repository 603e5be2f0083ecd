"""What a rigid flight leaves out: phalanges that bend under their loads and ring when these change.

A phalanx is a beam on two hinges under the load of its own mass, ρA (f - r″) across it, and the
torques at its ends. With p the larger load and t the sum of the torques of both ends,

    δ = (5 p L⁴/384 + t L²/(9 √3))/(E I),  ω₁ = (π/L)² √(E I/(ρA)),

and it rings at δ ω₁ where the loads come suddenly, of which a share reaches the tip as it touches:
in the time T of a flight it grows to no more than 1 - cos(ω₁ T) of it.
"""

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

import meshes
from reference_fem.arrays import Array
from reference_fem.rigid_chain import ChainState, RigidChain
from reference_fem.rigid_flight import Descent
from reference_fem.settings import Drive, Material

WEIGHT_SHARE, TORQUE_SHARE = 0.1, 0.3
"""Of δ ω₁: where elements fly, tips of fingers that fall touch 0.01 to 0.08 of it slower or faster,
of driven ones 0.1 to 0.3 (nine fingers of 1e7 to 1e9 Pa, whirls left out)."""
SAMPLES = 50
"""States of a flight at which its bending is looked at, with those at its torques' kinks."""


class LeftOut(NamedTuple):
    """The largest δ/L, rad, δ, m, and its share of δ ω₁, m/s, of a flight's phalanges."""

    angle: float
    depth: float
    speed: float


def sag(
    chain: RigidChain, state: ChainState, torques: Array, geometry: meshes.FingerGeometry,
    materials: Sequence[Material],
) -> tuple[Array, Array]:  # fmt: skip
    """δ, m, and ω₁, rad/s, of each phalanx, (P,).

    torques : at the two ends of each phalanx of the whole finger, the sum of their sizes, N·m
    """
    own = chain.torques.at(state.time_s)
    changes = chain.rates_of_change(np.concatenate([state.angles, state.rates]), own)
    lengths, radii = np.array(geometry.lengths), np.array(geometry.radii)
    # a phalanx points along -X at rest: r″ of its end less that of its hinge
    turned = np.exp(1j * state.angles)
    gained = -lengths * turned * (1j * changes[chain.links :] - state.rates**2)
    end = np.cumsum(gained)
    ends = complex(*chain.fall) - np.stack([end - gained, end])
    modulus, density = np.array([(m.youngs_modulus, m.density) for m in materials]).T
    stiffness, line = modulus * math.pi * radii**4 / 4.0, density * math.pi * radii**2
    load = line * np.abs((ends * turned.conj()).imag).max(axis=0)
    bent = 5.0 * load * lengths**4 / 384.0 + torques * lengths**2 / (9.0 * math.sqrt(3.0))
    return bent / stiffness, (math.pi / lengths) ** 2 * np.sqrt(stiffness / line)


def left_out(
    chain: RigidChain, flown: Descent, drive: Drive, geometry: meshes.FingerGeometry,
    materials: Sequence[Material],
) -> LeftOut:  # fmt: skip
    """What of a flight is left out.

    chain : of the whole finger, or of one of its like parts
    """
    begin, joints = flown.start.time_s, drive.torques_for(chain.links)
    kinks = joints.times[(joints.times > begin) & (joints.times < flown.touch_s)]
    found = []
    for time in [*np.linspace(begin, flown.touch_s, SAMPLES), *kinks]:
        ends = np.abs(joints.at(time))
        if drive.reaction:
            ends[:-1] += ends[1:]
        found.append(sag(chain, flown.state_at(time), ends, geometry, materials))
    frequency = found[0][1]
    grown = 1.0 - np.cos(np.minimum(frequency * (flown.touch_s - begin), math.pi / 2.0))
    depth = np.max([depth for depth, _ in found], axis=0) * grown
    angle = float((depth / np.array(geometry.lengths)).max())
    share = TORQUE_SHARE if joints.values.any() else WEIGHT_SHARE
    return LeftOut(angle, float(depth.max()), share * float((depth * frequency).max()))
