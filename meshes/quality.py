"""Quality of elements: scaled Jacobian and volume."""

import math

import numpy as np

from meshes.mesh import Floats, Ints

# Each corner with its neighbours along the three (two) local axes, right-handed.
_CORNERS_3D = np.array([
    [0, 1, 3, 4], [1, 2, 0, 5], [2, 3, 1, 6], [3, 0, 2, 7],
    [4, 7, 5, 0], [5, 4, 6, 1], [6, 5, 7, 2], [7, 6, 4, 3],
])  # fmt: skip
_CORNERS_2D = np.array([[0, 1, 3], [1, 2, 0], [2, 3, 1], [3, 0, 2]])


def scaled_jacobians(points: Floats, cells: Ints) -> Floats:
    """Scaled Jacobian of each element, (n_cells,): 1 for a brick, <= 0 if inverted.

    The smallest over the corners of ``det(e1, e2, e3) / (|e1| |e2| |e3|)``, e the edges that leave
    the corner (Knupp, SIAM J. Sci. Comput. 23 (2001) 193); 0 where an edge has no length.
    """
    table = _CORNERS_3D if points.shape[1] == 3 else _CORNERS_2D
    nodes = points[cells]
    worst = np.full(cells.shape[0], np.inf)
    for corner, *neighbours in table:
        edges = nodes[:, neighbours] - nodes[:, [corner]]
        lengths = np.linalg.norm(edges, axis=2).prod(axis=1)
        with np.errstate(invalid="ignore", divide="ignore"):
            scaled = np.where(lengths > 0.0, np.linalg.det(edges) / lengths, 0.0)
        worst = np.minimum(worst, scaled)
    return worst


def volumes(points: Floats, cells: Ints) -> Floats:
    """Volume (area in 2D) of each element, (n_cells,), m^3 or m^2.

    Exact for the trilinear map: the integral of its Jacobian, of degree 2 in each coordinate, by
    two Gauss points per direction.
    """
    dim = points.shape[1]
    signs = np.array([[-1, -1, -1], [1, -1, -1], [1, 1, -1], [-1, 1, -1]], dtype=float)
    signs = np.vstack([signs, signs * [1, 1, -1]]) if dim == 3 else signs[:, :2]
    nodes = points[cells]
    total = np.zeros(cells.shape[0])
    for point in signs / math.sqrt(3.0):
        factors = 1.0 + signs * point
        gradient = np.empty((signs.shape[0], dim))
        for axis in range(dim):
            others = [a for a in range(dim) if a != axis]
            gradient[:, axis] = signs[:, axis] * factors[:, others].prod(axis=1) / 2**dim
        total += np.linalg.det(np.einsum("eni,nj->eij", nodes, gradient))
    return total
