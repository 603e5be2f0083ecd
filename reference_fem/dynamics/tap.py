"""When a tap begins, and when it is over."""

import math

import numpy as np

from reference_fem.arrays import Array
from reference_fem.contact.law import NORMAL
from reference_fem.dynamics.next_touch import bent_touches
from reference_fem.dynamics.state import State, Tap
from reference_fem.dynamics.step import Block, advance
from reference_fem.model import Model
from reference_fem.results.result import ForceRecord, Status
from reference_fem.settings import Settings

# Fewest steps without contact that count as a separation.
LEAST_WAIT = 10
# A body that comes down again within this many durations of its contact is still in the same tap.
SAME_TAP = 2.0


def tap_after(
    model: Model, tap: Tap, state: State, block: Block, touch_in_s: float, until_s: float
) -> Tap:
    """The tap after a block that started from `state`.

    It is over once the surface has not been touched for 10 % of the contact so far, a quarter of
    an axial wave's transit of the last phalanx or ten steps, whichever is longest (single nodes
    chatter at the start and at the end), and will not be for twice that contact or transit.
    With `until_s` it has the touches, ten steps apart, that begin within that time of the first.

    touch_in_s : `next_touch_s` of the block's start. until_s : `Settings.tap_until_s`.
    """
    if tap.over:
        return tap
    steps = np.flatnonzero(block.log[:, NORMAL] > 0.0)
    touched = state.time_s + steps * model.step_s
    first, last, velocity = tap.first_touch_s, tap.last_touch_s, tap.tip_velocity
    if steps.size and first is None:
        first = last = float(touched[0])
        # Its velocity half a step before the touch: the block may have begun fifty steps earlier.
        before, _ = advance(model, state, max(int(steps[0]), 1), False)
        x, y = before.velocity[model.pole, :2]
        velocity = (float(x), float(y))
    if first is None or last is None:
        return tap
    least = LEAST_WAIT * model.step_s
    if until_s > 0.0:
        begins = np.diff(touched, prepend=last) > least
        touched = touched[np.cumsum(begins & (touched - first > until_s)) == 0]
    if touched.size:
        last = float(touched[-1])
    now = state.time_s + (len(block.log) - 1) * model.step_s
    if until_s > 0.0:
        over = now - first > until_s and now - last > least
    else:
        wait, soon = parting_s(model, last - first)
        over = bool(now - last > wait and touch_in_s > soon)
    return Tap(first, last, over, velocity)


def parting_s(model: Model, lasted: Array | float) -> tuple[Array, Array]:
    """(wait, soon), s: a tap is over once untouched for `wait` with no touch due within `soon`."""
    wait = np.maximum(0.1 * lasted, max(0.25 * model.transit_s, LEAST_WAIT * model.step_s))
    return wait, SAME_TAP * np.maximum(lasted, model.transit_s)


def bends_back(
    model: Model, tap: Tap, state: State, forces: ForceRecord, until_s: float
) -> tuple[str, ...]:
    """Caution about a tip whose bending brings it back as soon as a touch of the same tap.

    state, forces : the run's last ones. until_s : `Settings.tap_until_s`.
    """
    first, last = tap.first_touch_s, tap.last_touch_s
    if first is None or last is None or not tap.over or until_s > 0.0:
        return ()
    until = last + float(sum(parting_s(model, last - first)))
    pressed = forces.time_s[forces.normal_force_N > 0.0]
    again = pressed[pressed - last > LEAST_WAIT * model.step_s]
    if again.size:
        soon, what = again[0] <= until, f"touches again {1e3 * (again[0] - last):.2g} ms after"
    else:
        within, u, v = until - state.time_s, state.displacement, state.velocity
        soon = within > 0.0 and bent_touches(model, u, v, within)
        what = f"bends, and may touch again within {1e3 * (until - last):.2g} ms of"
    if not soon:
        return ()
    unit = 10.0 ** (math.floor(math.log10(until - first)) - 1)
    return (
        f"the last phalanx {what} the tap; that counts as another tap, as a rigid one would stay"
        f" away: solver.fem.tap_until = {math.ceil((until - first) / unit) * unit:.2g} adds it to"
        " the first",
    )


def ending(settings: Settings, tap: Tap, now_s: float, start_s: float) -> tuple[Status, str] | None:
    """How an explicit run that began at `start_s` ends at `now_s`, if it does."""
    end = settings.end_time_s
    if tap.first_touch_s is None:
        late = end is not None and now_s >= end
        flies = settings.flight != "rigid"
        # After a rigid flight the surface is a few steps away.
        waited = settings.max_flight_time_s if flies else settings.max_contact_time_s
        if late or now_s - start_s > waited:
            return Status.NOT_REACHED, f"no contact up to t = {now_s:.6g} s"
        return None
    if (end is not None and now_s >= end) or (end is None and tap.over):
        if tap.over:
            return Status.COMPLETED, f"completed at t = {now_s:.6g} s"
        return Status.STILL_IN_CONTACT, f"the tap goes on at the end time, t = {now_s:.6g} s"
    lasts = now_s - tap.first_touch_s
    if not tap.over and lasts > settings.tap_until_s + settings.max_contact_time_s:
        return Status.STILL_IN_CONTACT, f"the tap lasts {lasts:.3g} s, at t = {now_s:.6g} s"
    return None
