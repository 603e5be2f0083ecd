"""Settings that keep a relative error, from what is known of a tap before it is solved.

Rigid rods (`hcm.flight`) fall to the touch first, which costs little: they say when it comes, how
fast, and what they leave out. Then, with eps the error wanted:

- contact: the tip is a spring k/e*^2 on the free end of a beam, whose impedance there is
  |Z| = rho A c/sqrt(2), c = (E I/(rho A))^(1/4) sqrt(w) (Cremer, Heckl and Petersson 2005). Above
  the frequency w where |Z| = k/(e*^2 w) the spring shields the beam. The trapezoidal rule's time
  scale is wrong by (w h)^2/12, elements of length l by (kappa l)^4 with the wave number
  kappa = (w^2 rho A/(E I))^(1/4): hence h ~ sqrt(eps)/w and l ~ eps^(1/4)/kappa.
- flight: loads that come suddenly leave the beams a vibration, of speed V_0 by
  `rigid_chain.reactions` at the start, and slow ones bend them, V_1 at the touch. Rods leave out
  both. Collocation in few steps takes the bending with it, but the vibration arrives with a phase
  of chance; in steps that follow it, its phase is wrong by w t_c times their error.

The shares before these are measured on 110 random scenes, so that 95 of 100 keep them.
"""

from __future__ import annotations

import math
import time
from collections.abc import Mapping
from dataclasses import dataclass, replace
from types import MappingProxyType
from typing import Any

from hcm.contact.build import law_of
from hcm.estimate import LEFT_OUT_OVER, estimate_errors, relative_errors
from hcm.flight.rigid_chain import clearance, reactions
from hcm.flight.rigid_flight import TOUCHED, integrate_flight
from hcm.model import Scene, build_model
from hcm.parameters import (
    GAUSS,
    GENERALIZED_ALPHA,
    Finger,
    ParameterError,
    Phalanx,
    Settings,
    Tip,
)
from hcm.result import Accuracy, Choice, Status, TapResult
from hcm.simulate import LARGEST_LEFT_OUT, Progress, simulate

SMALLEST, LARGEST = 1e-6, 0.1
# w h over sqrt(eps), and elements of a phalanx over kappa L/eps^(1/4)
STEP_SHARE, ELEMENT_SHARE = 1.0, 0.3
MOST_ELEMENTS = 200
# of V_1 and of V_0, over the speed of approach: what they change in the tap
BEND_SHARE, RING_SHARE = 0.25, 0.25
# a vibration of amplitude V_0/w is wrong by this many times the error of a step
STEPS_ERROR = 10.0
# A beam's first frequency is too high by (pi/n)^4/720 on n cubic elements; a tenth of the error is
# left to what that turns the phase by in a flight.
PHASE_PART = 72.0
# steps of a flight whose vibration is not followed: in fewer, Newton's method fails again and again
# on stiff fingers
FEW_STEPS = 60
# of eps: errors of the rods' flight over the surface's depth, and of an acceleration
RODS_SHARE, NEWTON_SHARE = 1e-3, 1e-5
# of a flight as rods, beside one that decides, over the surface's depth
RODS_TOLERANCE = 1e-6

# A companion differs by at least this many times the run's error (`hcm.companion`).
COMPANION = 3.0
HELD = (
    "peak_normal_force_N",
    "normal_impulse_N_s",
    "contact_duration_s",
    "contact_time_s",
)
"""What an accuracy is about, by the summary's fields."""
SETTINGS = (
    "elements", "flight", "flight_integrator", "flight_step", "flight_tolerance", "contact_step",
    "contact_tolerance", "spectral_radius", "newton_tolerance",
)  # fmt: skip
"""What is chosen, unless it is stated."""

Stated = Mapping[str, object]


@dataclass(frozen=True)
class Chosen:
    """A scene with its settings, and the choices that led to them.

    flight_error : what the flight adds to the tap's relative error; inf where it is not known.
    """

    scene: Scene
    choices: tuple[Choice, ...]
    flight_error: float


@dataclass(frozen=True)
class Fall:
    """The rods' flight: its time (s), the tip's approach, V_0, V_1 and the largest V (m/s)."""

    time: float
    speed: float
    ringing: float
    bending: float
    largest: float


