"""Programs that run the bar of `validation.peers.bar` beside the reference.

Every program runs in a process of its own, in a temporary folder, for a bounded time.
"""

import os
import sys
import tempfile
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from importlib import import_module
from pathlib import Path

from validation.errors import RunFailedError
from validation.harness.processes import CrashedError, call_isolated
from validation.harness.provenance import installed, version
from validation.peers import calculix, calculix_bar
from validation.peers.bar import PARTS, STEP_S, TIMEOUT_S, Bar, BarRun

ERRORS = "errors.txt"


def _run_apart(module: str, bar: Bar, _element: str) -> BarRun:
    """Run a module of this package in a process of its own."""
    with tempfile.TemporaryDirectory() as folder:
        try:
            seconds, end_m = call_isolated(_run_here, module, bar, folder, limit_s=TIMEOUT_S)
        except CrashedError as error:
            said = Path(folder, ERRORS)
            last = said.read_text(errors="replace").splitlines()[-1:] if said.exists() else []
            raise RunFailedError(": ".join([f"no answer: {error}", *last])) from error
    return BarRun(8, seconds, end_m, STEP_S, PARTS)


def _run_here(module: str, bar: Bar, folder: str) -> tuple[float, float]:
    """Run it in this process, whose output is not shown: programs say hello and good-bye."""
    os.chdir(folder)
    for stream, name in ((1, os.devnull), (2, ERRORS)):
        with open(name, "wb") as file:
            os.dup2(file.fileno(), stream)
    os.environ["OMP_NUM_THREADS"] = str(bar.threads)
    try:
        found: tuple[float, float] = import_module(f"validation.peers.{module}").run_bar(bar)
    except Exception as error:
        raise RunFailedError(f"{type(error).__name__}: {error}") from error
    return found


@dataclass(frozen=True)
class BarProgram:
    """A program that can run the bar with some of its elements.

    module : its Python package, also its distribution's name; empty for CalculiX. run_bar raises
    RunFailedError, RuntimeError, OSError, ValueError or subprocess.TimeoutExpired where it fails.
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
               partial(_run_apart, "akantu_bar"), 1),
    BarProgram("Kratos", "BSD-4-Clause", _EXTRA, "KratosMultiphysics",
               ("SmallDisplacementElement3D8N",), partial(_run_apart, "kratos_bar")),
)  # fmt: skip


def absent() -> list[str]:
    """Programs that are not installed, with how to get them."""
    return [f"{program.name} ({program.install})" for program in PROGRAMS if not program.present]
