"""Run the reduced model: from rest, through flight and contact, to separation or an end time."""

from __future__ import annotations

import math
import time
from collections.abc import Callable

import numpy as np

from hcm import loop as tap
from hcm.beam.chain import build_chain, build_probe
from hcm.contact.law import FLIGHT, Contact, contact_law
from hcm.flight import rigid_flight
from hcm.flight.rigid_chain import rods
from hcm.flight.rigid_flight import TOUCHED, fly
from hcm.integrators.gauss_tableau import STAGES, with_collocation
from hcm.integrators.workspace import Integrator, coefficients, workspace
from hcm.parameters import GAUSS, Drive, Finger, ParameterError, Settings, Surface, Tip, check_scene
from hcm.piece import first_piece, next_piece
from hcm.posture import postures
from hcm.result import Event, History, Statistics, Status, Summary, TapResult, history_of
from hcm.rigid_start import RigidStart, rigid_motion
from hcm.sensitivity import LARGEST_CHANGE, change, factors, repetition
from hcm.start import after_flight, at_once
from hcm.state import Clock, Motion, Plan, motion
from hcm.summary import summarize
from hcm.workload import check_size, most_steps

Progress = Callable[[float, str], None]

# An energy residual beyond this share of the largest kinetic energy is no longer numerical damping:
# the run is not COMPLETED, whatever its forces look like.
LARGEST_RESIDUAL = 0.1
# What a rigid flight leaves out may change the tap by this share; the estimate is that of
# `rigid_chain.reactions`, 8 to 200 times the change (measured on 9 scenes with steady flights).
LARGEST_LEFT_OUT = 0.01
TABLE_ROWS = 4096
# Newton iterations allowed per step of `max_steps`, those of event searches and of repeated steps
# included: a smooth motion takes 2 to 4.
ITERATIONS_A_STEP = 20
# Iterations times elements between two looks at the clock, about a second: progress is shown, and
# an interrupt obeyed, that often.
UPDATES_A_CALL = 4_000_000
EVENT_ROWS = 256

_STATUS = {
    tap.DONE: Status.COMPLETED,
    tap.NEWTON_FAILED: Status.NEWTON_FAILED,
    tap.FLIGHT_TOO_LONG: Status.NOT_REACHED,
    tap.CONTACT_TOO_LONG: Status.STILL_IN_CONTACT,
}

