"""Numbering for locality: neighbours in space are near in memory."""

from __future__ import annotations

import numpy as np
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import reverse_cuthill_mckee

from meshes.arrays import Ints


def renumber(cells: Ints, n_points: int) -> tuple[Ints, Ints]:
    """Order nodes by reverse Cuthill-McKee on the element graph and elements by their mean node.

    Returns
    -------
    order
        Old node number of each new one, (n_points,).
    cells
        The elements in their new order and node numbers, (n_cells, nodes per cell).
    """
    per_cell = cells.shape[1]
    rows = np.repeat(cells, per_cell, axis=1).ravel()
    columns = np.tile(cells, (1, per_cell)).ravel()
    graph = coo_matrix((np.ones(rows.size, dtype=np.int8), (rows, columns)), (n_points, n_points))
    order = np.asarray(reverse_cuthill_mckee(graph.tocsr(), symmetric_mode=True), dtype=np.int64)
    new = np.empty(n_points, dtype=np.int64)
    new[order] = np.arange(n_points)
    renumbered = new[cells]
    by_mean = np.argsort(renumbered.sum(axis=1), kind="stable")
    return order, renumbered[by_mean]
