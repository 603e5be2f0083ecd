"""Events in a step of collocation, from its stages: in contact, and in flight if it does both.

The stages hold the step's motion to order s + 1 at c_i h. An event lies where its function first
changes sign from one of them to the next (the step's ends included). It is located there on the
step's own polynomial, which then ends with it: this takes no trial step, and the factors stay those
of whole steps. Only for a function that starts at zero and is past it at the first stage are there
trial steps.
"""

import math

from hcm.arrays import Floats
from hcm.assembly.equations import move_chords
from hcm.assembly.state import Motion
from hcm.compiled import by_type, kernel
from hcm.contact.events import SlotValues
from hcm.contact.law import FLIGHT, ContactState
from hcm.integrators import event_search
from hcm.integrators.event_search import NO_EVENT, values_and_rates, values_at
from hcm.integrators.gauss import accelerate, move_velocities
from hcm.integrators.gauss_systems import combine
from hcm.integrators.gauss_tableau import GaussIntegrator

# Most evaluations of a step's polynomial for an event; bracket, over the step, that ends them.
TRIALS, RESOLUTION = 60, 1e-15


@kernel
def stage_motion(i: int, old: Motion, integrator: GaussIntegrator) -> Motion:
    """The motion at stage i of the latest step, which began at `old`."""
    gauss = integrator.gauss
    a = gauss.stage[i]
    return Motion(gauss.q[i], gauss.v[i], a, a, gauss.chords[i], a, old.drive)


@kernel
def point(
    p: int, h: float, contact: ContactState, old: Motion, new: Motion, integrator: GaussIntegrator
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
    h: float, found: int, tolerance: SlotValues, contact: ContactState, old: Motion, new: Motion,
    integrator: GaussIntegrator,
) -> tuple[int, int]:  # fmt: skip
    """The slot that is passed first, other than `found`, and the first point that is past it.

    A slot that starts at zero has just fired: it may fire again once it has been positive; if it
    never is, the point returned is 0.
    """
    begin, before = point(0, h, contact, old, new, integrator)
    values, last = before, integrator.tableau.c.size + 1
    positive = 0
    for k in range(3):
        positive |= int(before[k] > tolerance[k]) << k
    for p in range(1, last + 1):
        time, values = point(p, h, contact, old, new, integrator)
        slot, earliest = NO_EVENT, math.inf
        for k in range(3):
            if k != found and values[k] < -tolerance[k] and positive >> k & 1:
                above = max(before[k], 0.0)
                at = begin + (time - begin) * above / (above - values[k])
                if at < earliest:
                    slot, earliest = k, at
            positive |= int(values[k] > tolerance[k]) << k
        if slot != NO_EVENT:
            return slot, p
        begin, before = time, values
    for k in range(3):
        if k != found and values[k] < -tolerance[k]:
            return k, 0
    return NO_EVENT, 0


@kernel
def lagrange(k: int, x: float, c: Floats) -> float:
    """Lagrange's polynomial l_k(x) on the nodes c (s,)."""
    value = 1.0
    for j in range(c.size):
        if j != k:
            value *= (x - c[j]) / (c[k] - c[j])
    return value


@kernel
def value_inside(
    slot: int, share: float, h: float, contact: ContactState, old: Motion, new: Motion,
    integrator: GaussIntegrator,
) -> float:  # fmt: skip
    """A slot's event function at `share` of the latest step, h long; overwrites `new`'s tip."""
    tip, c, gauss = integrator.chain.tip, integrator.tableau.c, integrator.gauss
    for m in range(tip, tip + 4):
        new.q[m], new.v[m] = old.q[m] + share * h * old.v[m], old.v[m]
    for k in range(c.size):
        weight = lagrange(k, share, c) * share / c[k]
        for m in range(tip, tip + 4):
            new.q[m] += h * h * weight * gauss.unknown[k, m]
            new.v[m] += weight * (gauss.v[k, m] - old.v[m])
    return values_at(new, contact, integrator)[slot]


