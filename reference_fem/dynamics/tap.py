"""When a tap begins, and when it is over."""

import numpy as np

from reference_fem.arrays import Array, Flags
from reference_fem.compiled import njit
from reference_fem.contact.law import NORMAL
from reference_fem.dynamics.state import State, Tap
from reference_fem.dynamics.step import Block, advance
from reference_fem.model import Model
from reference_fem.result import Status
from reference_fem.settings import Settings

# Fewest steps without contact that count as a separation.
LEAST_WAIT = 10
# A body that comes down again within this many durations of its contact is still in the same tap.
SAME_TAP = 2.0
# Transits of an axial wave along the last phalanx: more than any run lasts.
NEVER = 1e12


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


def next_touch_s(model: Model, displacement: Array, velocity: Array) -> float:
    """Time until the last phalanx would reach the surface as a rigid body, s.

    If it does not come down, `NEVER` transits of a wave, as records hold finite numbers.

    An edge that hits first bounces off while its body still comes down, so that nodes tell nothing
    about the body. With the mean velocity v_c and the spin ω = L/I of the last phalanx in the plane
    of motion, a point of gap g arrives after

        g / -v_y,  v_y = v_cy + ω (x - x_c) < 0

    displacement, velocity : (n_points, dim).
    """
    nodes, body = model.contact.nodes, model.body_of_point == model.touching_body
    centre, mean, spin = _planar_motion(body, model.mass, model.points, displacement, velocity)
    place = model.contact.touching_points(model.points.take(nodes, 0) + displacement.take(nodes, 0))
    speed = mean + spin * (place[:, 0] - centre)
    down = speed < 0.0
    gap = np.maximum(place[down, 1] + model.surface.height, 0.0)
    return float(np.min(gap / -speed[down], initial=NEVER * model.transit_s))


@njit(cache=True)
def _planar_motion(
    body: Flags, mass: Array, points: Array, displacement: Array, velocity: Array
) -> tuple[float, float, float]:
    """x_c, m, v_cy, m/s, and ω, rad/s, of the points that `body` marks."""
    total, centre, mean = 0.0, np.zeros(2), np.zeros(2)
    for i in range(mass.size):
        if body[i]:
            total += mass[i]
            for k in range(2):
                centre[k] += mass[i] * (points[i, k] + displacement[i, k])
                mean[k] += mass[i] * velocity[i, k]
    centre /= total
    mean /= total
    momentum, inertia = 0.0, 0.0
    for i in range(mass.size):
        if body[i]:
            x = points[i, 0] + displacement[i, 0] - centre[0]
            y = points[i, 1] + displacement[i, 1] - centre[1]
            momentum += mass[i] * (x * (velocity[i, 1] - mean[1]) - y * (velocity[i, 0] - mean[0]))
            inertia += mass[i] * (x * x + y * y)
    return centre[0], mean[1], momentum / inertia


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
