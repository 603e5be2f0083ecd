"""One run of CalculiX: a folder and a process of its own, a bounded time, what it printed."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

PROGRAM = "ccx"
COMPLETED, TIMED_OUT, NOT_CONVERGED = "completed", "timed out", "not converged"
_FORCE = re.compile(
    r"total force \(fx,fy,fz\) for set FLOOR and time\s+(\S+)\s+(\S+)\s+(\S+)\s+(\S+)"
)
_NODE = re.compile(r"\s*\d+(\s+\S+){3}\s*$")
_GIVEN_UP = ("no convergence", "too many cutbacks", "increment size smaller than minimum")


@dataclass(frozen=True)
class Ran:
    """What it answered.

    Attributes
    ----------
    answer
        COMPLETED, TIMED_OUT, NOT_CONVERGED, or "stopped: " and what it said.
    time_s, normal_force_N : (k,)
        After every increment, of the meshed half.
    velocity : (n, 3) | None
        Of the block's nodes after the last increment, m/s; None if it made none.
    wall_time_s
        Of the whole process.
    """

    answer: str
    time_s: NDArray[np.float64]
    normal_force_N: NDArray[np.float64]
    velocity: NDArray[np.float64] | None
    wall_time_s: float


def available() -> bool:
    """Whether CalculiX is installed."""
    return shutil.which(PROGRAM) is not None


def run(deck: str, timeout_s: float) -> Ran:
    """Run an input file on one thread; killed after `timeout_s`, what it printed so far is kept."""
    with tempfile.TemporaryDirectory() as folder:
        (Path(folder) / "tap.inp").write_text(deck, encoding="ascii")
        start = time.perf_counter()
        code: int | None = None
        try:
            done = subprocess.run(
                [PROGRAM, "tap"], cwd=folder, stdout=subprocess.PIPE, stderr=subprocess.STDOUT,
                text=True, errors="replace", timeout=timeout_s, check=False,
                env={**os.environ, "OMP_NUM_THREADS": "1"},
            )  # fmt: skip
            code, said = done.returncode, done.stdout
        except subprocess.TimeoutExpired:
            said = ""
        seconds = time.perf_counter() - start
        data = Path(folder) / "tap.dat"
        printed = data.read_text(encoding="ascii", errors="replace") if data.exists() else ""
    times, forces = floor_forces(printed)
    return Ran(answer(code, said), times, forces, last_velocities(printed), seconds)


def floor_forces(printed: str) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Times (s) and the floor's upward forces (N) of all increments in a .dat file."""
    found = np.array([(m[1], m[3]) for m in _FORCE.finditer(printed)], dtype=float).reshape(-1, 2)
    return found[:, 0], found[:, 1]


def last_velocities(printed: str) -> NDArray[np.float64] | None:
    """Nodes' velocities (n, 3), m/s, after the last increment that a .dat file has them of."""
    _, _, block = printed.rpartition("velocities (vx,vy,vz)")
    rows = [line.split()[1:] for line in block.splitlines() if _NODE.match(line)]
    return np.array(rows, dtype=float) if rows else None


def answer(code: int | None, said: str) -> str:
    """How a run ended, by its exit code (None: killed) and what it said."""
    if code is None:
        return TIMED_OUT
    if code == 0 and "Job finished" in said:
        return COMPLETED
    if any(words in said for words in _GIVEN_UP):
        return NOT_CONVERGED
    errors = [line.strip() for line in said.splitlines() if "*ERROR" in line]
    return f"stopped: {errors[-1] if errors else f'exit code {code}'}"
