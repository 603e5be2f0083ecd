"""Call the compiled loop until a run ends, its taps are over, or it is interrupted."""

import math
from collections.abc import Callable
from typing import NamedTuple

from hcm import loop
from hcm.assembly.state import LAST_STEP, Motion, RunTotals, StepLimits, empty_motion
from hcm.beam.drive import piece_at
from hcm.contact.law import FLIGHT, ContactState
from hcm.integrators.gauss_tableau import GaussIntegrator
from hcm.integrators.step import AnyIntegrator
from hcm.model import Model
from hcm.parameters import GAUSS, Settings
from hcm.results.record import Segment, empty_record, next_segment
from hcm.results.result import OtherEnd
from hcm.results.status import Status
from hcm.start import BeamStart, enter_piece
from hcm.taps.next_touch import next_touch_s
from hcm.taps.tap import taps_of

Progress = Callable[[float, str], None]

# An energy residual beyond this share of the largest kinetic energy, 2.5 % of a force, is no longer
# numerical damping: the run is not COMPLETED, whatever its forces look like. The article's steps of
# 1 ms lose 4 % on its driven fingers; of 144 random scenes at the defaults none lost over 0.1 %.
LARGEST_RESIDUAL = 0.05
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


class SteppingResult(NamedTuple):
    """History and end of a run's steps.

    over_s : times, s, when taps were found to be over. other_ends : near ends of the first tap.
    """

    segments: list[Segment]
    status: Status
    over_s: list[float]
    other_ends: list[OtherEnd]


def rows_between(settings: Settings) -> int:
    """Rows of a step in contact before that of its end: one per stage of collocation, or none."""
    return settings.stages if settings.contact_integrator == GAUSS else 0


def take_steps(model: Model, begun: BeamStart, progress: Progress | None) -> SteppingResult:
    """Call the compiled loop until the run ends or is interrupted."""
    over_s, other_ends = list[float](), list[OtherEnd]()
    status: Status = begun.status
    if status is not Status.COMPLETED:
        return SteppingResult([begun.segment], status, over_s, other_ends)
    settings, motion = model.settings, begun.motion
    new = empty_motion(model.chain)
    segments, code = [begun.segment], loop.RUNNING
    cost, most = model.generalized_alpha.work.cost, ITERATIONS_A_STEP * settings.max_steps
    between = rows_between(settings)
    stages = settings.stages if settings.flight_integrator == GAUSS else max(between, 1)
    per_call = 1 + UPDATES_A_CALL // (model.chain.first.size * stages)
    until = model.limits if model.tap_ends is None else model.limits._replace(taps=1)
    piece = piece_at(model.drive, begun.segment.totals.time)
    try:
        whole = integrator = model.integrator()
        kind = integrator.__class__, integrator.law.__class__
        while status is Status.COMPLETED and code == loop.RUNNING:
            last, spent = segments[-1], int(cost[0])
            size = min(TABLE_ROWS, settings.max_steps - last.steps)
            if size <= 0 or spent >= most:
                status = Status.WORK_LIMIT
                break
            following = piece_at(model.drive, last.totals.time)
            # whatever ended the last call there, a tap or a kink of the torques
            if following is not piece and not enter_piece(
                model, motion, last.contact, last.totals.time
            ):
                status = Status.NEWTON_FAILED
                break
            piece, over = following, following.end_s
            limits = until._replace(
                iterations=min(most, spent + per_call), end_time=min(until.end_time, over)
            )
            record = empty_record(size + between, EVENT_ROWS, model.chain, model.frames)
            contact, totals, rows, events, code = loop.advance_by_kind(
                kind, motion, new, last.contact, last.totals, limits, integrator, model.probe,
                model.outline, record,
            )  # fmt: skip
            first_row = begun.segment.rows[0]
            state, totals = ContactState(*contact), RunTotals(*totals)
            segments.append(next_segment(last, first_row, state, totals, rows, events, record))
            last = segments[-1]
            # a run of no taps is done as it touches, before it has tapped
            tapped = last.totals.taps >= limits.taps if limits.taps else state.normal_mode != FLIGHT
            kink = code == loop.DONE and over < until.end_time and not tapped
            if kink:
                code = loop.RUNNING
            status = _STATUS.get(code, Status.COMPLETED)
            # a NaN compares false: it counts as unbalanced
            allowed = LARGEST_RESIDUAL * last.kinetic_J + model.roundoff_J
            balanced = last.imbalance_J <= allowed
            # a kink may come so early that the finger hardly moves yet
            if status is Status.COMPLETED and not (balanced or kink):
                status = Status.UNBALANCED
            if code == loop.DONE and (
                further := _further(model, segments, motion, over_s, other_ends)
            ):
                until, code = further, loop.RUNNING
                integrator = whole if last.totals.time in over_s else _as_in_contact(whole)
            if progress is not None:
                progress(*_fraction(model, last))
    except KeyboardInterrupt:
        status = Status.INTERRUPTED
    return SteppingResult(segments, status, over_s, other_ends)