_FALL = {
    rigid_flight.TOUCHED: Status.COMPLETED,
    rigid_flight.ENDED: Status.COMPLETED,
    rigid_flight.FULL: Status.WORK_LIMIT,
    # only steps too long for the motion give no finite error however often they are shortened
    rigid_flight.FAILED: Status.UNBALANCED,
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
    chain, rest = build_chain(finger, drive)
    law, probe = contact_law(surface, tip), build_probe(finger)
    n, phalanges = rest.size, len(finger.phalanges)
    speed = np.zeros(n)
    if start is not None:
        rest, speed = rigid_motion(finger, chain, start)
        if (clearance := float(rest[chain.tip + 1]) + surface.height) <= 0:
            raise ParameterError(
                f"start.angles = {start.angles!r}: put the tip {-clearance:.3g} m below the"
                " surface; it must start above it"
            )
    begin = 0.0 if start is None else float(start.time_s)
    old = motion(chain, rest, speed)
    new = Motion(*[np.empty_like(part) for part in old])
    # what a finger at rest gathers by round-off: measured up to 1e-20 of E A L at 40 elements of
    # E = 1e12 Pa and 3000 steps; a light finger on a breeze of gravity moves with 1e-12
    roundoff_J = 1e-16 * sum(p.youngs_modulus * p.area * p.length for p in finger.phalanges)
    work = workspace(n)
    plan, most = _plan(settings), ITERATIONS_A_STEP * settings.max_steps
    co = coefficients(settings.spectral_radius, settings.newton_tolerance, settings.reuse_factors)
    plain = Integrator(co, chain, law, work)
    collocation = settings.flight_integrator == GAUSS
    integrator = with_collocation(plain) if collocation else plain
    undamped = integrator._replace(co=coefficients(1.0, co.tolerance, co.reuse))
    updates = chain.first.size * (STAGES if collocation else 1)
    per_call = 1 + UPDATES_A_CALL // updates
    frames = tap.FrameTable(
        np.array(settings.frame_times, dtype=float), np.empty((len(settings.frame_times), n))
    )
    if settings.frame_times:
        frames.q[:] = np.nan
        frames.q[frames.time == begin] = rest
    status, code = Status.COMPLETED, tap.RUNNING
    steps, at_touch = 0, False
    consistent = settings.consistent_start
    if settings.flight == "rigid":
        links = rods(finger, surface, drive)
        try:
            fall = fly(links, start, plan, settings.max_steps)
            begun = after_flight(links, fall, consistent, plan, old, plain, probe, frames)
            steps, status = fall.time.size - 1, _FALL[fall.code]
            at_touch = fall.code == TOUCHED
        except KeyboardInterrupt:
            old = motion(chain, rest, speed)  # where an unfinished flight left it is no state
            begun = at_once(begin, plan.flight_step, consistent, old, plain, probe)
            steps, at_touch, status = 0, False, Status.INTERRUPTED
    else:
        begun = at_once(begin, _first_step(settings), consistent, old, plain, probe)
    if not begun.solved:
        status = Status.NEWTON_FAILED
    pieces = [first_piece(begun, steps, at_touch, old)]
    try:
        while status is Status.COMPLETED and code == tap.RUNNING:
            last, spent = pieces[-1], int(work.cost[0])
            size = min(TABLE_ROWS, settings.max_steps - last.steps)
            if size <= 0 or spent >= most:
                status = Status.WORK_LIMIT
                break
            plan = plan._replace(iterations=min(most, spent + per_call))
            record = tap.Record(
                np.empty((size, len(tap.COLUMNS))),
                np.empty((size, 2 * phalanges)),
                tap.EventTable(
                    np.empty(EVENT_ROWS),
                    np.empty(EVENT_ROWS, dtype=np.int64),
                    np.empty((EVENT_ROWS, n)),
                    np.empty((EVENT_ROWS, n)),
                ),
                frames,
            )
            mode, counted, n_rows, n_events, code = tap.run(
                old, new, last.contact, last.clock, plan, integrator, undamped, probe, record
            )
            pieces.append(next_piece(last, begun.rows[0], mode, counted, n_rows, n_events, record))
            last, status = pieces[-1], _STATUS.get(code, Status.COMPLETED)
            # a NaN compares false and is no balance
            balanced = last.imbalance_J <= LARGEST_RESIDUAL * last.kinetic_J + roundoff_J
            if status is Status.COMPLETED and not balanced:
                status = Status.UNBALANCED
            if progress is not None:
                progress(*_fraction(last.clock, last.contact, settings))
    except KeyboardInterrupt:
        status = Status.INTERRUPTED
    last, clock = pieces[-1], pieces[-1].clock
    events = tuple([event for piece in pieces for event in piece.events])
    history = history_of(
        np.concatenate([piece.rows for piece in pieces]),
        np.concatenate([piece.reactions for piece in pieces]),
    )
    summary = summarize(history, events, last.imbalance_J / max(last.kinetic_J, roundoff_J))
    doubt = ""
    if status is Status.COMPLETED and begun.left_out > LARGEST_LEFT_OUT and events:
        status = Status.TOO_FLEXIBLE
        doubt = f"; bending and vibration may change the tap by up to {100 * begun.left_out:.2g} %"
    if status is Status.COMPLETED and settings.repeat:
        status, doubt = _repeated(
            finger, surface, tip, drive, settings, progress, start, history, summary, events
        )
    statistics = Statistics(
        steps=last.steps,
        newton_iterations=int(work.cost[0]),
        factorizations=int(work.cost[1]),
        rejected_steps=clock.rejected,
        event_trials=clock.trials,
        chatter_steps=clock.chatter_steps,
        wall_time_s=time.perf_counter() - started,
    )
    message = ""
    if status is not Status.COMPLETED:
        message = f"{status.value} at t = {clock.time:.9g} s after {last.steps} steps"
        if status is Status.WORK_LIMIT:
            message += (
                f" ({statistics.newton_iterations} iterations, {clock.rejected} repeated steps,"
                f" the last of {clock.step:.2g} s)"
            )
        message += doubt
    reached = (frames.time >= begin) & (frames.time <= clock.time)
    return TapResult(
        status,
        message,
        history,
        events,
        statistics,
        summary,
        postures(
            chain,
            [event.time_s for event in events],
            np.concatenate([piece.q for piece in pieces]),
            np.concatenate([piece.v for piece in pieces]),
        ),
        postures(chain, frames.time[reached].tolist(), frames.q[reached]),
    )


def _repeated(
    finger: Finger, surface: Surface, tip: Tip, drive: Drive, settings: Settings,
    progress: Progress | None, start: RigidStart | None, history: History, summary: Summary,
    events: tuple[Event, ...],
) -> tuple[Status, str]:  # fmt: skip
    """COMPLETED, or why a completed run can't be relied on, with what changes."""
    for tolerances in factors(history, events, summary, finger.length):
        again = repetition(settings, tolerances, summary, most_steps(finger))
        other = simulate(finger, surface, tip, drive, again, progress, start)
        if other.status is Status.INTERRUPTED:
            return Status.INTERRUPTED, " while it was repeated"
        what, share = change(summary, other)
        if share > LARGEST_CHANGE:
            by = f" by {100 * share:.2g} %" if share < math.inf else ""
            return Status.UNREPEATABLE, f"; {tolerances:g} times the tolerances change {what}{by}"
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
