"""The bar in CalculiX (GPL-2 or later): C3D8 and C3D8R, small strain, explicit dynamics.

Version 2.20 hangs where the step is prescribed (``DIRECT``) beside ``EXPLICIT``, so it takes its
own stable step, which its output names. The cost of a step is the difference between a long run
and a short one, over the difference of their steps: reading the mesh is not charged.
"""

import math
import os
import re
import subprocess
import time
from pathlib import Path

from validation.peers.bar import DENSITY, YOUNG, Bar, Ran

PROGRAM = "ccx"
POINTS = {"C3D8": 8, "C3D8R": 1}
SHORT_STEPS = 2
RUNS = 2
SELECTED = re.compile(r"SELECTED time increment:\s*([0-9.Ee+-]+)")


class CalculixError(Exception):
    """CalculiX did not do what was asked; the message says what it said."""


def deck(bar: Bar, element: str, steps: int) -> str:
    """Its input file."""
    points, cells = bar.mesh()
    velocity = bar.velocity(points)[:, 0]
    lines = ["*NODE,NSET=ALL"]
    lines += [f"{n},{x:.9g},{y:.9g},{z:.9g}" for n, (x, y, z) in enumerate(points.tolist(), 1)]
    lines.append(f"*ELEMENT,TYPE={element},ELSET=BAR")
    lines += [f"{n},{','.join(map(str, nodes))}" for n, nodes in enumerate((cells + 1).tolist(), 1)]
    ends = [str(n) for n, place in enumerate(points.tolist(), 1) if place[0] == 0.0]
    lines += ["*NSET,NSET=END", *(f"{n}," for n in ends)]
    lines += ["*MATERIAL,NAME=M", "*ELASTIC", f"{YOUNG},0.", "*DENSITY", f"{DENSITY}"]
    lines += ["*SOLID SECTION,ELSET=BAR,MATERIAL=M", "*INITIAL CONDITIONS,TYPE=VELOCITY"]
    lines += [f"{n},1,{v:.12g}" for n, v in enumerate(velocity.tolist(), 1)]
    duration = steps * bar.step_s
    lines += ["*STEP,INC=10000000", "*DYNAMIC,EXPLICIT=2", f"{bar.step_s:.10g},{duration:.12g}",
              "*NODE PRINT,NSET=END,FREQUENCY=1000000", "U", "*END STEP"]  # fmt: skip
    return "\n".join(lines) + "\n"


def _once(bar: Bar, name: str, timeout_s: float) -> tuple[float, float, float]:
    """Seconds, the step that it took, and the end's displacement."""
    start = time.perf_counter()
    done = subprocess.run(
        [PROGRAM, name], capture_output=True, text=True, timeout=timeout_s, check=False,
        env={**os.environ, "OMP_NUM_THREADS": str(bar.threads)},
    )  # fmt: skip
    seconds = time.perf_counter() - start
    selected = SELECTED.search(done.stdout)
    if done.returncode or selected is None:
        raise CalculixError(" ".join(done.stdout.split()[-20:]) or f"exit code {done.returncode}")
    rows = [line.split() for line in Path(f"{name}.dat").read_text(encoding="ascii").splitlines()]
    found = [float(row[1]) for row in rows if len(row) == 4 and row[0].isdigit()]
    return seconds, float(selected[1]), sum(found) / len(found)


def run(bar: Bar, element: str, timeout_s: float) -> Ran:
    """Run in the current folder.

    Raises
    ------
    CalculixError
        CalculiX failed.
    subprocess.TimeoutExpired
        One of its runs took longer than `timeout_s`.
    """
    names = {"short": SHORT_STEPS, "long": bar.steps}
    for name, steps in names.items():
        Path(f"{name}.inp").write_text(deck(bar, element, steps), encoding="ascii")
    found = {name: [_once(bar, name, timeout_s) for _ in range(RUNS)] for name in names}
    step, end = found["long"][0][1:]
    few, many = (math.ceil(count * bar.step_s / step) for count in (SHORT_STEPS, bar.steps))
    short, long = (min(seconds for seconds, _, _ in runs) for runs in found.values())
    per_step = (long - short) / (many - few)
    return Ran("CalculiX", f"{element}, small strain", POINTS[element], per_step, end, step, RUNS)


def version() -> str:
    """What ``ccx -v`` says."""
    said = subprocess.run([PROGRAM, "-v"], capture_output=True, text=True, check=False).stdout
    return said.strip().removeprefix("This is Version").strip()