def check_accuracy(accuracy: float) -> None:
    """Refuse what no settings are known for.

    Raises
    ------
    ParameterError
        It is too small or too large.
    """
    if not SMALLEST <= accuracy <= LARGEST:
        raise ParameterError(
            f"accuracy = {accuracy!r}: must be {SMALLEST:g} to {LARGEST:g}, the largest relative"
            " error wanted"
        )


def simulate_within(
    accuracy: float,
    scene: Scene,
    stated: Stated = MappingProxyType({}),
    progress: Progress | None = None,
) -> TapResult:
    """`hcm.simulate` with the settings of `settings_for`.

    A run that is expected to have a larger error is solved once more, for an accuracy that is
    smaller by as much; its time is that of all that was done for it.
    """
    began, spent, target, again = time.perf_counter(), 0.0, accuracy, ""
    while True:
        chosen = settings_for(target, scene, stated)
        spent += time.perf_counter() - began
        plain = replace(chosen.scene, settings=replace(chosen.scene.settings, estimate=False))
        result = simulate(**plain.arguments(), progress=progress)
        spent += result.statistics.wall_time_s
        expected = None
        if scene.settings.estimate and result.status is Status.COMPLETED:
            result, expected = _with_estimates(result, plain, chosen.flight_error, progress)
        if expected is None or expected <= accuracy or again:
            break
        again = f"solved again: {expected:.1g} was expected of the first run"
        target, began = max(accuracy**2 / expected, SMALLEST), time.perf_counter()
    choices = (*chosen.choices, *([Choice("accuracy", target, again)] if again else []))
    cautions = list(result.cautions)
    if expected is not None and expected > accuracy:
        cautions.append(f"expects a relative error of {expected:.1g}; {accuracy:g} was wanted")
    return replace(
        result,
        cautions=tuple(cautions),
        statistics=replace(result.statistics, wall_time_s=spent),
        accuracy=Accuracy(accuracy, expected, choices),
    )


