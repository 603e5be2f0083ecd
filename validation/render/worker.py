"""The drawing of one run: its pictures and what they share."""

import os
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from validation.errors import RunFailedError, UserError
from validation.render.details import draw_patch, draw_shape, write_gif
from validation.render.interactive import write_interactive
from validation.render.run_folder import DrawnRun, read_curves, read_run
from validation.render.views import PRESSURE, SPEED, STRESS, contact_sheet, deformed, draw, lowest_x

FRAMES = 6
SCALE_PERCENTILE = 99.7


@dataclass(frozen=True)
class Drawing:
    """A run, and what its pictures share."""

    folders: Sequence[Path]
    out: Path
    prefix: str

    @cached_property
    def run(self) -> DrawnRun:
        """The run in the first folder."""
        return read_run(self.folders[0])

    def path(self, what: str, suffix: str = "png") -> Path:
        """The file of a picture."""
        return self.out / f"{self.prefix}-{what}.{suffix}"

    def moment(self, time: float) -> str:
        """A time, counted from the first touch."""
        return f"t - t_c = {(time - self.run.contact_s) * 1e6:.0f} µs"

    @property
    def peak(self) -> tuple[float, Path]:
        """Time and file of the fields nearest to the peak force."""
        return min(self.run.steps, key=lambda step: abs(step[0] - self.run.peak_s))

    @property
    def text(self) -> str:
        """Title of a picture at peak force."""
        return f"{self.run.title}\n{self.moment(self.peak[0])} (peak force)"

    @cached_property
    def inside(self) -> Any:
        """The body at peak force, cut in the plane of motion."""
        return deformed(self.peak[1], cut=True)

    @cached_property
    def whole(self) -> Any:
        """The body at peak force."""
        return deformed(self.peak[1], cut=False)

    @property
    def stress_limits(self) -> tuple[float, float]:
        """Stress scale, cut at a percentile: a few contact elements would leave the rest black."""
        return 0.0, float(np.percentile(self.inside[STRESS], SCALE_PERCENTILE)) or 1.0

    def stress(self) -> None:
        """Stress in the plane of motion at peak force."""
        largest = np.max(self.inside[STRESS])
        text = f"{self.text}\nlargest {largest:.3g} MPa, beyond the scale"
        limits, path = self.stress_limits, self.path("stress")
        draw(path, self.inside, STRESS, text, self.run.height_m, zoom=True, limits=limits)

    def velocity(self) -> None:
        """Speed of the whole finger at peak force."""
        limits = (0.0, float(np.max(self.whole[SPEED])) or 1.0)
        path = self.path("velocity")
        draw(path, self.whole, SPEED, self.text, self.run.height_m, zoom=False, limits=limits)

    def pressure(self) -> None:
        """Contact pressure at peak force."""
        if PRESSURE in self.whole.array_names:
            draw_patch(self.path("pressure"), self.whole, self.text, self.run.height_m)

    def shape(self) -> None:
        """The deformation at peak force, enlarged."""
        draw_shape(self.path("shape"), self.peak[1], self.text, self.run.height_m)

    def sequence(self) -> None:
        """The tap in a few frames side by side."""
        indices = np.linspace(0, len(self.run.steps) - 1, min(FRAMES, len(self.run.steps)))
        chosen = [self.run.steps[index] for index in indices.round().astype(int)]
        with self._frames(chosen, "sequence", bar_on_each=False) as frames:
            contact_sheet(self.path("sequence"), frames, columns=3)

    def animation(self) -> None:
        """The tap as a GIF."""
        with self._frames(self.run.steps, "animation", bar_on_each=True) as frames:
            write_gif(self.path("animation", "gif"), frames)

    def interactive(self) -> None:
        """The tap as an interactive page, its forces beside those of the other runs."""
        steps = [(t - self.run.contact_s, deformed(file, cut=True)) for t, file in self.run.steps]
        curves = dict(read_curves(folder) for folder in self.folders)
        shown = steps, STRESS, self.stress_limits, self.run.height_m, curves
        write_interactive(self.path("interactive", "html"), self.run.title, *shown)

    @contextmanager
    def _frames(
        self, steps: Sequence[tuple[float, Path]], what: str, bar_on_each: bool
    ) -> Iterator[list[Path]]:
        """Draw the stress at some times from one viewpoint, in files removed after the block."""
        frames = []
        for number, (time, file) in enumerate(steps):
            frames.append(self.out / f".{self.prefix}-{what}-{number}.png")
            draw(
                frames[-1],
                deformed(file, cut=True),
                STRESS,
                self.moment(time),
                self.run.height_m,
                zoom=True,
                limits=self.stress_limits,
                with_bar=bar_on_each or number == len(steps) - 1,
                look_at=lowest_x(self.inside),
            )
        yield frames
        for frame in frames:
            frame.unlink()


def draw_run(folders: Sequence[Path], out: Path, prefix: str, wanted: Sequence[str]) -> None:
    """Draw pictures of the first folder's run; in a process of its own, whose stderr it discards.

    folders : the run's folder, then those of other runs, whose forces an interactive page shows.
    wanted : any of `off_screen.PICTURES` or ``interactive``, each a method of `Drawing`.

    Raises UserError: a folder holds no run to draw.
    Raises RunFailedError: the drawing failed.
    """
    with open(os.devnull, "wb") as nothing:
        os.dup2(nothing.fileno(), 2)
    drawing = Drawing(folders, out, prefix)
    try:
        for what in wanted:
            getattr(drawing, what)()
    except UserError:
        raise
    except Exception as error:
        raise RunFailedError(f"rendering failed: {type(error).__name__}: {error}") from error
