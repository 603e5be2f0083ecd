"""Run the reduced model: from rest, through flight and contact, to separation or an end time."""

from __future__ import annotations

import math
import time
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from hcm import tap
from hcm.clock import Clock, Plan
from hcm.collocation import STAGES, with_collocation
from hcm.estimate import check_size, most_steps
from hcm.generalized_alpha import initial_acceleration
from hcm.integrator import Integrator, coefficients, motion, workspace
from hcm.layout import build_chain, build_probe, contact_law
from hcm.lumped_contact import FLIGHT, FREE, Contact
from hcm.parameters import (
    GAUSS,
    Drive,
    Finger,
    ParameterError,
    Settings,
    Surface,
    Tip,
    check_scene,
)
from hcm.posture import postures
from hcm.repeatable import LARGEST_CHANGE, change, factors, repetition
from hcm.result import (
    EVENT_KINDS,
    Event,
    Floats,
    History,
    Statistics,
    Status,
    Summary,
    TapResult,
)
from hcm.rigid_start import RigidStart, rigid_motion
from hcm.summary import summarize

Progress = Callable[[float, str], None]

# An energy residual beyond this share of the largest kinetic energy is no longer numerical damping:
# the run is not COMPLETED, whatever its forces look like.
LARGEST_RESIDUAL = 0.1
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
    speed, begin = np.zeros(n), 0.0
    if start is not None:
        rest, speed = rigid_motion(finger, chain, start)
        begin = float(start.time_s)
        if (clearance := float(rest[chain.tip + 1]) + surface.height) <= 0:
            raise ParameterError(
                f"start.angles = {start.angles!r}: put the tip {-clearance:.3g} m below the"
                " surface; it must start above it"
            )
    old, new = motion(chain, rest, speed), motion(chain, rest, speed)
    # what a finger at rest gathers by round-off: measured up to 1e-20 of E A L at 40 elements of
    # E = 1e12 Pa and 3000 steps; a light finger on a breeze of gravity moves with 1e-12
    roundoff_J = 1e-16 * float((chain.axial_stiffness * chain.length).sum())
    kinetic_J = 0.0
    work = workspace(n)
    contact = Contact(FLIGHT, FREE, 0.0, 0.0, 0.0, 0.0)
    clock = Clock(begin, begin, _first_step(settings), 0, 0, 0, 0, 0, 0.0, 0.0, 0.0, 0.0, 0.0)
    plan, most = _plan(settings), ITERATIONS_A_STEP * settings.max_steps
    co = coefficients(settings.spectral_radius, settings.newton_tolerance, settings.reuse_factors)
    plain = Integrator(co, chain, law, work)
    collocation = settings.flight_integrator == GAUSS
    integrator = with_collocation(plain) if collocation else plain
    updates = chain.first.size * (STAGES if collocation else 1)
    per_call = 1 + UPDATES_A_CALL // updates
    frames = tap.FrameTable(
        np.array(settings.frame_times, dtype=float),
        np.full((len(settings.frame_times), n), np.nan),
    )
    frames.q[frames.time == begin] = rest
    event_q: list[Floats] = [np.empty((0, n))]
    event_v: list[Floats] = [np.empty((0, n))]
    rows: list[Floats] = [np.zeros((1, len(tap.COLUMNS)))]
    reactions: list[Floats] = [np.zeros((1, 2 * phalanges))]
    events: list[Event] = []
    status = Status.COMPLETED
    if settings.consistent_start and not initial_acceleration(old, contact, plain):
        status = Status.NEWTON_FAILED
    tap.write_row(rows[0][0], reactions[0][0], old, clock, contact, plain, probe)
    steps, code = 0, tap.RUNNING
    while status is Status.COMPLETED and code == tap.RUNNING:
        size, spent = min(TABLE_ROWS, settings.max_steps - steps), int(work.cost[0])
        if size <= 0 or spent >= most:
            status = Status.WORK_LIMIT
            break
        plan = plan._replace(iterations=min(most, spent + per_call))
        table, forces = (
            np.empty((size, len(tap.COLUMNS))),
            np.empty((size, 2 * phalanges)),
        )
        table_of_events = tap.EventTable(
            np.empty(EVENT_ROWS),
            np.empty(EVENT_ROWS, dtype=np.int64),
            np.empty((EVENT_ROWS, n)),
            np.empty((EVENT_ROWS, n)),
        )
        try:
            contact, clock, n_rows, n_events, code = tap.advance(
                old, new, contact, clock, plan, integrator, probe,
                tap.Record(table, forces, table_of_events, frames),
            )  # fmt: skip
            rows.append(table[:n_rows].copy())
            reactions.append(forces[:n_rows].copy())
            event_q.append(table_of_events.q[:n_events].copy())
            event_v.append(table_of_events.v[:n_events].copy())
            events += [
                Event(float(table_of_events.time[i]), EVENT_KINDS[table_of_events.kind[i]])
                for i in range(n_events)
            ]
            steps += n_rows
            status = _STATUS.get(code, Status.COMPLETED)
            # the newest table alone, against the start: what is older has been looked at
            newest = _history(
                np.concatenate([rows[0], rows[-1]]),
                np.concatenate([reactions[0], reactions[-1]]),
                phalanges,
            )
            kinetic_J = max(kinetic_J, float(newest.kinetic_energy_J.max()))
            off = float(np.abs(newest.energy_balance_J).max())
            # a NaN compares false and is no balance either
            balanced = off <= LARGEST_RESIDUAL * kinetic_J + roundoff_J
            if status is Status.COMPLETED and not balanced:
                status = Status.UNBALANCED
            if progress is not None:
                progress(*_fraction(clock, contact, settings))
        except KeyboardInterrupt:
            status = Status.INTERRUPTED
    history = _history(np.concatenate(rows), np.concatenate(reactions), phalanges)
    summary = summarize(history, tuple(events), roundoff_J)
    sensitive = ""
    if status is Status.COMPLETED and settings.repeat:
        status, sensitive = _repeated(
            finger, surface, tip, drive, settings, progress, start, history, summary, tuple(events)
        )
    statistics = Statistics(
        steps=steps,
        newton_iterations=int(work.cost[0]),
        factorizations=int(work.cost[1]),
        rejected_steps=clock.rejected,
        event_trials=clock.trials,
        chatter_steps=clock.chatter_steps,
        wall_time_s=time.perf_counter() - started,
    )
    message = ""
    if status is not Status.COMPLETED:
        message = f"{status.value} at t = {clock.time:.9g} s after {steps} steps"
        if status is Status.WORK_LIMIT:
            message += (
                f" ({statistics.newton_iterations} iterations, {clock.rejected} repeated steps,"
                f" the last of {clock.step:.2g} s)"
            )
        message += sensitive
    reached = (frames.time >= begin) & (frames.time <= clock.time)
    return TapResult(
        status,
        message,
        history,
        tuple(events),
        statistics,
        summary,
        postures(
            chain, [e.time_s for e in events], np.concatenate(event_q), np.concatenate(event_v)
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
    )


def _fraction(clock: Clock, contact: Contact, settings: Settings) -> tuple[float, str]:
    doing = "in flight" if contact.normal == FLIGHT else "in contact"
    label = f"{doing}, t = {clock.time:.4g} s"
    if settings.end_time is not None:
        return clock.time / settings.end_time, label
    return clock.taps / settings.taps, label


def _history(table: Floats, reactions: NDArray[np.float64], phalanges: int) -> History:
    column = {name: table[:, i] for i, name in enumerate(tap.COLUMNS)}
    return History(
        time_s=column["time"],
        normal_force_N=column["normal_force"],
        tangential_force_N=column["tangential_force"],
        tip_position_m=table[:, 3:5],
        tip_velocity_m_per_s=table[:, 5:7],
        particle_velocity_m_per_s=column["particle_velocity"],
        stress_R_Pa=column["stress_R"],
        kinetic_energy_J=column["kinetic"],
        strain_energy_J=column["strain"],
        gravity_energy_J=column["gravity"],
        contact_energy_J=column["contact_energy"],
        friction_dissipation_J=column["friction_loss"],
        restitution_dissipation_J=column["restitution_loss"],
        drive_work_J=column["drive_work"],
        mode=column["mode"].astype(np.int8),
        hinge_reactions_N=reactions.reshape(-1, phalanges, 2),
    )