@kernel
def shorten(
    share: float, h: float, contact: ContactState, old: Motion, new: Motion,
    integrator: GaussIntegrator,
) -> bool:  # fmt: skip
    """End the latest step, h long, at `share` of it; return whether all is finite.

    The new stages and end lie on the collocation's polynomials of degree s through the step's start
    and its stages. q and v have one each: the derivative of q's is v's at the stages only, and
    stiff vibrations would feel the difference.
    """
    chain, gauss, c = integrator.chain, integrator.gauss, integrator.tableau.c
    b, u, a, moved = gauss.residual, gauss.change, gauss.spare, integrator.work.increment
    for k in range(c.size):
        for m in range(moved.size):
            b[k, m], a[k, m] = gauss.unknown[k, m], gauss.stage[k, m]
            u[k, m] = gauss.v[k, m] - old.v[m]
    for i in range(c.size + 1):
        inside = i < c.size
        x = share * c[i] if inside else share
        q, v = (gauss.q[i], gauss.v[i]) if inside else (new.q, new.v)
        for m in range(moved.size):
            moved[m], v[m] = 0.0, old.v[m]
        for k in range(c.size):
            weight = lagrange(k, x, c)
            along = weight * x / c[k]
            for m in range(moved.size):
                moved[m] += along * b[k, m]
                v[m] += along * u[k, m]
            if inside:
                for m in range(moved.size):
                    gauss.stage[i, m] = weight * a[k, m] + (gauss.stage[i, m] if k > 0 else 0.0)
        for m in range(moved.size):
            if inside:
                gauss.unknown[i, m] = moved[m] / (share * share)
            moved[m] = x * h * old.v[m] + h * h * moved[m]
            q[m] = old.q[m] + moved[m]
        move_chords(old.chords, moved, chain, gauss.chords[i] if inside else new.chords)
    for m in range(moved.size):
        new.a[m] = (new.v[m] - old.v[m]) / (share * h)
    return accelerate(share * h, old, new, contact, integrator)


@kernel
def zero_inside(
    slot: int, after: int, h: float, tolerance: float, contact: ContactState, old: Motion,
    new: Motion, integrator: GaussIntegrator,
) -> float:  # fmt: skip
    """Share of the step at which a slot's value is zero, `after` being the first point past it: by
    false position (Illinois).
    """
    low, before = point(after - 1, h, contact, old, new, integrator)
    high, past = point(after, h, contact, old, new, integrator)
    low, high, g_low, g_high = low / h, high / h, before[slot], past[slot]
    side = 0
    for _ in range(TRIALS):
        share = high - g_high * (high - low) / (g_high - g_low)
        if not low < share < high or high - low <= RESOLUTION:
            break
        g = value_inside(slot, share, h, contact, old, new, integrator)
        if g > 0.0:
            low, g_low, g_high = share, g, 0.5 * g_high if side == 1 else g_high
            side = 1
        else:
            high, g_high, g_low = share, g, 0.5 * g_low if side == -1 else g_low
            side = -1
            if -g <= tolerance:
                break
    return high


@kernel
def fill_stages(h: float, old: Motion, integrator: GaussIntegrator) -> None:
    """Fill the stages' accelerations and velocities of the latest step from its unknowns."""
    combine(integrator.tableau.a_squared_inverse, integrator.gauss.unknown, integrator.gauss.stage)
    move_velocities(h, old, integrator)


@kernel
def end_early(
    slot: int, h: float, tolerance: float, contact: ContactState, old: Motion, new: Motion,
    integrator: GaussIntegrator,
) -> tuple[float, int]:  # fmt: skip
    """End the latest step, h long, where a value that starts at zero and is past it at the first
    stage returns to zero.

    The value may be positive for a moment, as for a tip that sticks on one edge of the friction
    cone and swings to the other. The polynomials' error exceeds the width of a narrow cone. Returns
    the step's length (0: the value falls at once; NaN: a trial failed) and the trials.
    """
    if values_and_rates(old, contact, integrator)[1][slot] * h < -tolerance:
        return 0.0, 0
    length, trials = event_search.locate(slot, h, tolerance, contact, old, new, integrator)
    if length > 0.0:
        fill_stages(length, old, integrator)
    return length, trials


@kernel
def first_event(
    h: float, tolerance: SlotValues, contact: ContactState, old: Motion, new: Motion,
    integrator: GaussIntegrator,
) -> tuple[float, int, int]:  # fmt: skip
    """`event_search.first_event` from the stages, where only `end_early` takes trial steps."""
    if not integrator.contact or (contact.normal_mode == FLIGHT and not integrator.flight):
        return event_search.first_event(h, tolerance, contact, old, new, integrator)
    found, trials = NO_EVENT, 0
    for _ in range(4):
        slot, after = first_passed(h, found, tolerance, contact, old, new, integrator)
        if slot == NO_EVENT:
            break
        if after == 0:
            h, used = end_early(slot, h, tolerance[slot], contact, old, new, integrator)
            trials, found = trials + used, slot
            if h > 0.0:
                continue
            return h, slot, trials
        if found == NO_EVENT:
            fill_stages(h, old, integrator)
        share = zero_inside(slot, after, h, tolerance[slot], contact, old, new, integrator)
        if not shorten(share, h, contact, old, new, integrator):
            return math.nan, slot, trials
        h, found = share * h, slot
    return h, found, trials


find_event = by_type(GaussIntegrator, first_event, event_search.first_event)
