"""``fingertap stress --peers``: ten of the hardest cells, by hcm, by SciPy's and by Exudyn's means.

Seven cells are frictionless with e* = 1, so that their contact is a one-sided linear spring, which
any solver can express; three have friction, loops or torques. Exudyn gets the seven (its one-sided
contact is switched by hand, see `validation.peers.exudyn_finger`), with adaptive steps, and is told
when to look for contact and for how long. The others would need Python code in each of its steps.
"""

import time
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from typing import Any

import hcm
from validation.harness.interrupts import unless_interrupted
from validation.harness.processes import CrashedError, call_isolated
from validation.harness.provenance import installed
from validation.harness.uncertainty import two_digits
from validation.models.adapter import Progress
from validation.peers import exudyn_finger
from validation.peers.scipy_ivp import solve_first_tap
from validation.studies.stress.hcm.judge import tighter
from validation.studies.stress.hcm.maps import STIFFNESS, soft_finger, soft_scene
from validation.studies.stress.judging import judged_scalars, largest_difference

# A tap's peak F_n (N) and impulse (N s).
PeakAndImpulse = tuple[float, ...]
# How a solver ended, its tap, and its wall time in s.
PeerAnswer = tuple[str, PeakAndImpulse | None, float]

SECONDS = 30.0
FLIGHT_STEP_S, CONTACT_STEPS = 1e-4, 2000
# Exudyn looks for contact from this share of its time before it, for this multiple of its duration.
BEFORE, WINDOW = 0.002, 1.3


def hard_cells() -> dict[str, hcm.Scene]:
    """Scenes by the reason why they are hard; first those that every solver can express."""
    soft = partial(soft_scene, friction=0.0, max_steps=100_000)
    slender = hcm.Phalanx(0.04, 0.0004, 1e9, 1400.0, elements=20)
    return {
        "stiffest beams, E 1e12 Pa": soft(soft_finger(1e12)),
        "softest beams, E 1e6 Pa": soft(soft_finger(1e6)),
        "stiffest tip, k 1e10 N/m": soft(tip=hcm.Tip(1e10)),
        "softest tip, k 1e3 N/m": soft(tip=hcm.Tip(1e3)),
        "slenderness 100, 20 elements": soft(hcm.Finger((slender,) * 3)),
        "80 elements a phalanx": soft(soft_finger(elements=80)),
        "30 phalanges": soft(soft_finger(count=30, elements=2), 0.96),
        "friction 10, tangential ratio 1e3": soft(friction=10.0, tip=hcm.Tip(STIFFNESS, 1.0, 1e3)),
        "e* 0.05, friction 5.3: a tap that barely ends": soft(
            friction=5.337, tip=hcm.Tip(STIFFNESS, 0.05, 284.8)
        ),
        "torques that wind the finger up": soft(
            friction=0.5, drive=hcm.Drive((0.00631,) * 3, 1.233)
        ),
    }


def peak_and_impulse(result: hcm.TapResult) -> PeakAndImpulse | None:
    """Peak and impulse of the first tap in a run of hcm, None if it has none."""
    scalars = judged_scalars(result.summary, result.history)
    return None if scalars is None else scalars[:2]


def _described(answer: PeerAnswer, truth: PeakAndImpulse | None) -> str:
    """A cell of the table: how it ended, how far it is from the truth, its time."""
    ending, tap, seconds = answer
    error = largest_difference(tap, truth)
    off = "" if error is None else f", off by {two_digits(100 * error)} %"
    return f"{ending}{off} ({seconds:.2g} s)"


def _timed(solve: Callable[[], tuple[str, PeakAndImpulse | None]]) -> PeerAnswer:
    start = time.perf_counter()
    ending, tap = solve()
    return ending, tap, time.perf_counter() - start


def _hcm(scene: hcm.Scene) -> hcm.TapResult:
    return unless_interrupted(hcm.simulate_scene(scene))


def _exudyn(scene: hcm.Scene, contact_s: float, window_s: float) -> PeerAnswer:
    """Solve by Exudyn, in a process of its own whose start and imports are not timed."""
    exudyn_finger.load()

    def solve() -> tuple[str, PeakAndImpulse | None]:
        try:
            found = exudyn_finger.tap(
                scene, FLIGHT_STEP_S, window_s / CONTACT_STEPS, True,
                (1 - BEFORE) * contact_s, adaptive=True, window=window_s,
            ).quantities  # fmt: skip
        except exudyn_finger.PeerFailedError as error:
            return str(error), None
        return "completed", (found.peak_normal_force_N, found.normal_impulse_N_s)

    return _timed(solve)


def _exudyn_cell(scene: hcm.Scene, result: hcm.TapResult, truth: PeakAndImpulse | None) -> str:
    """Its adaptive steps may shrink without end, within one call of its own code."""
    s = result.summary
    if scene.surface.friction or scene.tip.restitution < 1.0:
        return "not expressible without Python in the step"
    if s.contact_time_s is None or s.contact_duration_s is None:
        return "no contact to look for"
    window = WINDOW * s.contact_duration_s
    try:
        answer = call_isolated(_exudyn, scene, s.contact_time_s, window, limit_s=SECONDS)
    except CrashedError as ended:
        return f"no answer: {ended}"
    return _described(answer, truth)


def peers_table(progress: Progress) -> list[dict[str, Any]]:
    """One row per cell; an error is the larger of peak F_n and impulse against a tighter run."""
    cells, rows = hard_cells(), []
    _hcm(next(iter(cells.values())))  # loads the compiled kernels: not timed
    for number, (name, scene) in enumerate(cells.items()):
        progress(number / len(cells), name)
        start = time.perf_counter()
        result = _hcm(scene)
        seconds = time.perf_counter() - start
        tight = replace(scene, settings=tighter(scene.settings, 5.0, 100.0))
        truth = peak_and_impulse(_hcm(tight))
        own = result.status.value, peak_and_impulse(result), seconds
        scipy = _timed(partial(solve_first_tap, scene, SECONDS))
        row = {
            "cell": name,
            "hcm": _described(own, truth),
            "SciPy RK45, defaults": _described(scipy, truth),
        }
        if installed("exudyn"):
            row["Exudyn, adaptive steps"] = _exudyn_cell(scene, result, truth)
        rows.append(row)
    return rows
