"""Smallest Jacobian of the elements that touch: whether one of them is turned inside out."""

import numpy as np

from reference_fem.arrays import Array, Index
from reference_fem.compiled import SAFE_MATH, njit
from reference_fem.elements.blocks import LANES
from reference_fem.elements.hexahedron import edges as hex8_edges
from reference_fem.elements.quadrilateral import kernel as quad4_kernel
from reference_fem.elements.stress import lower
from reference_fem.model import Model


def touching_det(model: Model, displacement: Array, pressure: Array) -> float:
    """Smallest det(dx/dξ), m³ or m², at the Gauss points of the elements under pressure; else inf.

    All Gauss points, also those that a 1-point element does without. Its sign is that of det F.
    Parameters: displacement (n_points, dim), pressure (n_points,).
    """
    cells = _touched(model.cells, model.skin, pressure)
    if not cells.size:
        return np.inf
    smallest = _smallest_solid if displacement.shape[1] == 3 else _smallest_plane
    return float(smallest(model.points, displacement, model.cells, cells))


@njit(cache=True)
def _touched(cells: Index, chosen: Index, pressure: Array) -> Index:
    """Those of the chosen cells that have a node under pressure."""
    found = np.empty(chosen.size, dtype=np.int64)
    count = 0
    for cell in chosen:
        touches = False
        for node in cells[cell]:
            touches |= pressure[node] > 0.0
        if touches:
            found[count] = cell
            count += 1
    return found[:count]


@njit(cache=True, error_model="numpy")
def _gather(
    points: Array, displacement: Array, cells: Index, chosen: Index, first: int, s: Array
) -> None:
    """Nodal positions of chosen[first], chosen[first + 1], .. into lanes; the last one repeats.

    Rows of s (rows, LANES): x of all corners, then y, z, as in `elements.blocks`.
    """
    corners, dim = cells.shape[1], points.shape[1]
    for lane in range(LANES):
        cell = chosen[min(first + lane, chosen.size - 1)]
        for a in range(corners):
            node = cells[cell, a]
            for i in range(dim):
                s[(i * corners + a) * LANES + lane] = points[node, i] + displacement[node, i]


@njit(cache=True, fastmath=SAFE_MATH, error_model="numpy")
def _smallest_solid(points: Array, displacement: Array, cells: Index, chosen: Index) -> float:
    """Smallest g_1·(g_2 x g_3), m³, of the chosen hexahedra; NaN if one is."""
    s, least = np.empty(24 * LANES), np.full(LANES, np.inf)
    for first in range(0, chosen.size, LANES):
        _gather(points, displacement, cells, chosen, first, s)
        for lane in range(LANES):
            x = hex8_edges.at_points(hex8_edges.base_vectors(s, 0, lane))
            y = hex8_edges.at_points(hex8_edges.base_vectors(s, 8, lane))
            z = hex8_edges.at_points(hex8_edges.base_vectors(s, 16, lane))
            for q in range(8):
                (a, b, c), (d, e, f), (g, h, i) = x[q], y[q], z[q]
                det = a * (e * i - f * h) + b * (f * g - d * i) + c * (d * h - e * g)
                least[lane] = lower(least[lane], det)
    return _least(least)


@njit(cache=True, fastmath=SAFE_MATH, error_model="numpy")
def _smallest_plane(points: Array, displacement: Array, cells: Index, chosen: Index) -> float:
    """Smallest g_1 x g_2, m², of the chosen quadrilaterals; NaN if one is."""
    s, least = np.empty(8 * LANES), np.full(LANES, np.inf)
    for first in range(0, chosen.size, LANES):
        _gather(points, displacement, cells, chosen, first, s)
        for lane in range(LANES):
            x, y = quad4_kernel.base_vectors(s, 0, lane), quad4_kernel.base_vectors(s, 4, lane)
            for q in range(4):
                det = x[q][0] * y[q][1] - x[q][1] * y[q][0]
                least[lane] = lower(least[lane], det)
    return _least(least)


@njit(cache=True, error_model="numpy")
def _least(values: Array) -> float:
    """Smallest of them; NaN if one is."""
    smallest = np.inf
    for value in values:
        smallest = lower(smallest, value)
    return smallest
