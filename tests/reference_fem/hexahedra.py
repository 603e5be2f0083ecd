"""Boxes of 8-node hexahedra for the elements' tests, their forces and tangents."""

import numpy as np

from reference_fem.elements import hex8
from reference_fem.elements.geometry import CORNERS

YOUNG, POISSON, DENSITY = 1e9, 0.4, 1400.0


def grid(nx, ny, nz, size=1e-3, distortion=0.0, seed=0):
    """Box of nx x ny x nz hexahedra, corners in VTK's order, nodes moved at random."""
    shape = (nx + 1, ny + 1, nz + 1)
    axes = [np.arange(n) * size for n in shape]
    points = np.stack(np.meshgrid(*axes, indexing="ij"), -1).reshape(-1, 3)
    index = np.arange(len(points)).reshape(shape)
    first = np.stack(np.meshgrid(*(np.arange(n - 1) for n in shape), indexing="ij"), -1)
    corners = first.reshape(-1, 1, 3) + CORNERS[3]
    cells = index[corners[..., 0], corners[..., 1], corners[..., 2]]
    rng = np.random.default_rng(seed)
    return points + distortion * size * rng.uniform(-1, 1, points.shape), cells


def kernel(points, cells, poisson=POISSON):
    n = len(cells)
    return hex8(points, cells, np.full(n, YOUNG), np.full(n, poisson), np.full(n, DENSITY))


def force(k, displacement):
    out = np.full((k.n_nodes, k.dim), np.nan)
    k.internal_force(displacement, out)
    return out


def tangent(k, points):
    """Stiffness at the reference by central differences; exact up to step^2 and round-off."""
    step = 1e-7 * 1e-3
    n = points.size
    matrix = np.empty((n, n))
    for i in range(n):
        displacement = np.zeros(n)
        displacement[i] = step
        up = force(k, displacement.reshape(points.shape))
        matrix[:, i] = (up - force(k, -displacement.reshape(points.shape))).ravel() / (2 * step)
    return 0.5 * (matrix + matrix.T)
