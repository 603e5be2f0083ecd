"""Choose how the flight to the surface is solved for a wanted relative error eps.

Sudden loads excite a vibration of the beams, of speed V_0 (`rigid_chain.reactions` at the start);
slow ones bend them, which counts as a speed V_1 (the same at the touch). Rods leave out both.
Collocation in few steps includes the bending, but the vibration then has an arbitrary phase at the
touch. If that matters, the vibration is followed in phase up to a frequency w_f, or added as modes
(`hcm.modal_flight`) where a start at rest excites it and that takes less time. Its speed at the
tip falls with w^-p, p = 1/2 after a sudden torque, 3/2 after a sudden weight, and above the
contact's frequency w_c the spring transmits a share w_c/w. The rest changes the tap by eps if

    w_f = w_1 r^(1/p) up to w_c, from there w_c (r (w_1/w_c)^p)^(1/(1 + p)),   r ~ V_0/(v eps),

with w_1 the slowest phalanx's frequency. In a flight of t_c the phase of w_f advances by w_f t_c.
Its relative error is that of elements of length l (`_wave`), and that of steps h of s stages,
(s!)^2/((2 s)! (2 s + 1)!) (w_f h)^(2 s): l and h are such that each gives `TURN` at the touch.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from numpy.polynomial.polynomial import polyval

from hcm.estimates.resolution import over_phase
from hcm.flight.fall import RODS_TOLERANCE, Fall, slowest_frequency
from hcm.modal_flight import MOST_MODAL, rings
from hcm.model import Scene
from hcm.parameters import GAUSS, GENERALIZED_ALPHA, STAGES, Finger, Phalanx, Settings
from hcm.results.result import Choice
from hcm.simulate import LARGEST_LEFT_OUT

MOST_ELEMENTS = 200
# relative change of the tap over V_1/v, v the speed of approach: for a lumped tip and a refined one
BEND_SHARE, REFINED_BEND_SHARE = 0.25, 0.3
# the same for V_0, and p: where torques excite the vibration and where the weight does
BY_TORQUE, BY_WEIGHT, REFINED_BY_WEIGHT = (1.0, 0.5), (0.25, 1.5), (0.5, 1.5)
# the same for what stretches of V_0, besides its part in V_0: all of it moves the tip, of bending a
# quarter. Of 1,797 runs of fast steep starts without weight 15 missed what they stated twice, or
# their accuracy by half, 3.3 and 2.2 times at most, none with it
BY_STRETCHING = 0.75
# phase error of w_f at the touch, rad: one by the elements and one by the steps
TURN = 0.3
# relative error of a hinged beam's frequencies with customized masses over (kappa l)^6, a middle
# value of the first six (5.4 to 1.2e-5, measured); largest kappa l, rad, of a wave that cubics fit
FREE_END, LONGEST_WAVE = 3e-5, 1.5
# factor on r, to follow the vibration a little further: a flight that is judged not to keep the
# accuracy is solved again, in three times the time
FURTHER = 1.5
# stages if a vibration limits the steps of 5: steps of 8 are 2.1 times as long and cost 1.6 times
FOLLOWING_STAGES = 8
# Steps that follow a vibration and take as long as its modes and the few steps of their flight: a
# polynomial in the number of elements, measured on 4 to 200 of them.
AS_LONG = (200.0, 7.0, 0.11)
# Settings that keep a flight from being modal if they are stated.
OF_MODES = {"flight", "flight_elements"}
# steps of a flight whose vibration is not followed; the same over eps^(-1/4) if it is below QUIET
# of the wanted error. In a dozen, Newton's method often fails on stiff fingers; of 16 louder scenes
# that bend slowly 5 miss 1e-3 in 45 steps, none in 90; of quiet ones none of 80 misses 1e-2 in 17,
# none of 51 1e-3 in 30 (5 in 20), none of 33 1e-4 in 53 (2 in 40)
FEW_STEPS, FEWEST_STEPS, QUIET = 90, 5.4, 0.7
# factor on the deflection of a finger by its weight, largest V over slowest w: a section that sinks
# by more below the surface, with the tip as far above it, touches first: all 175 that sink by 0.3
# do (of 1,200 scenes); torques may whirl a finger out of 200
SUNK = 10.0
# over the surface's depth: steps whose polynomial has a larger last term are shortened
BENT_TOLERANCE = 1e-4
# elements of a phalanx that bends slowly in flight: against the contact's elements throughout, 32
# taps at 1e-3 and 1e-4 change by 0.2 of the wanted error with 2 elements, 0.05 with 3 (medians)
BENT_ELEMENTS = 4
# flight_tolerance over eps, of flights as rods and of flights after a tap
STEP_SHARE = 1e-3

Stated = Mapping[str, Any]


@dataclass(frozen=True)
class FlightChoice:
    """How the flight is solved. error : relative error that it adds to the tap. elements : smallest
    number for each phalanx. followed : whether its vibration is followed.
    """

    choices: tuple[Choice, ...]
    error: float
    elements: tuple[int, ...]
    followed: bool = False
    stages: int = STAGES


def choose_flight(
    accuracy: float, scene: Scene, fall: Fall | None, frequency: float, driven: bool,
    stated: Stated, modal: bool = True,
) -> FlightChoice:  # fmt: skip
    """Choose the flight for an accuracy.

    frequency : w_c of the contact, rad/s. driven : whether torques act before the touch. modal :
    whether a vibration may be carried to the touch as modes.
    """
    one = (1,) * len(scene.finger.phalanges)
    if fall is None:
        return FlightChoice((), math.inf, one)
    ringing_share, _ = _ringing(scene, fall, driven)
    bent = REFINED_BEND_SHARE if scene.assumptions.any else BEND_SHARE
    skips = max(bent * fall.bending / fall.speed, ringing_share)
    stiff = skips <= accuracy and fall.largest <= LARGEST_LEFT_OUT * fall.speed
    if stated.get("flight", "rigid" if stiff else "") == "rigid":
        why = f"skipped: bending and vibration, {skips:.1g} of the tap"
        return FlightChoice(_as_rods(accuracy, why, 1.0, "the tolerance decides"), skips, one)
    if stated.get("flight_integrator") == GENERALIZED_ALPHA:
        return FlightChoice((), math.inf, one)
    way = fall.largest / slowest_frequency(scene.finger)
    if fall.sunk > SUNK * way and not (driven or "flight" in stated):
        why = "skipped: the finger meets the surface before its tip does"
        step = min(fall.time / FEW_STEPS, 1.0)
        return FlightChoice(_as_rods(accuracy, why, step, "to find that touch"), skips, one)
    return _elastic(accuracy, scene, fall, frequency, skips, driven, stated, modal)


def _ringing(scene: Scene, fall: Fall, driven: bool) -> tuple[float, float]:
    """Relative change of the tap that the vibration may cause, and p."""
    by_weight = REFINED_BY_WEIGHT if scene.assumptions.any else BY_WEIGHT
    share, decay = BY_TORQUE if driven else by_weight
    return (share * fall.ringing + BY_STRETCHING * fall.stretching) / fall.speed, decay


def _as_rods(accuracy: float, why: str, step: float, why_step: str) -> tuple[Choice, ...]:
    """Choices for a flight as rods in steps of at most `step`, s."""
    tolerance = min(STEP_SHARE * accuracy, RODS_TOLERANCE)
    return (
        Choice("flight", "rigid", why),
        Choice("flight_step", step, why_step),
        Choice("flight_tolerance", tolerance, "at least as fine as the fall that predicts it"),
    )


def _elastic(
    accuracy: float, scene: Scene, fall: Fall, frequency: float, skips: float, driven: bool,
    stated: Stated, modal: bool,
) -> FlightChoice:  # fmt: skip
    """Choose a flight by collocation, in few steps or, if it matters, with the vibration in phase.

    skips : relative change of the tap that a flight as rods would cause.
    """
    phalanges = scene.finger.phalanges
    ringing_share, decay = _ringing(scene, fall, driven)
    elastic = (
        Choice("flight", "elastic", f"a rigid one would change the tap by {skips:.1g}"),
        Choice("flight_integrator", GAUSS, "order 10: long steps"),
        _tolerance(accuracy, scene.settings),
    )

    # a finger driven by torques may not take longer steps either
    quiet = ringing_share <= QUIET * accuracy and not driven
    steps = min(FEWEST_STEPS / min(accuracy, 1e-2) ** 0.25, FEW_STEPS) if quiet else FEW_STEPS
    longest = min(fall.time / steps, 1.0)
    if ringing_share <= accuracy:
        why = f"skipped: the vibration, {ringing_share:.1g} of the tap, is not resolved"
        fewer = "skipped until the touch: finer elements, as it bends slowly"
        few = Choice("flight_elements", BENT_ELEMENTS, fewer)
        one = (1,) * len(phalanges)
        made = (*elastic, few, Choice("flight_step", longest, why))
        return FlightChoice(made, ringing_share, one)
    share = (1.0 if driven else FURTHER) * ringing_share / accuracy
    highest = followed_frequency(scene.finger, frequency, share, decay)
    turn = TURN / (highest * fall.time)
    wave = _wave(turn, scene.assumptions.has("shear"))
    counts = tuple([count_elements(p, highest, wave) for p in phalanges])
    fewer = "skipped until the touch: finer elements, above that frequency"
    few = Choice("flight_elements", max(counts), fewer)
    stages = STAGES if _in_phase(STAGES, turn) >= highest * longest else FOLLOWING_STAGES
    stages = stated.get("stages", stages)
    step = min(_in_phase(stages, turn) / highest, longest)
    why = f"the vibration, {ringing_share:.1g} of the tap, keeps its phase up to {hz(highest)}"
    modal = modal and rings(scene) and sum(counts) <= MOST_MODAL
    if modal and not OF_MODES & {*stated} and fall.time / step > polyval(sum(counts), AS_LONG):
        why = f"the vibration, {ringing_share:.1g} of the tap, is added at the touch"
        long = Choice("flight_step", longest, "skipped until the touch: steps that follow it")
        carried = (Choice("flight", "modal", why), *elastic[1:], few, long)
        return FlightChoice(carried, 0.0, counts, True)
    made = (*elastic, few, Choice("flight_step", step, why))
    return FlightChoice(made, 0.0, counts, True, stages)


def _tolerance(accuracy: float, settings: Settings) -> Choice:
    """Flight tolerance: equal steps would lose the energy of the vibration that a tap leaves."""
    if settings.taps > 1 or settings.end_time is not None:
        return Choice("flight_tolerance", STEP_SHARE * accuracy, "flights after a tap vibrate")
    return Choice(
        "flight_tolerance", BENT_TOLERANCE, "equal steps where a flight of rods predicts them"
    )


def _wave(turn: float, sheared: bool) -> float:
    """Phase kappa l of a wave over an element, rad, at which its frequency error is a share `turn`.

    With customized masses (`hcm.beam.customized_mass`) that error is `FREE_END` (kappa l)^6, with
    shear some (kappa l)^4/720: 0.3 to 1.3 of that on 3 to 8 elements of L/d 4 and 10, more if the
    phalanx is stockier or has more elements.
    """
    least = (720.0 * turn) ** 0.25 if sheared else (turn / FREE_END) ** (1 / 6)
    return float(min(least, LONGEST_WAVE))


def _in_phase(stages: int, turn: float) -> float:
    """Phase w h of a step, rad, at which the relative phase error of so many stages is `turn`."""
    return (turn * over_phase(stages)) ** (1 / (2 * stages))


def followed_frequency(finger: Finger, contact: float, share: float, decay: float) -> float:
    """Angular frequency w_f, rad/s, above which a vibration may arrive in any phase.

    contact : w_c. share : r, the vibration's change of the tap over the wanted error. decay : p.
    """
    slowest = slowest_frequency(finger)
    shielded = max(slowest, contact)
    left = share * (slowest / shielded) ** decay
    whole = slowest * share ** (1 / decay)
    return whole if left < 1.0 else shielded * left ** (1 / (1 + decay))


def count_elements(phalanx: Phalanx, frequency: float, turn: float) -> int:
    """Number of elements for a wave of that frequency, rad/s, to have kappa l <= `turn` in each."""
    waves = (frequency**2 * phalanx.line_density / phalanx.bending_stiffness) ** 0.25
    return min(max(math.ceil(waves * phalanx.length / turn), 1), MOST_ELEMENTS)


def hz(frequency: float) -> str:
    """Format an angular frequency, rad/s, in Hz."""
    return f"{frequency / (2 * math.pi):.2g} Hz"
