"""Where a falling finger touches, and how hard: by its rigid chain and Hertz's law."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

import meshes
from meshes.bounds import Bound, check_number
from reference_fem.contact.hertz import hertz_impact
from reference_fem.flight.rigid_flight import fly
from reference_fem.rigid.rigid_chain import ChainState, chain_and_start
from reference_fem.rigid.true_body import lowest_point, true_chain, true_gap
from reference_fem.settings import LONGEST_S, Drive, Material, Surface


@dataclass(frozen=True)
class Touch:
    """A prediction before anything is solved: the patch is good to some 5 % on the paper's fingers.

    angle : between the last phalanx's axis and the direction to the surface, rad (`touch_angle`)
    speed : of the lowest point towards the surface, m/s; at least 0.
    mass : effective mass with which it meets the surface, kg
    force, patch_radius : Hertz's at the largest approach, N and m (in 2D half the width)
    """

    angle: float
    speed: float
    mass: float
    force: float
    patch_radius: float


def touch_angle(axis: float) -> float:
    """Between the last phalanx's axis and the direction to the surface, rad, -π to π.

    A phalanx `axis` below the horizontal, rad, after any number of turns, touches at π/2 - axis
    from its axis: negative beyond the vertical, where the upper side touches. Beyond ±π/2 the end
    points up, and the rim at the hinge touches.
    """
    return math.remainder(0.5 * math.pi - axis, 2.0 * math.pi)


def impact_state(
    geometry: meshes.FingerGeometry,
    materials: Sequence[Material],
    surface: Surface,
    drive: Drive,
    clearance_m: float,
    max_flight_time_s: float = 2.0,
    start: ChainState | None = None,
    dim: int = 3,
) -> ChainState | None:
    """State of the true body's rigid flight with `clearance_m` left below its lowest point.

    The flight begins at `start`, or at rest along -X; a start that is already nearer is returned.
    Runs on several meshes from this state touch with the same angles and rates, if the clearance
    exceeds how far nodes stand out at the contact.

    dim : 3, or 2 for the plane-stress body. Returns None if the surface is not reached in time.

    Raises ValueError: bad input; names it, its value and what is allowed.
    """
    check_number("clearance_m", clearance_m, Bound("m", at_least=0))
    check_number("max_flight_time_s", max_flight_time_s, Bound("s", above=0, at_most=LONGEST_S))
    chain, first = chain_and_start(true_chain(geometry, materials, drive, dim), start)
    gap = true_gap(geometry, surface.height - clearance_m)
    if gap(first.angles) <= 0.0:
        return first
    state_at, time_s = fly(chain, first, gap, first.time_s + max_flight_time_s)
    return None if time_s is None else state_at(time_s)


def predicted_touch(
    geometry: meshes.FingerGeometry,
    materials: Sequence[Material],
    surface: Surface,
    drive: Drive,
    state: ChainState,
    dim: int = 3,
) -> Touch:
    """The touch of the finger of `geometry` in a rigid state at the surface.

    With the mobility G of the lowest point (`RigidChain.mobility`) and friction in gross
    slip, F_t = r F_n, r = -μ sgn v_x, the point meets the surface with the mass m = 1/(G_yy + r
    G_yx), or with 1/G_yy where that is not positive (Painlevé's jamming).
    The largest force is that of Hertz's ball, or of his disc, of that mass (`hertz_impact`).

    dim : 3, or 2 for the plane-stress body

    Raises ValueError: bad input; names it, its value and what is allowed.
    """
    chain, state = chain_and_start(true_chain(geometry, materials, drive, dim), state)
    radius, axis = geometry.radii[-1], float(state.angles[-1])
    hinge = chain.hinges_at(state.angles, state.rates)[0][-1]
    reach, *offset = lowest_point(geometry, axis)
    lowest = hinge - reach * np.array([math.cos(axis), math.sin(axis)]) + offset
    mobility, velocity = chain.mobility(state, lowest)
    slip = -surface.friction * float(np.sign(velocity[0]))
    yielding = float(mobility[1, 1] + slip * mobility[1, 0])
    if yielding <= 0.0:
        yielding = float(mobility[1, 1])
    mass = 1.0 / yielding
    speed = max(0.0, -float(velocity[1]))
    impact = hertz_impact(mass, speed, radius, materials[-1], axis, dim)
    return Touch(touch_angle(axis), speed, mass, *impact)
