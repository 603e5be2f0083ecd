"""The first flight of a finger that neither bends nor stretches, to the moment of first contact.

Only gravity and the joint torques load a finger in flight: from rest it stays straight to 1e-5 of
its length, and the vibration that its release excites moves the soft tap's peak force by 1e-4.
If that is below the wanted error, the thin rods of `hcm.flight.rigid_chain` fall instead, and
the beams take over, unstrained, at the touch.
"""

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from hcm.arrays import Floats
from hcm.assembly.state import LAST_STEP, StepLimits
from hcm.beam.drive import Piece, piece_at
from hcm.compiled import ByKind, entry, kernel
from hcm.flight.dormand_prince import STAGES, dormand_prince
from hcm.flight.rigid_chain import Rods, clearance, rates
from hcm.integrators.event_search import (
    TIME_RESOLUTION,
    TRIALS,
    dip_below,
    zero_of_cubic,
)
from hcm.integrators.step_size import REPEATS, SHRINK

# How a flight, or a call of `take_steps`, ended; BLOCKED: the body reached the surface first.
TOUCHED, ENDED, FULL, FAILED, BLOCKED = 0, 1, 2, 3, 4
# The touch is located to this share of the surface's depth, or of the steps' tolerance if that is
# more: with inexact steps the rate at the end is not the height's slope, and Newton's method slows.
LOCATED, OF_TOLERANCE = 1e-15, 1e-6
GROWTH = 4.0
# Largest turn of the fastest rod in a step at the rate of its start, rad, and half of the largest
# one in all: where the integrator is exact (a rod without loads, or under a torque alone) no error
# limits a step, and the cubic that finds a dip of the tip becomes useless (`cubic_error`).
TURN = 0.3
# Each trial leaves a 16th of the cubic's error or less: three are at round-off.
DIP_TRIALS = 3
TABLE_ROWS = 256


class RigidFlight(NamedTuple):
    """The motion of rods from a state to the touch or the end.

    time : (m,) s. states : (m, 2 P) angles (rad) and rates (rad/s). accelerations : (m, P) rad/s^2.
    torques : (m, P) N m. torque_change_work : (m,) J, int (theta - theta_0) dtau, by which the
    drive's work is less than tau (theta - theta_0).
    code : how it ended. repeats, trials : repeated steps, and trial steps of the search.
    """

    time: Floats
    states: Floats
    accelerations: Floats
    torques: Floats
    torque_change_work: Floats
    code: int
    repeats: int
    trials: int


@kernel
def locate_touch(
    time: float, h: float, near: float, state: Floats, stages: Floats, rods: Rods, new: Floats
) -> tuple[float, int]:
    """Shorten a step h past the surface to end on it, within `near` (m); `new` gets its state.

    Returns its length and the trials. Newton's iteration on the tip's height, from the zero of the
    cubic through the heights and speeds at both ends, with bisection where it leaves the bracket.
    """
    low, high, length, trials = 0.0, h, h, 0
    begin_gap, begin_speed = clearance(state, rods)
    gap, speed = clearance(new, rods)
    while abs(gap) > near and high - low > TIME_RESOLUTION and trials < TRIALS:
        low, high = (length, high) if gap > 0.0 else (low, length)
        if trials == 0 and begin_gap > 0.0 > gap:
            length = zero_of_cubic(h, begin_gap, begin_speed, gap, speed)
        else:
            length = length - gap / speed if speed != 0.0 else math.inf
        if not low < length < high:
            length = 0.5 * (low + high)
        trials += 1
        dormand_prince(time, length, state, stages, rods, new)
        gap, speed = clearance(new, rods)
    return length, trials


@kernel
def controlled_step(
    time: float, h: float, tolerance: float, state: Floats, stages: Floats, rods: Rods, new: Floats
) -> tuple[float, float, int]:
    """Take a step of at most h that keeps the tolerance (m; 0: any finite one) and twice `TURN`.

    Returns its length, the factor by which the next may change, and the repeats used: more than
    `REPEATS` mean failure.
    """
    for repeats in range(REPEATS + 1):
        error = dormand_prince(time, h, state, stages, rods, new)
        change = 0.9 * (tolerance / max(error, 1e-6 * tolerance)) ** 0.2 if tolerance > 0.0 else 1.0
        if error <= tolerance or (tolerance == 0.0 and error < math.inf):
            turned = largest_turn(h, state, new) / (2.0 * TURN)
            if turned <= 1.0:
                return h, min(GROWTH, change), repeats
            change = 0.9 / turned
        h *= max(SHRINK, change) if error < math.inf else SHRINK
    return h, SHRINK, REPEATS + 1


