"""CalculiX (GPL-2 or later): parts of an input file, one run of the program, what it printed."""

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

from validation.curve_files.solver_output import with_exponents

PROGRAM = "ccx"
COMPLETED, TIMED_OUT, NOT_CONVERGED = "completed", "timed out", "not converged"
_NUMBERED_ROW = re.compile(r"\s*\d+(\s+\S+){3}\s*$")
_GIVEN_UP = ("no convergence", "too many cutbacks", "increment size smaller than minimum")


@dataclass(frozen=True)
class CalculixRun:
    """How a run ended and what it left.

    answer : COMPLETED, TIMED_OUT, NOT_CONVERGED, or "stopped: " and the program's last error
    said : its standard output and errors; empty where it was killed.
    printed : its .dat file, as far as it got
    wall_time_s : of the whole process
    """

    answer: str
    said: str
    printed: str
    wall_time_s: float


def available() -> bool:
    """Whether CalculiX is installed."""
    return shutil.which(PROGRAM) is not None


def version() -> str:
    """The version that ``ccx -v`` prints."""
    said = subprocess.run([PROGRAM, "-v"], capture_output=True, text=True, check=False).stdout
    return said.strip().removeprefix("This is Version").strip()


def run_calculix(deck: str, timeout_s: float, threads: int = 1) -> CalculixRun:
    """Run an input file in a folder of its own; killed after `timeout_s`."""
    with tempfile.TemporaryDirectory() as folder:
        (Path(folder) / "job.inp").write_text(deck, encoding="ascii")
        start = time.perf_counter()
        code: int | None = None
        try:
            done = subprocess.run(
                [PROGRAM, "job"], cwd=folder, stdout=subprocess.PIPE, stderr=subprocess.STDOUT,
                text=True, errors="replace", timeout=timeout_s, check=False,
                env={**os.environ, "OMP_NUM_THREADS": str(threads)},
            )  # fmt: skip
            code, said = done.returncode, done.stdout
        except subprocess.TimeoutExpired:
            said = ""
        seconds = time.perf_counter() - start
        data = Path(folder) / "job.dat"
        printed = data.read_text(encoding="ascii", errors="replace") if data.exists() else ""
    return CalculixRun(answer(code, said), said, with_exponents(printed), seconds)


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


def nodes(name: str, points: NDArray[np.float64], first: int = 1) -> list[str]:
    """A set of nodes (n, 3), m, numbered from `first`."""
    rows = enumerate(points.tolist(), first)
    return [f"*NODE,NSET={name}", *(f"{n},{x:.12g},{y:.12g},{z:.12g}" for n, (x, y, z) in rows)]


def elements(kind: str, name: str, cells: NDArray[np.int64], first: int = 1) -> list[str]:
    """A set of hexahedra (m, 8), nodes counted from 1 in VTK's order, numbered from `first`."""
    rows = [f"{n},{','.join(map(str, row))}" for n, row in enumerate(cells.tolist(), first)]
    return [f"*ELEMENT,TYPE={kind},ELSET={name}", *rows]


def material(name: str, young: float, poisson: float, density: float, filled: str) -> list[str]:
    """An elastic material (Pa, -, kg/m^3) and the set of elements that it fills."""
    return [
        f"*MATERIAL,NAME={name}", "*ELASTIC", f"{young},{poisson}", "*DENSITY", f"{density}",
        f"*SOLID SECTION,ELSET={filled},MATERIAL={name}",
    ]  # fmt: skip


def last_vectors(printed: str, heading: str) -> NDArray[np.float64] | None:
    """Vectors (n, 3) of nodes in the last table under a heading of a .dat file; None: no table."""
    _, found, table = printed.rpartition(heading)
    rows = [line.split()[1:] for line in table.splitlines() if _NUMBERED_ROW.match(line)]
    return np.array(rows, dtype=float) if found and rows else None
