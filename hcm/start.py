"""Start the beams: in flight, or at the touch that ends a flight as rods or on fewer elements."""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from hcm.arrays import Floats
from hcm.assembly.equations import fill_chords
from hcm.assembly.state import Motion, RunTotals, build_motion, empty_motion, initial_totals
from hcm.beam.drive import Piece, piece_at, set_drive
from hcm.beam.outline import Outline, depth
from hcm.beam.probe import Probe
from hcm.compiled import ByKind, entry
from hcm.contact.contract import Law, begin_mode, contact_position, contact_velocity
from hcm.contact.events import NORMAL, transition
from hcm.contact.law import IN_FLIGHT, ContactState
from hcm.flight import rigid_chain, rigid_flight
from hcm.flight.fall import Fall
from hcm.flight.rigid_chain import Rods, acting_between, clearance
from hcm.flight.rigid_flight import BLOCKED, TOUCHED, RigidFlight, integrate_flight
from hcm.integrators.generalized_alpha import initial_acceleration
from hcm.integrators.workspace import Integrator
from hcm.model import Model, fill_rigid_motion
from hcm.parameters import Settings
from hcm.results.record import FrameTable, Segment, empty_rows, first_segment, hermite, write_row
from hcm.results.status import Status

_STATUS = {
    rigid_flight.TOUCHED: Status.COMPLETED,
    rigid_flight.ENDED: Status.COMPLETED,
    rigid_flight.FULL: Status.WORK_LIMIT,
    # no finite error, however often its steps are shortened: they are too long for the motion
    rigid_flight.FAILED: Status.UNBALANCED,
    rigid_flight.BLOCKED: Status.BODY_TOUCHES,
}


class BeamStart(NamedTuple):
    """What the beams start from.

    motion : their state, which the loop overwrites. segment : the history up to and including that
    moment. status : COMPLETED if they may go on, else why not. left_out : speed of the vibration
    that a rigid or modal flight may leave out, over the tip's speed of approach.
    """

    motion: Motion
    segment: Segment
    status: Status
    left_out: float = 0.0


@entry
def first_contact(motion: Motion, tip: int, law: Law) -> ContactState:
    """Contact at the end of the first flight."""
    x, gap = contact_position(motion.q, tip, IN_FLIGHT, law)
    vt, vn = contact_velocity(motion.q, motion.v, tip, IN_FLIGHT, law)
    contact, _ = transition(NORMAL, x, gap, vt, vn, IN_FLIGHT, law)
    begin_mode(motion.q, tip, IN_FLIGHT, contact, law)
    return contact


@entry
def write_first_row(
    row: Floats, reactions: Floats, consistent: bool, old: Motion, totals: RunTotals,
    contact: ContactState, integrator: Integrator, probe: Probe,
) -> bool:  # fmt: skip
    """Write the beams' first row; return whether their first acceleration could be found."""
    solved = initial_acceleration(old, contact, integrator) if consistent else True
    write_row(row, reactions, old, totals, contact, integrator, probe)
    return solved


def start_beams(
    model: Model, rods: tuple[Rods, tuple[Piece, ...]] | None = None, fall: Fall | None = None
) -> BeamStart:
    """Start the beams at once, or where a flight as rods ends (at its start if it is interrupted).

    rods : the rods and the torques on them. fall : their fall, if it is known.
    """
    if rods is None:
        return start_in_flight(model, _first_step(model.settings))
    acting, pieces = rods
    try:
        if fall is not None and fall.serves(model.limits):
            flight = fall.flight
        else:
            flight = integrate_flight(
                acting, model.angles, model.start_s, model.limits, model.settings.max_steps, pieces
            )
            acting = acting_between(acting, pieces, model.start_s, float(flight.time[-1]))
        return start_after_flight(model, acting, flight)
    except KeyboardInterrupt:
        begun = start_in_flight(model, model.limits.flight_step)
        return begun._replace(status=Status.INTERRUPTED)


