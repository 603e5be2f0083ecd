"""Boxes of hexahedra and rectangles of quadrilaterals for the elements' tests, their tangents."""

import numpy as np

from reference_fem.elements import ElementKernel, hex8
from reference_fem.elements.geometry import CORNERS

YOUNG, POISSON, DENSITY, SIZE = 1e9, 0.4, 1400.0, 1e-3


def grid(
    *counts: int, size: float = SIZE, distortion: float = 0.0, seed: int = 0
) -> tuple[np.ndarray, np.ndarray]:
    """Box of nx x ny x nz hexahedra or nx x ny quadrilaterals, nodes moved at random.

    Corners in VTK's order; numbered section by section along x, as a finger's mesh is.
    """
    shape = [n + 1 for n in counts]
    axes = [np.arange(n) * size for n in shape]
    points = np.stack(np.meshgrid(*axes, indexing="ij"), -1).reshape(-1, len(counts))
    index = np.arange(len(points)).reshape(shape)
    first = np.stack(np.meshgrid(*map(np.arange, counts), indexing="ij"), -1)
    corners = first.reshape(-1, 1, len(counts)) + CORNERS[len(counts)]
    cells = index[tuple(np.moveaxis(corners, -1, 0))]
    rng = np.random.default_rng(seed)
    return points + distortion * size * rng.uniform(-1, 1, points.shape), cells


def material(n: int, poisson: float = POISSON) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Young's modulus, Poisson's ratio and density of n elements."""
    return np.full(n, YOUNG), np.full(n, poisson), np.full(n, DENSITY)


def kernel(points: np.ndarray, cells: np.ndarray, poisson: float = POISSON) -> ElementKernel:
    """8-point hexahedra."""
    return hex8(points, cells, *material(len(cells), poisson))


def force(k: ElementKernel, displacement: np.ndarray) -> np.ndarray:
    """The internal force, N, in an array that held no numbers before."""
    out = np.full((k.n_nodes, k.dim), np.nan)
    k.internal_force(displacement, out)
    return out


def tangent(k: ElementKernel, points: np.ndarray) -> np.ndarray:
    """Stiffness at the reference by central differences; exact up to step^2 and round-off."""
    step = 1e-7 * SIZE
    n = points.size
    matrix = np.empty((n, n))
    for i in range(n):
        displacement = np.zeros(n)
        displacement[i] = step
        up = force(k, displacement.reshape(points.shape))
        matrix[:, i] = (up - force(k, -displacement.reshape(points.shape))).ravel() / (2 * step)
    return 0.5 * (matrix + matrix.T)


def rotation(angle: float) -> np.ndarray:
    """A turn about the axis (1, 2, 3)."""
    x, y, z = np.array([1.0, 2.0, 3.0]) / np.sqrt(14.0)
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.eye(3) + np.sin(angle) * cross + (1 - np.cos(angle)) * cross @ cross
