"""Sides, orientation (VTK order) and numbering of elements."""

import numpy as np
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import reverse_cuthill_mckee

from meshes.mesh import Floats, Ints

# Local nodes of each side, ordered so that the right-hand normal points outwards.
HEXAHEDRON_FACES = np.array(
    [[0, 3, 2, 1], [4, 5, 6, 7], [0, 1, 5, 4], [1, 2, 6, 5], [2, 3, 7, 6], [3, 0, 4, 7]]
)
# Counter-clockwise quadrilaterals: the outward normal is to the right of the direction.
QUADRILATERAL_EDGES = np.array([[0, 1], [1, 2], [2, 3], [3, 0]])


def local_facets(dim: int) -> Ints:
    """Local node numbers of an element's sides, (6, 4) or (4, 2), outward oriented."""
    return HEXAHEDRON_FACES if dim == 3 else QUADRILATERAL_EDGES


def sides(cells: Ints) -> Ints:
    """Sides of each element, (n_cells, 6, 4) or (n_cells, 4, 2), outward oriented."""
    return cells[:, local_facets(3 if cells.shape[1] == 8 else 2)]


def numbered(*groups: Ints) -> list[Ints]:
    """Numbers (k,) of each group's facets, (k, n): the same for the same nodes in any order."""
    rows = np.sort(np.concatenate(groups), axis=1)
    numbers = np.unique(rows, axis=0, return_inverse=True)[1].ravel()
    return np.split(numbers, np.cumsum([len(group) for group in groups])[:-1])


def facets(cells: Ints) -> tuple[Ints, Ints]:
    """All facets in the order of elements, (k, 4) or (k, 2), outward oriented in the first element
    of each; and how many elements each belongs to, (k,).
    """
    each = sides(cells).reshape(-1, cells.shape[1] // 2)
    _, first, count = np.unique(
        np.sort(each, axis=1), axis=0, return_index=True, return_counts=True
    )
    order = np.argsort(first)
    return np.asarray(each[first[order]], dtype=np.int64), count[order]


def outer_facets(cells: Ints) -> Ints:
    """Facets that belong to one element only, (k, 4) or (k, 2), outward oriented."""
    each, count = facets(cells)
    return each[count == 1]


def orient(points: Floats, cells: Ints) -> Ints:
    """Reverse the elements that are wound the wrong way round (those of gmsh's blocks may be)."""
    corner = points[cells]
    edges = corner[:, [1, 3, 4] if points.shape[1] == 3 else [1, 3]] - corner[:, :1]
    turned = np.linalg.det(edges) < 0.0
    mirrored = [0, 3, 2, 1, 4, 7, 6, 5] if points.shape[1] == 3 else [0, 3, 2, 1]
    cells = cells.copy()
    cells[turned] = cells[turned][:, mirrored]
    return cells


def renumber(cells: Ints, n_points: int) -> tuple[Ints, Ints, Ints]:
    """Order nodes by reverse Cuthill-McKee on the element graph and elements by their mean node.

    Returns the old node number of each new one, (n_points,), the elements in their new order
    and node numbers, (n_cells, nodes per cell), and the old number of each, (n_cells,).
    """
    per_cell = cells.shape[1]
    rows = np.repeat(cells, per_cell, axis=1).ravel()
    columns = np.tile(cells, (1, per_cell)).ravel()
    graph = coo_matrix((np.ones(rows.size, dtype=np.int8), (rows, columns)), (n_points, n_points))
    order = np.asarray(reverse_cuthill_mckee(graph.tocsr(), symmetric_mode=True), dtype=np.int64)
    renumbered = np.argsort(order)[cells]  # by the permutation's inverse
    by_mean = np.argsort(renumbered.sum(axis=1), kind="stable")
    return order, renumbered[by_mean], by_mean


def structured(number: Ints) -> Ints:
    """Cells in VTK's order of a block with these node numbers, (i,), (i, j) or (i, j, k)."""
    corners = [number[:-1], number[1:]]
    if number.ndim > 1:
        low, high = corners
        corners = [low[:, :-1], high[:, :-1], high[:, 1:], low[:, 1:]]
    if number.ndim > 2:
        corners = [n[..., :-1] for n in corners] + [n[..., 1:] for n in corners]
    return np.stack(corners, axis=-1).reshape(-1, len(corners))
