"""Joint torques as follower couples over the nodes of a phalanx's first face."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from reference_fem.arrays import Array, Index
from reference_fem.compiled import njit
from reference_fem.joints.rotation import best_fit_angle, centred_arms, cross_and_dot


@dataclass(frozen=True)
class Couple:
    """A torque about Z on a set of nodes.

    Attributes
    ----------
    phalanx
        Number w of the phalanx, from 0.
    torque
        t_w on the mesh as given (a half model's is half), N·m.
    nodes : (k,)
    arms : (k, 2)
        Reference arms from the set's mass centre, m.
    masses : (k,)
    """

    phalanx: int
    torque: float
    nodes: Index
    arms: Array
    masses: Array

    def angle(self, displacement: Array, near: float) -> float:
        """Rotation of the face, on the branch nearest to `near`; the torque's work is t θ."""
        return best_fit_angle(displacement, self.nodes, self.arms, self.masses, near)

    def apply(self, displacement: Array, residual: Array) -> None:
        """Subtract the couple's nodal forces from the residual."""
        apply_couple(self.torque, displacement, self.nodes, self.arms, self.masses, residual)


def build_couple(
    phalanx: int, torque: float, points: Array, nodes: Index, lumped_mass: Array
) -> Couple:
    """Couple over `nodes` with the lumped masses as weights."""
    masses = np.ascontiguousarray(lumped_mass[nodes])
    return Couple(phalanx, torque, nodes, centred_arms(points, nodes, masses), masses)


@njit(cache=True)
def apply_couple(
    torque: float,
    displacement: Array,
    nodes: Index,
    arms: Array,
    masses: Array,
    residual: Array,
) -> None:
    """f_i = t ∂θ/∂x_i = t m_i e_z x R(θ) X_i / ρ,  ρ = Σ m_j x_j·R(θ) X_j.

    θ is the face's best-fit rotation (see `rotation`). The forces follow the face, sum to zero
    because Σ m_i X_i = 0, have the moment t exactly (the definition of ρ), and their work is
    t Δθ exactly, which lets the audit take it from the angle. In the paper the torque acts on
    the first node's slope (eq. 14); this is its counterpart for a solid face.

    Parameters
    ----------
    residual : (n_points, dim)
        Internal minus external force; changed in place.
    """
    sine, cosine = cross_and_dot(displacement, nodes, arms, masses)
    scale = torque / (sine * sine + cosine * cosine)
    for j in range(nodes.size):
        i = nodes[j]
        rotated_x = cosine * arms[j, 0] - sine * arms[j, 1]
        rotated_y = sine * arms[j, 0] + cosine * arms[j, 1]
        residual[i, 0] += scale * masses[j] * rotated_y
        residual[i, 1] -= scale * masses[j] * rotated_x
