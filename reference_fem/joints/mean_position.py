"""Weights of a face's mean position: by area, so that they do not depend on where its nodes lie."""

import numpy as np

from meshes.topology import outer_facets
from reference_fem.arrays import Array, Index
from reference_fem.contact.stiffness import facet_areas
from reference_fem.elements.kinds import chord

POINTS = 8
"""Gauss points per edge in 2D; the square root in the chord's thickness needs more than a
polynomial would: 8 leave an error of 1e-4 of the last edge's share."""


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
