"""Run the reduced model: from rest, through flight and contact, to separation or an end time."""

import math
import time
from collections.abc import Callable
from dataclasses import replace
from functools import partial

import numpy as np

from hcm import loop
from hcm.arrays import Floats
from hcm.assumptions import PAPER, Assumptions
from hcm.beam.division import divided, flight_elements
from hcm.beam.drive import piece_at
from hcm.beam.outline import depth
from hcm.bounds import ParameterError, check_kind
from hcm.contact.build import beyond_checks
from hcm.contact.law import FLIGHT, Contact
from hcm.estimate import estimate_errors
from hcm.fall import Fall
from hcm.flight.rigid_chain import build_rods
from hcm.model import Model, RigidStart, Scene, build_model, until_touch
from hcm.other_ends import held_touches, with_other_ends
from hcm.parameters import GAUSS, Drive, Finger, Settings, Surface, Tip, check_scene
from hcm.posture import Postures, node_places
from hcm.record import Segment, empty_record, next_segment
from hcm.resolution import judge_steps
from hcm.result import OtherEnd, Statistics, Status, TapResult, history_of
from hcm.start import BeamStart, enter_piece, start_beams, start_divided
from hcm.state import Clock, Motion, Plan, empty_motion
from hcm.summary import summarize
from hcm.tap import next_touch_s, returned, slow_end, taps_of
from hcm.workload import check_size

Progress = Callable[[float, str], None]

# An energy residual beyond this share of the largest kinetic energy, 2.5 % of a force, is no longer
# numerical damping: the run is not COMPLETED, whatever its forces look like. The article's steps of
# 1 ms lose 4 % on its driven fingers; of 144 random scenes at the defaults none lost over 0.1 %.
LARGEST_RESIDUAL = 0.05
# What a rigid flight leaves out may change the tap by this share; the estimate is that of
# `rigid_chain.reactions`, 8 to 200 times the change (measured on 9 scenes with steady flights).
LARGEST_LEFT_OUT = 0.01
TABLE_ROWS, EVENT_ROWS = 4096, 256
# Newton iterations allowed per step of `max_steps`, those of event searches and of repeated steps
# included: a smooth motion takes 2 to 4.
ITERATIONS_A_STEP = 20
# Iterations times elements that a call of the loop may take, about a second: progress is shown, and
# an interrupt obeyed, that often.
UPDATES_A_CALL = 4_000_000

_STATUS = {
    loop.DONE: Status.COMPLETED,
    loop.NEWTON_FAILED: Status.NEWTON_FAILED,
    loop.FLIGHT_TOO_LONG: Status.NOT_REACHED,
    loop.CONTACT_TOO_LONG: Status.STILL_IN_CONTACT,
    loop.BODY_TOUCHES: Status.BODY_TOUCHES,
    loop.LOSES_HOLD: Status.LOSES_HOLD,
}


