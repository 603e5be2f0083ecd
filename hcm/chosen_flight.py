"""The flight to the surface for a wanted relative error eps.

Sudden loads excite a vibration of the beams, of speed V_0 (`rigid_chain.reactions` at the start);
slow ones bend them, which counts as a speed V_1 (the same at the touch). Rods leave out both.
Collocation in few steps includes the bending, but the vibration then arrives in any phase. Where
that matters, the vibration is followed in phase up to a frequency w_f. Its speed at the tip falls
with w^-p, p = 1/2 after a sudden torque, 3/2 after a sudden weight, and above the contact's
frequency w_c the spring passes on a share w_c/w. What is not followed changes the tap by eps for

    w_f = w_1 r^(1/p) up to w_c, from there w_c (r (w_1/w_c)^p)^(1/(1 + p)),   r ~ V_0/(v eps),

w_1 the slowest phalanx's frequency. In a flight of t_c the phase of w_f advances by w_f t_c, with a
relative error by elements of length l (`_wave`) and by steps h of s stages, which is
(s!)^2/((2 s)! (2 s + 1)!) (w_f h)^(2 s): l and h are such that each errs by `TURN` at the touch.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from hcm.fall import Fall, slowest_frequency
from hcm.model import Scene
from hcm.parameters import GAUSS, GENERALIZED_ALPHA, STAGES, Finger, Phalanx, Settings
from hcm.resolution import over_phase
from hcm.result import Choice
from hcm.simulate import LARGEST_LEFT_OUT

MOST_ELEMENTS = 200
# of V_1, over the speed of approach: what it changes in the tap, of a lumped tip and a refined one
BEND_SHARE, REFINED_BEND_SHARE = 0.25, 0.3
# the same of V_0, and p, where torques ring the finger and where its weight does
BY_TORQUE, BY_WEIGHT, REFINED_BY_WEIGHT = (1.0, 0.5), (0.25, 1.5), (0.5, 1.5)
# rad, of w_f at the touch, by the elements and by the steps
TURN = 0.3
# relative error of a hinged beam's frequencies by customized masses over (kappa l)^6, in the middle
# of its first six (5.4 to 1.2e-5, measured); rad, of an element, beyond which cubics are no waves
FREE_END, LONGEST_WAVE = 3e-5, 1.5
# of r, for what is followed a little further: a flight that is judged not to keep the accuracy is
# solved again, in three times the time
FURTHER = 1.5
# where a vibration shortens the steps of 5: those of 8 are 2.1 times as long, their cost 1.6 times
FOLLOWING_STAGES = 8
# steps where it is not, over eps^(-1/4) where it is below QUIET of the error wanted: in a dozen,
# Newton's method fails again and again on stiff fingers; of 16 louder scenes that bend slowly 5
# miss an accuracy of 1e-3 in 45 steps, none in 90; of quiet ones none of 80 misses 1e-2 in 17, of
# 51 none 1e-3 in 30 (5 in 20), of 33 none 1e-4 in 53 (2 in 40)
FEW_STEPS, FEWEST_STEPS, QUIET = 90, 5.4, 0.7
# of the way that its weight bends a finger, the largest V over its slowest w: what sinks by more
# than so many, its tip being as far above the surface, meets it first: all 175 that sink by 0.3 do
# (of 1,200 scenes); torques may whirl a finger out of 200
SUNK = 10.0
# of the surface's depth: steps that bend the finger by so much more than a polynomial are shorter
BENT_TOLERANCE = 1e-4
# elements of a phalanx that bends slowly in flight: those of the contact change 32 taps at 1e-3 and
# 1e-4 by 0.2 of the error wanted from 2 elements, 0.05 from 3 (medians)
BENT_ELEMENTS = 4
# of eps: errors of a step over the surface's depth, of rods' flights and of those after a tap
STEP_SHARE = 1e-3

Stated = Mapping[str, Any]


@dataclass(frozen=True)
class FlightChoice:
    """What makes the flight. error : what it adds to the tap's, relative. elements : least of each
    phalanx. followed : whether its vibration is.
    """

    choices: tuple[Choice, ...]
    error: float
    elements: tuple[int, ...]
    followed: bool = False
    stages: int = STAGES


def choose_flight(
    accuracy: float, scene: Scene, fall: Fall | None, frequency: float, driven: bool, stated: Stated
) -> FlightChoice:
    """The flight for an accuracy.

    frequency : w_c of the contact, rad/s. driven : whether torques act by then.
    """
    one = (1,) * len(scene.finger.phalanges)
    if fall is None:
        return FlightChoice((), math.inf, one)
    ringing_share, _ = _ringing(scene, fall, driven)
    bent = REFINED_BEND_SHARE if scene.assumptions.any else BEND_SHARE
    skips = max(bent * fall.bending / fall.speed, ringing_share)
    stiff = skips <= accuracy and fall.largest <= LARGEST_LEFT_OUT * fall.speed
    if stated.get("flight", "rigid" if stiff else "") == "rigid":
        why = f"skipped: what bends and vibrates, {skips:.1g} of the tap"
        return FlightChoice(_as_rods(accuracy, why, 1.0, "the tolerance decides"), skips, one)
    if stated.get("flight_integrator") == GENERALIZED_ALPHA:
        return FlightChoice((), math.inf, one)
    way = fall.largest / slowest_frequency(scene.finger)
    if fall.sunk > SUNK * way and not (driven or "flight" in stated):
        why = "skipped: the finger meets the surface before its tip does"
        step = min(fall.time / FEW_STEPS, 1.0)
        return FlightChoice(_as_rods(accuracy, why, step, "when it does"), skips, one)
    return _elastic(accuracy, scene, fall, frequency, skips, driven, stated)


def _ringing(scene: Scene, fall: Fall, driven: bool) -> tuple[float, float]:
    """Share of the tap that the vibration may change, and p."""
    by_weight = REFINED_BY_WEIGHT if scene.assumptions.any else BY_WEIGHT
    share, decay = BY_TORQUE if driven else by_weight
    return share * fall.ringing / fall.speed, decay


def _as_rods(accuracy: float, why: str, step: float, why_step: str) -> tuple[Choice, ...]:
    """A flight as rods in steps of at most `step`, s."""
    return (
        Choice("flight", "rigid", why),
        Choice("flight_step", step, why_step),
        Choice("flight_tolerance", STEP_SHARE * accuracy, "a share of the accuracy"),
    )


def _elastic(
    accuracy: float, scene: Scene, fall: Fall, frequency: float, skips: float, driven: bool,
    stated: Stated,
) -> FlightChoice:  # fmt: skip
    """A flight by collocation, in few steps or, where it matters, with the vibration in phase.

    skips : what a flight as rods would change in the tap.
    """
    phalanges = scene.finger.phalanges
    ringing_share, decay = _ringing(scene, fall, driven)
    elastic = (
        Choice("flight", "elastic", f"a rigid one would change the tap by {skips:.1g}"),
        Choice("flight_integrator", GAUSS, "order 10: long steps"),
        _tolerance(accuracy, scene.settings),
    )

    # a finger that torques drive may not take longer steps either
    quiet = ringing_share <= QUIET * accuracy and not driven
    steps = min(FEWEST_STEPS / min(accuracy, 1e-2) ** 0.25, FEW_STEPS) if quiet else FEW_STEPS
    longest = min(fall.time / steps, 1.0)
    if ringing_share <= accuracy:
        why = f"skipped: the vibration, {ringing_share:.1g} of the tap, is not followed"
        fewer = "skipped until the touch: the contact's, as it bends slowly"
        few = Choice("flight_elements", BENT_ELEMENTS, fewer)
        one = (1,) * len(phalanges)
        made = (*elastic, few, Choice("flight_step", longest, why))
        return FlightChoice(made, ringing_share, one)
    share = (1.0 if driven else FURTHER) * ringing_share / accuracy
    highest = followed_frequency(scene.finger, frequency, share, decay)
    turn = TURN / (highest * fall.time)
    stages = STAGES if _in_phase(STAGES, turn) >= highest * longest else FOLLOWING_STAGES
    stages = stated.get("stages", stages)
    step = min(_in_phase(stages, turn) / highest, longest)
    why = f"the vibration, {ringing_share:.1g} of the tap, arrives in phase up to {hz(highest)}"
    wave = _wave(turn, scene.assumptions.has("shear"))
    counts = tuple([count_elements(p, highest, wave) for p in phalanges])
    fewer = "skipped until the touch: the contact's, above that frequency"
    few = Choice("flight_elements", max(counts), fewer)
    made = (*elastic, few, Choice("flight_step", step, why))
    return FlightChoice(made, 0.0, counts, True, stages)


def _tolerance(accuracy: float, settings: Settings) -> Choice:
    """A tap leaves the finger vibrating: equal steps of the flight behind it lose that energy."""
    if settings.taps > 1 or settings.end_time is not None:
        return Choice("flight_tolerance", STEP_SHARE * accuracy, "flights after a tap vibrate")
    return Choice(
        "flight_tolerance", BENT_TOLERANCE, "equal steps, but where no rods foretell them"
    )


def _wave(turn: float, sheared: bool) -> float:
    """Turn kappa l of a wave by an element at which its frequency is wrong by the share `turn`.

    By customized masses (`hcm.beam.customized_mass`) that is `FREE_END` (kappa l)^6, with shear
    some (kappa l)^4/720: 0.3 to 1.3 of it on 3 to 8 elements of L/d 4 and 10, more of stockier ones
    and on more elements.
    """
    least = (720.0 * turn) ** 0.25 if sheared else (turn / FREE_END) ** (1 / 6)
    return float(min(least, LONGEST_WAVE))


def _in_phase(stages: int, turn: float) -> float:
    """Turn w h of a step at which that many stages are out of phase by the share `turn` of it."""
    return (turn * over_phase(stages)) ** (1 / (2 * stages))


def followed_frequency(finger: Finger, contact: float, share: float, decay: float) -> float:
    """Angular frequency w_f, rad/s, above which a vibration may arrive in any phase.

    contact : w_c. share : r of the vibration over the error wanted. decay : p.
    """
    slowest = slowest_frequency(finger)
    shielded = max(slowest, contact)
    left = share * (slowest / shielded) ** decay
    whole = slowest * share ** (1 / decay)
    return whole if left < 1.0 else shielded * left ** (1 / (1 + decay))


def count_elements(phalanx: Phalanx, frequency: float, turn: float) -> int:
    """Elements whose length turns a wave of that frequency, rad/s, by kappa l = `turn`."""
    waves = (frequency**2 * phalanx.line_density / phalanx.bending_stiffness) ** 0.25
    return min(max(math.ceil(waves * phalanx.length / turn), 1), MOST_ELEMENTS)


def hz(frequency: float) -> str:
    """An angular frequency, rad/s, in Hz."""
    return f"{frequency / (2 * math.pi):.2g} Hz"
