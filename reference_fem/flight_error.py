"""What a flight does to a tap: errors of its arrival and speed, and what it leaves out.

The shape's own flight (`true_body`) ends where its round outline touches. So a facet's sagitta,
masses that a mesh kept, an end that barely touches and a chain that whirls without order show
alike: the last two arrive at another touch, and of the tap nothing is known. After a rigid flight
the steps that lead to the touch change the speed too: until a wave has come from its hinge the tip
falls freely. What it leaves out (`left_out`) is read off such a flight of phalanges that begin
turned by what they bend, and the speed that they ring at; a coarse flight has that in a phase of
chance.

A force follows the speed at contact: F ~ v^6/5, t ~ v^-1/5 (Hertz), impulse ~ v. A vibration of the
speed V that a flight left out goes on in the tap: times change by V/v too, and bending waves have a
stress of 2 sqrt(E rho) V. So does one that only sets in at the touch, where phalanges that were
rigid take up their loads (`SETTLES`).
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

import meshes
from reference_fem.arrays import Array
from reference_fem.left_out import left_out
from reference_fem.mesh_error import IMPULSE, STRESS
from reference_fem.rigid_chain import ChainState, RigidChain, chain_and_start, pose
from reference_fem.rigid_flight import Descent, descent, fly
from reference_fem.settings import Drive, Material, Settings, Surface, check_materials
from reference_fem.true_body import true_chain, true_gap

OF_SPEED = {"normal_impulse_N_s": 1.0, "contact_duration_s": 0.2, "peak_normal_force_time_s": 0.2}
"""Powers of the speed at contact that numbers follow; others follow 6/5 (`power`)."""
SETTLES = {"contact_duration_s": 0.25, "peak_normal_force_time_s": 0.25, STRESS: 0.6}
"""Of `LeftOut.settling` over the speed at contact: what it changes in a number, the others 0.36; 19
of 20 change less (152 random fingers with and without, by the reduced model's beams)."""

# Of the true shape's flight: ten times the run's own, so that a flight which magnifies differences
# shows by how much, and short of steps that pass over a touch.
TOLERANCE = 1e-10
# Angle by which a phalanx lies otherwise at another touch, rad.
ANOTHER = 0.1


def power(name: str) -> float:
    """Of the speed at contact, which a number follows."""
    return OF_SPEED.get(name, 1.2)


class Unseen(NamedTuple):
    """What a flight leaves out of arrival, s, and of the pole's velocity, (2,) m/s; the speeds that
    phalanges ring at and settle at (`LeftOut`), m/s.
    """

    late_s: float
    apart: Array
    rung: float = 0.0
    settling: float = 0.0

    def share(self, name: str, fall: float) -> float:
        """Relative error of a number of a tap at the speed `fall`, m/s."""
        of_speed = power(name) * float(max(self.apart))
        return (max(of_speed, self.rung) + SETTLES.get(name, 0.36) * self.settling) / fall


@dataclass(frozen=True)
class Flight:
    """A rigid flight.

    gap : of the chain's angles, m, which ends it
    pole : the tip's end at rest, (1, 2 or 3) m
    """

    chain: RigidChain
    gap: Callable[[Array], float]
    pole: Array
    flown: Descent

    @property
    def touch(self) -> ChainState:
        """Where it ends."""
        return self.flown.state_at(self.flown.touch_s)

    def pole_velocity(self, state: ChainState) -> Array:
        """(2,), m/s."""
        last = np.array([self.chain.links - 1])
        return pose(self.chain, state, self.pole, last)[1][0, :2]

    def touch_of(
        self, other: RigidChain, gap: Callable[[Array], float], start: ChainState
    ) -> ChainState | None:
        """Where another chain or start comes to this touch; None where it comes to none or
        another one.
        """
        touch = self.touch
        end = touch.time_s + 0.5 * (touch.time_s - start.time_s)
        state_at, arrival = fly(other, start, gap, end, TOLERANCE)
        if arrival is None:
            return None
        found = state_at(arrival)
        return None if np.abs(found.angles - touch.angles).max() > ANOTHER else found


def arrival_errors(
    flight: Flight, true: RigidChain, gap: Callable[[Array], float]
) -> tuple[float, Array]:
    """Errors of arrival (s) and of the pole's velocity; inf where the true shape, a chain with its
    gap, has no such touch.
    """
    touch = flight.touch
    other = flight.touch_of(true, gap, flight.flown.start)
    if other is None:
        return math.inf, np.full(2, math.inf)
    its = replace(flight, chain=true).pole_velocity(other)
    return abs(touch.time_s - other.time_s), np.abs(flight.pole_velocity(touch) - its)


def unseen(
    flight: Flight, how: str, drive: Drive, geometry: meshes.FingerGeometry,
    materials: Sequence[Material], fall: float,
) -> Unseen:  # fmt: skip
    """What a flight leaves out; inf where phalanges that begin turned by the angle that they bend
    have no such touch.

    how : "rigid" or "coarse". fall : speed at the touch, m/s
    """
    touch, flown = flight.touch, flight.flown
    left = left_out(flight.chain, flown, drive, geometry, materials)
    if how == "coarse":
        return Unseen(left.depth / fall, np.full(2, left.speed), left.speed)
    # against each other, which a whirl magnifies most
    turned = left.angle * (-1.0) ** np.arange(flight.chain.links)
    bent = replace(flown.start, angles=flown.start.angles - turned)
    other = flight.touch_of(flight.chain, flight.gap, bent)
    if other is None:
        return Unseen(math.inf, np.full(2, math.inf))
    changed = flight.pole_velocity(touch) - flight.pole_velocity(other)
    late = abs(touch.time_s - other.time_s) + left.depth / fall
    return Unseen(late, np.abs(changed) + left.speed, left.speed, left.settling)


class RodFlight(NamedTuple):
    """What a rigid flight leaves out of the impulse, relative, inf where that is not known; and how
    long it takes, s. 0 where it does not touch.
    """

    left_out: float
    lasts_s: float


def rod_flight(
    geometry: meshes.FingerGeometry,
    materials: Sequence[Material],
    surface: Surface,
    drive: Drive,
    settings: Settings,
    start: ChainState | None = None,
    dim: int = 3,
) -> RodFlight:
    """The true body's, before anything is solved.

    Parameters
    ----------
    dim : 3, or 2 for the plane-stress body
    other parameters : as of `simulate`

    Raises
    ------
    ValueError
        For bad input, naming it, its value and what is allowed.
    """
    check_materials(materials, geometry.phalanges)
    chain, first = chain_and_start(true_chain(geometry, materials, drive, dim), start)
    gap = true_gap(geometry, surface.height)
    flown = descent(chain, gap, first, settings)
    if flown is None:
        return RodFlight(0.0, 0.0)
    pole = np.array([[geometry.hinges[-1] - geometry.lengths[-1], 0.0]])
    flight = Flight(chain, gap, pole, flown)
    fall = max(abs(float(flight.pole_velocity(flight.touch)[1])), 1e-300)
    left = unseen(flight, "rigid", drive, geometry, materials, fall).share(IMPULSE, fall)
    return RodFlight(left, flown.touch_s - first.time_s)