def simulate(
    finger: Finger,
    surface: Surface,
    tip: Tip,
    drive: Drive = Drive(),  # noqa: B008  frozen
    settings: Settings = Settings(),  # noqa: B008  frozen
    progress: Progress | None = None,
    start: RigidStart | None = None,
    assumptions: Assumptions = PAPER,
    fall: Fall | None = None,
) -> TapResult:
    """Let the finger fall from rest along -X, or from `start`, and tap the surface.

    Parameters
    ----------
    finger, surface, tip, drive : the scene, SI units.
    settings : numerical choices.
    progress : called now and then with (fraction of the run, what it is doing).
    start : rigid state to start from, its tip above the surface; None: at rest along -X at t = 0.
    assumptions : the paper's, or refinements of them.
    fall : of the finger as rods, if it is known (`hcm.fall`); a rigid flight like it is not solved.

    Returns
    -------
    The result so far whatever the status: a run that fails or is interrupted keeps its history.

    Raises
    ------
    ParameterError
        Something is of another kind, the parts of the scene do not fit each other, the finger
        starts below the surface, or the run would need more memory or steps than allowed.
    """
    scene = Scene(finger, surface, tip, drive, settings, start, assumptions)
    if progress is not None and not callable(progress):
        raise ParameterError(f"progress = {progress!r}: must be a function of (fraction, text)")
    if fall is not None:
        check_kind("fall", fall, Fall)
    check_scene(finger, surface, drive)
    check_size(finger, settings)
    started = time.perf_counter()
    model = build_model(finger, surface, tip, drive, settings, start, assumptions)
    few = flight_elements(finger, settings)
    if few is None:
        rods = None
        if settings.flight == "rigid":
            rods = fall.rods if fall else build_rods(finger, surface, drive, assumptions)
        begun = start_beams(model, rods, fall)
    else:
        flight = build_model(few, surface, tip, drive, settings, start, assumptions)
        flight = until_touch(flight, few, assumptions)
        up = start_beams(flight)
        flown, ended, *_ = _take_steps(flight, up, progress)
        divide = partial(divided, few=few, many=finger, chain=model.chain, assumptions=assumptions)
        begun = start_divided(model, flight, flown, up.motion, ended, divide)
    segments, status, over_s, other_ends = _take_steps(model, begun, progress)
    last, clock = segments[-1], segments[-1].clock
    events = tuple([event for s in segments for event in s.events])
    q, v = np.concatenate([s.q for s in segments]), np.concatenate([s.v for s in segments])
    rows = np.concatenate([s.rows for s in segments])
    history = history_of(rows, np.concatenate([s.reactions for s in segments]))
    taps = taps_of(events, None if model.tap_ends is None else over_s)
    residual = last.imbalance_J / max(last.kinetic_J, model.roundoff_J)
    summary = summarize(history, events, taps, residual, _rows_between(settings))
    doubt = ""
    cautions: tuple[str, ...] = ()
    if status is Status.COMPLETED:
        status, doubt, cautions = judge_steps(history, events, summary, settings)
        if assumptions.any and summary.peak_normal_force_N is not None:
            slope = q[[event.kind for event in events].index("contact"), model.chain.tip + 2 :]
            angle = math.atan2(-slope[1], abs(slope[0]))
            peak, stress = summary.peak_normal_force_N, summary.peak_stress_R_Pa or 0.0
            pressed = int((history.normal_force_N * (history.time_s <= taps[0][1])).argmax())
            pull = -math.copysign(1.0, slope[0]) * float(history.tangential_force_N[pressed])
            cautions += beyond_checks(
                finger.phalanges[-1], tip, assumptions, angle, peak, stress, pull
            )
        if taps and assumptions.has("hertz"):
            cautions += slow_end(history.time_s, history.normal_force_N, taps[0])
    if taps and model.tap_ends is not None:
        height = model.generalized_alpha.law.height
        other_ends += returned(
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
        rejected_steps=clock.rejected,
        event_trials=clock.trials,
        chatter_steps=clock.chatter_steps,
        wall_time_s=time.perf_counter() - started,
    )
    frames, places = model.frames, node_places(model.chain)
    first = end = 0
    if frames.time.size:
        first = int(frames.time.searchsorted(model.start_s))
        end = int(frames.time.searchsorted(clock.time, "right"))
    result = TapResult(
        status,
        _message(status, clock, statistics) + doubt,
        history,
        events,
        statistics,
        summary,
        Postures(tuple([event.time_s for event in events]), places, q, v),
        Postures(tuple(frames.time[first:end].tolist()), places, frames.q[first:end]),
        cautions=cautions,
        taps=taps,
        other_ends=tuple(other_ends),
        given=scene.arguments(),
    )
    if status is not Status.COMPLETED or not settings.estimate or summary.contact_time_s is None:
        return result

    def again(finger: Finger, changed: Settings) -> TapResult:
        return simulate(finger, surface, tip, drive, changed, progress, start, assumptions)

    found = estimate_errors(result, again, finger, settings, begun.left_out)
    errors, open_ends, ended = with_other_ends(
        result, found.errors, lambda until: simulate(**held_touches(result, until))
    )
    status = found.status if ended is Status.COMPLETED else ended
    return replace(
        result,
        status=status,
        message=_message(status, clock, statistics) + found.doubt,
        errors=errors,
        cautions=(*cautions, *found.cautions, *open_ends),
    )


def _rows_between(settings: Settings) -> int:
    """Rows of a step in contact before that of its end: one a stage."""
    return settings.stages if settings.contact_integrator == GAUSS else 0


