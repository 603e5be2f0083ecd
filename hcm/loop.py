"""The compiled loop: steps, events, and the record of both (paper, figs. 5 and 6).

A step is accepted whole or up to the first event in it; only then do the contact's mode and history
change. The loop returns to Python when its tables are full, so that progress can be shown and a run
can be interrupted.
"""

import math

from hcm.arrays import Floats
from hcm.assembly.equations import depends_on_velocity
from hcm.assembly.state import LAST_STEP, Motion, RunTotals, StepLimits, advance_totals
from hcm.beam.outline import Outline, depth
from hcm.beam.probe import Probe
from hcm.compiled import ByKind, entry_with, inlined, kernel
from hcm.contact.contract import (
    begin_mode,
    commit_history,
    contact_position,
    contact_velocity,
    unrecovered_energy,
)
from hcm.contact.events import LIFT_OFF, TOUCH, transition
from hcm.contact.law import FLIGHT, FREE, STICK, ContactState, without_history
from hcm.integrators.event_search import NO_EVENT
from hcm.integrators.generalized_alpha import change_step
from hcm.integrators.step import AnyIntegrator, loss_of_step, with_coefficients
from hcm.integrators.step_size import REPEATS, accepted_step, event_tolerances
from hcm.integrators.workspace import trapezoidal
from hcm.results.record import Record, write_row
from hcm.results.stage_rows import (
    fill_frames,
    friction_of_step,
    rows_of_step,
    write_between,
)

# Why the loop returned.
RUNNING, DONE, NEWTON_FAILED, FLIGHT_TOO_LONG, CONTACT_TOO_LONG, BODY_TOUCHES = 0, 1, 2, 3, 4, 5
LOSES_HOLD = 6
# After this many events without an advance in time a whole step is taken in the current mode, so
# that the loop always moves on; chatter is then resolved to the step only. A tip that sticks is
# allowed one event more: held for a whole step it may transmit far more than mu F_n.
INSTANT_EVENTS = 8


@kernel
def copy_motion(source: Motion, target: Motion) -> None:
    """Overwrite `target` with `source`."""
    for i in range(source.q.size):
        target.q[i] = source.q[i]
        target.v[i] = source.v[i]
        target.acceleration[i] = source.acceleration[i]
        target.a[i] = source.a[i]
        target.jerk[i] = source.jerk[i]
    for e in range(source.chords.shape[0]):
        target.chords[e, 0] = source.chords[e, 0]
        target.chords[e, 1] = source.chords[e, 1]
    for t in range(source.drive.shape[1]):
        target.drive[0, t], target.drive[1, t] = source.drive[0, t], source.drive[1, t]


@kernel
def restart(motion: Motion, q: Floats, v: Floats) -> None:
    """Note the event's q and v (n,); the jerk jumps there, so a's delay behind q.. starts anew."""
    for i in range(q.size):
        q[i], v[i] = motion.q[i], motion.v[i]
        motion.a[i] = motion.acceleration[i]
        motion.jerk[i] = 0.0


@inlined
def limit_reached(in_flight: bool, totals: RunTotals, limits: StepLimits) -> int:
    """Why no further step may be taken; RUNNING: one may."""
    if limits.end_time - totals.time <= LAST_STEP * totals.time:
        return DONE
    elapsed = totals.time - totals.phase_start
    if in_flight:
        return FLIGHT_TOO_LONG if elapsed > limits.max_flight_time else RUNNING
    return CONTACT_TOO_LONG if elapsed > limits.max_contact_time else RUNNING


