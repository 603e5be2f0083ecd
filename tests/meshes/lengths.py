"""Lengths of elements that the tests measure meshes by."""

import numpy as np

from meshes.mesh import Floats, Ints
from meshes.quality import volumes
from meshes.topology import local_facets

EDGES_3D = np.array(
    [[0, 1], [1, 2], [2, 3], [3, 0], [4, 5], [5, 6], [6, 7], [7, 4], [0, 4], [1, 5], [2, 6], [3, 7]]
)


def edge_lengths(points: Floats, cells: Ints) -> Floats:
    """Lengths of each element's edges, (n_cells, 12 or 4), m."""
    table = EDGES_3D if points.shape[1] == 3 else local_facets(2)
    ends = points[cells[:, table]]
    return np.asarray(np.linalg.norm(ends[:, :, 1] - ends[:, :, 0], axis=2))


def characteristic_lengths(points: Floats, cells: Ints) -> Floats:
    """Volume over the largest face (in 2D: area over the longest edge), (n_cells,), m.

    The length that LS-DYNA's theory manual takes for solid elements in ``dt = L/c``.
    """
    if points.shape[1] == 2:
        return np.asarray(volumes(points, cells) / edge_lengths(points, cells).max(axis=1))
    faces = points[cells[:, local_facets(3)]]
    diagonals = np.cross(faces[:, :, 2] - faces[:, :, 0], faces[:, :, 3] - faces[:, :, 1])
    areas = 0.5 * np.linalg.norm(diagonals, axis=2)
    return np.asarray(volumes(points, cells) / areas.max(axis=1))