def _further(
    model: Model, segments: list[Segment], motion: Motion, over_s: list[float],
    other_ends: list[OtherEnd],
) -> StepLimits | None:  # fmt: skip
    """Limits to go on with after a stop to check whether the tap is over; None: the run is done.

    Between the touches of a tap the steps are those in contact: a flight's tolerance, relative to
    the surface's depth, may be a hundredth of an indentation.

    over_s : gets the time when a tap is over. other_ends : gets the near ends of the first tap.
    """
    rule, totals = model.tap_ends, segments[-1].totals
    if rule is None or model.limits.end_time - totals.time <= LAST_STEP * totals.time:
        return None
    taps = taps_of((event for s in segments for event in s.events), over_s)
    tap, check_s = taps[-1], math.inf
    if tap[1] < math.inf:
        check_s = rule.first_check_s(tap)
        if check_s - totals.time <= LAST_STEP * totals.time:
            law = model.generalized_alpha.law
            touch = next_touch_s(motion.q, motion.v, model.chain, law.height)
            if len(taps) == 1:
                tip_in_s = _tip_in_s(model, segments, motion)
                other_ends += rule.near_ends_when_checked(tap, totals.time, touch, tip_in_s)
            check_s = rule.next_check_s(tap, totals.time, touch)
        if check_s == math.inf:
            over_s.append(totals.time)
            if len(taps) >= model.limits.taps:
                return None
    limits = model.limits._replace(
        taps=totals.taps + 1, end_time=min(check_s, model.limits.end_time)
    )
    if check_s == math.inf:
        return limits
    return limits._replace(
        flight_step=min(limits.flight_step, limits.contact_step),
        flight_tolerance=min(limits.flight_tolerance, limits.contact_tolerance),
    )


def _as_in_contact(integrator: AnyIntegrator) -> AnyIntegrator:
    """The integrator with the method of contact in flight too."""
    if isinstance(integrator, GaussIntegrator):
        return integrator._replace(flight=integrator.contact)
    return integrator


def _tip_in_s(model: Model, segments: list[Segment], motion: Motion) -> float:
    """Time, s, until a tip at its present speed is back where it left the surface; inf: never.

    With restitution it left at a residual indentation, which the contact keeps.
    """
    down = model.chain.tip + 1
    left = next(q for s in reversed(segments) for q in s.q[::-1])[down]
    above, speed = motion.q[down] - left, -motion.v[down]
    return max(float(above / speed), 0.0) if speed > 0.0 else math.inf


def _fraction(model: Model, last: Segment) -> tuple[float, str]:
    doing = "in flight" if last.contact.normal_mode == FLIGHT else "in contact"
    time, end = last.totals.time, model.settings.end_time
    label = f"{doing}, t = {time:.4g} s"
    if end is None:
        return last.totals.taps / model.settings.taps, label
    # a run that starts at its end, or after it, is done
    return (time - model.start_s) / (end - model.start_s) if end > model.start_s else 1.0, label
