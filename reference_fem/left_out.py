"""What a rigid flight leaves out: phalanges that bend under their loads and ring when these change.

A phalanx is a beam on two hinges under the load of its own mass, ρA (f - r″) across it, and the
torque on it. With p the larger load of both ends and t the torque,

    δ = (5 p L⁴/384 + t L²/(9 √3))/(E I),  ω₁ = (π/L)² √(E I/(ρA)),

and it rings at δ ω₁ where the loads come suddenly, of which a share reaches the tip as it touches.
"""

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

import meshes
from reference_fem.arrays import Array
from reference_fem.rigid_chain import ChainState, RigidChain
from reference_fem.rigid_flight import Descent
from reference_fem.settings import Material

BY_WEIGHT, BY_TORQUE = 0.1, 0.25
"""Of δ ω₁: where elements fly, tips of fingers that fall touch 0.01 to 0.08 of it slower or faster,
of driven ones 0.1 to 0.3 (nine fingers of 1e7 to 1e9 Pa)."""
SAMPLES = 50
"""States of a flight at which its bending is looked at."""


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

    torques : on each body of the whole finger, N·m
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
    bent = 5.0 * load * lengths**4 / 384.0 + np.abs(torques) * lengths**2 / (9.0 * math.sqrt(3.0))
    return bent / stiffness, (math.pi / lengths) ** 2 * np.sqrt(stiffness / line)


def left_out(
    chain: RigidChain, flown: Descent, copies: int, geometry: meshes.FingerGeometry,
    materials: Sequence[Material],
) -> LeftOut:  # fmt: skip
    """What of a flight is left out.

    chain : of one of so many copies of the finger
    """
    times = np.linspace(flown.start.time_s, flown.touch_s, SAMPLES)
    found = [
        sag(chain, flown.state_at(t), copies * chain.torques.at(t), geometry, materials)
        for t in times
    ]
    depth, frequency = np.max([depth for depth, _ in found], axis=0), found[0][1]
    angle = float((depth / np.array(geometry.lengths)).max())
    share = BY_TORQUE if chain.torques.values.any() else BY_WEIGHT
    return LeftOut(angle, float(depth.max()), share * float((depth * frequency).max()))
