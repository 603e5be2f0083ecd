"""Thickness of the plane-stress model: the chord of the round section."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from reference_fem.elements import quad4_quadrature_points

Array = NDArray[np.float64]
Index = NDArray[np.int64]


def chord_thickness(points: Array, cells: Index, radius: Array) -> Array:
    """Chord 2 sqrt(R² - y²) at the quadrature points of each cell, (n_cells, 4), m.

    With it area, second moment and mass of a section are those of the round beam, up to the
    quadrature error of the square root next to the outline. The round end keeps the chord of the
    section: it is half a cylinder across Z cut to that thickness, not half a ball.

    Parameters
    ----------
    points : (n_points, 2)
    cells : (n_cells, 4)
    radius : (n_cells,)
        R of the phalanx the cell belongs to.
    """
    height = quad4_quadrature_points(points, cells)[..., 1]
    chord: Array = 2.0 * np.sqrt(np.maximum(radius[:, None] ** 2 - height**2, 0.0))
    return chord
