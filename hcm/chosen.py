"""Settings that keep a relative error, from what is known of a tap before it is solved.

Rigid rods (`hcm.flight`) fall to the touch first, which costs little: they say when it comes, how
fast, and what they leave out. Then, with eps the error wanted:

- contact: the tip is a spring k/e*^2 on the free end of a beam, whose impedance there is
  |Z| = rho A c/sqrt(2), c = (E I/(rho A))^(1/4) sqrt(w) (Cremer, Heckl and Petersson 2005). Above
  the frequency w where |Z| = k/(e*^2 w) the spring shields the beam. The trapezoidal rule's time
  scale is wrong by (w h)^2/12, elements of length l by (kappa l)^4 with the wave number
  kappa = (w^2 rho A/(E I))^(1/4): hence h ~ sqrt(eps)/w and l ~ eps^(1/4)/kappa. Collocation
  keeps its order where it resolves the waves that the touch sets off, and no step does all of them:
  what it leaves goes with about h^2 too, at steps thirty times as long.
- flight: loads that come suddenly leave the beams a vibration, of speed V_0 by
  `rigid_chain.reactions` at the start, and slow ones bend them, V_1 at the touch. Rods leave out
  both. Collocation in few steps takes the bending with it, but the vibration arrives with a phase
  of chance. Followed is what rings below a frequency w_f: the tip's speed is ~ w^-p, p = 1/2 of a
  sudden torque, 3/2 of a sudden weight, and the spring passes on w^-1 of it above w_c of the
  contact, so that what is left out is eps for

      w_f = w_1 r^(1/p) up to w_c, from there w_c (r (w_1/w_c)^p)^(1/(1 + p)),   r ~ V_0/(v eps),

  w_1 the slowest phalanx's. It turns by w_f t_c (1 + phi) in a flight of t_c, phi = (kappa l)^4/720
  on cubic elements and (s!)^2/((2 s)! (2 s + 1)!) (w_f h)^(2 s) by s stages: hence l and h, for a
  turn that is wrong by `TURN`.

The shares before these are measured on 110 random scenes, so that 95 of 100 keep them.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from types import MappingProxyType
from typing import Any

from hcm.beam.drive import acting_joints
from hcm.contact.build import law_of
from hcm.fall import Fall, rods_fall
from hcm.model import Scene
from hcm.parameters import (
    GAUSS,
    GENERALIZED_ALPHA,
    STAGES,
    Finger,
    ParameterError,
    Phalanx,
    Tip,
)
from hcm.result import Choice
from hcm.simulate import LARGEST_LEFT_OUT

SMALLEST, LARGEST = 1e-6, 0.1
# w h over sqrt(eps), and elements of a phalanx over kappa L/eps^(1/4)
STEP_SHARE, ELEMENT_SHARE = 1.0, 0.3
# the first by collocation, whose largest w h is a fourth of a tap; the hard finger's peak is off by
# 18e-6 at w h = 0.2, by 0.6e-6 at 0.1
STAGE_SHARE, LONGEST_TURN = 30.0, 1.2
# of refined beams, whose elements' errors fall with l^2 only: the first as it is, and elements over
# kappa L/sqrt(eps). 4, 5 and 7 elements of the soft finger are off by 2.9, 1.7 and 0.8e-3, steps of
# w h = sqrt(eps) by 0.02e-3
REFINED_STEP_SHARE, REFINED_ELEMENT_SHARE = 2.0, 0.08
MOST_ELEMENTS = 200
# of those, in the phalanges before the last: a wave comes back from them when the tap is nearly
# over. 85 taps at 1e-3 keep their errors with 0.7 of them; with 0.6, 3 of 208 more miss 1e-3
INNER_SHARE = 0.8
# of V_1, over the speed of approach: what it changes in the tap
BEND_SHARE = 0.25
# the same of V_0, and p, where torques ring the finger and where its weight does
BY_TORQUE, BY_WEIGHT = (1.0, 0.5), (0.25, 1.5)
# rad, of w_f at the touch, by the elements and by the steps
TURN = 0.3
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
# of eps: errors of the rods' flight over the surface's depth, and of an acceleration, which is at
# most the second, by the contact's integrator: collocation's iteration ends on its way of a step
RODS_SHARE = 1e-3
NEWTON = {GENERALIZED_ALPHA: (1e-5, 1e-8), GAUSS: (1e-3, 1e-6)}
# the least of undriven collocation, of eps and at most: 30 falls at 1e-5 change by a tenth of it at
# most, nine of ten by a fiftieth
FINE_NEWTON = (1e-2, 1e-7)
# where torques whirl the finger: what the iteration leaves in the highest modes adds up in a flight
# without damping, to 5 % of a peak at 1e-6, 0.01 % at 1e-9
DRIVEN_NEWTON = (1e-6, 1e-9)

SETTINGS = (
    "elements", "flight", "flight_integrator", "flight_elements", "flight_step", "flight_tolerance",
    "contact_step", "contact_tolerance", "contact_integrator", "stages", "spectral_radius",
    "newton_tolerance",
)  # fmt: skip
"""What is chosen, unless it is stated."""

Stated = Mapping[str, Any]


@dataclass(frozen=True)
class Chosen:
    """A scene with its settings, and the choices that led to them.

    flight_error : what the flight adds to the tap's relative error; inf where it is not known.
    followed : whether its vibration is followed up to the touch. fall : of its rods; None where
    they do not touch.
    """

    scene: Scene
    choices: tuple[Choice, ...]
    flight_error: float
    followed: bool
    fall: Fall | None


@dataclass(frozen=True)
class Flown:
    """How the finger gets to the surface; elements : least ones of each phalanx."""

    choices: tuple[Choice, ...]
    error: float
    elements: tuple[int, ...]
    followed: bool = False
    stages: int = STAGES


def check_accuracy(accuracy: float) -> None:
    """Raise `ParameterError` where no settings are known for so small or large an accuracy."""
    if not SMALLEST <= accuracy <= LARGEST:
        raise ParameterError(
            f"accuracy = {accuracy!r}: must be {SMALLEST:g} to {LARGEST:g}, the largest relative"
            " error wanted"
        )


def settings_for(accuracy: float, scene: Scene, stated: Stated = MappingProxyType({})) -> Chosen:
    """Settings with which peak force, impulse, duration and arrival are off by at most `accuracy`.

    Parameters
    ----------
    accuracy : relative, against the converged answer of the same equations.
    scene : its settings are kept where nothing is chosen: taps, times, limits.
    stated : settings that stay as they are in the scene, by their names; "elements" are the
        finger's.
    """
    check_accuracy(accuracy)
    return choose(accuracy, scene, stated)


def choose(accuracy: float, scene: Scene, stated: Stated) -> Chosen:
    """`settings_for` any accuracy, as a run that is judged may need a smaller one."""
    phalanges = scene.finger.phalanges
    fall = rods_fall(scene)
    hertz = None
    if scene.assumptions.has("hertz") and fall is not None:
        hertz = law_of(scene.finger, scene.surface, scene.tip, scene.assumptions).k
    frequency = contact_frequency(phalanges[-1], scene.tip, hertz, fall.speed if fall else 0.0)
    flight = _flight(accuracy, scene, fall, frequency, stated)
    lumped = not scene.assumptions.any
    wave = accuracy**0.25 / ELEMENT_SHARE if lumped else accuracy**0.5 / REFINED_ELEMENT_SHARE
    waves = [*[wave / INNER_SHARE] * (len(phalanges) - 1), wave]
    counts = tuple([
        max(_count(p, frequency, turn), least)
        for p, turn, least in zip(phalanges, waves, flight.elements, strict=True)
    ])  # fmt: skip
    # springs that slip by parts leave no smooth pieces
    method = stated.get("contact_integrator", GAUSS if lumped else GENERALIZED_ALPHA)
    stages = stated.get("stages", flight.stages)
    of_turn = STEP_SHARE if lumped else REFINED_STEP_SHARE
    of_turn = STAGE_SHARE * stages / STAGES if method == GAUSS else of_turn
    step = min(min(of_turn * math.sqrt(accuracy), LONGEST_TURN) / frequency, 1.0)
    whirls = _driven(scene)
    share, most = DRIVEN_NEWTON if method == GAUSS and whirls else NEWTON[method]
    fine = min(FINE_NEWTON[0] * accuracy, FINE_NEWTON[1]) if method == GAUSS and not whirls else 0.0
    newton = min(max(share * accuracy, fine, 1e-12), most)
    choices = (
        Choice("elements", counts, f"waves of {_hz(frequency)}; the spring shields higher ones"),
        *flight.choices,
        Choice("contact_integrator", method, f"order {2 * stages if method == GAUSS else 2}"),
        Choice("stages", stages, "more where a vibration is followed: longer steps"),
        Choice("contact_step", step, f"oscillations of {_hz(frequency)}"),
        Choice("contact_tolerance", 0.0, "skipped: equal steps need no error of each"),
        Choice("newton_tolerance", newton, "iterations end below the steps' errors"),
    )
    made: dict[str, Any] = {c.setting: c.value for c in choices if c.setting not in stated}
    finger = scene.finger
    if made.pop("elements", None) is not None:
        pairs = zip(phalanges, counts, strict=True)
        finger = Finger(tuple([replace(p, elements=n) for p, n in pairs]))
    told = (Choice(name, stated[name], "stated") for name in SETTINGS if name in stated)
    kept = (*(c for c in choices if c.setting not in stated), *told)
    made_of = replace(scene, finger=finger, settings=replace(scene.settings, **made))
    return Chosen(made_of, kept, flight.error, flight.followed, fall)


def contact_frequency(
    phalanx: Phalanx, tip: Tip, hertz: float | None = None, speed: float = 0.0
) -> float:
    """Angular frequency w, rad/s, above which the tip's spring shields a beam that ends there.

    hertz : K of F_n = K d^(3/2), N/m^(3/2), in the place of the tip's spring: it is as stiff as at
    the depth v/w, v the speed of approach, m/s.
    """
    beam = phalanx.bending_stiffness**0.25 * phalanx.line_density**0.75
    if hertz is not None:  # w^(3/2) = sqrt(2) k/beam, k = 3/2 K (v/w)^(1/2)/e*^2
        return math.sqrt(1.5 * math.sqrt(2.0 * speed) * hertz / (tip.restitution**2 * beam))
    stiffness = tip.normal_stiffness / tip.restitution**2
    return (math.sqrt(2.0) * stiffness / beam) ** (2.0 / 3.0)


def _count(phalanx: Phalanx, frequency: float, turn: float) -> int:
    """Elements whose length turns a wave of that frequency, rad/s, by kappa l = `turn`."""
    waves = (frequency**2 * phalanx.line_density / phalanx.bending_stiffness) ** 0.25
    return min(max(math.ceil(waves * phalanx.length / turn), 1), MOST_ELEMENTS)


def _flight(
    accuracy: float, scene: Scene, fall: Fall | None, frequency: float, stated: Stated
) -> Flown:
    """The flight for an accuracy; frequency : w_c of the contact, rad/s."""
    phalanges = scene.finger.phalanges
    one = (1,) * len(phalanges)
    if fall is None:
        return Flown((), math.inf, one)
    driven = _driven(scene)
    kind = BY_TORQUE if driven else BY_WEIGHT
    bent, rung = BEND_SHARE * fall.bending / fall.speed, kind[0] * fall.ringing / fall.speed
    skips = max(bent, rung)
    stiff = skips <= accuracy and fall.largest <= LARGEST_LEFT_OUT * fall.speed
    if stated.get("flight", "rigid" if stiff else "") == "rigid":
        skipped = (
            Choice("flight", "rigid", f"skipped: what bends and vibrates, {skips:.1g} of the tap"),
            Choice("flight_step", 1.0, "the tolerance decides"),
            Choice("flight_tolerance", RODS_SHARE * accuracy, "a share of the accuracy"),
        )
        return Flown(skipped, skips, one)
    if stated.get("flight_integrator") == GENERALIZED_ALPHA:
        return Flown((), math.inf, one)
    way = fall.largest / _slowest(scene.finger)
    if fall.sunk > SUNK * way and not (driven or "flight" in stated):
        blocked = (
            Choice("flight", "rigid", "skipped: the finger meets the surface before its tip does"),
            Choice("flight_step", min(fall.time / FEW_STEPS, 1.0), "when it does"),
            Choice("flight_tolerance", RODS_SHARE * accuracy, "a share of the accuracy"),
        )
        return Flown(blocked, skips, one)
    elastic = (
        Choice("flight", "elastic", f"a rigid one would change the tap by {skips:.1g}"),
        Choice("flight_integrator", GAUSS, "order 10: long steps"),
        Choice("flight_tolerance", BENT_TOLERANCE, "equal steps, but where no rods foretell them"),
    )

    def of_elements(few: int, why: str) -> tuple[Choice, ...]:
        # torques may whirl a finger, and its tap then hangs on all that the flight does
        return () if driven else (Choice("flight_elements", few, why),)

    # nor may whirling ones take longer steps
    quiet = rung <= QUIET * accuracy and not driven
    steps = min(FEWEST_STEPS / min(accuracy, 1e-2) ** 0.25, FEW_STEPS) if quiet else FEW_STEPS
    longest = min(fall.time / steps, 1.0)
    if rung <= accuracy:
        why = f"skipped: the vibration, {rung:.1g} of the tap, is not followed"
        few = of_elements(
            BENT_ELEMENTS, "skipped until the touch: the contact's, as it bends slowly"
        )
        return Flown((*elastic, *few, Choice("flight_step", longest, why)), rung, one)
    highest = followed_frequency(scene.finger, frequency, rung / accuracy, kind[1])
    turn = TURN / (highest * fall.time)
    stages = STAGES if _in_phase(STAGES, turn) >= highest * longest else FOLLOWING_STAGES
    stages = stated.get("stages", stages)
    step = min(_in_phase(stages, turn) / highest, longest)
    why = f"the vibration, {rung:.1g} of the tap, arrives in phase up to {_hz(highest)}"
    counts = tuple([_count(p, highest, (720.0 * turn) ** 0.25) for p in phalanges])
    few = of_elements(max(counts), "skipped until the touch: the contact's, above that frequency")
    return Flown((*elastic, *few, Choice("flight_step", step, why)), 0.0, counts, True, stages)


def _in_phase(stages: int, turn: float) -> float:
    """Turn w h of a step at which that many stages are out of phase by the share `turn` of it."""
    over_phase = math.comb(2 * stages, stages) * math.factorial(2 * stages + 1)
    return (turn * over_phase) ** (1 / (2 * stages))


def _driven(scene: Scene) -> bool:
    """Whether torques drive the finger."""
    return acting_joints(scene.drive, len(scene.finger.phalanges))[0].size > 0


def followed_frequency(finger: Finger, contact: float, share: float, decay: float) -> float:
    """Angular frequency w_f, rad/s, above which a vibration may arrive in any phase.

    contact : w_c. share : r of the vibration over the error wanted. decay : p.
    """
    slowest = _slowest(finger)
    shielded = max(slowest, contact)
    left = share * (slowest / shielded) ** decay
    whole = slowest * share ** (1 / decay)
    return whole if left < 1.0 else shielded * left ** (1 / (1 + decay))


def _slowest(finger: Finger) -> float:
    """The slowest phalanx's first angular frequency on two hinges, rad/s."""
    return min(
        (math.pi / p.length) ** 2 * math.sqrt(p.bending_stiffness / p.line_density)
        for p in finger.phalanges
    )


def _hz(frequency: float) -> str:
    return f"{frequency / (2 * math.pi):.2g} Hz"
