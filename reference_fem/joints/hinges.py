"""Hinges: exact constraints on mean positions, by Lagrange multipliers.

Means are by area, so that they do not depend on where a face's nodes lie.
"""

from typing import NamedTuple

import numpy as np

from meshes.topology import outer_facets
from reference_fem.arrays import Array, Index
from reference_fem.compiled import inner
from reference_fem.contact.law import Motion
from reference_fem.elements.facet_quadrature import facet_areas
from reference_fem.elements.kinds import chord

POINTS = 8
"""Gauss points per edge in 2D; the square root in the chord's thickness needs more than a
polynomial would: 8 leave an error of 1e-4 of the last edge's share."""


class Hinges(NamedTuple):
    """P constraints Σ_i c_i u_i = 0 in the plane of motion; compiled kernels take it as it is.

    Hinge 1 holds the mean displacement of `hinge_1_proximal` at zero; hinge w+1 ties the mean of
    `hinge_{w+1}_proximal` (weights +) to that of `hinge_w_distal` (weights -). Rotation about
    the hinge stays free. Means are by area (`mean_weights`).

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
    def size(self) -> int:
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


def mean_weights(points: Array, cells: Index, nodes: Index, radius: float) -> tuple[Index, Array]:
    """c_i = ∫ N_i dA / A over the outer facets that `nodes` span, or over edges where it has none.

    Σ c_i u_i is then the mean displacement of the face, exactly for fields that the elements
    represent, and the hinge's force λ is the uniform traction λ/A: neither depends on the mesh,
    whereas an average of the nodes is weighted by their density. A half model's part of the face
    needs no factor. In 2D A is the edges' length times the chord of the round section
    (`kinds.chord`); the edges of a shaft's hole count by their length (in 2D: as points).

    points : (n_points, dim). cells : (n_cells, 8 | 4). nodes : (k,).
    radius : R of the phalanx, m; used in 2D.

    Returns the nodes (k,), sorted, and their weights (k,), of sum 1.

    Raises ValueError: the nodes span neither facets nor edges, or some belong to none of those.
    """
    nodes = np.unique(nodes)
    dim = points.shape[1]
    sides = outer_facets(cells[np.isin(cells, nodes).any(axis=1)])
    facets = sides[np.isin(sides, nodes).all(axis=1)]
    if len(facets):
        share = (
            facet_areas(points, facets)[1] if dim == 3 else _chord_shares(points, facets, radius)
        )
    elif dim == 2:
        facets, share = nodes[:, None], np.ones((nodes.size, 1))
    else:
        edges = np.stack([sides, np.roll(sides, -1, axis=1)], axis=-1).reshape(-1, 2)
        edges = np.unique(np.sort(edges, axis=1), axis=0)
        facets = edges[np.isin(edges, nodes).all(axis=1)]
        share = facet_areas(points, facets)[1]
    weights = np.bincount(np.searchsorted(nodes, facets).ravel(), share.ravel(), nodes.size)
    if not (weights > 0.0).all():
        raise ValueError(
            f"{np.count_nonzero(weights <= 0.0)} of its {nodes.size} nodes lie on no facet (or, "
            "where there is none, no edge) of the outer surface that the set spans; give the nodes "
            "of an end face"
        )
    return nodes, weights / weights.sum()


def _chord_shares(points: Array, edges: Index, radius: float) -> Array:
    """∫ N_i t dl of edges (k, 2) in the plane, t the chord of the round section, (k, 2) m²."""
    places, weights = np.polynomial.legendre.leggauss(POINTS)
    shape = 0.5 * np.stack([1.0 - places, 1.0 + places], axis=1)
    ends = points[edges]
    length = np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1)
    thickness = chord(ends[..., 1] @ shape.T, np.full((len(edges), 1), radius))
    return np.asarray(0.5 * length[:, None] * ((weights * thickness) @ shape))


@inner()
def hinge_reactions(motion: Motion, hinges: Hinges, residual: Array, reactions: Array) -> None:
    """Solve for the multipliers and add their forces to the residual.

    The leapfrog step u' = u + Δt (v + Δt a), a = M⁻¹(-r + Cᵀλ) + f, must end on C u' = 0:

        (C M⁻¹ Cᵀ) λ = C (M⁻¹ r - f) - (C v + C u/Δt)/Δt

    The last term is round-off: it keeps the linear constraint from drifting.

    residual : (n_points, dim), r, internal minus external force without gravity; changed in place
        to r - Cᵀλ.
    reactions : λ (P, 2), the force of each hinge on its proximal set, N; filled
    """
    displacement, velocity, step = motion.displacement, motion.velocity, motion.step
    inverse_mass, gravity_vector = motion.inverse_mass, motion.gravity_vector
    nodes, weights, starts, inverse_schur = hinges
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
