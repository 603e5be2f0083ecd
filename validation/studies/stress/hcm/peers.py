"""``fingertap stress --peers``: ten of the hardest cells, by hcm, by SciPy's and by Exudyn's means.

Seven cells are frictionless with e* = 1, so that their contact is a one-sided linear spring, which
any solver can express; three have friction, loops or torques. Exudyn gets the seven (its one-sided
contact is put on by hand, see `validation.peers.exudyn_finger`), with adaptive steps, and is told
when to look for contact and for how long. The others would need Python code in each of its steps.
"""

from __future__ import annotations

import contextlib
import importlib
import importlib.util
import io
import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import hcm
from validation.harness.interrupts import unless_interrupted
from validation.harness.processes import workers
from validation.models.adapter import Progress
from validation.peers.scipy_ivp import solve_first_tap
from validation.studies.random_scenes import HcmScene
from validation.studies.stress.hcm.judge import first_tap, tighter
from validation.studies.stress.judging import largest_difference

# A tap's peak F_n (N) and impulse (N s).
Tap = tuple[float, float]
# What a solver says, its tap, and its wall time in s.
PeerAnswer = tuple[str, Tap | None, float]

SECONDS = 30.0
FLIGHT_STEP_S, CONTACT_STEPS = 1e-4, 2000
# Exudyn starts to look this share before contact, and looks for this multiple of its duration.
BEFORE, WINDOW = 0.002, 1.3
SOFT = hcm.Phalanx(0.04, 0.015, 1e9, 1400.0, elements=5)


@dataclass(frozen=True)
class HardCell:
    """Why a cell is hard, its scene, and whether its contact is a frictionless linear spring."""

    name: str
    scene: HcmScene
    linear: bool = True


def _scene(
    phalanx: hcm.Phalanx = SOFT, count: int = 3, height: float = 0.1, friction: float = 0.0,
    tip: hcm.Tip = hcm.Tip(0.78e6), drive: hcm.Drive = hcm.Drive(),  # noqa: B008  frozen
) -> HcmScene:  # fmt: skip
    return HcmScene(
        hcm.Finger((phalanx,) * count), hcm.Surface(height, friction), tip, drive,
        hcm.Settings(max_steps=100_000),
    )  # fmt: skip


def hard_cells() -> tuple[HardCell, ...]:
    """The cells, those that every solver can express first."""
    slender = hcm.Phalanx(0.04, 0.0004, 1e9, 1400.0, elements=20)
    return (
        HardCell("stiffest beams, E 1e12 Pa", _scene(replace(SOFT, youngs_modulus=1e12))),
        HardCell("softest beams, E 1e6 Pa", _scene(replace(SOFT, youngs_modulus=1e6))),
        HardCell("stiffest tip, k 1e10 N/m", _scene(tip=hcm.Tip(1e10))),
        HardCell("softest tip, k 1e3 N/m", _scene(tip=hcm.Tip(1e3))),
        HardCell("slenderness 100, 20 elements", _scene(slender)),
        HardCell("80 elements a phalanx", _scene(replace(SOFT, elements=80))),
        HardCell("30 phalanges", _scene(replace(SOFT, elements=2), 30, 0.96)),
        HardCell("friction 10, tangential ratio 1e3",
                 _scene(friction=10.0, tip=hcm.Tip(0.78e6, 1.0, 1e3)), linear=False),
        HardCell("e* 0.05, friction 5.3: a tap that barely ends",
                 _scene(friction=5.337, tip=hcm.Tip(0.78e6, 0.05, 284.8)), linear=False),
        HardCell("torques that wind the finger up",
                 _scene(friction=0.5, drive=hcm.Drive((0.00631,) * 3, 1.233)), linear=False),
    )  # fmt: skip


def peak_and_impulse(result: hcm.TapResult) -> Tap | None:
    """The first tap of a run of hcm, None if it has none."""
    scalars = first_tap(result)
    return None if scalars is None else scalars[:2]


