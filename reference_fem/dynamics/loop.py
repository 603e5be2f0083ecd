"""Drives the explicit loop: when to search for contact, what to record, when to stop."""

import math
import time
from dataclasses import dataclass, field, replace

import numpy as np

from reference_fem.arrays import Progress
from reference_fem.cautions import Evidence, cautions
from reference_fem.dynamics.coarse_flight import CoarseFlight
from reference_fem.dynamics.energy import sample
from reference_fem.dynamics.flight_block import FLIGHT_BLOCK, flight_block, speed_down
from reference_fem.dynamics.guards import advice, failure, searched
from reference_fem.dynamics.recorder import Recorder
from reference_fem.dynamics.restart import RestartFile
from reference_fem.dynamics.state import LoopState, State, Tap, pack
from reference_fem.dynamics.step import Block, advance, lowest_gap
from reference_fem.dynamics.tap import bends_back, ending, tap_after
from reference_fem.model import Model
from reference_fem.results.result import ForceRecord, Status, Summary, TapResult
from reference_fem.results.summary import summarize
from reference_fem.settings import Settings

SPEED_MARGIN = 1.0
"""Speed, m/s, added to the tip's own where it decides how far above the surface contact is searched
for: a larger one costs searches, a smaller one looks of `flight_block`."""


@dataclass(frozen=True)
class Reporting:
    """Where a run reports its progress and keeps its restart file.

    progress : called after each block
    restart : file that is written after each block at which it is due, and at an interrupt
    started : `time.perf_counter()` of the caller's start, for the wall time
    """

    progress: Progress | None = None
    restart: RestartFile | None = None
    started: float = field(default_factory=time.perf_counter)


def explicit_tap(
    model: Model,
    settings: Settings,
    loop_state: LoopState,
    reporting: Reporting | None = None,
    recorder: Recorder | None = None,
    flight: CoarseFlight | None = None,
) -> TapResult:
    """Explicit run from `loop_state` to the end of the first tap or `settings.end_time_s`.

    A tap's end: see `tap.tap_after`.

    recorder : that of the run which this one continues.
    flight : coarse flight that `loop_state` may be in until it hands over; it is not recorded.
    """
    reporting = reporting or Reporting()
    recorder = recorder or Recorder(settings)
    now = loop_state
    in_tap = audit_interval(model)
    beyond = settings.output_interval or in_tap
    in_tap = min(in_tap, beyond)  # the first tap's numbers are read from its audits
    status, message = Status.INTERRUPTED, ""
    try:
        while True:
            on, flown = model, None
            if flight is not None and now.coarse:
                flown = flight.advanced(now.state, settings.lead_steps)
                on, now = (model, flight.handed_over(now)) if flown is None else (flight.model, now)
            state = now.state
            after, block = flown or _advanced(model, state, beyond if now.tap.over else in_tap)
            taken = sample(on, state, block, now.origin_energy_J or 0.0)
            if now.origin_energy_J is None:
                now = replace(now, origin_energy_J=taken.energy_balance_J)
                taken = sample(on, state, block, taken.energy_balance_J)
            found = failure(on, settings, now, block, taken)
            if taken.finite:
                if not now.coarse:
                    recorder.add(model, state, block, taken, now.tap.over)
                now = replace(
                    now,
                    largest_kinetic_J=max(now.largest_kinetic_J, taken.kinetic_energy_J),
                    largest_error_J=max(now.largest_error_J, abs(taken.energy_balance_J)),
                )
            if found is not None:
                status, message = found
                break
            tap = tap_after(on, now.tap, state, block, taken.next_touch_s, settings.tap_until_s)
            now = replace(now, state=after, tap=tap, audits=now.audits + 1)
            ends = ending(settings, tap, after.time_s, now.start_s)
            if ends is not None:
                status, message = searched(on, after) or ends
                break
            _report(model, settings, now, reporting, recorder)
    except KeyboardInterrupt:
        message = f"interrupted at step {now.state.step}, t = {now.state.time_s:.6g} s"
        ended = ending(settings, now.tap, now.state.time_s, now.start_s) is not None
        # a resumed run would go on after its end, or record a block twice
        if not (ended or recorder.holds(now.state)):
            _save(now, reporting, recorder)
    return result_of(model, settings, now, reporting, recorder, status, message)


