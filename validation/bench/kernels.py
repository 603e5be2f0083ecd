"""Element updates per second of the reference's force kernels on a box of 60,000 elements."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from validation.bench.timing import shortest_in_turns

if TYPE_CHECKING:
    import pandas as pd

BOX = (100, 25, 24)  # elements along x, y, z
SHEET = (300, 200)
SIZE_M = 1e-3
YOUNG, POISSON, DENSITY = 1e9, 0.4, 1400.0
STRAIN = 1e-3  # of the random displacement that the force is taken at
THREADS = (1, 2)
BUDGET_S = 3.0

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]


@dataclass(frozen=True)
class Speed:
    """Updates per second of one kernel on a number of threads."""

    element: str
    threads: int
    elements: int
    updates_per_s: float
    runs: int


def box(counts: tuple[int, ...]) -> tuple[Floats, Integers]:
    """Points and cells (VTK's order) of a box of cubes or a sheet of squares; x varies fastest."""
    axes = [np.arange(n + 1) for n in counts]
    grid = np.meshgrid(*reversed(axes), indexing="ij")
    points = (np.stack([axis.ravel() for axis in reversed(grid)], axis=1) * SIZE_M).astype(
        np.float64
    )
    stride = np.cumprod([1, *(n + 1 for n in counts[:-1])])
    corner = [np.arange(n) for n in counts]
    cells = np.meshgrid(*reversed(corner), indexing="ij")
    first = sum(c.ravel() * s for c, s in zip(reversed(cells), stride, strict=True))
    face = [0, stride[0], stride[0] + stride[1], stride[1]]
    offsets = face if len(counts) == 2 else [*face, *(stride[2] + o for o in face)]
    return points, (np.asarray(first)[:, None] + np.array(offsets)).astype(np.int64)


def factories(points: Floats, cells: Integers) -> dict[str, Callable[[], Any]]:
    """What builds each element that a mesh of this dimension can take."""
    from reference_fem.model import ELEMENTS

    n = len(cells)
    young, poisson, density = (np.full(n, value) for value in (YOUNG, POISSON, DENSITY))
    radius = np.full(n, np.abs(points[:, 1]).max())
    return {
        name: partial(build, points, cells, young, poisson, density, radius)
        for name, build in ELEMENTS[points.shape[1]].items()
    }


def measure(counts: tuple[int, ...], threads: tuple[int, ...], budget_s: float) -> list[Speed]:
    """Time the force of every element of one dimension."""
    import numba

    points, cells = box(counts)
    if len(counts) == 2:
        points = points - [0.0, points[:, 1].max() / 2]  # the chord's thickness is about y = 0
    displacement = STRAIN * SIZE_M * np.random.default_rng(0).standard_normal(points.shape)
    force = np.empty_like(points)
    before = numba.get_num_threads()
    available = [n for n in threads if n <= numba.config.NUMBA_NUM_THREADS]

    def force_on(kernel: Any, count: int) -> None:
        numba.set_num_threads(count)
        kernel.internal_force(displacement, force)

    built = {name: build() for name, build in factories(points, cells).items()}
    cases = [(name, count) for name in built for count in available]
    try:
        times = shortest_in_turns([partial(force_on, built[n], c) for n, c in cases], budget_s)
    finally:
        numba.set_num_threads(before)
    return [
        Speed(name, count, len(cells), len(cells) / timed.wall_time_s, timed.runs)
        for (name, count), timed in zip(cases, times, strict=True)
    ]


def measure_all(progress: Callable[[float, str], None]) -> list[Speed]:
    """Solid hexahedra, then plane quadrilaterals."""
    progress(0.0, "hexahedra's kernels")
    solid = measure(BOX, THREADS, BUDGET_S)
    progress(0.8, "quadrilaterals' kernels")
    return solid + measure(SHEET, THREADS, BUDGET_S)


def table(speeds: list[Speed]) -> "pd.DataFrame":
    """One row a kernel and number of threads."""
    import pandas as pd

    one = {s.element: s.updates_per_s for s in speeds if s.threads == 1}
    return pd.DataFrame(
        {
            "element": s.element,
            "elements": s.elements,
            "threads": s.threads,
            "million_updates_per_s": s.updates_per_s / 1e6,
            "over_one_thread": s.updates_per_s / one[s.element],
            "runs": s.runs,
        }
        for s in speeds
    )
