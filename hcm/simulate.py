"""Run the reduced model: from rest, through flight and contact, to separation or an end time."""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from hcm import loop
from hcm.arrays import Floats
from hcm.beam.chain import Chain, Probe, build_chain, build_probe
from hcm.contact.law import FLIGHT, Contact, contact_law
from hcm.flight.rigid_chain import build_rods
from hcm.flight.rigid_flight import integrate_flight
from hcm.integrators.gauss_tableau import STAGES, with_collocation
from hcm.integrators.step import AnyIntegrator
from hcm.integrators.workspace import Integrator, coefficients, workspace
from hcm.parameters import GAUSS, Drive, Finger, ParameterError, Settings, Surface, Tip, check_scene
from hcm.posture import postures
from hcm.record import FrameTable, Segment, empty_record, next_segment
from hcm.result import Event, History, Statistics, Status, Summary, TapResult, history_of
from hcm.sensitivity import LARGEST_CHANGE, largest_change, repetition_settings, tolerance_factors
from hcm.start import BeamStart, RigidStart, rigid_motion, start_after_flight, start_in_flight
from hcm.state import Clock, Motion, Plan, build_motion
from hcm.summary import summarize
from hcm.workload import check_size, most_steps

Progress = Callable[[float, str], None]

# An energy residual beyond this share of the largest kinetic energy is no longer numerical damping:
# the run is not COMPLETED, whatever its forces look like.
LARGEST_RESIDUAL = 0.1
# What a rigid flight leaves out may change the tap by this share; the estimate is that of
# `rigid_chain.reactions`, 8 to 200 times the change (measured on 9 scenes with steady flights).
LARGEST_LEFT_OUT = 0.01
TABLE_ROWS, EVENT_ROWS = 4096, 256
# Newton iterations allowed per step of `max_steps`, those of event searches and of repeated steps
# included: a smooth motion takes 2 to 4.
ITERATIONS_A_STEP = 20
# Iterations times elements between two looks at the clock, about a second: progress is shown, and
# an interrupt obeyed, that often.
UPDATES_A_CALL = 4_000_000

_STATUS = {
    loop.DONE: Status.COMPLETED,
    loop.NEWTON_FAILED: Status.NEWTON_FAILED,
    loop.FLIGHT_TOO_LONG: Status.NOT_REACHED,
    loop.CONTACT_TOO_LONG: Status.STILL_IN_CONTACT,
}


def simulate(
    finger: Finger,
    surface: Surface,
    tip: Tip,
    drive: Drive = Drive(),  # noqa: B008  frozen
    settings: Settings = Settings(),  # noqa: B008  frozen
    progress: Progress | None = None,
    start: RigidStart | None = None,
) -> TapResult:
    """Let the finger fall from rest along -X, or from `start`, and tap the surface.

    Parameters
    ----------
    finger, surface, tip, drive : the scene, SI units.
    settings : numerical choices.
    progress : called now and then with (fraction of the run, what it is doing).
    start : rigid state to start from, its tip above the surface; None: at rest along -X at t = 0.

    Returns
    -------
    The result so far whatever the status: a run that fails or is interrupted keeps its history.

    Raises
    ------
    ParameterError
        The parts of the scene do not fit each other, the start lies below the surface, or the run
        would need more memory or steps than allowed.
    """
    check_scene(finger, surface, drive)
    check_size(finger, settings)
    started = time.perf_counter()
    scene = _Scene(finger, surface, tip, drive)
    model = _assemble(scene, settings, start)
    motion = build_motion(model.chain, model.q, model.v)
    if settings.flight == "rigid":
        begun = _start_after_flight(scene, settings, start, model, motion)
    else:
        step = _first_step(settings)
        consistent = settings.consistent_start
        begun = start_in_flight(
            model.start_s, step, consistent, motion, model.generalized_alpha, model.probe
        )
    segments, status = _take_steps(model, begun, motion, settings, progress)
    last, clock = segments[-1], segments[-1].clock
    events = tuple([event for segment in segments for event in segment.events])
    history = history_of(
        np.concatenate([segment.rows for segment in segments]),
        np.concatenate([segment.reactions for segment in segments]),
    )
    summary = summarize(history, events, last.imbalance_J / max(last.kinetic_J, model.roundoff_J))
    doubt = ""
    if status is Status.COMPLETED and begun.left_out > LARGEST_LEFT_OUT and events:
        status = Status.TOO_FLEXIBLE
        doubt = f"; bending and vibration may change the tap by up to {100 * begun.left_out:.2g} %"
    if status is Status.COMPLETED and settings.repeat:
        status, doubt = _repeated(scene, settings, progress, start, history, summary, events)
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
    frames = model.frames
    reached = (frames.time >= model.start_s) & (frames.time <= clock.time)
    return TapResult(
        status,
        _message(status, clock, statistics) + doubt,
        history,
        events,
        statistics,
        summary,
        postures(
            model.chain,
            [event.time_s for event in events],
            np.concatenate([segment.q for segment in segments]),
            np.concatenate([segment.v for segment in segments]),
        ),
        postures(model.chain, frames.time[reached].tolist(), frames.q[reached]),
    )