def _report(
    model: Model, settings: Settings, now: LoopState, reporting: Reporting, recorder: Recorder
) -> None:
    """Write the restart file if it is due, and report."""
    if reporting.restart is not None and reporting.restart.due:
        _save(now, reporting, recorder)
    if reporting.progress is not None:
        reporting.progress(*_progress(model, settings, now))


def _save(now: LoopState, reporting: Reporting, recorder: Recorder) -> None:
    """Write the restart file, if the run keeps one."""
    if reporting.restart is not None:
        spent = now.spent_s + time.perf_counter() - reporting.started
        reporting.restart.write(pack(replace(now, spent_s=spent)) | recorder.archive())


def result_of(
    model: Model,
    settings: Settings,
    now: LoopState,
    reporting: Reporting,
    recorder: Recorder,
    status: Status,
    message: str,
) -> TapResult:
    """The result of a run that has ended, its message with advice and any trouble on the way."""
    if todo := advice(model, status):
        message = f"{message}: {todo}"
    if reporting.restart is not None and reporting.restart.problem:
        message = f"{message}; {reporting.restart.problem}"
    forces, history, tap = recorder.forces(), recorder.history(), now.tap
    kinetic, error = now.largest_kinetic_J, now.largest_error_J
    summary = summarize(
        forces,
        history,
        model.surface.friction,
        tap.tip_velocity,
        _separation_s(model, forces, tap),
        Summary(
            energy_residual=error / kinetic if kinetic > 0.0 else None,
            wall_time_s=now.spent_s + time.perf_counter() - reporting.started,
            steps=now.steps,
            elements=model.symmetry_factor * len(model.cells),
            time_step_s=model.step_s,
        ),
    )
    snapshots = recorder.snapshots(model)
    over = math.inf if tap.last_touch_s is None or not tap.over else tap.last_touch_s
    doubts = cautions(Evidence(forces.until(over), history, snapshots, model, settings, over))
    if status is Status.COMPLETED:
        doubts += bends_back(model, tap, now.state, forces, settings.tap_until_s)
    return TapResult(status, message, history, forces, snapshots, summary, doubts)


def _separation_s(model: Model, forces: ForceRecord, tap: Tap) -> float | None:
    """When the first tap ended, by its contact law from the last two steps, s."""
    if tap.last_touch_s is None or not tap.over:
        return None
    last = int(np.searchsorted(forces.time_s, tap.last_touch_s))
    steps = slice(max(last - 1, 0), last + 1)
    return model.contact.separation_s(forces.time_s[steps], forces.normal_force_N[steps])


def audit_interval(model: Model) -> int:
    """Steps between audits: some 150 in a tap of five transits of the last phalanx."""
    return max(1, round(5.0 * model.transit_s / (150.0 * model.step_s)))


def _advanced(model: Model, state: State, interval: int) -> tuple[State, Block]:
    """The next block; contact is searched for, in `interval` steps, where it may happen."""
    if state.memory.touching.any():  # no look at the gap is needed
        return advance(model, state, interval, True)

    def gap(of: State) -> float:
        return lowest_gap(model, of.displacement)

    soon = 2.0 * (SPEED_MARGIN + speed_down(model, state)) * FLIGHT_BLOCK * model.step_s
    flown = flight_block(model, state, FLIGHT_BLOCK if gap(state) > soon else 0, gap)
    return flown or advance(model, state, interval, True)


def _progress(model: Model, settings: Settings, now: LoopState) -> tuple[float, str]:
    """Share done, as far as it can be known, and what is going on."""
    time_s, first_touch_s = now.state.time_s, now.tap.first_touch_s
    if first_touch_s is None:
        if settings.flight == "rigid":
            return 0.0, "approach"
        return min(0.99, (time_s - now.start_s) / settings.max_flight_time_s), "flight"
    # A tap lasts for some five to eight transits of the last phalanx.
    return min(0.99, (time_s - first_touch_s) / (8.0 * model.transit_s)), "contact"
