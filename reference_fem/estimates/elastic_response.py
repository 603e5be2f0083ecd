"""What a rigid flight leaves out: phalanges that bend and stretch under their loads and ring when
these change.

A phalanx is a beam on two hinges under the load of its own mass, ρA (f - r″) across it, and the
torques at its ends. With p the larger end's load and M the sum of both torques' magnitudes,

    δ = (5 p L⁴/384 + M L²/(9 √3))/(E I),  ω₁ = (π/L)² √(E I/(ρA)),

and it rings at the speed δ ω₁ where the loads come suddenly; a share of it reaches the tip. In a
flight of duration T < π/2ω₁ they grow to no more than (1 - cos ω₁ T) δ and sin(ω₁ T) δ ω₁. Along
its axis it is a rod held at one end under the load p of its mass and the force F of the phalanges
beyond,

    ε = (p L²/2 + F L)/(E A),  ω = π/(2 L) √(E/ρ),

which come suddenly where a flight begins. Torques that change on the way excite it again, perhaps
in phase: their jumps count as such an M, and changes of their rate, over ω₁; all are added.
"""

import math
from collections.abc import Sequence
from itertools import pairwise
from typing import NamedTuple

import numpy as np

import meshes
from reference_fem.arrays import Array
from reference_fem.flight.rigid_flight import Descent
from reference_fem.rigid.rigid_chain import ChainState, RigidChain
from reference_fem.settings import Drive, Material

WEIGHT_SHARE, TORQUE_SHARE = 0.1, 0.3
"""Shares of δ ω₁ by which tips of flying elements touch slower or faster: 0.01 to 0.08 in fingers
that fall, 0.1 to 0.3 in driven ones (nine fingers of 1e7 to 1e9 Pa, none that whirls)."""
STRETCH_SHARE = 0.7
"""Share of ε ω that reaches the tip: fingers of 1e7 Pa that start at 36 to 50 degrees touch slower
or faster by 0.24 to 0.68 of it (four fingers)."""
SAMPLES = 50
"""Times in a flight at which its bending is evaluated, besides its torques' kinks."""


class ElasticResponse(NamedTuple):
    """Elastic response of the phalanges to a flight.

    angle : largest δ/L, rad
    depth : largest δ plus the sum of all ε, m
    ringing_speed : share of the largest δ ω₁ plus share of the largest ε ω, m/s
    settling : largest δ ω₁ + ε ω of the loads at the touch, on phalanges rigid until then, m/s
    stretching_speed : the part of `ringing_speed` along the axis, m/s
    stretching_phase : largest ω T, rad
    """

    angle: float
    depth: float
    ringing_speed: float
    settling: float
    stretching_speed: float
    stretching_phase: float


def loads(
    chain: RigidChain, state: ChainState, lengths: Array, line: Array
) -> tuple[Array, Array, Array]:
    """The loads that phalanges carry, (P,): p across and along each, N/m, the larger of its ends',
    and F, N. line : ρA of each, kg/m.
    """
    own = chain.torques.at(state.time_s)
    changes = chain.rates_of_change(np.concatenate([state.angles, state.rates]), own)
    # a phalanx points along -X at rest: r″ of its end less that of its hinge
    turned = np.exp(1j * state.angles)
    gained = -lengths * turned * (1j * changes[chain.links :] - state.rates**2)
    end = np.cumsum(gained)
    ends = complex(*chain.gravity_vector) - np.stack([end - gained, end])
    weights = line * lengths * ends.mean(axis=0)
    beyond = np.cumsum(weights[::-1])[::-1] - weights
    own_frame, pulls = line * ends * turned.conj(), beyond * turned.conj()
    across, along = np.abs(own_frame.imag).max(axis=0), np.abs(own_frame.real).max(axis=0)
    return across, along, np.abs(pulls.real)


def elastic_response(
    chain: RigidChain, flown: Descent, drive: Drive, geometry: meshes.FingerGeometry,
    materials: Sequence[Material],
) -> ElasticResponse:  # fmt: skip
    """The response of the phalanges to the loads of a rigid flight.

    chain : of the whole finger, or of a half model
    """
    begin, touch, joints = flown.start.time_s, flown.touch_s, drive.torques_for(chain.links)
    lengths, radii = np.array(geometry.lengths), np.array(geometry.radii)
    modulus, density = np.array([(m.youngs_modulus, m.density) for m in materials]).T
    area = math.pi * radii**2
    stiffness, line = modulus * area * radii**2 / 4.0, density * area
    first = (math.pi / lengths) ** 2 * np.sqrt(stiffness / line)
    axial = 0.5 * math.pi / lengths * np.array([m.bar_speed for m in materials])

    def bent_by(of_joints: Array) -> Array:
        """δ by the joints' torques alone, (P,) m."""
        ends = np.abs(of_joints)
        if drive.reaction:
            ends[:-1] += ends[1:]
        return np.asarray(ends * lengths**2 / (9.0 * math.sqrt(3.0) * stiffness))

    def deformed(time_s: float, of_joints: Array) -> tuple[Array, Array]:
        """δ and ε under the loads and the joints' torques of a time, (P,) m."""
        across, along, pull = loads(chain, flown.state_at(time_s), lengths, line)
        bent = 5.0 * across * lengths**4 / (384.0 * stiffness) + bent_by(of_joints)
        return bent, (0.5 * along * lengths**2 + pull * lengths) / (modulus * area)

    kinks = joints.times[(joints.times > begin) & (joints.times < touch)]
    times = (*np.linspace(begin, touch, SAMPLES), *kinks)
    torques = np.array([joints.at(time) for time in times])
    bent, drawn = zip(*map(deformed, times, torques), strict=True)
    turned, drawing = (np.minimum(w * (touch - begin), math.pi / 2.0) for w in (first, axial))
    depth, stretch = np.max(bent, axis=0), drawn[0]
    for (start, end, value, rate), (_, _, later, changed) in pairwise(joints.pieces(begin, touch)):
        depth += bent_by(later - value - (end - start) * rate) + bent_by(changed - rate) / first
    bending_speed = float((depth * first * np.sin(turned)).max())
    stretching_speed = STRETCH_SHARE * float((stretch * axial * np.sin(drawing)).max())
    depth, stretch = depth * (1.0 - np.cos(turned)), stretch * (1.0 - np.cos(drawing))
    share = TORQUE_SHARE if torques.any() else WEIGHT_SHARE
    at_touch = bent[SAMPLES - 1] * first + drawn[SAMPLES - 1] * axial
    return ElasticResponse(
        float((depth / lengths).max()),
        float(depth.max() + stretch.sum()),
        share * bending_speed + stretching_speed,
        float(at_touch.max()),
        stretching_speed,
        float(axial.max() * (touch - begin)),
    )