class _Scene(NamedTuple):
    finger: Finger
    surface: Surface
    tip: Tip
    drive: Drive


@dataclass(frozen=True)
class _Model:
    """A scene and its settings as the compiled loop takes them.

    integrator : that of the run, of which `generalized_alpha` is a part; undamped with xi = 1.
    q, v : (n,) bordered, where the run starts. iterations : Newton's between two looks at the
    clock. roundoff_J : energy that a finger at rest gathers by round-off.
    """

    chain: Chain
    probe: Probe
    generalized_alpha: Integrator
    integrator: AnyIntegrator
    undamped: AnyIntegrator
    plan: Plan
    frames: FrameTable
    start_s: float
    q: Floats
    v: Floats
    iterations: int
    roundoff_J: float


def _assemble(scene: _Scene, settings: Settings, start: RigidStart | None) -> _Model:
    finger, surface, tip, drive = scene
    chain, q = build_chain(finger, drive)
    v, start_s = np.zeros(q.size), 0.0
    if start is not None:
        q, v = rigid_motion(finger, chain, start)
        start_s = float(start.time_s)
        if (clearance := float(q[chain.tip + 1]) + surface.height) <= 0:
            raise ParameterError(
                f"start.angles = {start.angles!r}: put the tip {-clearance:.3g} m below the"
                " surface; it must start above it"
            )
    co = coefficients(settings.spectral_radius, settings.newton_tolerance, settings.reuse_factors)
    plain = Integrator(co, chain, contact_law(surface, tip), workspace(q.size))
    collocation = settings.flight_integrator == GAUSS
    integrator = with_collocation(plain) if collocation else plain
    times = np.array(settings.frame_times, dtype=float)
    frames = FrameTable(times, np.full((times.size, q.size), np.nan))
    frames.q[frames.time == start_s] = q
    return _Model(
        chain,
        build_probe(finger),
        plain,
        integrator,
        integrator._replace(co=coefficients(1.0, co.tolerance, co.reuse)),
        _plan(settings),
        frames,
        start_s,
        q,
        v,
        1 + UPDATES_A_CALL // (chain.first.size * (STAGES if collocation else 1)),
        # measured up to 1e-20 of E A L at 40 elements of E = 1e12 Pa and 3000 steps; a light finger
        # on a breeze of gravity moves with 1e-12
        1e-16 * sum(p.youngs_modulus * p.area * p.length for p in finger.phalanges),
    )


def _start_after_flight(
    scene: _Scene, settings: Settings, start: RigidStart | None, model: _Model, motion: Motion
) -> BeamStart:
    """Start at the end of a flight as rods, or where it started if it is interrupted."""
    integrator, probe, plan = model.generalized_alpha, model.probe, model.plan
    state = np.zeros(2 * len(scene.finger.phalanges))
    if start is not None:
        state[:] = *start.angles, *start.rates
    try:
        rods = build_rods(scene.finger, scene.surface, scene.drive)
        flight = integrate_flight(rods, state, model.start_s, plan, settings.max_steps)
        return start_after_flight(
            rods, flight, settings.consistent_start, plan, motion, integrator, probe, model.frames
        )
    except KeyboardInterrupt:
        # where an unfinished flight left the motion is no state
        motion = build_motion(model.chain, model.q, model.v)
        begun = start_in_flight(
            model.start_s, plan.flight_step, settings.consistent_start, motion, integrator, probe
        )
        return replace(begun, status=Status.INTERRUPTED)