def _take_steps(
    model: Model, begun: BeamStart, progress: Progress | None
) -> tuple[list[Segment], Status, list[float], list[OtherEnd]]:
    """Call the compiled loop until the run ends or is interrupted.

    The last are the times at which taps were seen to be over, s, and ends that the first nearly
    had.
    """
    over_s, other_ends = list[float](), list[OtherEnd]()
    status: Status = begun.status
    if status is not Status.COMPLETED:
        return [begun.segment], status, over_s, other_ends
    settings, motion = model.settings, begun.motion
    new = empty_motion(model.chain)
    segments, code = [begun.segment], loop.RUNNING
    cost, most = model.generalized_alpha.work.cost, ITERATIONS_A_STEP * settings.max_steps
    between = _rows_between(settings)
    stages = settings.stages if settings.flight_integrator == GAUSS else max(between, 1)
    per_call = 1 + UPDATES_A_CALL // (model.chain.first.size * stages)
    until = model.plan if model.tap_ends is None else model.plan._replace(taps=1)
    try:
        integrator = model.integrator()
        kind = integrator.__class__, integrator.law.__class__
        while status is Status.COMPLETED and code == loop.RUNNING:
            last, spent = segments[-1], int(cost[0])
            size = min(TABLE_ROWS, settings.max_steps - last.steps)
            if size <= 0 or spent >= most:
                status = Status.WORK_LIMIT
                break
            over = piece_at(model.drive, last.clock.time).end_s
            plan = until._replace(
                iterations=min(most, spent + per_call), end_time=min(until.end_time, over)
            )
            record = empty_record(size + between, EVENT_ROWS, model.chain, model.frames)
            contact, clock, rows, events, code = loop.advance_by_kind(
                kind, motion, new, last.contact, last.clock, plan, integrator, model.probe,
                model.outline, record,
            )  # fmt: skip
            first_row = begun.segment.rows[0]
            segments.append(
                next_segment(
                    last, first_row, Contact(*contact), Clock(*clock), rows, events, record
                )
            )
            last = segments[-1]
            kink = code == loop.DONE and over < until.end_time and last.clock.taps < plan.taps
            if kink:
                enter_piece(model, motion, last.contact, last.clock.time)
                code = loop.RUNNING
            status = _STATUS.get(code, Status.COMPLETED)
            # a NaN compares false and is no balance
            allowed = LARGEST_RESIDUAL * last.kinetic_J + model.roundoff_J
            balanced = last.imbalance_J <= allowed
            # a kink may come so early that the finger hardly moves yet
            if status is Status.COMPLETED and not (balanced or kink):
                status = Status.UNBALANCED
            if code == loop.DONE and (
                further := _further(model, segments, motion, over_s, other_ends)
            ):
                until, code = further, loop.RUNNING
            if progress is not None:
                progress(*_fraction(last.clock, last.contact, settings))
    except KeyboardInterrupt:
        status = Status.INTERRUPTED
    return segments, status, over_s, other_ends


def _further(
    model: Model, segments: list[Segment], motion: Motion, over_s: list[float],
    other_ends: list[OtherEnd],
) -> Plan | None:  # fmt: skip
    """Until when a run goes on that stopped to look whether its tap is over; None: it is done.

    over_s : gets the time of a tap that is. other_ends : those that the first nearly had.
    """
    rule, clock = model.tap_ends, segments[-1].clock
    if rule is None or model.plan.end_time - clock.time <= loop.LAST_STEP * clock.time:
        return None
    taps = taps_of((event for s in segments for event in s.events), over_s)
    tap, look = taps[-1], math.inf
    if tap[1] < math.inf:
        look = rule.first_look_s(tap)
        if look - clock.time <= loop.LAST_STEP * clock.time:
            law = model.generalized_alpha.law
            touch = next_touch_s(motion.q, motion.v, model.chain, law.height)
            if len(taps) == 1:
                tip_in_s = _tip_in_s(model, segments, motion)
                other_ends += rule.looked(tap, clock.time, touch, tip_in_s)
            look = rule.next_look_s(tap, clock.time, touch)
        if look == math.inf:
            over_s.append(clock.time)
            if len(taps) >= model.plan.taps:
                return None
    return model.plan._replace(taps=clock.taps + 1, end_time=min(look, model.plan.end_time))


def _tip_in_s(model: Model, segments: list[Segment], motion: Motion) -> float:
    """Time until a tip that left is where it left at its own speed, s; inf: never.

    With restitution it left with what the contact keeps of its indentation.
    """
    down = model.chain.tip + 1
    left = next(q for s in reversed(segments) for q in s.q[::-1])[down]
    above, speed = motion.q[down] - left, -motion.v[down]
    return max(float(above / speed), 0.0) if speed > 0.0 else math.inf


def _message(status: Status, clock: Clock, statistics: Statistics) -> str:
    if status is Status.COMPLETED:
        return ""
    message = f"{status.value} at t = {clock.time:.9g} s after {statistics.steps} steps"
    if status is Status.WORK_LIMIT:
        message += (
            f" ({statistics.newton_iterations} iterations, {clock.rejected} repeated steps,"
            f" the last of {clock.step:.2g} s)"
        )
    return message


def _where(model: Model, q: Floats) -> str:
    below, element, x = depth(q, model.chain, model.outline)
    phalanx = int(np.searchsorted(model.chain.hinge, model.chain.first[element]))
    return f": phalanx {phalanx} is {below:.2g} m below it at X = {x:.4g} m"


def _fraction(clock: Clock, contact: Contact, settings: Settings) -> tuple[float, str]:
    doing = "in flight" if contact.normal == FLIGHT else "in contact"
    label = f"{doing}, t = {clock.time:.4g} s"
    if settings.end_time is not None:
        return clock.time / settings.end_time, label
    return clock.taps / settings.taps, label
