"""Off-screen renders, each made in a process of its own: VTK ends a crash without an exception."""

import ctypes
import ctypes.util
import subprocess
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

LIBRARIES = "libgl1 libegl1 libglu1-mesa libxft2 libxcursor1 libxinerama1 libgomp1"
TIMEOUT_S = 300

STILL = ("stress", "velocity", "sequence")
PICTURES = ("stress", "velocity", "pressure", "shape", "sequence", "animation")


@dataclass(frozen=True)
class Renders:
    """Pictures of one run, and why some are missing."""

    pictures: dict[str, Path]
    problem: str = ""


def missing_libraries() -> str:
    """What keeps VTK from drawing off-screen here, empty if nothing does.

    VTK needs libGL to be imported, and EGL or OSMesa to open an off-screen window.
    """

    def loads(*names: str) -> bool:
        for name in names:
            try:
                ctypes.CDLL(ctypes.util.find_library(name) or f"lib{name}.so.1")
            except OSError:
                continue
            return True
        return False

    lacking = [
        title
        for title, present in (
            ("libGL", loads("GL")),
            ("libEGL or libOSMesa", loads("EGL", "OSMesa")),
        )
        if not present
    ]
    if not lacking:
        return ""
    return f"{' and '.join(lacking)} cannot be loaded; on Debian or Ubuntu: apt install {LIBRARIES}"


def render_run(run_folder: Path, out: Path, prefix: str, wanted: Sequence[str] = STILL) -> Renders:
    """Draw pictures of one run from its ``fields`` folder.

    Parameters
    ----------
    run_folder : holds summary.json and fields/tap.pvd.
    out : folder for the pictures, named ``<prefix>-<what>.png`` (the animation: ``.gif``).
    wanted : which of `PICTURES`; a pressure is drawn where the fields hold one.
    """
    problem = missing_libraries()
    if problem:
        return Renders({}, problem)
    out.mkdir(parents=True, exist_ok=True)
    command = [sys.executable, "-m", "validation.render.worker", str(run_folder), str(out), prefix]
    command += wanted
    try:
        done = subprocess.run(
            command, capture_output=True, text=True, timeout=TIMEOUT_S, check=False
        )
    except subprocess.TimeoutExpired:
        return Renders(_pictures(out, prefix, wanted), f"rendering took longer than {TIMEOUT_S} s")
    if done.returncode == 0:
        return Renders(_pictures(out, prefix, wanted))
    if done.returncode < 0:
        cause = (
            f"VTK crashed (signal {-done.returncode}); on Debian or Ubuntu: apt install {LIBRARIES}"
        )
    else:
        cause = (done.stderr.strip().splitlines() or ["no message"])[-1]
    return Renders(_pictures(out, prefix, wanted), f"rendering failed: {cause}")


def _pictures(out: Path, prefix: str, wanted: Sequence[str]) -> dict[str, Path]:
    suffixes = {what: "gif" if what == "animation" else "png" for what in wanted}
    files = {what: out / f"{prefix}-{what}.{suffix}" for what, suffix in suffixes.items()}
    return {what: path for what, path in files.items() if path.is_file()}
