"""Errors that a flight leaves in a tap: in arrival and speed, and by the motion that it omits.

The run's flight is compared with the true shape's (`true_body`), which ends where its round outline
touches: they differ by a facet's sagitta and by masses that the mesh kept. Where an end barely
touches or a chain whirls chaotically, the true shape may come to another touch, and nothing is
known about the tap. After a rigid flight the steps before the touch change the speed too: the tip
falls freely until a wave arrives from its hinge. What a rigid flight omits (`elastic_response`) is
estimated by a flight that starts with phalanges turned by their bending angle, and from the speed
at which they ring; in a coarse flight they ring with an arbitrary phase. A flight of elements omits
the share of the bending that its cells miss, which a whirl magnifies as well.

The numbers depend on the speed at contact: F ~ v^6/5, t ~ v^-1/5 (Hertz), impulse ~ v. An omitted
vibration of speed V continues in the tap: times change by V/v too, and bending waves have a stress
of 2 sqrt(E rho) V. At the touch phalanges that were rigid take up their loads and begin to vibrate,
which changes the numbers too (`SETTLING_EFFECT`).
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

import meshes
from reference_fem.arrays import Array
from reference_fem.estimates.elastic_response import elastic_response
from reference_fem.estimates.mesh_error import IMPULSE, STRESS
from reference_fem.flight.rigid_flight import Descent, descent, fly
from reference_fem.rigid.rigid_chain import ChainState, RigidChain, chain_and_start, pose
from reference_fem.rigid.true_body import true_chain, true_gap
from reference_fem.settings import Drive, Material, Settings, Surface

OF_SPEED = {"normal_impulse_N_s": 1.0, "contact_duration_s": 0.2, "peak_normal_force_time_s": 0.2}
"""Magnitudes of the exponents of the speed at contact in these numbers; 6/5 in the others."""
SETTLING_EFFECT = {"contact_duration_s": 0.25, "peak_normal_force_time_s": 0.25, STRESS: 0.6}
"""Relative change of a number per `ElasticResponse.settling` / v, 0.36 for the others; 19 of 20
change less (152 random fingers with and without it, by the reduced model's beams)."""

STRETCHING_ERROR = 0.016
"""Relative error of a phalanx's first axial frequency over the square of its cells' length over its
diameter: (π/2n)²/24 of n elements; 0.1 % at a quarter (measured)."""

# Tolerance of the true shape's flight: ten times the run's own, so that a flight which magnifies
# differences shows by how much, but too small for steps that pass over a touch.
TOLERANCE = 1e-10
CHANGE, MAGNIFIED = 1e-5, 0.01
"""Change of the start's angles, rad, and the relative change of the speed of approach by it from
which on a flight magnifies its start."""
# Turn of a phalanx, rad, below which no flight does (0.4 % in 260 random falls of rods).
TURNED = math.pi
# Difference of a phalanx's angle above which a touch counts as another one, rad.
OTHER_TOUCH_ANGLE = 0.1


def speed_exponent(name: str) -> float:
    """Magnitude of the exponent of the speed at contact in a number."""
    return OF_SPEED.get(name, 1.2)


class OmittedMotion(NamedTuple):
    """What a flight omits: errors of arrival, s, and of the pole's velocity, (2,) m/s, and the
    speeds `ringing_speed` and `settling` of `ElasticResponse`, m/s.
    """

    late_s: float
    apart: Array
    ringing_speed: float = 0.0
    settling: float = 0.0

    def share(self, name: str, approach_speed: float) -> float:
        """Relative error of a number of a tap with this speed at contact, m/s."""
        of_speed = speed_exponent(name) * float(max(self.apart))
        of_settling = SETTLING_EFFECT.get(name, 0.36) * self.settling
        return (max(of_speed, self.ringing_speed) + of_settling) / approach_speed


class FlightErrors(NamedTuple):
    """Errors at the touch.

    late_s, apart : of its time, s, and of the pole's velocity, (2,) m/s, by the mesh's shape and
    masses. of_speed : the latter over the speed of approach. omitted : by what the flight omits.
    """

    late_s: float
    apart: Array
    of_speed: float
    omitted: OmittedMotion


NOTHING_OMITTED = OmittedMotion(0.0, np.zeros(2))
WITHOUT_SHAPE = FlightErrors(math.inf, np.full(2, math.inf), 0.0, NOTHING_OMITTED)
"""For a mesh whose true body is not known: its flight adds no error to the tap's numbers."""


@dataclass(frozen=True)
class Flight:
    """A rigid flight.

    gap : height above the surface, m, as a function of the angles; the flight ends where it closes
    pole : the tip's end at rest, (1, 2 or 3) m
    """

    chain: RigidChain
    gap: Callable[[Array], float]
    pole: Array
    flown: Descent

    @property
    def touch(self) -> ChainState:
        """State at the touch, where the flight ends."""
        return self.flown.state_at(self.flown.touch_s)

    def pole_velocity(self, state: ChainState) -> Array:
        """Velocity of the pole in a state of the chain, (2,) m/s."""
        last = np.array([self.chain.links - 1])
        return pose(self.chain, state, self.pole, last)[1][0, :2]

    def touch_of(
        self, other: RigidChain, gap: Callable[[Array], float], start: ChainState
    ) -> ChainState | None:
        """State in which another chain, or one from another start, comes to this touch; None where
        it comes to none or to another one.
        """
        touch = self.touch
        end = touch.time_s + 0.5 * (touch.time_s - start.time_s)
        found = start
        if gap(start.angles) > 0.0:  # else between the facets and the round end that they stand for
            state_at, arrival = fly(other, start, gap, end, TOLERANCE)
            if arrival is None:
                return None
            found = state_at(arrival)
        return None if np.abs(found.angles - touch.angles).max() > OTHER_TOUCH_ANGLE else found


def magnified(flight: Flight) -> float:
    """Relative change of the speed of approach if the start's angles change by `CHANGE`, in
    alternating directions; inf if that leads to another touch, 0 if no phalanx turns far.
    """
    touch, start = flight.touch, flight.flown.start
    times = np.linspace(start.time_s, touch.time_s, 64)
    turned = np.ptp([flight.flown.state_at(t).angles for t in times.tolist()], axis=0).max()
    if turned < TURNED:
        return 0.0
    changed = start.angles + CHANGE * (-1.0) ** np.arange(flight.chain.links)
    other = flight.touch_of(flight.chain, flight.gap, replace(start, angles=changed))
    if other is None:
        return math.inf
    speed, its = (float(flight.pole_velocity(state)[1]) for state in (touch, other))
    return abs(its - speed) / max(abs(speed), 1e-300)


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


def omitted_motion(
    flight: Flight, how: str, drive: Drive, geometry: meshes.FingerGeometry,
    materials: Sequence[Material], approach_speed: float, section: float = math.inf,
) -> OmittedMotion:  # fmt: skip
    """What a flight omits; inf where phalanges that begin turned by the angle that they bend, or by
    what cells miss of it, do not come to this touch.

    how : `Settings.flight`. A flight of elements has the bending, up to their cells' error, and the
        ringing, but not its phase, except along the axis in its own cells: shafts of 0.2 diameters
        changed the speed at contact by 0.1 to 4 %, of seven soft fingers that torques drive
    approach_speed : speed at the touch, m/s
    section : length of the cells that fly along the shafts over their diameter; of the bending n
        cells across miss 1/n^2, as the midpoint rule does of the second moment of area
    """
    touch, flown = flight.touch, flight.flown
    response = elastic_response(flight.chain, flown, drive, geometry, materials)
    share, ringing, depth = 1.0, response.ringing_speed, response.depth
    if how != "rigid":
        share = min(section**2, 1.0)
    if how == "explicit":
        phase = min(STRETCHING_ERROR * section**2 * response.stretching_phase, 1.0)
        ringing, depth = ringing - (1.0 - phase) * response.stretching_speed, 0.0
    # in alternating directions, which a whirl magnifies most
    turned = share * response.angle * (-1.0) ** np.arange(flight.chain.links)
    bent = replace(flown.start, angles=flown.start.angles - turned)
    other = flight.touch_of(flight.chain, flight.gap, bent)
    if other is None:
        return OmittedMotion(math.inf, np.full(2, math.inf))
    changed = flight.pole_velocity(touch) - flight.pole_velocity(other)
    late = abs(touch.time_s - other.time_s) + depth / approach_speed
    settling = response.settling if how == "rigid" else 0.0
    return OmittedMotion(late, np.abs(changed) + ringing, ringing, settling)


class RodFlight(NamedTuple):
    """Relative error of the impulse by what a rigid flight leaves out, inf if it is not known, and
    the duration of the flight, s. Both are 0 if the surface is not reached.
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
    """The true body's `RodFlight`, known before anything is solved.

    dim : 3, or 2 for the plane-stress body; other parameters as in `simulate`

    Raises ValueError: bad input; names it, its value and what is allowed.
    """
    chain, first = chain_and_start(true_chain(geometry, materials, drive, dim), start)
    gap = true_gap(geometry, surface.height)
    flown = descent(chain, gap, first, settings)
    if flown is None:
        return RodFlight(0.0, 0.0)
    pole = np.array([[geometry.hinges[-1] - geometry.lengths[-1], 0.0]])
    flight = Flight(chain, gap, pole, flown)
    approach_speed = max(abs(float(flight.pole_velocity(flight.touch)[1])), 1e-300)
    omitted = omitted_motion(flight, "rigid", drive, geometry, materials, approach_speed)
    return RodFlight(omitted.share(IMPULSE, approach_speed), flown.touch_s - first.time_s)