@kernel
def largest_turn(h: float, state: Floats, new: Floats) -> float:
    """Largest turn of a rod in a step from `state` to `new`, or h times its rate at the end, rad.

    Rates are parabolas at most where loads are linear in time: with the rate at its start these two
    bound the turn at any time in the step.
    """
    n, turn = state.size // 2, 0.0
    for i in range(n):
        turn = max(turn, abs(new[i] - state[i]), h * abs(new[n + i]))
    return turn


@kernel
def cubic_error(h: float, state: Floats, new: Floats, stages: Floats, rods: Rods) -> float:
    """Bound on how far the cubic through the ends of a step is from the tip's height y, m.

        h^4 max |y''''|/384,  y = sum L sin(theta),
        |(sin theta)''''| <= w^4 + 6 w^2 |theta''| + 3 theta''^2 + 4 w |theta'''|

    for theta'' linear in time, w the largest rate; first and last of `stages` have theta''.
    """
    n, error = rods.length.size, 0.0
    for i in range(n):
        first, last = h * h * stages[0, n + i], h * h * stages[STAGES - 1, n + i]
        jerk, a = abs(last - first), max(abs(first), abs(last))
        w = h * max(abs(state[n + i]), abs(new[n + i])) + jerk / 8.0
        error += rods.length[i] * (w**4 + 6.0 * w * w * a + 3.0 * a * a + 4.0 * w * jerk) / 384.0
    return error


@kernel
def first_below(
    time: float, h: float, state: Floats, stages: Floats, rods: Rods, new: Floats
) -> tuple[float, int]:
    """Time in (0, h] of a step to `new` at which the tip is below the surface, or 0.

    If it is not at the end, trial steps go to the minima of cubics, as long as these are within
    their errors above zero or below, through both ends and then through the last trial. `new` gets
    the last one's state. Returns the trials too.
    """
    low, high = 0.0, h
    (g_low, d_low), (g_high, d_high) = clearance(state, rods), clearance(new, rods)
    if not g_high > 0.0:
        return h, 0
    error = cubic_error(h, state, new, stages, rods)
    for trials in range(DIP_TRIALS):
        level = error * ((high - low) / h) ** 4
        at = low + dip_below(level, high - low, g_low, d_low, g_high, d_high)
        if at == low:
            return 0.0, trials
        dormand_prince(time, at, state, stages, rods, new)
        gap, speed = clearance(new, rods)
        if gap <= 0.0:
            return at, trials + 1
        if speed > 0.0:
            high, g_high, d_high = at, gap, speed
        else:
            low, g_low, d_low = at, gap, speed
    return 0.0, DIP_TRIALS


@kernel
def write_row(time: float, state: Floats, stages: Floats, row: Floats) -> None:
    """Write time, state (2 P,) and accelerations, from the first of `stages`, to a row."""
    n = state.size // 2
    row[0] = time
    for i in range(2 * n):
        row[1 + i] = state[i]
    for i in range(n):
        row[1 + 2 * n + i] = stages[0, n + i]


@entry
def take_steps(
    time: float, h: float, end: float, longest: float, tolerance: float, state: Floats, new: Floats,
    stages: Floats, known: bool, rods: Rods, rows: Floats,
) -> tuple[int, int, int, int, float]:  # fmt: skip
    """Step `state` (2 P,) on to the touch, to `end` (s) or until `rows` (1 + m, 1 + 3 P) are full.

    On return, `stages` (7, 2 P) begin with the state's rates; on entry too if they are `known`.

    Steps keep `tolerance` (m), are at most `longest` (s), and turn no rod by more than
    `controlled_step` allows; without a tolerance all are as long as that. Returns the rows written
    after that of the start (time, state, accelerations), how it ended, repeats, trials, the next
    step.
    """
    n = rods.length.size
    repeats, trials = 0, 0
    near = max(LOCATED * rods.height, OF_TOLERANCE * tolerance)
    if not known:
        rates(time, state, rods, stages[0])
    write_row(time, state, stages, rows[0])
    for row in range(rows.shape[0] - 1):
        remaining = end - time
        if remaining <= LAST_STEP * time:
            return row, ENDED, repeats, trials, h
        fastest = 0.0
        for i in range(n):
            fastest = max(fastest, abs(state[n + i]))
        h = min(h, longest, remaining, TURN / max(fastest, 1e-300))
        h, change, repeated = controlled_step(time, h, tolerance, state, stages, rods, new)
        repeats += repeated
        if repeated > REPEATS:
            return row, FAILED, repeats, trials, h
        code, step = FULL, h
        below, used = first_below(time, h, state, stages, rods, new)
        trials += used
        if below > 0.0:
            step, used = locate_touch(time, below, near, state, stages, rods, new)
            trials += used
            code = TOUCHED
        elif used > 0:
            dormand_prince(time, h, state, stages, rods, new)
        time += step
        for i in range(2 * n):
            stages[0, i], state[i] = stages[STAGES - 1, i], new[i]
        write_row(time, state, stages, rows[row + 1])
        h *= change
        if code == TOUCHED:
            return row + 1, TOUCHED, repeats, trials, h
    return rows.shape[0] - 1, FULL, repeats, trials, h


