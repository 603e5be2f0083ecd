"""The compiled loop: steps, events, and the record of both (paper, figs. 5 and 6).

A step is accepted whole or up to the first event in it; then the contact's mode and history change,
and nowhere else. The loop returns to Python when its tables are full, so that progress can be shown
and a run can be interrupted.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from hcm.arrays import Floats
from hcm.beam.chain import Probe
from hcm.compiled import kernel
from hcm.contact.events import LIFT_OFF, TOUCH, transition
from hcm.contact.law import (
    FLIGHT,
    Contact,
    PlainContact,
    contact_force,
    particle_velocity,
    plain_contact,
    stored_energy,
)
from hcm.energy import energies, stress_at_probe
from hcm.integrators.event_search import NO_EVENT
from hcm.integrators.generalized_alpha import change_step
from hcm.integrators.step import AnyIntegrator
from hcm.integrators.step_size import REPEATS, accept, event_tolerances
from hcm.state import Clock, Motion, Plan, account

# Why the loop came back.
RUNNING, DONE, NEWTON_FAILED, FLIGHT_TOO_LONG, CONTACT_TOO_LONG = 0, 1, 2, 3, 4

COLUMNS = (
    "time",
    "normal_force",
    "tangential_force",
    "tip_x",
    "tip_y",
    "tip_vx",
    "tip_vy",
    "particle_velocity",
    "stress_R",
    "kinetic",
    "strain",
    "gravity",
    "contact_energy",
    "friction_loss",
    "restitution_loss",
    "drive_work",
    "mode",
)
# After this many events without an advance in time, a whole step is taken in the current mode:
# chatter is then resolved to the step, and the loop always moves on.
INSTANT_EVENTS = 8


# The fields of a clock.
PlainClock = tuple[float, float, float, int, int, int, int, int, float, float, float, float, float]


class EventTable(NamedTuple):
    """Located events: time (m,) s, kind (m,), nodal coordinates q and their rates v (m, n)."""

    time: Floats
    kind: NDArray[np.int64]
    q: Floats
    v: Floats


class FrameTable(NamedTuple):
    """Times at which the posture is wanted, (m,) s in rising order, and the postures q (m, n)."""

    time: Floats
    q: Floats


class Record(NamedTuple):
    """What a call of `advance` fills.

    rows : (m, len(COLUMNS)), one an accepted step. reactions : (m, 2 P). events, frames.
    """

    rows: Floats
    reactions: Floats
    events: EventTable
    frames: FrameTable


@kernel
def write_row(
    row: Floats, reactions: Floats, motion: Motion, clock: Clock, contact: Contact,
    integrator: AnyIntegrator, probe: Probe,
) -> None:  # fmt: skip
    """Fill one row of the history (in the order of COLUMNS) and of the hinge reactions."""
    chain, law = integrator.chain, integrator.law
    q, v, tip = motion.q, motion.v, chain.tip
    x, gap = q[tip], q[tip + 1] + law.height
    ft, fn = contact_force(x, gap, contact, law)
    kinetic, strain, gravity = energies(q, v, chain)
    row[0], row[1], row[2] = clock.time, fn, ft
    row[3], row[4], row[5], row[6] = x, q[tip + 1], v[tip], v[tip + 1]
    row[7] = particle_velocity(v[tip], v[tip + 1], contact, law)
    row[8] = stress_at_probe(q, chain, probe)
    row[9], row[10], row[11] = kinetic, strain, gravity
    row[12] = stored_energy(x, gap, contact, law)
    row[13], row[14], row[15] = (clock.friction_loss, clock.restitution_loss, clock.drive_work)
    row[16] = 3 * contact.normal + contact.tangential
    for w in range(chain.hinge.size):
        for c in range(2):
            reactions[2 * w + c] = motion.acceleration[chain.hinge[w] + c]


@kernel
def hermite(s: float, h: float, q0: float, v0: float, q1: float, v1: float) -> float:
    """The cubic from (q0, v0) to (q1, v1), h later, at a share s of that time."""
    p, r = s * s * (3.0 - 2.0 * s), s * (1.0 - s)
    bend = (1.0 - s) * v0 - s * v1
    return (1.0 - p) * q0 + p * q1 + h * r * bend


@kernel
def fill_frames(clock: Clock, h: float, old: Motion, new: Motion, frames: FrameTable) -> None:
    """Interpolate q (cubic Hermite in q and v) at the wanted times inside an accepted step."""
    for m in range(frames.time.size):
        if frames.time[m] <= clock.time:
            continue
        # as the next step's search will see its start: a time between is in one of the two
        if frames.time[m] > clock.time + h:
            return
        s = min((frames.time[m] - clock.time) / h, 1.0)
        for i in range(old.q.size):
            frames.q[m, i] = hermite(s, h, old.q[i], old.v[i], new.q[i], new.v[i])


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


@kernel
def restart(motion: Motion, q: Floats, v: Floats) -> None:
    """Note the event's q and v (n,); the jerk jumps there, so a's delay behind q.. starts anew."""
    for i in range(q.size):
        q[i], v[i] = motion.q[i], motion.v[i]
        motion.a[i] = motion.acceleration[i]
        motion.jerk[i] = 0.0


@kernel
def advance(
    old: Motion,
    new: Motion,
    contact: Contact,
    clock: Clock,
    plan: Plan,
    integrator: AnyIntegrator,
    undamped: AnyIntegrator,
    probe: Probe,
    record: Record,
) -> tuple[Contact, Clock, int, int, int]:
    """Step on until the run ends, a table is full or `plan.iterations` are spent.

    `old` holds the state and is overwritten. `undamped` is the integrator with xi = 1, for flights
    after a tap if `plan.undamped`. Returns the contact, the clock, the number of rows and
    of events written, and why the loop came back.
    """
    chain, law, work = integrator.chain, integrator.law, integrator.work
    rows, reactions, events, frames = record
    n_rows, n_events = 0, 0
    while n_rows < rows.shape[0] and n_events < events.time.size and work.cost[0] < plan.iterations:
        in_flight = contact.normal == FLIGHT
        remaining = plan.end_time - clock.time
        if remaining <= 1e-12 * clock.time:
            return contact, clock, n_rows, n_events, DONE
        elapsed = clock.time - clock.phase_start
        if in_flight and elapsed > plan.max_flight_time:
            return contact, clock, n_rows, n_events, FLIGHT_TOO_LONG
        if not in_flight and elapsed > plan.max_contact_time:
            return contact, clock, n_rows, n_events, CONTACT_TOO_LONG
        h = min(clock.step, remaining)
        rebound = plan.undamped and in_flight and clock.taps > 0
        method = undamped if rebound else integrator
        tolerance = event_tolerances(contact, clock, plan, law)
        chatter = clock.instant >= INSTANT_EVENTS
        h, slot, trials, repeats, growth = accept(
            h, in_flight, rebound, chatter, clock.speed, tolerance, plan, contact, old, new, method
        )
        if repeats > REPEATS:
            return contact, clock, n_rows, n_events, NEWTON_FAILED
        if h > 0.0:
            fill_frames(clock, h, old, new, frames)
            clock = account(clock, h, old, new, chain, contact, law)
            copy_motion(new, old)
        tip = chain.tip
        x, gap = old.q[tip], old.q[tip + 1] + law.height
        phase_start, taps, instant = clock.phase_start, clock.taps, clock.instant
        next_step, kind = clock.step, NO_EVENT
        if slot == NO_EVENT and h > 0.0:
            longest = plan.flight_step if in_flight else plan.contact_step
            next_step = min(longest, growth * h)
            # xi = 1 delays nothing: a differs from q.. by round-off, which changes would multiply
            anew = rebound and next_step != h
            change_step(0.0 if anew else next_step / h, old)
        if slot != NO_EVENT:
            contact, kind = transition(slot, x, gap, old.v[tip], old.v[tip + 1], contact, law)
            events.time[n_events], events.kind[n_events] = clock.time, kind
            restart(old, events.q[n_events], events.v[n_events])
            n_events += 1
            instant += 1
            if kind in (TOUCH, LIFT_OFF):
                phase_start = clock.time
                next_step = plan.contact_step
            taps += int(kind == LIFT_OFF)
        elif contact.normal == FLIGHT and gap > 0.0 and contact.gap_ref < 0.0:
            contact = Contact(FLIGHT, contact.tangential, 0.0, 0.0, 0.0, x)
        clock = Clock(
            clock.time, phase_start, next_step, taps, instant,
            clock.rejected + repeats, clock.trials + trials, clock.chatter_steps + int(chatter),
            clock.friction_loss, clock.restitution_loss, clock.drive_work,
            clock.speed, clock.force,
        )  # fmt: skip
        if h > 0.0 or kind != NO_EVENT:
            write_row(rows[n_rows], reactions[n_rows], old, clock, contact, integrator, probe)
            n_rows += 1
        if kind == LIFT_OFF and taps >= plan.taps:
            return contact, clock, n_rows, n_events, DONE
    return contact, clock, n_rows, n_events, RUNNING


@kernel
def run(
    old: Motion,
    new: Motion,
    contact: Contact,
    clock: Clock,
    plan: Plan,
    integrator: AnyIntegrator,
    undamped: AnyIntegrator,
    probe: Probe,
    record: Record,
) -> tuple[PlainContact, PlainClock, int, int, int]:
    """`advance` for Python: the fields of contact and clock as plain tuples.

    Numba makes a named tuple by calling its class, where a pending interrupt is raised: two of them
    in one result are then a crash of the process, plain tuples a KeyboardInterrupt.
    """
    c, k, n_rows, n_events, code = advance(
        old, new, contact, clock, plan, integrator, undamped, probe, record
    )
    return (
        plain_contact(c),
        (
            k.time, k.phase_start, k.step, k.taps, k.instant, k.rejected, k.trials,
            k.chatter_steps, k.friction_loss, k.restitution_loss, k.drive_work, k.speed, k.force,
        ),
        n_rows, n_events, code,
    )  # fmt: skip
