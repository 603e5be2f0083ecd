"""Off-screen renders, each made in a process of its own: VTK ends a crash without an exception."""

import ctypes
import ctypes.util
import subprocess
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from validation.errors import UserError

LIBRARIES = "libgl1 libegl1 libglu1-mesa libxft2 libxcursor1 libxinerama1 libgomp1"
TIMEOUT_S = 300

INTERACTIVE = "interactive"
STILL = ("stress", "velocity", "sequence")
SUFFIXES = {"animation": "gif", INTERACTIVE: "html"}
PICTURES = ("stress", "velocity", "pressure", "shape", "sequence", "animation")


@dataclass(frozen=True)
class Renders:
    """Pictures of one run, why some are missing, and whether the run is no run to draw."""

    pictures: dict[str, Path]
    problem: str = ""
    refused: bool = False


def missing_libraries() -> str:
    """What keeps VTK from drawing off-screen here, empty if nothing does.

    VTK needs libGL to be imported, and EGL or OSMesa to open an off-screen window.
    """

    def loads(name: str) -> bool:
        try:
            ctypes.CDLL(ctypes.util.find_library(name) or f"lib{name}.so.1")
        except OSError:
            return False
        return True

    alternatives = ("GL",), ("EGL", "OSMesa")
    lacking = [
        " or ".join(f"lib{name}" for name in names)
        for names in alternatives
        if not any(map(loads, names))
    ]
    if not lacking:
        return ""
    return f"{' and '.join(lacking)} cannot be loaded; on Debian or Ubuntu: apt install {LIBRARIES}"


def render_run(
    run_folder: Path,
    out: Path,
    prefix: str,
    wanted: Sequence[str] = STILL,
    beside: Sequence[Path] = (),
) -> Renders:
    """Draw pictures of one run from its ``fields`` folder.

    Parameters
    ----------
    run_folder : holds summary.json and fields/tap.pvd.
    out : folder for the pictures, named ``<prefix>-<what>.png`` (see `SUFFIXES`).
    wanted : which of `PICTURES`, or interactive; a pressure is drawn where the fields hold one.
    beside : folders of other runs, whose forces an interactive page shows.
    """
    problem = missing_libraries()
    if problem:
        return Renders({}, problem)
    out.mkdir(parents=True, exist_ok=True)
    folders = map(str, (run_folder, *beside))
    problem, refused = _draw([str(out), prefix, ",".join(wanted), *folders])
    files = {what: out / f"{prefix}-{what}.{SUFFIXES.get(what, 'png')}" for what in wanted}
    return Renders({what: path for what, path in files.items() if path.is_file()}, problem, refused)


def _draw(arguments: Sequence[str]) -> tuple[str, bool]:
    """Run `worker` on its arguments; why it failed, and whether by what it was given to draw."""
    command = [sys.executable, "-m", "validation.render.worker", *arguments]
    try:
        done = subprocess.run(
            command, capture_output=True, text=True, timeout=TIMEOUT_S, check=False
        )
    except subprocess.TimeoutExpired:
        return f"rendering took longer than {TIMEOUT_S} s", False
    if done.returncode == 0:
        return "", False
    cause = (done.stderr.strip().splitlines() or ["no message"])[-1]
    if done.returncode < 0:
        hint = f"on Debian or Ubuntu: apt install {LIBRARIES}"
        cause = f"VTK crashed (signal {-done.returncode}); {hint}"
    if done.returncode == UserError.exit_code:
        return cause, True
    return f"rendering failed: {cause}", False
