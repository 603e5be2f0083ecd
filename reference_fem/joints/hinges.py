"""Hinges: exact constraints on mean positions, by Lagrange multipliers."""

from dataclasses import dataclass

import numpy as np

from reference_fem.arrays import Array, Index
from reference_fem.compiled import njit


@dataclass(frozen=True)
class Hinges:
    """P constraints Σ_i c_i u_i = 0 in the plane of motion.

    Hinge 1 holds the mean displacement of `hinge_1_proximal` at zero; hinge w+1 ties the mean of
    `hinge_{w+1}_proximal` (weights +) to that of `hinge_w_distal` (weights -). Rotation about
    the hinge stays free. Means are by area (`mean_position.mean_weights`).

    nodes : (k,)
    weights : (k,), c_i; those of one side sum to +-1.
    starts : (P + 1,), hinge h owns entries starts[h]:starts[h+1]
    inverse_schur : (P, P), (C M⁻¹ Cᵀ)⁻¹, kg
    """

    nodes: Index
    weights: Array
    starts: Index
    inverse_schur: Array

    @property
    def count(self) -> int:
        """P."""
        return self.starts.size - 1


def build_hinges(sides: list[tuple[tuple[Index, Array], ...]], lumped_mass: Array) -> Hinges:
    """Hinges from sides [(nodes, signed weights), ...]; one or two sides per hinge.

    sides : per hinge its sides; a side's weights sum to +1 or -1. lumped_mass : (n_points,).
    """
    nodes = [np.concatenate([side[0] for side in hinge]) for hinge in sides]
    weights = [np.concatenate([side[1] for side in hinge]) for hinge in sides]
    count = len(sides)
    rows = np.zeros((count, lumped_mass.size))
    for hinge in range(count):
        np.add.at(rows[hinge], nodes[hinge], weights[hinge])
    schur = (rows / lumped_mass) @ rows.T
    inverse = np.asarray(np.linalg.inv(schur), dtype=np.float64)
    return Hinges(
        nodes=np.concatenate([*nodes, np.empty(0, np.int64)]).astype(np.int64),
        weights=np.concatenate([*weights, np.empty(0)]),
        starts=np.cumsum([0, *[n.size for n in nodes]]).astype(np.int64),
        inverse_schur=inverse,
    )


@njit(cache=True)
def hinge_reactions(
    displacement: Array,
    velocity: Array,
    residual: Array,
    inverse_mass: Array,
    gravity_vector: tuple[float, float],
    step: float,
    nodes: Index,
    weights: Array,
    starts: Index,
    inverse_schur: Array,
    reactions: Array,
) -> None:
    """Solve for the multipliers and add their forces to the residual.

    The leapfrog step u' = u + Δt (v + Δt a), a = M⁻¹(-r + Cᵀλ) + f, must end on C u' = 0:

        (C M⁻¹ Cᵀ) λ = C (M⁻¹ r - f) - (C v + C u/Δt)/Δt

    The last term is round-off: it keeps the linear constraint from drifting.

    displacement, velocity : (n_points, dim), u at t_n and v at t_n - Δt/2.
    residual : (n_points, dim), r, internal minus external force without gravity; changed in place
        to r - Cᵀλ.
    reactions : (P, 2), filled with λ, the force of the hinge on its proximal set, N.
    """
    count = starts.size - 1
    right = np.zeros((count, 2))
    for h in range(count):
        for j in range(starts[h], starts[h + 1]):
            i = nodes[j]
            c = weights[j]
            for d in range(2):
                right[h, d] += c * (
                    inverse_mass[i] * residual[i, d]
                    - (velocity[i, d] + displacement[i, d] / step) / step
                )
                right[h, d] -= c * gravity_vector[d]
    for h in range(count):
        for d in range(2):
            total = 0.0
            for other in range(count):
                total += inverse_schur[h, other] * right[other, d]
            reactions[h, d] = total
    for h in range(count):
        for j in range(starts[h], starts[h + 1]):
            for d in range(2):
                residual[nodes[j], d] -= weights[j] * reactions[h, d]
