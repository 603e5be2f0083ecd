"""The reference's peers on one bar, one after the other: updates per second and displacement.

Every peer runs in a process of its own, in a temporary folder, for a bounded time. One that is not
installed is named and left out; one that fails is a row that says how.
"""

import contextlib
import importlib.util
import json
import os
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from validation.harness.provenance import version
from validation.peers import calculix_bar as bar_calculix
from validation.peers import own_bar as bar_ours
from validation.peers.bar import Bar, Ran

if TYPE_CHECKING:
    import pandas as pd

BAR = Bar((100, 25, 24), 60, 2)
QUICK_BAR = Bar((40, 10, 10), 60, 2)
TIMEOUT_S = 240.0
OWN = "fingertap"
ROOT = Path(__file__).resolve().parents[2]


@dataclass(frozen=True)
class Peer:
    """A peer: its distribution and module where it is a Python package; the elements it runs."""

    name: str
    licence: str
    install: str
    module: str
    elements: tuple[str, ...]

    @property
    def present(self) -> bool:
        """Whether it can be run."""
        if self.name == "CalculiX":
            return shutil.which(bar_calculix.PROGRAM) is not None
        return importlib.util.find_spec(self.module) is not None

    @property
    def version(self) -> str:
        """Of what is installed."""
        if self.name == "CalculiX":
            return bar_calculix.version()
        return version(self.module)


PEERS = (
    Peer("CalculiX", "GPL-2.0-or-later", "apt-get install calculix-ccx", "ccx", ("C3D8", "C3D8R")),
    Peer("Akantu", "LGPL-3.0", "pip install 'fingertap[bench]'", "akantu", ("hexahedron_8",)),
    Peer("Kratos", "BSD-4-Clause", "pip install 'fingertap[bench]'", "KratosMultiphysics",
         ("SmallDisplacementElement3D8N",)),
)  # fmt: skip


@dataclass(frozen=True)
class Row:
    """One code and element; what it did, or why it did not."""

    code: str
    version: str
    licence: str
    element: str
    bar: Bar
    ran: Ran | None
    status: str = "COMPLETED"

    @property
    def updates_per_s(self) -> float | None:
        """Element updates per second of whole steps."""
        return None if self.ran is None else self.bar.elements / self.ran.seconds_per_step


def absent() -> list[str]:
    """Peers that are not installed, with how to get them."""
    return [f"{peer.name} ({peer.install})" for peer in PEERS if not peer.present]


def _calculix(bar: Bar, element: str) -> Ran:
    with tempfile.TemporaryDirectory() as folder, contextlib.chdir(folder):
        return bar_calculix.run(bar, element, TIMEOUT_S)


def _program(name: str) -> Callable[[Bar, str], Ran]:
    def run(bar: Bar, element: str) -> Ran:
        path = os.pathsep.join(filter(None, (str(ROOT), os.environ.get("PYTHONPATH"))))
        threads = {"OMP_NUM_THREADS": str(bar.threads), "PYTHONPATH": path}
        with tempfile.TemporaryDirectory() as folder:
            done = subprocess.run(
                [sys.executable, "-m", f"validation.peers.{name}", json.dumps(bar.arguments())],
                cwd=folder, env={**os.environ, **threads}, capture_output=True, text=True,
                timeout=TIMEOUT_S, check=False,
            )  # fmt: skip
        # Kratos says good-bye on standard output, after the result
        answers = [line for line in done.stdout.splitlines() if line.startswith("{")]
        if done.returncode or not answers:
            raise RuntimeError((done.stderr.strip().splitlines() or ["no answer"])[-1])
        return Ran(**json.loads(answers[-1]))

    return run


RUN: dict[str, Callable[[Bar, str], Ran]] = {
    "CalculiX": _calculix,
    "Akantu": _program("akantu_bar"),
    "Kratos": _program("kratos_bar"),
}


def measure_peer(peer: Peer, bar: Bar, element: str) -> Row:
    """One row; a peer that fails says how."""
    head = (peer.name, peer.version, peer.licence, element, bar)
    try:
        return Row(*head, RUN[peer.name](bar, element))
    except subprocess.TimeoutExpired:
        return Row(*head, None, f"stopped after {TIMEOUT_S:g} s")
    except (bar_calculix.CalculixError, RuntimeError, OSError, ValueError) as error:
        return Row(*head, None, f"failed: {error}")


def measure_all(bar: Bar, progress: Callable[[float, str], None]) -> list[Row]:
    """The reference, every peer that is there, and the reference again: its best time counts.

    All on as many threads as the bar asks for and numba may use.
    """
    import numba

    bar = replace(bar, threads=min(bar.threads, numba.config.NUMBA_NUM_THREADS))
    own: dict[str, Any] = {}
    cases = [(peer, element) for peer in PEERS if peer.present for element in peer.elements]
    rows = []
    for turn in range(2):
        progress(0.9 * turn, "the bar in the reference")
        for element in bar_ours.POINTS:
            ran = bar_ours.run(bar, element)
            best = own.get(element)
            if best is None or ran.seconds_per_step < best.seconds_per_step:
                own[element] = ran
        if not turn:
            for number, (peer, element) in enumerate(cases):
                progress(0.1 + 0.8 * number / len(cases), f"the bar in {peer.name}, {element}")
                rows.append(measure_peer(peer, bar, element))
    ours = [Row(OWN, version("fingertap"), "BSD-3-Clause", element, bar, ran)
            for element, ran in own.items()]  # fmt: skip
    return ours + rows


def fastest_peer(rows: list[Row]) -> Row | None:
    """The peer with the most updates per second."""
    peers = [row for row in rows if row.code != OWN and row.updates_per_s is not None]
    return max(peers, key=lambda row: row.updates_per_s or 0.0, default=None)


def table(rows: list[Row]) -> "pd.DataFrame":
    """One row a code and element; how many times as fast the reference is.

    ``hex8_sri_over_it`` compares with the reference's 8-point hexahedron, ``same_points_over_it``
    with the hexahedron of as many points.
    """
    import pandas as pd

    speed = {row.ran.points: row.updates_per_s for row in rows
             if row.code == OWN and row.ran is not None and row.updates_per_s}  # fmt: skip
    end = next(row.ran.end_m for row in rows if row.ran is not None and row.code == OWN)
    found = []
    for row in rows:
        line: dict[str, Any] = {
            "code": row.code, "version": row.version, "licence": row.licence,
            "element": row.element, "elements": row.bar.elements, "threads": row.bar.threads,
            "status": row.status,
        }  # fmt: skip
        if row.ran is not None and row.updates_per_s is not None:
            line |= {
                "points": row.ran.points,
                "million_updates_per_s": row.updates_per_s / 1e6,
                "hex8_sri_over_it": speed[8] / row.updates_per_s,
                "same_points_over_it": speed[row.ran.points] / row.updates_per_s,
                "end_displacement_um": row.ran.end_m * 1e6,
                "off_exact": row.ran.end_m / row.bar.exact_end_m - 1.0,
                "off_fingertap": row.ran.end_m / end - 1.0,
                "step_us": row.ran.step_s * 1e6,
                "runs": row.ran.runs,
            }
        found.append(line)
    return pd.DataFrame(found)
