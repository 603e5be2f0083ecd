"""Predict a tap from a fall of rigid rods: when, how fast, and what rods leave out."""

import math
from dataclasses import dataclass, replace

import numpy as np

from hcm.assembly.state import StepLimits
from hcm.beam.drive import Piece
from hcm.flight.rigid_chain import Rods, acting_between, build_rods, clearance, survey
from hcm.flight.rigid_flight import TOUCHED, RigidFlight, integrate_flight
from hcm.model import RigidStart, Scene, check_scene, limits_of, rods_state
from hcm.parameters import Finger, Phalanx

# tolerance, over the surface's depth, of a flight as rods that serves as a prediction
RODS_TOLERANCE = 1e-6
# Change of the start's angles, rad, and the relative change of the speed of approach by it from
# which on a run is cautioned. In 260 random falls in which no rod turned by TURNED, rad, the speed
# changed by 0.4 % at most; in 33 others by 1 % or more 7 times.
CHANGE, MAGNIFIED, TURNED = 1e-5, 0.01, math.pi
ELSEWHERE = 0.1  # rad, of a phalanx's angle, by which a touch is another one
# the limits that have no effect on such a flight
OF_CONTACT = {"contact_step", "taps", "contact_tolerance", "max_contact_time", "undamped"}
OF_FLIGHT = tuple(of for of in StepLimits._fields if of not in OF_CONTACT)


@dataclass(frozen=True)
class Fall:
    """The rods' flight: its time, s; the speed of the tip's approach, m/s; the speed that rods
    leave out (`reactions`) at the start, what stretches of it, at the touch and at most, m/s; the
    largest depth of a section below the surface, m, while the tip is at least as far above it.
    flight, limits : the flight itself and how it was solved. rods : the rods and the torques on
    them.
    """

    time: float
    speed: float
    ringing: float
    stretching: float
    bending: float
    largest: float
    sunk: float
    flight: RigidFlight
    limits: StepLimits
    rods: tuple[Rods, tuple[Piece, ...]]

    def serves(self, limits: StepLimits) -> bool:
        """Whether a run of the same scene within these limits begins with the same flight."""
        return all(getattr(limits, of) == getattr(self.limits, of) for of in OF_FLIGHT)


def rods_fall(scene: Scene) -> Fall | None:
    """The fall of the phalanges as rods; None if they do not touch."""
    finger, drive, settings = scene.finger, scene.drive, scene.settings
    check_scene(finger, scene.surface, drive)
    state, start_s = rods_state(finger, scene.start)
    rods, pieces = build_rods(finger, scene.surface, drive, scene.assumptions)
    limits = limits_of(settings, scene.surface.height)
    limits = limits._replace(
        flight_step=1.0, flight_tolerance=RODS_TOLERANCE * scene.surface.height
    )
    flight = integrate_flight(rods, state, start_s, limits, settings.max_steps, pieces)
    if flight.code != TOUCHED:
        return None
    rods = acting_between(rods, pieces, start_s, float(flight.time[-1]))
    radius = np.array([p.diameter / 2 for p in finger.phalanges])
    ringing, stretching, bending, largest, sunk = survey(
        flight.states, flight.accelerations, radius, float(scene.surface.height), rods, state.copy()
    )
    speed = max(abs(clearance(flight.states[-1], rods)[1]), 1e-300)
    time = float(flight.time[-1]) - start_s
    return Fall(
        time, speed, ringing, stretching, bending, largest, sunk, flight, limits, (rods, pieces)
    )


def magnified(scene: Scene, fall: Fall) -> tuple[str, ...]:
    """A caution if the fall magnifies small changes of its start, as those of a whirling chain do.

    The angles change in alternating directions.
    """
    count = len(scene.finger.phalanges)
    angles = fall.flight.states[:, :count]
    if np.ptp(angles, axis=0).max() < TURNED:
        return ()
    state, start_s = rods_state(scene.finger, scene.start)
    changed = state[:count] + CHANGE * (-1.0) ** np.arange(count)
    start = RigidStart(tuple(changed.tolist()), tuple(state[count:].tolist()), start_s)
    other = rods_fall(replace(scene, start=start))
    what = "which touch it comes to"
    if other and np.abs(other.flight.states[-1] - fall.flight.states[-1])[:count].max() < ELSEWHERE:
        by = abs(other.speed / fall.speed - 1.0)
        if by < MAGNIFIED:
            return ()
        what = f"the speed of approach by {100 * by:.2g} %"
    return (
        f"the fall magnifies its start: as rigid rods, angles changed by {CHANGE:g} rad change "
        f"{what}, which the errors leave out: start nearer to the touch",
    )


def slowest_frequency(finger: Finger) -> float:
    """The slowest phalanx's first angular frequency on two hinges, rad/s."""
    return min(
        (math.pi / p.length) ** 2 * math.sqrt(p.bending_stiffness / p.line_density)
        for p in finger.phalanges
    )


def omitted_time(speed_share: float, finger: Finger, lasts_s: float) -> float:
    """Largest error, s, of the touch of rods that leave out this share of the speed of approach.

    2 share/w_1, as a beam that is loaded suddenly swings to twice its static deflection; in a
    shorter flight the tip moves by no more than the speed times the flight's time. None of 180
    random fingers exceeds that, or the other errors known of the touch.
    """
    return speed_share * min(2.0 / slowest_frequency(finger), lasts_s)


def bending_wave_stress(speed: float, phalanx: Phalanx) -> float:
    """Stress at mid-length, Pa, of a beam on two hinges that vibrates at `speed`, m/s, in its first
    shape: E d/2 times the curvature v sqrt(rho A/(E I)), which is 2 v sqrt(E rho) in a round rod.
    """
    return 2.0 * speed * math.sqrt(phalanx.youngs_modulus * phalanx.density)