def _first_step(settings: Settings) -> float:
    """Longest first step, s: short after a start from q.. = 0, which leaves out half its loads."""
    if settings.consistent_start or settings.flight_tolerance == 0.0:
        return float(settings.flight_step)
    return float(min(settings.flight_step, settings.contact_step))


def start_in_flight(model: Model, step: float) -> BeamStart:
    """Start from the model's own state, with a first step of at most `step`, s."""
    motion = build_motion(model.chain, model.q, model.v)
    totals = initial_totals(model.start_s, step)
    set_drive(model.start_s, piece_at(model.drive, model.start_s), motion.drive)
    rows, reactions = empty_rows(1, model.chain)
    solved = write_first_row(
        rows[0], reactions[0], model.settings.consistent_start, motion, totals, IN_FLIGHT,
        model.generalized_alpha, model.probe,
    )  # fmt: skip
    segment = first_segment(IN_FLIGHT, totals, rows, reactions, 0, motion)
    return BeamStart(motion, segment, Status.COMPLETED if solved else Status.NEWTON_FAILED)


def enter_piece(model: Model, motion: Motion, contact: ContactState, time_s: float) -> bool:
    """Go on after a kink of the drive, where the rate of q.. jumps, and q.. itself may jump.

    Returns whether q.. could be found.
    """
    set_drive(time_s, piece_at(model.drive, time_s), motion.drive)
    motion.jerk[:] = 0.0
    return bool(initial_acceleration(motion, contact, model.generalized_alpha))


def start_after_flight(model: Model, rods: Rods, flight: RigidFlight) -> BeamStart:
    """Write the history of a rigid flight and start at its end, or where a body touches."""
    motion, end = empty_motion(model.chain), float(flight.time[-1])
    set_drive(end, piece_at(model.drive, end), motion.drive)
    # one row more: where the beams take over, forces jump from the rods' to theirs
    rows, reactions = empty_rows(flight.time.size + 1, model.chain)
    kind = model.generalized_alpha.law.__class__, flight.states.flags.c_contiguous
    contact, totals, steps, code, solved, left_out = write_flight_by_kind(
        kind, flight, model.limits.contact_step, model.settings.consistent_start, rods, motion,
        model.generalized_alpha, model.probe, model.outline, rows, reactions, model.frames,
    )  # fmt: skip
    at, rows, reactions = RunTotals(*totals), rows[: steps + 2], reactions[: steps + 2]
    if code == BLOCKED:
        set_drive(at.time, piece_at(model.drive, at.time), motion.drive)
        solved = write_first_row(
            rows[-1], reactions[-1], model.settings.consistent_start, motion, at, IN_FLIGHT,
            model.generalized_alpha, model.probe,
        )  # fmt: skip
    segment = first_segment(ContactState(*contact), at, rows, reactions, steps, motion)
    return BeamStart(motion, segment, _STATUS[code] if solved else Status.NEWTON_FAILED, left_out)


class Flown(NamedTuple):
    """A flight on elements of its own: their model, history and last state, how it ended, and what
    it leaves out (`BeamStart`).
    """

    model: Model
    segments: list[Segment]
    motion: Motion
    status: Status
    left_out: float = 0.0


def start_divided(model: Model, flown: Flown, divide: Callable[[Floats], Floats]) -> BeamStart:
    """Start where a flight on fewer elements ended.

    divide : converts coordinates or velocities (m, n) on them to those on the model's elements.
    """
    flight, segments, motion, status, left_out = flown
    last, start = segments[-1], empty_motion(model.chain)
    start.q[:], start.v[:] = divide(np.array([motion.q, motion.v]))
    fill_chords(start.q, model.chain, start.chords)
    set_drive(last.totals.time, piece_at(model.drive, last.totals.time), start.drive)
    if flight.frames.time.size:
        reached = ~np.isnan(flight.frames.q[:, 0])
        model.frames.q[reached] = divide(flight.frames.q[reached])
    model.generalized_alpha.work.cost[:] += flight.generalized_alpha.work.cost
    # one row more: the division admits waves that the few elements could not have
    row, reaction = empty_rows(1, model.chain)
    rows = np.concatenate([*[s.rows for s in segments], row])
    reactions = np.concatenate([*[s.reactions for s in segments], reaction])
    contact = last.contact
    if last.events:
        contact = first_contact(start, model.chain.tip, model.generalized_alpha.law)
    solved = write_first_row(
        rows[-1], reactions[-1], True, start, last.totals, contact, model.generalized_alpha,
        model.probe,
    )  # fmt: skip
    segment = first_segment(contact, last.totals, rows, reactions, last.steps, start)
    return BeamStart(start, segment, status if solved else Status.NEWTON_FAILED, left_out)