def _take_steps(
    model: _Model, begun: BeamStart, motion: Motion, settings: Settings, progress: Progress | None
) -> tuple[list[Segment], Status]:
    """Call the compiled loop, which advances `motion`, until the run ends or is interrupted."""
    new = Motion(*[np.empty_like(part) for part in motion])
    segments, status, code = [begun.segment], begun.status, loop.RUNNING
    cost, most = model.generalized_alpha.work.cost, ITERATIONS_A_STEP * settings.max_steps
    try:
        while status is Status.COMPLETED and code == loop.RUNNING:
            last, spent = segments[-1], int(cost[0])
            size = min(TABLE_ROWS, settings.max_steps - last.steps)
            if size <= 0 or spent >= most:
                status = Status.WORK_LIMIT
                break
            plan = model.plan._replace(iterations=min(most, spent + model.iterations))
            record = empty_record(size, EVENT_ROWS, model.chain, model.frames)
            contact, clock, rows, events, code = loop.advance(
                motion, new, last.contact, last.clock, plan, model.integrator, model.undamped,
                model.probe, record,
            )  # fmt: skip
            first_row = begun.segment.rows[0]
            segments.append(
                next_segment(
                    last, first_row, Contact(*contact), Clock(*clock), rows, events, record
                )
            )
            last, status = segments[-1], _STATUS.get(code, Status.COMPLETED)
            # a NaN compares false and is no balance
            allowed = LARGEST_RESIDUAL * last.kinetic_J + model.roundoff_J
            balanced = last.imbalance_J <= allowed
            if status is Status.COMPLETED and not balanced:
                status = Status.UNBALANCED
            if progress is not None:
                progress(*_fraction(last.clock, last.contact, settings))
    except KeyboardInterrupt:
        status = Status.INTERRUPTED
    return segments, status


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


def _repeated(
    scene: _Scene, settings: Settings, progress: Progress | None, start: RigidStart | None,
    history: History, summary: Summary, events: tuple[Event, ...],
) -> tuple[Status, str]:  # fmt: skip
    """COMPLETED, or why a completed run can't be relied on, with what changes."""
    finger = scene.finger
    for factor in tolerance_factors(history, events, summary, finger.length):
        again = repetition_settings(settings, factor, summary, most_steps(finger))
        other = simulate(*scene, again, progress, start)
        if other.status is Status.INTERRUPTED:
            return Status.INTERRUPTED, " while it was repeated"
        what, share = largest_change(summary, other)
        if share > LARGEST_CHANGE:
            by = f" by {100 * share:.2g} %" if share < math.inf else ""
            return Status.UNREPEATABLE, f"; {factor:g} times the tolerances change {what}{by}"
    return Status.COMPLETED, ""


def _first_step(settings: Settings) -> float:
    """Half of the first step's loads are left out by a start from q.. = 0: keep it short."""
    if settings.consistent_start or settings.flight_tolerance == 0.0:
        return float(settings.flight_step)
    return float(min(settings.flight_step, settings.contact_step))


def _plan(settings: Settings) -> Plan:
    endless = settings.end_time is not None
    return Plan(
        float(settings.flight_step),
        float(settings.contact_step),
        np.iinfo(np.int64).max if endless else settings.taps,
        float(settings.end_time) if settings.end_time is not None else math.inf,
        float(settings.flight_tolerance),
        float(settings.contact_tolerance),
        math.inf if endless else float(settings.max_flight_time),
        float(settings.max_contact_time),
        undamped=settings.flight_tolerance > 0.0 and settings.flight_integrator != GAUSS,
    )


def _fraction(clock: Clock, contact: Contact, settings: Settings) -> tuple[float, str]:
    doing = "in flight" if contact.normal == FLIGHT else "in contact"
    label = f"{doing}, t = {clock.time:.4g} s"
    if settings.end_time is not None:
        return clock.time / settings.end_time, label
    return clock.taps / settings.taps, label
