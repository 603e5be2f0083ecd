"""A free bar of cubes that vibrates along its axis: the benchmark of the reference and its peers.

With Poisson's ratio 0 a bar's axial motion is exactly one-dimensional. From the initial velocity
v = V cos(pi x/L) it stays a standing wave,

    u(x, t) = V/omega cos(pi x/L) sin(omega t),   omega = pi c/L,   c = sqrt(E/rho).

Strains stay below 1e-4, where small- and large-strain theory agree.
"""

import math
import time
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from meshes.topology import structured

SIZE_M = 1e-3  # edge of a cube
YOUNG, DENSITY = 1e9, 1400.0  # E, Pa; rho, kg/m^3
WAVE_SPEED = math.sqrt(YOUNG / DENSITY)  # c, m/s
SPEED = 0.03  # V, m/s
# The step that every code is asked to take: a share of an edge over c, below every code's limit.
STEP_S = 0.4 * SIZE_M / WAVE_SPEED
PARTS = 3  # into which the steps are divided; the fastest counts
TIMEOUT_S = 240.0  # for each run of a program

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]


def box(counts: tuple[int, ...]) -> tuple[Floats, Integers]:
    """Points and cells (VTK's order) of a box of cubes or a sheet of squares.

    Numbered section by section along x, as a finger's mesh is.
    """
    number = np.arange(math.prod(n + 1 for n in counts)).reshape([n + 1 for n in counts])
    grid = np.meshgrid(*map(np.arange, number.shape), indexing="ij")
    points = np.stack([axis.ravel() for axis in grid], axis=1) * SIZE_M
    return points.astype(np.float64), structured(number)


@dataclass(frozen=True)
class Bar:
    """Elements along x, y, z, explicit steps to take, and threads to take them on."""

    counts: tuple[int, int, int]
    steps: int
    threads: int

    @property
    def elements(self) -> int:
        """Number of hexahedra."""
        return math.prod(self.counts)

    @property
    def length(self) -> float:
        """L, m."""
        return self.counts[0] * SIZE_M

    @property
    def time_s(self) -> float:
        """Time at which displacements are compared."""
        return self.steps * STEP_S

    def mesh(self) -> tuple[Floats, Integers]:
        """Points (n, 3) and cells (m, 8) in VTK's order, which is also CalculiX' and gmsh's."""
        return box(self.counts)

    def velocity(self, points: Floats) -> Floats:
        """Initial velocity (n, 3), m/s."""
        velocity = np.zeros_like(points)
        velocity[:, 0] = SPEED * np.cos(np.pi * points[:, 0] / self.length)
        return velocity

    @property
    def exact_end_m(self) -> float:
        """Displacement of the end x = 0 at `time_s`."""
        omega = math.pi * WAVE_SPEED / self.length
        return SPEED / omega * math.sin(omega * self.time_s)


@dataclass(frozen=True)
class BarRun:
    """One code's result for the bar.

    points : integration points of the element. seconds_per_step : shortest of `runs` measurements.
    end_m : mean displacement along x of the nodes at x = 0. step_s : the step that was taken.
    """

    points: int
    seconds_per_step: float
    end_m: float
    step_s: float
    runs: int


def seconds_per_step(take_step: Callable[[], object], steps: int) -> float:
    """Take all steps; returns seconds per step in the fastest part, without the first two steps."""
    warm = min(2, steps - 1)
    for _ in range(warm):
        take_step()
    left, best = steps - warm, float("inf")
    for part in range(PARTS):
        count = left * (part + 1) // PARTS - left * part // PARTS
        start = time.perf_counter()
        for _ in range(count):
            take_step()
        best = min(best, (time.perf_counter() - start) / count) if count else best
    return best
