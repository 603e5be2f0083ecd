"""What a step of collocation in contact knows between its ends: events, losses and rows by stages.

The stages hold the step's motion to order s + 1 at c_i h. An event lies where its function first
changes sign from one of them to the next (an end of the step among them), and is located there by
the cubic through four of them and the secant method, a trial being a step of that length. What a
sliding tip loses is a quadrature of F_t V_P, of the stages' order.
"""

import math

from hcm.arrays import Floats
from hcm.beam.chain import Probe
from hcm.beam.equations import dissipation
from hcm.compiled import by_type, kernel
from hcm.contact.contract import (
    contact_force,
    friction_loss,
    particle_velocity,
    place,
    velocity,
)
from hcm.contact.events import SlotValues
from hcm.contact.law import FLIGHT, SLIP, Contact
from hcm.integrators import event_search
from hcm.integrators.event_search import NO_EVENT, NOISE, TIME_RESOLUTION, values_at
from hcm.integrators.gauss import step
from hcm.integrators.gauss_tableau import GaussIntegrator
from hcm.integrators.step import AnyIntegrator
from hcm.record import write_row
from hcm.state import Clock, Motion, advance_clock

TRIALS = 60
HALVINGS = 50


@kernel
def stage_motion(i: int, old: Motion, integrator: GaussIntegrator) -> Motion:
    """The motion at stage i of the latest step, which began at `old`."""
    gauss = integrator.gauss
    a = gauss.stage[i]
    return Motion(gauss.q[i], gauss.v[i], a, a, gauss.chords[i], a, old.drive)


@kernel
def point(
    p: int, h: float, contact: Contact, old: Motion, new: Motion, integrator: GaussIntegrator
) -> tuple[float, SlotValues]:
    """Time since the step's start, s, and event functions: p = 0 its start, s + 1 its end."""
    if p == 0:
        return 0.0, values_at(old, contact, integrator)
    c = integrator.tableau.c
    if p == c.size + 1:
        return h, values_at(new, contact, integrator)
    stage = stage_motion(p - 1, old, integrator)
    return c[p - 1] * h, values_at(stage, contact, integrator)


@kernel
def first_passed(
    h: float, found: int, tolerance: SlotValues, contact: Contact, old: Motion, new: Motion,
    integrator: GaussIntegrator,
) -> tuple[int, int]:  # fmt: skip
    """The slot that is passed first, `found` left out, and the point that is past it."""
    begin, before = point(0, h, contact, old, new, integrator)
    for p in range(1, integrator.tableau.c.size + 2):
        time, values = point(p, h, contact, old, new, integrator)
        slot, earliest = NO_EVENT, math.inf
        for k in range(3):
            if k == found or not values[k] < -tolerance[k]:
                continue
            at = begin + (time - begin) * max(before[k], 0.0) / (max(before[k], 0.0) - values[k])
            if at < earliest:
                slot, earliest = k, at
        if slot != NO_EVENT:
            return slot, p
        begin, before = time, values
    return NO_EVENT, 0


@kernel
def cubic_root(
    low: float, high: float, t: tuple[float, float, float, float],
    g: tuple[float, float, float, float],
) -> tuple[float, float]:  # fmt: skip
    """Where the cubic through (t_i, g_i) falls through zero in [low, high], and its slope there."""
    a = (g[1] - g[0]) / (t[1] - t[0])
    b, c = (g[2] - g[1]) / (t[2] - t[1]), (g[3] - g[2]) / (t[3] - t[2])
    d, e = (b - a) / (t[2] - t[0]), (c - b) / (t[3] - t[1])
    f = (e - d) / (t[3] - t[0])
    middle, left = 0.5 * (low + high), 0.5 * (high - low)
    for _ in range(HALVINGS):
        u = middle - t[0]
        left *= 0.5
        value = g[0] + u * (a + (middle - t[1]) * (d + (middle - t[2]) * f))
        middle += left if value > 0.0 else -left
    u, v, w = middle - t[0], middle - t[1], middle - t[2]
    return middle, a + d * (u + v) + f * (u * v + u * w + v * w)


@kernel
def narrow(
    slot: int, after: int, h: float, tolerance: float, contact: Contact, old: Motion, new: Motion,
    integrator: GaussIntegrator,
) -> tuple[float, int]:  # fmt: skip
    """Length of the step that ends just past the slot's zero, which point `after` is the first
    past, `new` being that step; NaN where a trial fails. And the trials used.
    """
    last = integrator.tableau.c.size + 1
    first = min(max(after - 2, 0), last - 3)
    t0, v0 = point(first, h, contact, old, new, integrator)
    t1, v1 = point(first + 1, h, contact, old, new, integrator)
    t2, v2 = point(first + 2, h, contact, old, new, integrator)
    t3, v3 = point(first + 3, h, contact, old, new, integrator)
    times, values = (t0, t1, t2, t3), (v0[slot], v1[slot], v2[slot], v3[slot])
    at = after - first
    time, slope = cubic_root(times[at - 1], times[at], times, values)
    # stages are known less well than ends: the zero may lie beyond them
    low, high = times[max(at - 2, 0)], times[min(at + 1, 3)]
    share = max(1e-14, NOISE * integrator.co.tolerance) * h
    before, g_before = math.nan, math.nan
    for trials in range(1, TRIALS + 1):
        if not step(time, contact, old, new, integrator):
            return math.nan, trials
        g = values_at(new, contact, integrator)[slot]
        if g <= 0.0 and -g <= max(tolerance, share * abs(slope)):
            return time, trials
        low, high = (time, high) if g > 0.0 else (low, time)
        if high - low <= TIME_RESOLUTION:
            break
        if trials > 1:
            slope = (g - g_before) / (time - before)
        before, g_before = time, g
        # just past it: the middle of what counts as there
        time = time - g / slope + 0.5 * share if slope != 0.0 else math.nan
        if not low < time < high or trials % 8 == 7:
            time = 0.5 * (low + high)
    return (high, TRIALS) if step(high, contact, old, new, integrator) else (math.nan, TRIALS)


