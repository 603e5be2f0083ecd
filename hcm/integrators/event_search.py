"""Location of the first event inside a step.

The step is repeated with trial lengths h' in (0, h], the integrator being the interpolant, until a
bracket of the event function's sign change is shorter than `TIME_RESOLUTION` or than what Newton's
tolerance leaves uncertain of a trial, or until a trial is past the change by no more than that, by
its value and rate. A slot is examined if its sign has changed over the step, or if its rates at
both ends and the cubic through them suggest a dip below zero in between. An event function that
starts at zero (it has just fired, or two events coincide) is judged by where it goes: it fires
again only after it has been positive.
"""

import math

from hcm.assembly.state import Motion
from hcm.compiled import kernel
from hcm.contact.contract import contact_position, contact_velocity
from hcm.contact.events import NORMAL, SEPARATION, TANGENTIAL, SlotValues, event_rates, event_values
from hcm.contact.law import ContactState
from hcm.integrators.step import AnyIntegrator, take_step

TRIALS = 80
TIME_RESOLUTION = 1e-15
# Trials of one length differ by Newton's tolerance in their acceleration, which moves an event by
# about that share of the step; a bracket this many times longer can still be halved.
NOISE = 10.0
# Share of that bracket by which trials aim past the zero: a trial past it ends the search.
PAST = 0.2
# For the zero of a cubic on (0, 1).
ROOT_ITERATIONS, ROOT_RESOLUTION = 20, 1e-12
NO_EVENT = -1


@kernel
def values_at(motion: Motion, contact: ContactState, integrator: AnyIntegrator) -> SlotValues:
    """Event functions of a motion's tip."""
    law, tip = integrator.law, integrator.chain.tip
    x, gap = contact_position(motion.q, tip, contact, law)
    vt, vn = contact_velocity(motion.q, motion.v, tip, contact, law)
    return event_values(x, gap, vt, vn, contact, law)


@kernel
def values_and_rates(
    motion: Motion, contact: ContactState, integrator: AnyIntegrator
) -> tuple[SlotValues, SlotValues]:
    """Event functions of a motion's tip, and their rates."""
    law, tip = integrator.law, integrator.chain.tip
    x, gap = contact_position(motion.q, tip, contact, law)
    vt, vn = contact_velocity(motion.q, motion.v, tip, contact, law)
    at, an = contact_velocity(motion.q, motion.acceleration, tip, contact, law)
    return (
        event_values(x, gap, vt, vn, contact, law),
        event_rates(x, gap, vt, vn, at, an, contact, law),
    )


@kernel
def overshot(
    tolerance: SlotValues, motion: Motion, contact: ContactState, integrator: AnyIntegrator
) -> int:
    """Slot that the motion has passed, F_n's first (a contact cannot pull), or `NO_EVENT`."""
    values = values_at(motion, contact, integrator)
    for slot in (SEPARATION, TANGENTIAL, NORMAL):
        if values[slot] < -tolerance[slot]:
            return slot
    return NO_EVENT


@kernel
def hermite_slope(
    h: float, g0: float, d0: float, g1: float, d1: float
) -> tuple[float, float, float]:
    """A, B, C of p'(s) = A s^2 + B s + C, s = t/h, of the cubic with values g and rates d at the
    ends of a step h.
    """
    a = 6.0 * (g0 - g1) + 3.0 * h * (d0 + d1)
    b = 6.0 * (g1 - g0) - h * (4.0 * d0 + 2.0 * d1)
    return a, b, h * d0


@kernel
def dip_below(level: float, h: float, g0: float, d0: float, g1: float, d1: float) -> float:
    """Time in (0, h) where the cubic Hermite interpolant has a minimum below `level`, or 0."""
    if not (g0 > 0.0 and g1 > 0.0):
        return 0.0
    a, b, c = hermite_slope(h, g0, d0, g1, d1)
    # a minimum where p' rises through zero
    root = math.sqrt(max(b * b - 4.0 * a * c, 0.0))
    if c < 0.0:
        s = 2.0 * c / (-b - root) if b + root != 0.0 else 0.5
    else:
        s = 0.5 * (root - b) / a if a > 0.0 > b and root > 0.0 else 0.0
    if not 0.0 < s < 1.0:
        return 0.0
    value = g0 + s * (c + s * (0.5 * b + s * a / 3.0))
    return s * h if value < level else 0.0


