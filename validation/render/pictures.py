"""The pictures of a run; importing it loads VTK."""

from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from validation.render.details import draw_patch, draw_shape, write_gif
from validation.render.interactive import write_interactive
from validation.render.run_folder import DrawnRun, read_curves
from validation.render.views import PRESSURE, SPEED, STRESS, contact_sheet, deformed, draw, lowest_x

FRAMES = 6
SCALE_PERCENTILE = 99.7


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