def _with_estimates(
    result: TapResult, scene: Scene, flight_error: float, progress: Progress | None
) -> tuple[TapResult, float | None]:
    """The run with its errors, and the largest relative one that is expected.

    Steps and elements in contact are judged on taps after a flight as rods, whatever the run's own
    was: a companion that did not follow a vibration would differ by all of it.
    """

    def rods_tap(finger: Finger, settings: Settings) -> TapResult:
        tap = simulate(
            **replace(scene, finger=finger, settings=settings).arguments(), progress=progress
        )
        flexible = tap.status is Status.TOO_FLEXIBLE
        return replace(tap, status=Status.COMPLETED) if flexible else tap

    own, settings = result, scene.settings
    if settings.flight != "rigid" and math.isfinite(flight_error):
        rigid = replace(settings, flight="rigid", flight_step=1.0, flight_tolerance=RODS_TOLERANCE)
        tap = rods_tap(scene.finger, rigid)
        if tap.status is Status.COMPLETED:
            own, settings = tap, rigid
    unseen = COMPANION * flight_error if math.isfinite(flight_error) else 0.0
    found = estimate_errors(own, rods_tap, scene.finger, settings, unseen * LEFT_OUT_OVER)
    result = replace(
        result,
        status=found.status,
        message=found.status.value + found.doubt if found.doubt else result.message,
        errors=found.errors,
        cautions=(*result.cautions, *found.cautions),
    )
    if not found.errors:
        return result, None
    shares = relative_errors(own.summary, found.errors)
    return result, max(shares[name] for name in HELD) / COMPANION


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
    phalanges = scene.finger.phalanges
    fall = rods_fall(scene)
    law = law_of(scene.finger, scene.surface, scene.tip, scene.assumptions)
    hertz = law.k if scene.assumptions.has("hertz") and fall is not None else None
    frequency = contact_frequency(phalanges[-1], scene.tip, hertz, fall.speed if fall else 0.0)
    flight, flight_error, least = _flight(accuracy, scene, fall, stated)
    counts = tuple([max(least, _elements(p, frequency, accuracy)) for p in phalanges])
    step = min(STEP_SHARE * math.sqrt(accuracy) / frequency, 1.0)
    newton = min(max(NEWTON_SHARE * accuracy, 1e-12), 1e-8)
    rate = f"{frequency / (2 * math.pi):.2g} Hz"
    choices = (
        Choice("elements", counts, f"waves of {rate}, above which the tip's spring shields them"),
        *flight,
        Choice("contact_step", step, f"oscillations of {rate}"),
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
    settings = replace(scene.settings, **made)
    return Chosen(replace(scene, finger=finger, settings=settings), kept, flight_error)


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


def _elements(phalanx: Phalanx, frequency: float, accuracy: float) -> int:
    waves = frequency**2 * phalanx.line_density / phalanx.bending_stiffness
    count = ELEMENT_SHARE * waves**0.25 * phalanx.length / accuracy**0.25
    return min(max(math.ceil(count), 1), MOST_ELEMENTS)


def rods_fall(scene: Scene) -> Fall | None:
    """The fall of the phalanges as rods; None where they do not touch."""
    rods = Finger(tuple([replace(p, elements=1) for p in scene.finger.phalanges]))
    rigid = replace(
        scene.settings, flight="rigid", flight_step=1.0, flight_tolerance=RODS_TOLERANCE
    )
    model = build_model(
        rods, scene.surface, scene.tip, scene.drive, rigid, scene.start, scene.assumptions
    )
    assert model.rods is not None
    most = scene.settings.max_steps
    given = model.rods, model.angles, model.start_s, model.plan, most
    flight = integrate_flight(*given, model.rods_drive)
    if flight.code != TOUCHED:
        return None
    out = model.angles.copy()
    rows = zip(flight.states, flight.accelerations, strict=True)
    left_out = [reactions(state, turns, model.rods, out) for state, turns in rows]
    speed = max(abs(clearance(flight.states[-1], model.rods)[1]), 1e-300)
    lasted = float(flight.time[-1]) - model.start_s
    return Fall(lasted, speed, left_out[0], left_out[-1], max(left_out))


def _flight(
    accuracy: float, scene: Scene, fall: Fall | None, stated: Stated
) -> tuple[list[Choice], float, int]:
    """How the finger gets to the surface, the relative error that this adds, least elements."""
    if fall is None:
        return [], math.inf, 1
    bent, rung = BEND_SHARE * fall.bending / fall.speed, RING_SHARE * fall.ringing / fall.speed
    stiff = bent <= accuracy and fall.largest <= LARGEST_LEFT_OUT * fall.speed
    if stated.get("flight", "rigid" if stiff else "") == "rigid":
        return [
            Choice("flight", "rigid", f"skipped: what bends and vibrates, {bent:.1g} of the tap"),
            Choice("flight_step", 1.0, "the tolerance decides"),
            Choice("flight_tolerance", RODS_SHARE * accuracy, "a share of the accuracy"),
        ], bent, 1  # fmt: skip
    if stated.get("flight_integrator") == GENERALIZED_ALPHA:
        return [], math.inf, 1
    flight = [
        Choice("flight", "elastic", f"a rigid one would change the tap by {bent:.1g}"),
        Choice("flight_integrator", GAUSS, "order 10: long steps"),
        Choice("flight_step", min(fall.time / FEW_STEPS, 1.0), f"1/{FEW_STEPS} of the flight"),
    ]
    if rung <= accuracy:
        why = f"skipped: the vibration, {rung:.1g} of the tap, is not followed"
        return [*flight, Choice("flight_tolerance", 1.0, why)], rung, 1
    slowest = min(
        (math.pi / p.length) ** 2 * math.sqrt(p.bending_stiffness / p.line_density)
        for p in scene.finger.phalanges
    )
    tolerance = accuracy * fall.speed / (STEPS_ERROR * slowest * scene.surface.height)
    why = f"the vibration, {rung:.1g} of the tap, arrives in phase"
    turned = math.pi**4 * slowest * fall.time * rung / (PHASE_PART * accuracy)
    least = min(math.ceil(turned**0.25), MOST_ELEMENTS)
    return [*flight, Choice("flight_tolerance", min(tolerance, 1.0), why)], accuracy, least
