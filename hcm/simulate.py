"""Run the reduced model: from rest, through flight and contact, to separation or an end time."""

import math
import time
from dataclasses import replace
from functools import partial

import numpy as np

from hcm.arrays import Floats
from hcm.assembly.state import RunTotals
from hcm.assumptions import PAPER, Assumptions
from hcm.beam.division import divided, flight_elements
from hcm.beam.outline import depth
from hcm.bounds import ParameterError, check_kind
from hcm.contact.build import beyond_checks, relaxation_cautions, sticking_cautions
from hcm.estimates.estimate import estimate_errors
from hcm.estimates.other_ends import with_other_ends
from hcm.estimates.resolution import judge_steps
from hcm.flight.fall import Fall
from hcm.flight.rigid_chain import build_rods
from hcm.modal_flight import fly_modal
from hcm.model import Model, RigidStart, Scene, build_model, check_scene, rods_state, until_touch
from hcm.parameters import Drive, Finger, Settings, Surface, Tip
from hcm.results.posture import Postures, node_places
from hcm.results.result import History, Statistics, Summary, TapResult, history_of
from hcm.results.status import Status
from hcm.start import BeamStart, Flown, start_beams, start_divided
from hcm.stepping import Progress, SteppingResult, rows_between, take_steps
from hcm.taps.next_touch import bent_touches, next_touch_s
from hcm.taps.summary import summarize
from hcm.taps.tap import (
    bends_back,
    ends_undecided,
    near_ends_when_touched_again,
    nearest,
    rising_stress,
    slow_end,
    taps_of,
)
from hcm.workload import check_size

# Largest share by which what a rigid flight leaves out may change the tap; `rigid_chain.reactions`
# estimates it, 8 to 200 times too large (measured on 9 scenes with steady flights).
LARGEST_LEFT_OUT = 0.01


def simulate(
    finger: Finger,
    surface: Surface,
    tip: Tip,
    drive: Drive = Drive(),  # noqa: B008  frozen
    settings: Settings = Settings(),  # noqa: B008  frozen
    progress: Progress | None = None,
    start: RigidStart | None = None,
    assumptions: Assumptions = PAPER,
) -> TapResult:
    """Let the finger fall from rest along -X, or from `start`, and tap the surface.

    Parameters
    ----------
    finger, surface, tip, drive : the scene, SI units.
    settings : numerical choices.
    progress : called now and then with (fraction of the run, what it is doing).
    start : rigid state to start from, its tip above the surface; None: at rest along -X at t = 0.
    assumptions : the paper's, or refinements of them.

    Returns
    -------
    The result, whatever the status: a run that fails or is interrupted keeps its history so far.

    Raises
    ------
    ParameterError
        An argument has the wrong type, the parts of the scene do not fit each other, the finger
        starts below the surface, or the run would need more memory or steps than allowed.
    """
    scene = Scene(finger, surface, tip, drive, settings, start, assumptions)
    return simulate_scene(scene, progress)


def simulate_scene(scene: Scene, progress: Progress | None = None) -> TapResult:
    """`simulate` of a scene in one piece."""
    check_kind("scene", scene, Scene)
    result, left_out = solve_once(scene, progress)
    completed = result.status is Status.COMPLETED
    if not completed or not scene.settings.estimate or result.summary.contact_time_s is None:
        return result
    again = partial(simulate_scene, progress=progress)
    return with_other_ends(estimate_errors(result, again, left_out), again)


def solve_once(
    scene: Scene, progress: Progress | None = None, fall: Fall | None = None
) -> tuple[TapResult, float]:
    """The run without its errors, and what its flight leaves out (`BeamStart`).

    fall : of this finger as rods, if known; a rigid flight equal to it is not solved again.
    """
    if progress is not None and not callable(progress):
        raise ParameterError(f"progress = {progress!r}: must be a function of (fraction, text)")
    check_scene(scene.finger, scene.surface, scene.drive)
    check_size(scene.finger, scene.settings, rods_state(scene.finger, scene.start)[1])
    started = time.perf_counter()
    model = build_model(scene)
    begun = _begin(scene, model, progress, fall)
    taken = take_steps(model, begun, progress)
    return _result(scene, model, begun, taken, started), begun.left_out


def _begin(scene: Scene, model: Model, progress: Progress | None, fall: Fall | None) -> BeamStart:
    """The state that the finger's own elements begin with: the scene's start, that of the touch
    of a flight as rods, or that of one of few elements.
    """
    finger, settings, assumptions = scene.finger, scene.settings, scene.assumptions
    if settings.flight == "rigid":
        rods = fall.rods if fall else build_rods(finger, scene.surface, scene.drive, assumptions)
        return start_beams(model, rods, fall)
    few = flight_elements(finger, settings)
    if few is None:
        return start_beams(model)
    fly = fly_modal if settings.flight == "modal" else _fly_elastic
    flown = fly(replace(scene, finger=few), progress, fall)
    divide = partial(divided, few=few, many=finger, chain=model.chain, assumptions=assumptions)
    return start_divided(model, flown, divide)


def _fly_elastic(scene: Scene, progress: Progress | None, fall: Fall | None) -> Flown:
    """A flight that leaves out nothing; scene : with the elements of the flight."""
    del fall
    model = until_touch(build_model(scene), scene.finger, scene.assumptions)
    begun = start_beams(model)
    taken = take_steps(model, begun, progress)
    return Flown(model, taken.segments, begun.motion, taken.status)


