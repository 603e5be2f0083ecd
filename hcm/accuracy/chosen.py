"""Choose settings that keep a relative error, from what is known of a tap before it is solved.

First rigid rods (`hcm.flight`) fall to the touch, which costs little: this gives its time, its
speed, and what rods leave out. Then, with eps the wanted error:

- contact: the tip is a spring k/e*^2 on the free end of a beam, whose impedance there is
  |Z| = rho A c/sqrt(2), c = (E I/(rho A))^(1/4) sqrt(w) (Cremer, Heckl and Petersson 2005). Above
  the frequency w where |Z| = k/(e*^2 w) the spring shields the beam. The trapezoidal rule's time
  scale is wrong by (w h)^2/12, elements of length l by (kappa l)^4 with the wave number
  kappa = (w^2 rho A/(E I))^(1/4): hence h ~ sqrt(eps)/w and l ~ eps^(1/4)/kappa. Collocation
  keeps its order only if it resolves the waves that the touch excites, and no step resolves them
  all: its error goes with about h^2 too, at steps thirty times as long. If the beam is stiff beside
  the spring, the phalanx's mass m vibrates on it faster than that: w >= sqrt(k/m)/e*.
- flight: `hcm.accuracy.chosen_flight`.

The factors of these relations were measured on 110 random scenes, so that 95 of 100 keep eps.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, fields, replace
from types import MappingProxyType
from typing import Any

from hcm.accuracy.chosen_flight import Stated, choose_flight, count_elements, hz
from hcm.beam.drive import acting_joints
from hcm.bounds import Bound, check_kind
from hcm.contact.build import law_of
from hcm.flight.fall import Fall, rods_fall
from hcm.model import Scene
from hcm.parameters import (
    GAUSS,
    GENERALIZED_ALPHA,
    STAGES,
    Finger,
    ParameterError,
    Phalanx,
    Settings,
    Tip,
)
from hcm.results.result import Choice

SMALLEST, LARGEST = 1e-6, 0.1
# w h over sqrt(eps), and elements of a phalanx over kappa L/eps^(1/4)
STEP_SHARE, ELEMENT_SHARE = 1.0, 0.3
# w h over sqrt(eps) of collocation, and its largest w h, a quarter of a tap; the hard finger's peak
# is off by 18e-6 at w h = 0.2, by 0.6e-6 at 0.1
STAGE_SHARE, LONGEST_TURN = 30.0, 1.2
# w1 h of collocation with 5 stages, w1 of the first bending of a beam with a hinge and a free end,
# and by how much of the compliance that this mode adds to the spring the tap changes where no step
# resolves it: of 276 stiff fingers on springs 18 missed 1e-3 (by 1.7 times at most) without them
BENDING_TURN, EXCITED_SHARE = 5.0, 0.3
# m/s at the touch, to the 1/4th power of which Hertz's frequencies go, where rods do not touch
UNKNOWN_SPEED = 1.0
# for refined beams, whose element errors fall with l^2 only: w h over sqrt(eps), and elements over
# kappa L/sqrt(eps). 4, 5 and 7 elements of the soft finger are off by 2.9, 1.7 and 0.8e-3, steps of
# w h = sqrt(eps) by 0.02e-3. Of 334 random falls with e* = 1 and 0.6 all but 12 keep 1e-3 with
# these and the flight's refined shares; with 0.08 and the lumped tip's shares 31 miss it, and the
# falls take a fifth longer, as more are solved again
REFINED_STEP_SHARE, REFINED_ELEMENT_SHARE = 2.0, 0.12
# factor on the elements of phalanges before the last: a wave returns from them when the tap is
# nearly over. 85 taps at 1e-3 keep their errors with 0.7; with 0.6, 3 more of 208 miss 1e-3
INNER_SHARE = 0.8
# Accuracy over the part left to the contact, if a flight's vibration is followed. Such a flight may
# take ten times as long, and would have to be solved again if the contact's error were too large
BESIDE = 2.0
# Newton's tolerance over eps, and its largest value, by the contact's integrator; it is relative to
# the acceleration, for collocation to the displacement in a step
NEWTON = {GENERALIZED_ALPHA: (1e-5, 1e-8), GAUSS: (1e-3, 1e-6)}
# the same for the smallest tolerance of undriven collocation: 30 falls at 1e-5 change by a tenth of
# eps at most, nine of ten by a fiftieth
FINE_NEWTON = (1e-2, 1e-7)
# the same where torques drive the finger: what the iteration leaves in the highest modes adds up in
# an undamped flight, to 5 % of a peak at 1e-6, 0.01 % at 1e-9
DRIVEN_NEWTON = (1e-6, 1e-9)

SETTINGS = (
    "elements", "flight", "flight_integrator", "flight_elements", "flight_step", "flight_tolerance",
    "contact_step", "contact_tolerance", "contact_integrator", "stages", "spectral_radius",
    "newton_tolerance",
)  # fmt: skip
"""Settings that are chosen unless they are stated."""
STATABLE = sorted({"elements", *(field.name for field in fields(Settings))})
"""Names of settings that a scene may state."""
STATED = "stated"
"""The reason of a choice that the scene has made."""


@dataclass(frozen=True)
class Chosen:
    """A scene with its settings, and the choices that led to them.

    flight_error : what the flight adds to the tap's relative error; inf if unknown.
    followed : whether its vibration is followed up to the touch. fall : of the finger as rods; None
    if they do not touch.
    """

    scene: Scene
    choices: tuple[Choice, ...]
    flight_error: float
    followed: bool
    fall: Fall | None


def check_accuracy(accuracy: float) -> None:
    """Raise `ParameterError` if no settings are known for so small or large an accuracy."""
    if not Bound(at_least=SMALLEST, at_most=LARGEST).holds(accuracy):
        given = f"a {type(accuracy).__name__}" if isinstance(accuracy, Scene) else repr(accuracy)
        raise ParameterError(
            f"accuracy = {given}: must be {SMALLEST:g} to {LARGEST:g}, the largest relative"
            " error wanted"
        )


def settings_for(accuracy: float, scene: Scene, stated: Stated = MappingProxyType({})) -> Chosen:
    """Settings with which peak force, impulse, duration and arrival are off by at most `accuracy`.

    Parameters
    ----------
    accuracy : relative, against the converged answer of the same equations.
    scene : its settings are kept where nothing is chosen: taps, times, limits.
    stated : settings that keep their values in the scene, by name; "elements" means the
        finger's.

    Raises
    ------
    ParameterError
        No settings are known for the accuracy, or a stated name is not a setting.
    """
    check_accuracy(accuracy)
    check_kind("scene", scene, Scene)
    check_kind("stated", stated, Mapping)
    if unknown := [name for name in stated if name not in STATABLE]:
        raise ParameterError(f"stated has {unknown[0]!r}: must be one of {', '.join(STATABLE)}")
    return choose(accuracy, scene, stated)


def choose(accuracy: float, scene: Scene, stated: Stated, modal: bool = True) -> Chosen:
    """`settings_for` without bounds on the accuracy: a second run may need a smaller one.

    modal : whether the flight may be modal.
    """
    phalanges = scene.finger.phalanges
    fall = rods_fall(scene)
    hertz = None
    if scene.assumptions.has("hertz"):
        hertz = law_of(scene.finger, scene.surface, scene.tip, scene.assumptions).k
    speed = fall.speed if fall else UNKNOWN_SPEED
    frequency = contact_frequency(phalanges[-1], scene.tip, hertz, speed)
    has_torques = acting_joints(scene.drive, len(phalanges))[0].size > 0
    driven = fall is not None and bool(fall.rods[0].moment.any())
    flight = choose_flight(accuracy, scene, fall, frequency, driven, stated, modal)
    lumped = not scene.assumptions.any
    in_contact = accuracy / BESIDE if flight.followed else accuracy
    wave = in_contact**0.25 / ELEMENT_SHARE if lumped else in_contact**0.5 / REFINED_ELEMENT_SHARE
    waves = [*[wave / INNER_SHARE] * (len(phalanges) - 1), wave]
    counts = tuple([
        max(count_elements(p, frequency, turn), least)
        for p, turn, least in zip(phalanges, waves, flight.elements, strict=True)
    ])  # fmt: skip
    # springs that slip one by one leave no smooth pieces
    method = stated.get("contact_integrator", GAUSS if lumped else GENERALIZED_ALPHA)
    stages = stated.get("stages", flight.stages)
    of_turn = STEP_SHARE if lumped else REFINED_STEP_SHARE
    of_turn = STAGE_SHARE * stages / STAGES if method == GAUSS else of_turn
    # where the beam is stiff beside the tip's spring, the phalanx's mass vibrates on it: sqrt(k/m)
    mass = phalanges[-1].line_density * phalanges[-1].length
    rigid = math.sqrt(tip_stiffness(scene.tip) / mass) if hertz is None else 0.0
    fastest = max(frequency, rigid)
    step = min(min(of_turn * math.sqrt(in_contact), LONGEST_TURN) / fastest, 1.0)
    if method == GAUSS:
        bending = first_bending_frequency(phalanges[-1])
        depth = speed / frequency if hertz else 0.0
        share = 4.0 * tip_stiffness(scene.tip, hertz, depth) / (mass * bending**2)
        if EXCITED_SHARE * share > in_contact:
            step = min(step, BENDING_TURN * stages / STAGES / bending)
    share, most = DRIVEN_NEWTON if method == GAUSS and has_torques else NEWTON[method]
    smooth = method == GAUSS and not has_torques
    fine = min(FINE_NEWTON[0] * accuracy, FINE_NEWTON[1]) if smooth else 0.0
    newton = min(max(share * accuracy, fine, 1e-12), most)
    choices = (
        Choice("elements", counts, f"waves up to {hz(frequency)}; the spring filters the rest"),
        *flight.choices,
        Choice("contact_integrator", method, f"order {2 * stages if method == GAUSS else 2}"),
        Choice("stages", stages, "more if a vibration is resolved: longer steps"),
        Choice("contact_step", step, f"oscillations of {hz(fastest)}"),
        Choice("contact_tolerance", 0.0, "skipped: equal steps need no error control"),
        Choice("newton_tolerance", newton, "iterations stop below the steps' errors"),
    )
    made: dict[str, Any] = {c.setting: c.value for c in choices if c.setting not in stated}
    finger = scene.finger
    if made.pop("elements", None) is not None:
        pairs = zip(phalanges, counts, strict=True)
        finger = Finger(tuple([replace(p, elements=n) for p, n in pairs]))
    stated_choices = (Choice(name, stated[name], STATED) for name in SETTINGS if name in stated)
    kept = (*(c for c in choices if c.setting not in stated), *stated_choices)
    made_of = replace(scene, finger=finger, settings=replace(scene.settings, **made))
    return Chosen(made_of, kept, flight.error, flight.followed, fall)


def contact_frequency(
    phalanx: Phalanx, tip: Tip, hertz: float | None = None, speed: float = 0.0
) -> float:
    """Angular frequency w, rad/s, above which the tip's spring shields a beam that ends there.

    hertz : K of F_n = K d^(3/2), N/m^(3/2), instead of the tip's spring; its stiffness is taken at
    the depth v/w. speed : v, of the approach, m/s.
    """
    beam = phalanx.bending_stiffness**0.25 * phalanx.line_density**0.75
    if hertz is not None:  # w^(3/2) = sqrt(2) k/beam, k = 3/2 K (v/w)^(1/2)/e*^2
        return math.sqrt(1.5 * math.sqrt(2.0 * speed) * hertz / (tip.restitution**2 * beam))
    return (math.sqrt(2.0) * tip_stiffness(tip) / beam) ** (2.0 / 3.0)


def first_bending_frequency(phalanx: Phalanx) -> float:
    """Angular frequency, rad/s, of the first mode of a beam with a hinge and a free end."""
    stiffness = phalanx.bending_stiffness / phalanx.line_density
    return 15.418 / phalanx.length**2 * math.sqrt(stiffness)


def tip_stiffness(tip: Tip, hertz: float | None = None, depth: float = 0.0) -> float:
    """The stiffer of a tip's two springs, that of restitution, or of Hertz's at a depth, N/m."""
    k = tip.k if hertz is None else 1.5 * hertz * math.sqrt(depth)
    return k / tip.restitution**2
