"""Sections of nodes: their best-fit planar rotation, and a torque as a couple on them."""

import math
from typing import NamedTuple

import numpy as np

from reference_fem.arrays import Array, Index
from reference_fem.compiled import inner, njit


class Section(NamedTuple):
    """Nodes that turn together in the plane of motion.

    nodes : (k,)
    arms : (k, 2), reference arms X_i from the set's mass centre, m: Σ m_i X_i = 0
    masses : (k,)
    """

    nodes: Index
    arms: Array
    masses: Array

    def angle(self, displacement: Array, near: float = 0.0) -> float:
        """Rotation θ, rad, on the branch nearest to `near`; the work of a torque T is T θ.

        NaN where the displacement is not finite.
        """
        return float(section_angle(self, displacement, near))


def build_section(points: Array, nodes: Index, lumped_mass: Array) -> Section:
    """Section of `nodes` (k,) with the lumped masses as weights."""
    masses = np.ascontiguousarray(lumped_mass[nodes])
    plane = points[nodes, :2]
    return Section(nodes, np.ascontiguousarray(plane - masses @ plane / masses.sum()), masses)


@inner()
def cross_and_dot(section: Section, displacement: Array) -> tuple[float, float]:
    """S = Σ m_i e_z·(X_i x x_i) and C = Σ m_i X_i·x_i, from which the current centre drops out.

    tan θ = S/C maximizes Σ m_i x_i·R(θ) X_i, the least-squares rotation (Kabsch 1976, in the
    plane).
    """
    nodes, arms, masses = section
    sine = 0.0
    cosine = 0.0
    for j in range(nodes.size):
        i = nodes[j]
        x = arms[j, 0] + displacement[i, 0]
        y = arms[j, 1] + displacement[i, 1]
        sine += masses[j] * (arms[j, 0] * y - arms[j, 1] * x)
        cosine += masses[j] * (arms[j, 0] * x + arms[j, 1] * y)
    return sine, cosine


@njit(cache=True)
def section_angle(section: Section, displacement: Array, near: float) -> float:
    """See `Section.angle`."""
    sine, cosine = cross_and_dot(section, displacement)
    angle = math.atan2(sine, cosine)
    if math.isnan(angle):  # the run has diverged: its audit says so
        return angle
    return angle + 2.0 * math.pi * round((near - angle) / (2.0 * math.pi))


@inner()
def apply_couple(section: Section, torque: float, displacement: Array, residual: Array) -> None:
    """f_i = t ∂θ/∂x_i = t m_i e_z x R(θ) X_i / ρ,  ρ = Σ m_j x_j·R(θ) X_j.

    θ is the face's best-fit rotation (see `cross_and_dot`). The forces follow the face, sum to zero
    because Σ m_i X_i = 0, have the moment t exactly (the definition of ρ), and their work is
    t Δθ exactly, which lets the audit take it from the angle. In the paper the torque acts on
    the first node's slope (eq. 14); this is its counterpart for a solid face.

    residual : (n_points, dim), internal minus external force; changed in place.
    """
    nodes, arms, masses = section
    sine, cosine = cross_and_dot(section, displacement)
    scale = torque / (sine * sine + cosine * cosine)
    for j in range(nodes.size):
        i = nodes[j]
        rotated_x = cosine * arms[j, 0] - sine * arms[j, 1]
        rotated_y = sine * arms[j, 0] + cosine * arms[j, 1]
        residual[i, 0] += scale * masses[j] * rotated_y
        residual[i, 1] -= scale * masses[j] * rotated_x