def _described(answer: PeerAnswer, truth: Tap | None) -> str:
    """A cell of the table: how it ended, how far it is from the truth, its time."""
    ending, tap, seconds = answer
    error = ""
    if tap is not None and truth is not None:
        error = f", off by {100 * largest_difference(tap, truth):.2g} %"
    return f"{ending}{error} ({seconds:.2g} s)"


def _timed(solve: Callable[[], tuple[str, Tap | None]]) -> PeerAnswer:
    start = time.perf_counter()
    ending, tap = solve()
    return ending, tap, time.perf_counter() - start


def _hcm(scene: HcmScene) -> hcm.TapResult:
    return unless_interrupted(hcm.simulate(**scene.arguments()))


def _given(scene: HcmScene) -> dict[str, Any]:
    """Finger, surface, tip and drive."""
    return {name: value for name, value in scene.arguments().items() if name != "settings"}


def _exudyn(scene: HcmScene, contact_s: float, window_s: float) -> tuple[str, Tap | None]:
    from validation.peers import exudyn_finger

    try:
        found = exudyn_finger.tap(
            _given(scene), FLIGHT_STEP_S, window_s / CONTACT_STEPS, True,
            (1 - BEFORE) * contact_s, adaptive=True, window=window_s,
        ).quantities  # fmt: skip
    except exudyn_finger.PeerFailedError as error:
        return str(error), None
    return "completed", (found.peak_normal_force_N, found.normal_impulse_N_s)


def _exudyn_imported(scene: HcmScene, contact_s: float, window_s: float) -> PeerAnswer:
    """In a process of its own, whose start and imports are not charged."""
    with contextlib.redirect_stdout(io.StringIO()):  # Exudyn says that it was imported
        for name in ("exudyn", "exudyn.itemInterface", "validation.peers.exudyn_finger"):
            importlib.import_module(name)
    return _timed(partial(_exudyn, scene, contact_s, window_s))


def limited(seconds: float, solve: Callable[..., PeerAnswer], *arguments: Any) -> PeerAnswer:
    """A function's answer from a process that is killed if it takes longer than that.

    Exudyn's adaptive steps may shrink for ever, within one call of its own code.
    """
    try:
        with workers(1) as pool:
            return pool.submit(solve, *arguments).result(seconds)
    except TimeoutError:
        return f"no answer after {seconds:g} s", None, seconds


def _exudyn_cell(cell: HardCell, result: hcm.TapResult, truth: Tap | None) -> str:
    s = result.summary
    if not cell.linear:
        return "not expressible without Python in the step"
    if s.contact_time_s is None or s.contact_duration_s is None:
        return "no contact to look for"
    window = WINDOW * s.contact_duration_s
    return _described(
        limited(SECONDS, _exudyn_imported, cell.scene, s.contact_time_s, window), truth
    )


def peers_table(progress: Progress) -> list[dict[str, Any]]:
    """One row a cell; errors are the larger of peak F_n and impulse against a much tighter run."""
    cells, rows = hard_cells(), []
    _hcm(cells[0].scene)  # loads the compiled kernels: not charged
    for number, cell in enumerate(cells):
        progress(number / len(cells), cell.name)
        start = time.perf_counter()
        result = _hcm(cell.scene)
        seconds = time.perf_counter() - start
        tight = replace(cell.scene, settings=tighter(cell.scene.settings, 5.0, 100.0))
        truth = peak_and_impulse(_hcm(tight))
        own = result.status.value, peak_and_impulse(result), seconds
        scipy = _timed(partial(solve_first_tap, **_given(cell.scene), seconds=SECONDS))
        row = {
            "cell": cell.name,
            "hcm": _described(own, truth),
            "SciPy RK45, defaults": _described(scipy, truth),
        }
        if importlib.util.find_spec("exudyn") is not None:
            row["Exudyn, adaptive steps"] = _exudyn_cell(cell, result, truth)
        rows.append(row)
    return rows
