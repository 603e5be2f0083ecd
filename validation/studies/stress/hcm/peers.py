"""``fingertap stress --peers``: ten of the hardest cells, by hcm, by SciPy's and by Exudyn's means.

Exudyn gets the cells whose contact is a frictionless linear spring (its one-sided contact is put on
by hand, see `validation.peers.exudyn_finger`), with adaptive steps, and is told when to look for
contact and for how long. The others would need Python code in each of its steps.
"""

from __future__ import annotations

import contextlib
import importlib
import importlib.util
import io
import time
from collections.abc import Callable
from typing import Any

import hcm
from validation.harness.interrupts import unless_interrupted
from validation.harness.workers import workers
from validation.peers.scipy_ivp import solve
from validation.studies.stress.hcm.hard_cells import HardCell, Tap, hard_cells, tap_of, truth_of

# What a solver says, its tap, and its wall time in s.
Answer = tuple[str, Tap | None, float]

SECONDS = 30.0
FLIGHT_STEP_S, CONTACT_STEPS = 1e-4, 2000
# Exudyn starts to look this share before contact, and looks for this multiple of its duration.
BEFORE, WINDOW = 0.002, 1.3


def _cell(answer: str, tap: Tap | None, seconds: float, truth: Tap | None) -> str:
    if tap is None:
        return f"{answer} ({seconds:.2g} s)"
    error = "" if truth is None else f", off by {100 * tap.error(truth):.2g} %"
    return f"{answer}{error} ({seconds:.2g} s)"


def _clocked(run: Callable[..., tuple[str, Tap | None]], *arguments: Any) -> Answer:
    begin = time.perf_counter()
    answer, tap = run(*arguments)
    return answer, tap, time.perf_counter() - begin


def _exudyn(cell: HardCell, contact_s: float, duration_s: float) -> tuple[str, Tap | None]:
    from validation.peers import exudyn_finger

    window = WINDOW * duration_s
    given = {name: value for name, value in cell.scene.arguments().items() if name != "settings"}
    try:
        found = exudyn_finger.tap(
            given, FLIGHT_STEP_S, window / CONTACT_STEPS, True,
            (1 - BEFORE) * contact_s, adaptive=True, window=window,
        ).quantities  # fmt: skip
    except exudyn_finger.PeerFailedError as error:
        return str(error), None
    return "completed", Tap(found.peak_normal_force_N, found.normal_impulse_N_s)


def _exudyn_alone(cell: HardCell, contact_s: float, duration_s: float) -> Answer:
    """In a process of its own, whose start and imports are not charged."""
    with contextlib.redirect_stdout(io.StringIO()):  # Exudyn says that it was imported
        for name in ("exudyn", "exudyn.itemInterface", "validation.peers.exudyn_finger"):
            importlib.import_module(name)
    return _clocked(_exudyn, cell, contact_s, duration_s)


def limited(seconds: float, run: Callable[..., Answer], *arguments: Any) -> Answer:
    """A function's answer from a process that is killed if it takes longer than that.

    Exudyn's adaptive steps may shrink for ever, within one call of its own code.
    """
    try:
        with workers(1) as pool:
            return pool.submit(run, *arguments).result(seconds)
    except TimeoutError:
        return f"no answer after {seconds:g} s", None, seconds


def _exudyn_cell(cell: HardCell, result: hcm.TapResult, truth: Tap | None) -> str:
    own = result.summary
    if not cell.linear:
        return "not expressible without Python in the step"
    if own.contact_time_s is None or own.contact_duration_s is None:
        return "no contact to look for"
    answer, tap, seconds = limited(
        SECONDS, _exudyn_alone, cell, own.contact_time_s, own.contact_duration_s
    )
    return _cell(answer, tap, seconds, truth)


def peers_table(progress: Callable[[float, str], None]) -> list[dict[str, Any]]:
    """One row a cell; errors are the larger of peak F_n and impulse against a much tighter run."""
    cells, rows = hard_cells(), []
    warm = cells[0].scene
    unless_interrupted(hcm.simulate(**warm.arguments()))
    for number, cell in enumerate(cells):
        progress(number / len(cells), cell.name)
        begin = time.perf_counter()
        result = unless_interrupted(hcm.simulate(**cell.scene.arguments()))
        seconds = time.perf_counter() - begin
        truth = truth_of(cell)
        row = {
            "cell": cell.name,
            "hcm": _cell(result.status.value, tap_of(result), seconds, truth),
            "SciPy RK45, defaults": _cell(*_clocked(solve, cell.scene, SECONDS, "RK45"), truth),
        }
        if importlib.util.find_spec("exudyn") is not None:
            row["Exudyn, adaptive steps"] = _exudyn_cell(cell, result, truth)
        rows.append(row)
    return rows
