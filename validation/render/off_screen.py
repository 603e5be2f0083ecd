"""Off-screen rendering, each run in its own process: VTK may crash it without an exception."""

import ctypes
import ctypes.util
import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from validation.errors import RunFailedError, UserError
from validation.harness.processes import CrashedError, call_isolated
from validation.render.run_folder import read_run

LIBRARIES = "libgl1 libegl1 libglu1-mesa libxft2 libxcursor1 libxinerama1 libgomp1"
TIMEOUT_S = 300
INTERACTIVE = "interactive"
STILL = ("stress", "velocity", "sequence")
SUFFIXES = {"animation": "gif", INTERACTIVE: "html"}
PICTURES = ("stress", "velocity", "pressure", "shape", "sequence", "animation")


@dataclass(frozen=True)
class Renders:
    """Pictures of one run, why some are missing, and whether its folder was refused."""

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

    run_folder : holds summary.json and fields/tap.pvd.
    out : folder for the pictures, named ``<prefix>-<what>.png`` (see `SUFFIXES`).
    wanted : any of `PICTURES`, or interactive; the pressure is drawn only if the fields have it.
    beside : folders of other runs, whose forces an interactive page shows.
    """
    problem = missing_libraries()
    if problem:
        return Renders({}, problem)
    out.mkdir(parents=True, exist_ok=True)
    files = {what: out / f"{prefix}-{what}.{SUFFIXES.get(what, 'png')}" for what in wanted}
    for path in files.values():  # an earlier run's
        path.unlink(missing_ok=True)
    refused = False
    try:
        call_isolated(draw_run, (run_folder, *beside), files, limit_s=TIMEOUT_S)
    except (UserError, RunFailedError) as error:
        problem, refused = str(error), isinstance(error, UserError)
    except CrashedError as error:
        remedy = f"if VTK crashed, on Debian or Ubuntu: apt install {LIBRARIES}"
        problem = f"rendering failed: {error}; {remedy}"
    return Renders({what: path for what, path in files.items() if path.is_file()}, problem, refused)


def draw_run(folders: Sequence[Path], files: Mapping[str, Path]) -> None:
    """Draw pictures of the first folder's run; in a process of its own, whose stderr it discards.

    files : by the names of `pictures.Drawing`'s methods.

    Raises UserError: a folder holds no run to draw.
    Raises RunFailedError: the drawing failed.
    """
    with open(os.devnull, "wb") as nothing:
        os.dup2(nothing.fileno(), 2)
    try:
        from validation.render.pictures import Drawing  # it loads VTK

        drawing = Drawing(read_run(folders[0]), folders)
        for what, path in files.items():
            getattr(drawing, what)(path)
    except UserError:
        raise
    except Exception as error:
        raise RunFailedError(f"rendering failed: {type(error).__name__}: {error}") from error
