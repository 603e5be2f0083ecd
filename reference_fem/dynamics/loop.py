"""Drives the explicit loop: when to search for contact, what to record, when to stop."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from reference_fem.cautions import cautions
from reference_fem.contact.penalty import NORMAL
from reference_fem.dynamics.energy import sample
from reference_fem.dynamics.guards import failure
from reference_fem.dynamics.loop_state import Position, Tap, pack, unpack
from reference_fem.dynamics.next_touch import next_touch_s
from reference_fem.dynamics.recorder import Recorder
from reference_fem.dynamics.restart import RestartFile
from reference_fem.dynamics.state import State
from reference_fem.dynamics.step import Block, advance, lowest_gap, start_state
from reference_fem.model import Model
from reference_fem.result import TapResult
from reference_fem.settings import Settings
from reference_fem.status import Status
from reference_fem.summary import Cost, summarize

Array = NDArray[np.float64]
Progress = Callable[[float, str], None]

# Steps of a block in flight: contact is out of reach for longer than that.
FLIGHT_BLOCK = 1000
# Speed that the surface may gain within a flight block, m/s: a generous bound on its reach.
SPEED_MARGIN = 1.0
# Steps without contact that a separation takes at least.
LEAST_WAIT = 10
# A body that comes down again within this many durations of its contact is still in the same tap.
SAME_TAP = 2.0


def run(
    model: Model,
    settings: Settings,
    displacement: Array,
    velocity: Array,
    time_s: float,
    progress: Progress | None = None,
    started: float | None = None,
    origin_energy_J: float | None = 0.0,
    angles: Array | None = None,
    restart: RestartFile | None = None,
) -> TapResult:
    """Explicit run from u and v at `time_s` to the end of the tap.

    Ends where the surface has not been touched for 10 % of the contact so far, a quarter of an
    axial wave's transit of the last phalanx or ten steps, whichever is longest (single nodes
    chatter at the start and at the end), and will not be for twice as long as the contact so far
    (see `departure`); with `settings.end_time_s`, at that time.

    Parameters
    ----------
    displacement, velocity : (n_points, dim)
    started
        `time.perf_counter()` of the caller's start, for the wall time.
    origin_energy_J
        Total energy that the balance is measured from: 0 for a body that set out from the mesh's
        rest position at rest; None takes the start of this run.
    angles : (phalanges,)
        Rotations so far, which count full turns; see `start_state`.
    restart
        Written to as the run goes on.
    """
    state = start_state(model, displacement, velocity, time_s, angles)
    position = Position(state, start_s=time_s, origin_energy_J=origin_energy_J)
    return follow(model, settings, position, None, progress, started, restart)


def resume(
    model: Model,
    settings: Settings,
    archive: Mapping[str, NDArray[Any]],
    progress: Progress | None,
    started: float | None,
    restart: RestartFile,
) -> TapResult:
    """Continue the run that `archive` was written by."""
    recorder = Recorder(settings.max_samples, settings.snapshots)
    recorder.restore(
        {k.removeprefix("recorder."): a for k, a in archive.items() if k.startswith("recorder.")}
    )
    position = unpack(archive)
    return follow(model, settings, position, recorder, progress, started, restart)


def follow(
    model: Model,
    settings: Settings,
    position: Position,
    recorder: Recorder | None = None,
    progress: Progress | None = None,
    started: float | None = None,
    restart: RestartFile | None = None,
) -> TapResult:
    """Run from `position` to the end of the tap; see `run`."""
    started = time.perf_counter() if started is None else started
    if recorder is None:
        recorder = Recorder(settings.max_samples, settings.snapshots)
    state, time_s, tap = position.state, position.start_s, position.tap
    largest_kinetic, largest_error = position.largest_kinetic_J, position.largest_error_J
    audits, origin = position.audits, position.origin_energy_J
    interval = settings.output_interval or audit_interval(model)
    status, message = Status.INTERRUPTED, ""
    try:
        while True:
            search = _in_reach(model, state)
            after, block = advance(model, state, interval if search else FLIGHT_BLOCK, search)
            taken = sample(model, state, block, origin or 0.0)
            if origin is None:
                origin = taken.energy_balance_J
                taken = sample(model, state, block, origin)
            found = failure(model, settings, state, block, taken, largest_kinetic, audits)
            audits += 1
            if taken.finite:
                recorder.add(model, state, block, taken)
                largest_kinetic = max(largest_kinetic, taken.kinetic_energy_J)
                largest_error = max(largest_error, abs(taken.energy_balance_J))
            if found is not None:
                status, message = found
                break
            tap = _follow(model, tap, state, block)
            state = after
            ending = _ending(settings, tap, state, time_s)
            if ending is not None:
                status, message = ending
                break
            if restart is not None and restart.due:
                spent = position.spent_s + time.perf_counter() - started
                here = Position(
                    state, time_s, tap, largest_kinetic, largest_error, origin, audits, spent
                )
                held = {f"recorder.{name}": a for name, a in recorder.archive().items()}
                restart.write(pack(here) | held)
            if progress is not None:
                progress(*_progress(model, settings, tap, state, time_s))
    except KeyboardInterrupt:
        message = f"interrupted at step {state.step}, t = {state.time_s:.6g} s"
    forces, history = recorder.forces(), recorder.history()
    cost = Cost(
        wall_time_s=position.spent_s + time.perf_counter() - started,
        steps=state.step,
        elements=model.copies * len(model.cells),
        time_step_s=model.step_s,
    )
    summary = summarize(
        forces,
        history,
        model.surface.friction,
        tap.tip_velocity,
        tap.last_touch_s if tap.over else None,
        largest_error / largest_kinetic if largest_kinetic > 0.0 else None,
        cost,
    )
    if status.advice:
        message = f"{message}: {status.advice}"
    if restart is not None and restart.problem:
        message = f"{message}; {restart.problem}"
    snapshots = recorder.snapshots(model)
    doubts = cautions(forces, history, snapshots, model, settings)
    return TapResult(status, message, history, forces, snapshots, summary, doubts)


def audit_interval(model: Model) -> int:
    """Steps between audits: some 150 in a tap of five transits of the last phalanx."""
    return max(1, round(5.0 * model.transit_s / (150.0 * model.step_s)))


def _in_reach(model: Model, state: State) -> bool:
    """Whether contact can happen within a flight block."""
    gap = lowest_gap(model, state.displacement)
    speed = float(np.max(-state.velocity[model.contact.nodes, 1], initial=0.0)) + SPEED_MARGIN
    return not gap > 2.0 * speed * FLIGHT_BLOCK * model.step_s


def _follow(model: Model, tap: Tap, state: State, block: Block) -> Tap:
    """The tap after a block."""
    touched = np.flatnonzero(block.log[:, NORMAL] > 0.0)
    if tap.over:
        return tap
    first, last, velocity = tap.first_touch_s, tap.last_touch_s, tap.tip_velocity
    if touched.size:
        if first is None:
            first = state.time_s + touched[0] * model.step_s
            # The body is still untouched at the block's start, a few steps before.
            x, y = block.velocity[model.pole, :2]
            velocity = (float(x), float(y))
        last = state.time_s + touched[-1] * model.step_s
    if first is None or last is None:
        return tap
    now = state.time_s + (len(block.log) - 1) * model.step_s
    wait = max(0.1 * (last - first), 0.25 * model.transit_s, LEAST_WAIT * model.step_s)
    over = now - last > wait
    if over:
        soon = SAME_TAP * max(last - first, model.transit_s)
        over = next_touch_s(model, state.displacement, block.velocity) > soon
    return Tap(first, last, over, velocity)


def _ending(
    settings: Settings, tap: Tap, state: State, start_s: float
) -> tuple[Status, str] | None:
    """How the run ends here, if it does."""
    now, end = state.time_s, settings.end_time_s
    if tap.first_touch_s is None:
        late = end is not None and now >= end
        flies = settings.flight == "explicit"
        # After a rigid flight the surface is a few steps away.
        waited = settings.max_flight_time_s if flies else settings.max_contact_time_s
        if late or now - start_s > waited:
            return Status.NOT_REACHED, f"no contact up to t = {now:.6g} s"
        return None
    if (end is not None and now >= end) or (end is None and tap.over):
        if tap.over:
            return Status.COMPLETED, f"completed at t = {now:.6g} s"
        return Status.STILL_IN_CONTACT, f"in contact at the end time, t = {now:.6g} s"
    if not tap.over and now - tap.first_touch_s > settings.max_contact_time_s:
        return (
            Status.STILL_IN_CONTACT,
            f"in contact for {now - tap.first_touch_s:.3g} s, at t = {now:.6g} s",
        )
    return None


def _progress(
    model: Model, settings: Settings, tap: Tap, state: State, start_s: float
) -> tuple[float, str]:
    """Share done, as far as it can be known, and what is going on."""
    if tap.first_touch_s is None:
        if settings.flight == "rigid":
            return 0.0, "approach"
        return min(0.99, (state.time_s - start_s) / settings.max_flight_time_s), "flight"
    # A tap lasts for some five to eight transits of the last phalanx.
    expected = 8.0 * model.transit_s
    return min(0.99, (state.time_s - tap.first_touch_s) / expected), "contact"
