"""Best-fit planar rotation of a set of nodes."""

from __future__ import annotations

import math

import numpy as np

from reference_fem.arrays import Array, Index
from reference_fem.compiled import njit


@njit(cache=True)
def cross_and_dot(
    displacement: Array, nodes: Index, arms: Array, masses: Array
) -> tuple[float, float]:
    """S = Σ m_i e_z·(X_i x x_i) and C = Σ m_i X_i·x_i.

    X_i (k, 2) are the arms from the set's mass centre in the reference configuration, so that
    the current centre drops out: Σ m_i X_i = 0. tan θ = S/C maximizes Σ m_i x_i·R(θ) X_i, the
    least-squares rotation (Kabsch 1976, in the plane).
    """
    sine = 0.0
    cosine = 0.0
    for j in range(nodes.size):
        i = nodes[j]
        x = arms[j, 0] + displacement[i, 0]
        y = arms[j, 1] + displacement[i, 1]
        sine += masses[j] * (arms[j, 0] * y - arms[j, 1] * x)
        cosine += masses[j] * (arms[j, 0] * x + arms[j, 1] * y)
    return sine, cosine


def centred_arms(points: Array, nodes: Index, masses: Array) -> Array:
    """X_i - Σ m_j X_j / Σ m_j in the plane of motion, (k, 2), m."""
    plane = points[nodes, :2]
    return np.ascontiguousarray(plane - masses @ plane / masses.sum())


def best_fit_angle(
    displacement: Array,
    nodes: Index,
    arms: Array,
    masses: Array,
    near: float = 0.0,
) -> float:
    """Rotation θ of the set, rad, on the branch nearest to the angle `near`."""
    sine, cosine = cross_and_dot(displacement, nodes, arms, masses)
    angle = math.atan2(sine, cosine)
    return angle + 2.0 * math.pi * round((near - angle) / (2.0 * math.pi))
