"""Smallest Jacobian of the elements that touch: whether one of them is turned inside out."""

import numpy as np

from reference_fem.arrays import Array
from reference_fem.elements.geometry import CORNERS, reference_element
from reference_fem.model import Model

# dN_a/dxi_k at the Gauss points, (a, q, k)
SLOPES = {dim: reference_element(dim).slopes[..., :-1].swapaxes(1, 2) for dim in CORNERS}


def touching_det(model: Model, displacement: Array, pressure: Array) -> float:
    """Smallest det(dx/dξ), m³ or m², at the Gauss points of the elements under pressure; else inf.

    All Gauss points count, also those that a 1-point element does not use. The sign is that of
    det F; NaN if one is NaN. Parameters: displacement (n_points, dim), pressure (n_points,).
    """
    cells = model.cells.take(model.contact_cells, 0)
    cells = cells[(pressure > 0.0).take(cells).any(axis=1)]
    if not cells.size:
        return np.inf
    corners = model.points.take(cells, 0) + displacement.take(cells, 0)
    jacobians = np.tensordot(corners, SLOPES[displacement.shape[1]], ((1,), (0,)))
    with np.errstate(invalid="ignore"):  # a displacement that is not finite makes the NaN
        return float(np.linalg.det(jacobians.swapaxes(1, 2)).min())
