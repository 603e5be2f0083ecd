"""Coulomb friction with a tangential penalty, by return mapping."""

from __future__ import annotations

import math

from numba import njit


@njit(cache=True)
def return_map(
    stiffness: float, offset_x: float, offset_z: float, limit: float
) -> tuple[float, float, float, float]:
    """Tangential force and the anchor's slip for one node.

    The node hangs on a spring k whose other end, the anchor a, slides when Coulomb's cone is
    reached (Wriggers, Computational Contact Mechanics, 2006, ch. 5.2):

        trial    f* = -k (x - a)
        stick    |f*| <= μ f_n:  f = f*,              a unchanged
        slip     otherwise:      f = μ f_n f*/|f*|,   a <- x + f/k

    Parameters
    ----------
    stiffness
        k, N/m.
    offset_x, offset_z
        x - a, m; a planar problem has no z component.
    limit
        μ f_n, N.

    Returns
    -------
    force_x, force_z
        f on the node, N.
    slip_x, slip_z
        Motion of the anchor, m.
    """
    length = math.hypot(offset_x, offset_z)
    if stiffness * length <= limit:
        return -stiffness * offset_x, -stiffness * offset_z, 0.0, 0.0
    unit_x = offset_x / length
    unit_z = offset_z / length
    slip = length - limit / stiffness
    return -limit * unit_x, -limit * unit_z, slip * unit_x, slip * unit_z
