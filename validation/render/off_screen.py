"""Off-screen rendering, each run in its own process: VTK may crash it without an exception."""

import ctypes
import ctypes.util
import os
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from validation.errors import RunFailedError, UserError
from validation.harness.processes import CrashedError, call_isolated
from validation.render.details import draw_patch, draw_shape, write_gif
from validation.render.interactive import write_interactive
from validation.render.run_folder import DrawnRun, read_curves, read_run
from validation.render.views import PRESSURE, SPEED, STRESS, contact_sheet, deformed, draw, lowest_x

LIBRARIES = "libgl1 libegl1 libglu1-mesa libxft2 libxcursor1 libxinerama1 libgomp1"
TIMEOUT_S = 300
INTERACTIVE = "interactive"
STILL = ("stress", "velocity", "sequence")
SUFFIXES = {"animation": "gif", INTERACTIVE: "html"}
PICTURES = ("stress", "velocity", "pressure", "shape", "sequence", "animation")
FRAMES = 6
SCALE_PERCENTILE = 99.7


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


@dataclass(frozen=True)
class Drawing:
    """A run's pictures, each a method that writes its file, and what they share.

    folders : of the run, then those of others, whose forces an interactive page shows.
    """

    run: DrawnRun
    folders: Sequence[Path]

    @cached_property
    def moments(self) -> list[str]:
        """Times of the steps, counted from the first touch, or from the start without one."""
        since = "t" if self.run.contact_s is None else "t - t_c"
        return [f"{since} = {time} µs" for time in self.run.since_touch()]

    @cached_property
    def peak(self) -> int:
        """Number of the step nearest to the peak force; the last one if nothing touched."""
        times = [time for time, _ in self.run.steps]
        at = times[-1] if self.run.peak_s is None else self.run.peak_s
        return int(np.abs(np.subtract(times, at)).argmin())

    @property
    def file(self) -> Path:
        """The fields nearest to the peak force."""
        return self.run.steps[self.peak][1]

    @property
    def text(self) -> str:
        """Title of a picture at peak force."""
        which = " (peak force)" * (self.run.peak_s is not None)
        return f"{self.run.title}\n{self.moments[self.peak]}{which}"

    @cached_property
    def inside(self) -> Any:
        """The body at peak force, cut in the plane of motion."""
        return deformed(self.file, cut=True)

    @cached_property
    def whole(self) -> Any:
        """The body at peak force."""
        return deformed(self.file, cut=False)

    @property
    def stress_limits(self) -> tuple[float, float]:
        """Stress scale, cut at a percentile: a few contact elements would leave the rest black."""
        return 0.0, float(np.percentile(self.inside[STRESS], SCALE_PERCENTILE)) or 1.0

    def stress(self, path: Path) -> None:
        """Stress in the plane of motion at peak force."""
        largest = float(np.max(self.inside[STRESS]))
        height, limits = self.run.height_m, self.stress_limits
        beyond = ", beyond the scale" * (largest > limits[1])
        text = f"{self.text}\nlargest {largest:.3g} MPa{beyond}"
        draw(path, self.inside, STRESS, text, height, zoom=True, limits=limits)

    def velocity(self, path: Path) -> None:
        """Speed of the whole finger at peak force."""
        limits = (0.0, float(np.max(self.whole[SPEED])) or 1.0)
        draw(path, self.whole, SPEED, self.text, self.run.height_m, zoom=False, limits=limits)

    def pressure(self, path: Path) -> None:
        """Contact pressure at peak force."""
        if PRESSURE in self.whole.array_names:
            draw_patch(path, self.whole, self.text, self.run.height_m)

    def shape(self, path: Path) -> None:
        """The deformation at peak force, enlarged."""
        draw_shape(path, self.file, self.text, self.run.height_m)

    def sequence(self, path: Path) -> None:
        """The tap in a few frames side by side."""
        indices = np.linspace(0, len(self.run.steps) - 1, min(FRAMES, len(self.run.steps)))
        with self._frames(indices.round().astype(int), path, bar_on_each=False) as frames:
            contact_sheet(path, frames, columns=3)

    def animation(self, path: Path) -> None:
        """The tap as a GIF."""
        with self._frames(range(len(self.run.steps)), path, bar_on_each=True) as frames:
            write_gif(path, frames)

    def interactive(self, path: Path) -> None:
        """The tap as an interactive page, its forces beside those of the other runs."""
        since = self.run.contact_s or 0.0
        steps = [(t - since, deformed(file, cut=True)) for t, file in self.run.steps]
        curves = dict(read_curves(folder) for folder in self.folders)
        shown = steps, self.run.since_touch(), STRESS, self.stress_limits, self.run.height_m, curves
        write_interactive(path, self.run.title, *shown)

    @contextmanager
    def _frames(self, steps: Iterable[int], path: Path, bar_on_each: bool) -> Iterator[list[Path]]:
        """Draw the stress of some steps from one viewpoint, in files removed after the block."""
        frames, last = [], len(self.run.steps) - 1
        for number in steps:
            frames.append(path.with_name(f".{path.stem}-{number}.png"))
            draw(
                frames[-1],
                deformed(self.run.steps[number][1], cut=True),
                STRESS,
                self.moments[number],
                self.run.height_m,
                zoom=True,
                limits=self.stress_limits,
                with_bar=bar_on_each or number == last,
                look_at=lowest_x(self.inside),
            )
        yield frames
        for frame in frames:
            frame.unlink()


def draw_run(folders: Sequence[Path], files: Mapping[str, Path]) -> None:
    """Draw pictures of the first folder's run; in a process of its own, whose stderr it discards.

    files : by the names of `Drawing`'s methods.

    Raises UserError: a folder holds no run to draw.
    Raises RunFailedError: the drawing failed.
    """
    with open(os.devnull, "wb") as nothing:
        os.dup2(nothing.fileno(), 2)
    try:
        drawing = Drawing(read_run(folders[0]), folders)
        for what, path in files.items():
            getattr(drawing, what)(path)
    except UserError:
        raise
    except Exception as error:
        raise RunFailedError(f"rendering failed: {type(error).__name__}: {error}") from error
