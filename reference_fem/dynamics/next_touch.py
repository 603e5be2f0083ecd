"""When a body that touches nothing will touch again: whether its tap is over."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from reference_fem.model import Model

Array = NDArray[np.float64]


def next_touch_s(model: Model, displacement: Array, velocity: Array) -> float:
    """Time until the last phalanx would reach the surface as a rigid body, s; inf: never.

    An edge that hits first springs off while its body still comes down, and what nodes do says
    nothing about the body. With the mean velocity v_c and the spin ω = L/I of the last phalanx in
    the plane of motion, a surface node of gap g arrives after

        g / -v_y,  v_y = v_cy + ω (x - x_c) < 0

    Parameters
    ----------
    displacement, velocity : (n_points, dim)
    """
    nodes = model.contact.nodes
    body = np.flatnonzero(model.body_of_point == model.touching_body)
    mass = model.mass[body]
    position = model.points[body, :2] + displacement[body, :2]
    centre = mass @ position / mass.sum()
    mean = mass @ velocity[body, :2] / mass.sum()
    arm, relative = position - centre, velocity[body, :2] - mean
    turn = mass @ (arm[:, 0] * relative[:, 1] - arm[:, 1] * relative[:, 0])
    spin = turn / (mass @ (arm * arm).sum(axis=1))
    place = model.points[nodes, :2] + displacement[nodes, :2]
    speed = mean[1] + spin * (place[:, 0] - centre[0])
    down = speed < 0.0
    gap = np.maximum(place[down, 1] + model.surface.height, 0.0)
    return float(np.min(gap / -speed[down], initial=np.inf))