def _result(
    scene: Scene, model: Model, begun: BeamStart, taken: SteppingResult, started: float
) -> TapResult:
    """The run without its errors; started : by `time.perf_counter`, s."""
    segments, status, over_s, other_ends = taken
    settings, last, totals = scene.settings, segments[-1], segments[-1].totals
    events = tuple([event for s in segments for event in s.events])
    q, v = np.concatenate([s.q for s in segments]), np.concatenate([s.v for s in segments])
    rows = np.concatenate([s.rows for s in segments])
    history = history_of(rows, np.concatenate([s.reactions for s in segments]))
    taps = taps_of(events, None if model.tap_ends is None else over_s)
    residual = last.imbalance_J / max(last.kinetic_J, model.roundoff_J)
    summary = summarize(
        history, events, taps, residual, rows_between(settings), scene.tip.restitution
    )
    doubt = ""
    cautions: tuple[str, ...] = ()
    height = model.generalized_alpha.law.height
    touching = scene.finger.phalanges[-1]
    relaxes = scene.assumptions.has("hertz") and touching.relaxation_time > 0
    if status is Status.COMPLETED:
        status, doubt, cautions = judge_steps(history, events, summary, settings, relaxes)
        if taps and model.tap_ends is not None:
            motion, of = begun.motion, (model.chain, height, touching)
            cautions += ends_undecided(taps[0], over_s)
            cautions += bends_back(
                model.tap_ends, taps, over_s, totals.time,
                lambda within_s: bent_touches(motion.q, motion.v, *of, within_s),
            )  # fmt: skip
        if lasts := summary.contact_duration_s:
            cautions += relaxation_cautions(touching, scene.assumptions, lasts)
        if taps and scene.assumptions.any:
            touched = [event.kind for event in events].index("contact")
            slope = q[touched, model.chain.tip + 2 :]
            cautions += _refinement_cautions(scene, summary, history, taps[0], slope)
    if taps and model.tap_ends is not None:
        other_ends += near_ends_when_touched_again(
            model.tap_ends, events, taps[0],
            lambda event: next_touch_s(q[event], v[event], model.chain, height),
        )  # fmt: skip
    if status is Status.COMPLETED and begun.left_out > LARGEST_LEFT_OUT and events:
        status = Status.TOO_FLEXIBLE
        doubt = f"; bending and vibration may change the tap by up to {100 * begun.left_out:.2g} %"
    if status is Status.BODY_TOUCHES:
        doubt = _where(model, begun.motion.q)
    cost = model.generalized_alpha.work.cost
    statistics = Statistics(
        steps=last.steps,
        newton_iterations=int(cost[0]),
        factorizations=int(cost[1]),
        rejected_steps=totals.rejected,
        event_trials=totals.trials,
        chatter_steps=totals.chatter_steps,
        wall_time_s=time.perf_counter() - started,
    )
    frames, places = model.frames, node_places(model.chain)
    first = end = 0
    if frames.time.size:
        first = int(frames.time.searchsorted(model.start_s))
        end = int(frames.time.searchsorted(totals.time, "right"))
    return TapResult(
        status,
        _message(status, totals, statistics) + doubt,
        history,
        events,
        statistics,
        summary,
        Postures(tuple([event.time_s for event in events]), places, q, v),
        Postures(tuple(frames.time[first:end].tolist()), places, frames.q[first:end]),
        cautions=cautions,
        taps=taps,
        other_ends=nearest(other_ends),
        given=vars(scene),
    )


def _refinement_cautions(
    scene: Scene, summary: Summary, history: History, tap: tuple[float, float], slope: Floats
) -> tuple[str, ...]:
    """Cautions of the refined assumptions for a tap; slope : r' of the tip as it touches, (2,)."""
    cautions: tuple[str, ...] = ()
    if summary.peak_normal_force_N is not None:
        last, tangential = scene.finger.phalanges[-1], history.tangential_force_N
        normal = history.normal_force_N * (history.time_s <= tap[1])
        pressed, pulled = int(normal.argmax()), int((abs(tangential) * (normal > 0.0)).argmax())
        cautions = beyond_checks(
            last,
            scene.tip,
            scene.assumptions,
            angle=math.atan2(-slope[1], abs(slope[0])),
            peak=summary.peak_normal_force_N,
            stress=summary.peak_stress_R_Pa or 0.0,
            pull=-math.copysign(1.0, slope[0]) * float(tangential[pressed]),
        )
        cautions += sticking_cautions(
            last, scene.surface, scene.assumptions, float(normal[pulled]), float(tangential[pulled])
        )
    if scene.assumptions.has("hertz"):
        cautions += slow_end(history.time_s, history.normal_force_N, tap)
        cautions += rising_stress(history.time_s, history.stress_R_Pa, tap)
    return cautions


def _message(status: Status, totals: RunTotals, statistics: Statistics) -> str:
    if status is Status.COMPLETED:
        return ""
    message = status.at(totals.time, statistics.steps)
    if status is Status.WORK_LIMIT:
        message += (
            f" ({statistics.newton_iterations} iterations, {totals.rejected} repeated steps,"
            f" the last of {totals.step:.2g} s)"
        )
    return message


def _where(model: Model, q: Floats) -> str:
    below, element, x = depth(q, model.chain, model.outline)
    phalanx = int(np.searchsorted(model.chain.hinge, model.chain.first[element]))
    return f": phalanx {phalanx} is {below:.2g} m below it at X = {x:.4g} m"