@kernel
def zero_of_cubic(h: float, g0: float, d0: float, g1: float, d1: float) -> float:
    """Time in (0, h) where the cubic Hermite interpolant is zero, g0 > 0 > g1: by Newton's method,
    with bisection where it leaves the bracket.
    """
    a, b, c = hermite_slope(h, g0, d0, g1, d1)
    low, high, s = 0.0, 1.0, g0 / (g0 - g1)
    for _ in range(ROOT_ITERATIONS):
        value = g0 + s * (c + s * (0.5 * b + s * a / 3.0))
        low, high = (s, high) if value > 0.0 else (low, s)
        slope, before = c + s * (b + s * a), s
        s = s - value / slope if slope != 0.0 else math.inf
        if not low < s < high:
            s = 0.5 * (low + high)
        if abs(s - before) < ROOT_RESOLUTION:
            break
    return s * h


@kernel
def locate(
    slot: int, high: float, tolerance: float, contact: ContactState, old: Motion, new: Motion,
    integrator: AnyIntegrator,
) -> tuple[float, int]:  # fmt: skip
    """Bracketing search for the slot's zero in [0, high]; `new` holds the step to `high`.

    Trials are the zeros of cubics through the bracket's ends, with bisection when that stalls.
    Returns the bracket's end just past the event (0 when it fires at once), which `new` is then the
    step to, and the trials used; a trial whose Newton iteration fails ends the search with NaN.
    """
    low, trials, lower_point, latest = 0.0, 0, high, high
    g, d = values_and_rates(old, contact, integrator)
    g_low, d_low = g[slot], d[slot]
    g, d = values_and_rates(new, contact, integrator)
    g_high, d_high = g[slot], d[slot]
    while g_low <= tolerance:
        # starts at zero: look for a moment at which it is positive
        lower_point *= 0.25
        if trials >= 12:
            return 0.0, trials
        trials += 1
        if not take_step(lower_point, contact, old, new, integrator):
            return math.nan, trials
        latest = lower_point
        g, d = values_and_rates(new, contact, integrator)
        if g[slot] > tolerance:
            low, g_low, d_low = lower_point, g[slot], d[slot]
        elif g[slot] < -tolerance:
            high, g_high, d_high = lower_point, g[slot], d[slot]
    share = max(1e-14, NOISE * integrator.co.tolerance)
    resolution = TIME_RESOLUTION + share * high
    while (
        high - low > resolution and trials < TRIALS
        and -g_high > max(tolerance, -d_high * resolution)
    ):  # fmt: skip
        middle = low + zero_of_cubic(high - low, g_low, d_low, g_high, d_high) + PAST * resolution
        if trials % 8 == 7 or (trials > 16 and trials % 2) or not low < middle < high:
            middle = 0.5 * (low + high)
        trials += 1
        if not take_step(middle, contact, old, new, integrator):
            return math.nan, trials
        latest = middle
        g, d = values_and_rates(new, contact, integrator)
        if g[slot] > 0.0:
            low, g_low, d_low = middle, g[slot], d[slot]
        else:
            high, g_high, d_high = middle, g[slot], d[slot]
        resolution = TIME_RESOLUTION + share * high
    if latest != high and not take_step(high, contact, old, new, integrator):
        return math.nan, trials
    return high, trials


@kernel
def first_event(
    h: float, tolerance: SlotValues, contact: ContactState, old: Motion, new: Motion,
    integrator: AnyIntegrator,
) -> tuple[float, int, int]:  # fmt: skip
    """Shorten the step `old` -> `new` (already taken with h) to end on the first event.

    Returns the step's length, the slot that fires (`NO_EVENT`) and the trials used. `new` holds the
    step of that length; a length of NaN says that a trial failed.
    """
    g0, d0 = values_and_rates(old, contact, integrator)
    g1, d1 = values_and_rates(new, contact, integrator)
    found, total = NO_EVENT, 0
    for _ in range(4):
        changed = False
        for slot in range(3):
            if slot == found or not math.isfinite(g1[slot]):
                continue
            high = h
            if g1[slot] >= -tolerance[slot]:
                high = dip_below(0.0, h, g0[slot], d0[slot], g1[slot], d1[slot])
                if high == 0.0:
                    continue
                total += 1
                if not take_step(high, contact, old, new, integrator):
                    return math.nan, slot, total
                if values_at(new, contact, integrator)[slot] >= -tolerance[slot]:
                    if not take_step(h, contact, old, new, integrator):
                        return math.nan, slot, total
                    continue
            event, trials = locate(slot, high, tolerance[slot], contact, old, new, integrator)
            total += trials
            if not math.isfinite(event):
                return event, slot, total
            h, found, changed = event, slot, True
            if h == 0.0:
                return h, found, total
            g1, d1 = values_and_rates(new, contact, integrator)
        if not changed:
            break
    return h, found, total
