"""Boxes of hexahedra and rectangles of quadrilaterals for the elements' tests, their tangents."""

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from reference_fem.elements.base import ElementKernel
from reference_fem.elements.geometry import CORNERS
from reference_fem.elements.kinds import (
    hex8,
    hex8_neo_hooke,
    hex8_one_point,
    quad4_plane_stress,
)

YOUNG, POISSON, DENSITY, SIZE, THICKNESS = 1e9, 0.4, 1400.0, 1e-3, 5e-3


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


def neo_hooke(points: np.ndarray, cells: np.ndarray, poisson: float = POISSON) -> ElementKernel:
    """Neo-Hookean 8-point hexahedra."""
    return hex8_neo_hooke(points, cells, *material(len(cells), poisson))


def one_point(points: np.ndarray, cells: np.ndarray, poisson: float = POISSON) -> ElementKernel:
    """1-point hexahedra."""
    return hex8_one_point(points, cells, *material(len(cells), poisson))


def sheet(
    points: np.ndarray, cells: np.ndarray, poisson: float = POISSON, thickness: Any = THICKNESS
) -> ElementKernel:
    """Quadrilaterals in plane stress, the thickness one for all or by points."""
    values = np.broadcast_to(thickness, cells.shape)
    return quad4_plane_stress(points, cells, *material(len(cells), poisson), values)


KINDS: dict[str, tuple[Callable[..., ElementKernel], int]] = {
    "hex8-sri": (kernel, 3),
    "hex8-one-point": (one_point, 3),
    "hex8-neo-hooke": (neo_hooke, 3),
    "quad4": (sheet, 2),
}
each_kind = pytest.mark.parametrize("kind", KINDS)


def body(kind: str, counts: tuple[int, ...], distortion: float = 0.0) -> tuple[Any, ...]:
    """Points, cells and kernel of a box; a sheet takes the first two counts."""
    build, dim = KINDS[kind]
    points, cells = grid(*counts[:dim], distortion=distortion, seed=1)
    return points, cells, build(points, cells)


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


def rotation(angle: float, dim: int = 3) -> np.ndarray:
    """A turn in the plane, or about the axis (1, 2, 3)."""
    if dim == 2:
        return np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    x, y, z = np.array([1.0, 2.0, 3.0]) / np.sqrt(14.0)
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.eye(3) + np.sin(angle) * cross + (1 - np.cos(angle)) * cross @ cross