take_steps_by_kind = ByKind(take_steps)


def integrate_flight(
    rods: Rods, state: Floats, time: float, limits: StepLimits, most_steps: int,
    drive: Sequence[Piece] = (),
) -> RigidFlight:  # fmt: skip
    """Let the rods fall from `state` (2 P,) at `time`, s, to the touch or to the end time.

    drive : torques on them over time; empty: the torques that they have.
    """
    links, state, new = rods.length.size, state.copy(), np.empty_like(state)
    stages = np.empty((STAGES, state.size))
    drive = drive or (Piece(rods.since, math.inf, rods.torque),)
    end = min(limits.end_time, time + limits.max_flight_time)
    tolerance = limits.flight_tolerance
    if tolerance > 0.0:  # an error estimate is only accurate to a few round-offs of the angles
        tolerance = max(tolerance, LOCATED * sum(rods.length.tolist()))
    steps, repeats, trials, code, until = 0, 0, 0, ENDED, -math.inf
    parts: list[tuple[Floats, Floats, Floats]] = []
    begin, before, kept = state, state, 0.0
    while not parts or (code == ENDED and until < end and steps < most_steps):
        piece = piece_at(drive, time)
        if piece.torques is not rods.torque:  # a copy takes as long as a step
            rods = rods._replace(torque=piece.torques, since=piece.begin_s)
        until, h, code = min(end, piece.end_s), limits.flight_step, FULL
        flown: list[Floats] = []
        while code == FULL and steps < most_steps:
            rows = np.empty((1 + min(TABLE_ROWS, most_steps - steps), 1 + 3 * links))
            written, code, repeated, tried, h = take_steps_by_kind(
                None, time, h, until, limits.flight_step, tolerance, state, new, stages,
                bool(flown), rods, rows,
            )  # fmt: skip
            flown.append(rows[min(len(flown), 1) : 1 + written])
            time = float(rows[written, 0]) if written else time
            steps, repeats, trials = steps + written, repeats + repeated, trials + tried
        table = np.concatenate(flown) if len(flown) > 1 else flown[0]
        load = np.empty((len(table), links))
        load[:] = piece.torques[0]
        rate = piece.torques[1]
        rises = any(rate.tolist())
        if rises:
            load += (table[:, :1] - piece.begin_s) * rate
        if parts:  # by the torque's jump; the first row repeats the last piece's end
            kept += float((load[0] - before) @ (table[0, 1 : 1 + links] - begin))
        else:
            begin = table[0, 1 : 1 + links]
        work = _torque_change_work(table, begin, rate) if rises else np.zeros(len(table))
        if kept:
            work += kept
        before, kept, first = load[-1], float(work[-1]), min(len(parts), 1)
        parts.append((table[first:], load[first:], work[first:]))
    if len(parts) > 1:
        table, load, work = (np.concatenate(part) for part in zip(*parts, strict=True))
    states, accelerations = table[:, 1 : 1 + 2 * links], table[:, 1 + 2 * links :]
    return RigidFlight(table[:, 0], states, accelerations, load, work, code, repeats, trials)


def _torque_change_work(table: Floats, begin: Floats, rate: Floats) -> Floats:
    """Int (theta - theta_0) . tau. dt up to each row (m,), J, by cubics through the rows."""
    links = begin.size
    h, angles = np.diff(table[:, :1], axis=0), table[:, 1 : 1 + links] - begin
    spins = table[:, 1 + links : 1 + 2 * links]
    swept = 0.5 * h * (angles[:-1] + angles[1:]) + h * h / 12.0 * (spins[:-1] - spins[1:])
    return np.concatenate([np.zeros(1), (swept @ rate).cumsum()])
