"""The bar in CalculiX: C3D8 and C3D8R, small strain, explicit dynamics.

Version 2.20 hangs if ``DIRECT`` prescribes the step beside ``EXPLICIT``, so it takes its own stable
step, which it prints. The cost of a step is the difference in time between a long run and a short
one over the difference in steps: reading the mesh does not count.
"""

import math
import re
import subprocess

import numpy as np

from validation.peers import calculix
from validation.peers.bar import DENSITY, STEP_S, TIMEOUT_S, YOUNG, Bar, BarRun

POINTS = {"C3D8": 8, "C3D8R": 1}
SHORT_STEPS = 2
RUNS = 2
SELECTED = re.compile(r"SELECTED time increment:\s*([0-9.Ee+-]+)")


def deck(bar: Bar, element: str, steps: int) -> str:
    """CalculiX's input file for the bar."""
    points, cells = bar.mesh()
    velocity = bar.velocity(points)[:, 0]
    lines = [*calculix.nodes("ALL", points), *calculix.elements(element, "BAR", cells + 1)]
    ends = np.flatnonzero(points[:, 0] == 0.0) + 1
    lines += ["*NSET,NSET=END", *(f"{n}," for n in ends.tolist())]
    lines += [
        *calculix.material("M", YOUNG, 0.0, DENSITY, "BAR"),
        "*INITIAL CONDITIONS,TYPE=VELOCITY",
    ]
    lines += [f"{n},1,{v:.12g}" for n, v in enumerate(velocity.tolist(), 1)]
    duration = steps * STEP_S
    lines += ["*STEP,INC=10000000", "*DYNAMIC,EXPLICIT=2", f"{STEP_S:.10g},{duration:.12g}",
              "*NODE PRINT,NSET=END,FREQUENCY=1000000", "U", "*END STEP"]  # fmt: skip
    return "\n".join(lines) + "\n"


def _run_once(bar: Bar, element: str, steps: int) -> tuple[float, float, float]:
    """Run it once; returns seconds, the step that it took, and the end's displacement."""
    done = calculix.run_calculix(deck(bar, element, steps), TIMEOUT_S, bar.threads)
    if done.answer == calculix.TIMED_OUT:
        raise subprocess.TimeoutExpired(calculix.PROGRAM, TIMEOUT_S)
    selected = SELECTED.search(done.said)
    ends = calculix.last_vectors(done.printed, "displacements")
    if done.answer != calculix.COMPLETED or selected is None or ends is None:
        raise RuntimeError(done.answer)
    return done.wall_time_s, float(selected[1]), sum(ends[:, 0].tolist()) / len(ends)


def run_bar(bar: Bar, element: str) -> BarRun:
    """Time a short and a long run, each several times."""
    short, long = (
        [_run_once(bar, element, steps) for _ in range(RUNS)] for steps in (SHORT_STEPS, bar.steps)
    )
    _, step, end = long[0]
    few, many = (math.ceil(count * STEP_S / step) for count in (SHORT_STEPS, bar.steps))
    saved = min(seconds for seconds, _, _ in long) - min(seconds for seconds, _, _ in short)
    return BarRun(POINTS[element], saved / (many - few), end, step, RUNS)