@entry_with("contract", nogil=True)  # so that the thread in `hcm.batch` can watch the parent
def advance(
    old: Motion, new: Motion, contact: ContactState, totals: RunTotals, limits: StepLimits,
    integrator: AnyIntegrator, probe: Probe, outline: Outline, record: Record,
) -> tuple[tuple[float, ...], tuple[float, ...], int, int, int]:  # fmt: skip
    """Step on until the run ends, a table is full or `limits.iterations` are spent.

    `old` holds the state and is overwritten. Returns the fields of the contact and of the totals,
    the number of rows and of events written, and why the loop returned.

    Fields, not named tuples: numba makes a named tuple by calling its class, where an interrupt
    that came while the loop ran is raised, and a result that holds two of them crashes the process.
    """
    co, chain, law, work = integrator.co, integrator.chain, integrator.law, integrator.work
    tip = chain.tip
    rows, reactions, events, frames = record
    n_rows, n_events, code = 0, 0, RUNNING
    full = rows.shape[0] - rows_of_step(integrator)
    while n_rows <= full and n_events < events.time.size and work.cost[0] < limits.iterations:
        in_flight = contact.normal_mode == FLIGHT
        code = limit_reached(in_flight, totals, limits)
        if code != RUNNING:
            break
        remaining = limits.end_time - totals.time
        h = last = min(totals.step, remaining)
        rebound = limits.undamped and in_flight and totals.taps > 0
        method = with_coefficients(trapezoidal(co) if rebound else co, integrator)
        tolerance = event_tolerances(contact, totals, limits, law)
        chatter = totals.instant >= INSTANT_EVENTS + int(contact.tangential_mode == STICK)
        h, slot, trials, repeats, growth = accepted_step(
            h, in_flight, rebound, chatter, totals.speed, tolerance, limits, contact, old, new,
            method,
        )  # fmt: skip
        if repeats > REPEATS:
            code = NEWTON_FAILED
            break
        if h > 0.0:
            fill_frames(h, contact, totals, old, new, method, frames)
            lost = 0.0
            if depends_on_velocity(chain, law):
                lost = loss_of_step(h, contact, old, new, method)
            n_rows += write_between(
                h, contact, totals, old, method, probe, rows[n_rows:], reactions[n_rows:]
            )
            friction = friction_of_step(totals.friction_loss, h, old, new, contact, method)
            totals = advance_totals(totals, h, friction, lost, old, new, chain, contact, law)
            copy_motion(new, old)
            commit_history(old.q, tip, contact, law)
        x, gap = contact_position(old.q, tip, contact, law)
        if math.isnan(gap):
            code = LOSES_HOLD
            break
        phase_start, taps, instant = totals.phase_start, totals.taps, totals.instant
        material_loss = totals.material_loss
        next_step, kind = totals.step, NO_EVENT
        # a step cut by the end says nothing about the next one
        if slot == NO_EVENT and h > 0.0 and not h == last == remaining:
            longest = limits.flight_step if in_flight else limits.contact_step
            next_step = min(longest, growth * h)
            # with xi = 1 a has no delay: it is q.. to round-off, which changes would multiply
            anew = rebound and next_step != h
            change_step(0.0 if anew else next_step / h, old)
        if slot != NO_EVENT:
            before, (vt, vn) = contact, contact_velocity(old.q, old.v, tip, contact, law)
            contact, kind = transition(slot, x, gap, vt, vn, contact, law)
            begin_mode(old.q, tip, before, contact, law)
            if math.isnan(contact_position(old.q, tip, contact, law)[1]):
                code, contact, kind = LOSES_HOLD, before, NO_EVENT
        if kind != NO_EVENT:
            events.time[n_events], events.kind[n_events] = totals.time, kind
            restart(old, events.q[n_events], events.v[n_events])
            n_events += 1
            instant += 1
            if kind in (TOUCH, LIFT_OFF):
                phase_start = totals.time
                next_step = limits.contact_step
            if kind == LIFT_OFF:
                taps += 1
                material_loss += unrecovered_energy(x, gap, before, law)
                _, lowest = contact_position(old.q, tip, contact, law)
                contact = without_history(FLIGHT, FREE, 0.0, min(contact.gap_ref, lowest), x)
        elif code == RUNNING and contact.normal_mode == FLIGHT and contact.gap_ref < 0.0 < gap:
            contact = without_history(FLIGHT, contact.tangential_mode, 0.0, 0.0, x)
        totals = RunTotals(
            time=totals.time, phase_start=phase_start, step=next_step, taps=taps, instant=instant,
            rejected=totals.rejected + repeats, trials=totals.trials + trials,
            chatter_steps=totals.chatter_steps + int(chatter),
            friction_loss=totals.friction_loss, restitution_loss=totals.restitution_loss,
            material_loss=material_loss, drive_work=totals.drive_work,
            speed=totals.speed, force=totals.force,
        )  # fmt: skip
        if h > 0.0 or kind != NO_EVENT:
            write_row(rows[n_rows], reactions[n_rows], old, totals, contact, integrator, probe)
            n_rows += 1
        if code == LOSES_HOLD:
            break
        if h > 0.0 and depth(old.q, chain, outline)[1] >= 0:
            code = BODY_TOUCHES
            break
        if kind in (TOUCH, LIFT_OFF) and taps >= limits.taps:
            code = DONE
            break
    return contact[:], totals[:], n_rows, n_events, code


# Its kind: the classes of the integrator and of its law.
advance_by_kind = ByKind(advance)