@kernel
def first_event(
    h: float, tolerance: SlotValues, contact: Contact, old: Motion, new: Motion,
    integrator: GaussIntegrator,
) -> tuple[float, int, int]:  # fmt: skip
    """`event_search.first_event`, by the stages where they are those of a contact."""
    if contact.normal == FLIGHT or not integrator.contact:
        return event_search.first_event(h, tolerance, contact, old, new, integrator)
    found, total = NO_EVENT, 0
    for _ in range(4):
        slot, after = first_passed(h, found, tolerance, contact, old, new, integrator)
        if slot == NO_EVENT:
            break
        start = values_at(old, contact, integrator)[slot]
        if after == 1 and start <= tolerance[slot]:  # it has just fired, or fires at once
            high, values = point(1, h, contact, old, new, integrator)
            event, trials = event_search.locate(
                slot, high, start, values[slot], tolerance[slot], contact, old, new, integrator
            )
            if event > 0.0 and not step(event, contact, old, new, integrator):
                event = math.nan
        else:
            event, trials = narrow(slot, after, h, tolerance[slot], contact, old, new, integrator)
        total += trials
        if not event > 0.0:
            return event, slot, total
        h, found = event, slot
    return h, found, total


@kernel
def friction_power(motion: Motion, contact: Contact, integrator: GaussIntegrator) -> float:
    """-F_t V_P, W."""
    tip, law = integrator.chain.tip, integrator.law
    x, gap = place(motion.q, tip, contact, law)
    vt, vn = velocity(motion.q, motion.v, tip, contact, law)
    return -contact_force(x, gap, contact, law)[0] * particle_velocity(gap, vt, vn, contact, law)


@kernel
def plain_friction(
    loss: float, h: float, old: Motion, new: Motion, contact: Contact, integrator: AnyIntegrator
) -> float:
    """`loss` and the step's own, J, as the law has it."""
    tip, law = integrator.chain.tip, integrator.law
    x0, y0 = place(old.q, tip, contact, law)
    x1, y1 = place(new.q, tip, contact, law)
    return friction_loss(loss, x0, y0, x1, y1, contact, law)


@kernel
def stage_friction(
    loss: float, h: float, old: Motion, new: Motion, contact: Contact, integrator: GaussIntegrator
) -> float:
    """The same by the stages of a tip that slides."""
    if not integrator.contact or contact.tangential != SLIP:
        return plain_friction(loss, h, old, new, contact, integrator)
    for i in range(integrator.tableau.b.size):
        stage = stage_motion(i, old, integrator)
        loss += h * integrator.tableau.b[i] * friction_power(stage, contact, integrator)
    return loss


@kernel
def no_stages(
    h: float, contact: Contact, clock: Clock, old: Motion, integrator: AnyIntegrator, probe: Probe,
    rows: Floats, reactions: Floats,
) -> int:  # fmt: skip
    """A step without stages writes none."""
    return 0


@kernel
def write_stages(
    h: float, contact: Contact, clock: Clock, old: Motion, integrator: GaussIntegrator,
    probe: Probe, rows: Floats, reactions: Floats,
) -> int:  # fmt: skip
    """Write a row for each stage of an accepted step in contact; returns how many."""
    chain, law, table = integrator.chain, integrator.law, integrator.tableau
    if contact.normal == FLIGHT or not integrator.contact:
        return 0
    slides, gauss = contact.tangential == SLIP, integrator.gauss
    power = gauss.change
    for j in range(table.c.size):
        stage = stage_motion(j, old, integrator)
        power[0, j] = friction_power(stage, contact, integrator) if slides else 0.0
        power[1, j] = 0.0
        if chain.damped:
            power[1, j] = dissipation(stage.q, stage.chords, stage.q, stage.chords, stage.v, chain)
    for i in range(table.c.size):
        stage = stage_motion(i, old, integrator)
        friction, lost = clock.friction_loss, 0.0
        if not slides:
            friction = plain_friction(friction, h, old, stage, contact, integrator)
        for j in range(table.c.size):
            friction += h * table.whole[i, j] * power[0, j]
            lost += h * table.whole[i, j] * power[1, j]
        at = advance_clock(clock, table.c[i] * h, friction, lost, old, stage, chain, contact, law)
        write_row(rows[i], reactions[i], stage, at, contact, integrator, probe)
    return int(table.c.size)


@kernel
def one_row(integrator: AnyIntegrator) -> int:
    """Most rows of a step."""
    return 1


@kernel
def stage_rows(integrator: GaussIntegrator) -> int:
    """The same, with a row a stage."""
    return integrator.tableau.c.size + 1 if integrator.contact else 1


find_event = by_type(GaussIntegrator, first_event, event_search.first_event)
friction_of_step = by_type(GaussIntegrator, stage_friction, plain_friction)
write_between = by_type(GaussIntegrator, write_stages, no_stages)
rows_of_step = by_type(GaussIntegrator, stage_rows, one_row)
