"""Thickness of the plane-stress model: the chord of the round section."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Index = NDArray[np.int64]

# Gauss points of the 4-node quadrilateral in the element kernels' order: xi, eta = +-1/sqrt(3),
# in the order of the nodes.
GAUSS = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]], dtype=np.float64) / np.sqrt(3.0)


def chord_thickness(points: Array, cells: Index, radius: Array) -> Array:
    """Chord 2 sqrt(R² - y²) at the 2 x 2 Gauss points of each cell, (n_cells, 4), m.

    With it area, second moment and mass of a section are those of the round beam, up to the
    quadrature error of the square root next to the outline.

    Parameters
    ----------
    points : (n_points, 2)
    cells : (n_cells, 4)
    radius : (n_cells,)
        R of the phalanx the cell belongs to.
    """
    corner = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]], dtype=np.float64)
    shape = 0.25 * (1 + GAUSS[:, :1] * corner[:, 0]) * (1 + GAUSS[:, 1:] * corner[:, 1])
    height = points[cells][..., 1] @ shape.T
    return 2.0 * np.sqrt(np.maximum(radius[:, None] ** 2 - height**2, 0.0))
