"""Programs that run the bar of `validation.peers.bar` beside the reference.

Every program runs in a process of its own, in a temporary folder, for a bounded time.
"""

import json
import os
import subprocess
import sys
import tempfile
from collections.abc import Callable
from dataclasses import asdict, dataclass, replace
from functools import partial
from pathlib import Path

from validation.harness.provenance import installed, version
from validation.peers import calculix, calculix_bar
from validation.peers.bar import TIMEOUT_S, Bar, BarRun

ROOT = Path(__file__).resolve().parents[2]


def _run_module(name: str, bar: Bar, _element: str) -> BarRun:
    """Run a module of this package as a program."""
    path = os.pathsep.join(filter(None, (str(ROOT), os.environ.get("PYTHONPATH"))))
    threads = {"OMP_NUM_THREADS": str(bar.threads), "PYTHONPATH": path}
    with tempfile.TemporaryDirectory() as folder:
        done = subprocess.run(
            [sys.executable, "-m", f"validation.peers.{name}", json.dumps(asdict(bar))],
            cwd=folder, env={**os.environ, **threads}, capture_output=True, text=True,
            timeout=TIMEOUT_S, check=False,
        )  # fmt: skip
    # Kratos says good-bye on standard output, after the result
    answers = [line for line in done.stdout.splitlines() if line.startswith("{")]
    if done.returncode or not answers:
        raise RuntimeError((done.stderr.strip().splitlines() or ["no answer"])[-1])
    return BarRun(**json.loads(answers[-1]))


@dataclass(frozen=True)
class BarProgram:
    """A program that can run the bar with some of its elements.

    module : its Python package, also its distribution's name; empty for CalculiX. run_bar raises
    RuntimeError, OSError, ValueError or subprocess.TimeoutExpired where the program fails.
    most_threads : that it can use. Akantu has more cores by MPI alone, which its wheel lacks.
    """

    name: str
    licence: str
    install: str
    module: str
    elements: tuple[str, ...]
    run_bar: Callable[[Bar, str], BarRun]
    most_threads: int = sys.maxsize

    def taken(self, bar: Bar) -> Bar:
        """The bar, on as many threads as the program can use."""
        return replace(bar, threads=min(bar.threads, self.most_threads))

    @property
    def present(self) -> bool:
        """Whether it can be run."""
        return installed(self.module) if self.module else calculix.available()

    @property
    def version(self) -> str:
        """The installed version."""
        return version(self.module) if self.module else calculix.version()


_EXTRA = "pip install 'fingertap[bench]'"
PROGRAMS = (
    BarProgram("CalculiX", "GPL-2.0-or-later", "apt-get install calculix-ccx", "",
               ("C3D8", "C3D8R"), calculix_bar.run_bar),
    BarProgram("Akantu", "LGPL-3.0", _EXTRA, "akantu", ("hexahedron_8",),
               partial(_run_module, "akantu_bar"), 1),
    BarProgram("Kratos", "BSD-4-Clause", _EXTRA, "KratosMultiphysics",
               ("SmallDisplacementElement3D8N",), partial(_run_module, "kratos_bar")),
)  # fmt: skip


def absent() -> list[str]:
    """Programs that are not installed, with how to get them."""
    return [f"{program.name} ({program.install})" for program in PROGRAMS if not program.present]
