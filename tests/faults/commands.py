"""Commands under fault: started in a process group of their own, completed."""

import os
import signal
import subprocess
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from tests.processes import COMMAND, started

PATIENCE_S = 900.0
ORPHAN_S = 10.0  # within which every process of a command that was killed has to be gone

RUN = ("run", "soft", "--model", "hcm")
PLANE = ("run", "soft", "--model", "fem2d", "--set", "surface.height=0.06")
LONG = (  # the whole fall by explicit steps
    *("run", "soft", "--model", "fem2d", "--set", "solver.fem.flight=explicit"),
    *("--set", "surface.height=0.07", "--resume"),
)
SOLID = (
    *("run", "soft", "--model", "fem3d", "--set", "solver.fem.flight=explicit"),
    *("--set", "surface.height=0.06", "--set", "solver.fem.tip_size=4e-3"),
    *("--set", "solver.fem.section_size=4e-3", "--set", "solver.fem.axial_size=8e-3", "--resume"),
)
PAPER = ("paper", "--no-reference")
STRESS = ("stress", "--quick")
VALIDATE = ("validate",)


@dataclass(frozen=True)
class Ended:
    """How a command ended: its exit code, what it said on standard error, and after how long."""

    code: int
    error: str
    seconds: float

    @property
    def lines(self) -> list[str]:
        return self.error.strip().splitlines()


def start(arguments: tuple[str, ...], out: Path, **popen: Any) -> "subprocess.Popen[str]":
    """A command that writes into a folder; one thread, for the machine is shared."""
    return started(
        "-c", COMMAND, *arguments, "--out", out,
        env={"OMP_NUM_THREADS": "1", "OMP_WAIT_POLICY": "passive"},
        stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, start_new_session=True, **popen,
    )  # fmt: skip


def finish(process: "subprocess.Popen[str]") -> Ended:
    """Wait for a command's end."""
    began = time.monotonic()
    try:
        _, error = process.communicate(timeout=PATIENCE_S)
    except subprocess.TimeoutExpired:
        os.killpg(process.pid, signal.SIGKILL)
        _, error = process.communicate()
        error += "\nhung: ended by the campaign"
    return Ended(process.returncode, error, time.monotonic() - began)


def complete(arguments: tuple[str, ...], out: Path, **popen: Any) -> Ended:
    """Run a command to its end."""
    return finish(start(arguments, out, **popen))


def orphans(group: int) -> bool:
    """Whether processes of a group live on for longer than they may."""
    deadline = time.monotonic() + ORPHAN_S
    while time.monotonic() < deadline:
        if not _living(group):
            return False
        time.sleep(0.1)
    return True


def _living(group: int) -> bool:
    for status in Path("/proc").glob("[0-9]*/stat"):
        try:
            fields = status.read_text().rpartition(")")[2].split()
        except OSError:
            continue
        if fields[0] != "Z" and int(fields[2]) == group:
            return True
    return False