@entry
def write_flight(
    flight: RigidFlight, step: float, consistent: bool, rods: Rods, old: Motion,
    integrator: Integrator, probe: Probe, outline: Outline, rows: Floats, reactions: Floats,
    frames: FrameTable,
) -> tuple[tuple[float, ...], tuple[float, ...], int, int, bool, float]:  # fmt: skip
    """Fill the rows, the hinges' reactions and the frames of a rigid flight.

    The last row is the beams' own, at the time of the one before; `step`, s, is their first. A
    flight ends, BLOCKED, where the body is below the surface first; the last row is then left to
    the caller, as `old` has the drive at the end of the whole flight. Returns the fields of the
    contact and of the totals there, the steps to it, how the flight ended, whether the beams' first
    acceleration could be found, and the largest speed that rods leave out, over the tip's approach.
    """
    beams, law = integrator.chain, integrator.law
    time, states = flight.time, flight.states
    links, tip, frame, code = rods.length.size, beams.tip, 0, flight.code
    contact, totals, fastest, left_out = IN_FLIGHT, initial_totals(time[0], step), 0.0, 0.0
    for m in range(time.size):
        if m > 0:
            h = time[m] - time[m - 1]
            while frame < frames.time.size and frames.time[frame] <= time[m]:
                if frames.time[frame] > time[m - 1]:
                    s = (frames.time[frame] - time[m - 1]) / h
                    before, after = states[m - 1], states[m]
                    for w in range(links):
                        rods.between[w] = hermite(
                            s, h, before[w], before[links + w], after[w], after[links + w]
                        )
                    frames.q[frame, :] = 0.0
                    fill_rigid_motion(rods.between, rods.length, beams, frames.q[frame], old.v)
                frame += 1
        fill_rigid_motion(states[m], rods.length, beams, old.q, old.v)
        fill_chords(old.q, beams, old.chords)
        speed, _ = rigid_chain.reactions(states[m], flight.accelerations[m], rods, reactions[m])
        left_out = max(left_out, speed)
        work = 0.0
        for w in range(links):
            old.acceleration[beams.hinge[w]] = reactions[m, 2 * w]
            old.acceleration[beams.hinge[w] + 1] = reactions[m, 2 * w + 1]
            work += flight.torques[m, w] * (states[m, w] - states[0, w])
        work -= flight.torque_change_work[m]
        fastest = max(fastest, abs(old.v[tip]) + abs(old.v[tip + 1]))
        totals = RunTotals(
            time=time[m], phase_start=time[0], step=step, taps=0, instant=0,
            rejected=flight.repeats, trials=flight.trials, chatter_steps=0,
            friction_loss=0.0, restitution_loss=0.0, material_loss=0.0, drive_work=work,
            speed=fastest, force=0.0,
        )  # fmt: skip
        write_row(rows[m], reactions[m], old, totals, contact, integrator, probe)
        if depth(old.q, beams, outline)[1] >= 0:
            code = BLOCKED
            break
    if code == TOUCHED:
        contact = first_contact(old, tip, law)
        totals = RunTotals(totals.time, totals.time, *totals[2:])
    old.acceleration[:] = 0.0
    solved = code == BLOCKED or write_first_row(
        rows[m + 1], reactions[m + 1], consistent, old, totals, contact, integrator, probe
    )
    approach = abs(clearance(states[m], rods)[1])
    return contact[:], totals[:], m, code, solved, left_out / max(approach, 1e-300)


# Its kind: the law's class, and whether the rows of the flight are contiguous in memory.
write_flight_by_kind = ByKind(write_flight)
