"""Integrals over the facets that may touch: Gauss points, areas and the nodes' shares of them."""

from typing import NamedTuple

import numpy as np

from reference_fem.arrays import Array, Index

# Points per direction. A patch's rim crosses facets; the force then follows it in steps of one
# point's share.
POINTS = 3
_CORNERS = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]], dtype=np.float64)


class FacetQuadrature(NamedTuple):
    """Shape functions and weights, of reference facets.

    facets : (n_facets, n), n = 4 for bilinear quadrilaterals, 2 for edges
    shape : (q, n), N_i at the points
    weight : (n_facets, q), reference area of each point, m²; an edge's is length times thickness.
    """

    facets: Index
    shape: Array
    weight: Array

    def nodal_area(self) -> tuple[Index, Array]:
        """Nodes (k,) of the facets and their shares Σ w N_i (k,), m²."""
        return nodal_sums(self.facets, self.weight @ self.shape)


def facet_quadrature(
    points: Array, facets: Index, thickness: Array | float = 1.0
) -> FacetQuadrature:
    """Gauss-Legendre rule of POINTS per direction on every facet.

    points : (n_points, dim). facets : (n_facets, 4 | 2). thickness : (n_facets,), of edges, m.
    """
    places, weights = np.polynomial.legendre.leggauss(POINTS)
    corners = points[facets]
    if facets.shape[1] == 2:
        shape = 0.5 * np.stack([1.0 - places, 1.0 + places], axis=1)
        return FacetQuadrature(
            facets, shape, 0.5 * (_lengths(corners) * thickness)[:, None] * weights
        )
    shape, stretch = _bilinear(corners, *np.meshgrid(places, places, indexing="ij"))
    return FacetQuadrature(facets, shape, stretch * np.outer(weights, weights).ravel())


def facet_areas(points: Array, facets: Index) -> tuple[Array, Array]:
    """Area of each facet (n_facets,) and its nodes' shares ∫ N_i dA (n_facets, 4 | 2).

    Bilinear quadrilaterals by 2 x 2 Gauss points; edges exactly (per unit thickness).
    """
    corners = points[facets]
    if facets.shape[1] == 2:
        length = _lengths(corners)
        return length, np.repeat(0.5 * length[:, None], 2, axis=1)
    shape, stretch = _bilinear(corners, *_CORNERS.T / np.sqrt(3.0))
    share = (stretch[:, :, None] * shape).sum(axis=1)
    return share.sum(axis=1), share


def nodal_sums(facets: Index, shares: Array) -> tuple[Index, Array]:
    """Nodes (k,) of facets (n_facets, n) and the sums of their shares (n_facets, n) there, (k,)."""
    nodes, place = np.unique(facets, return_inverse=True)
    sums = np.bincount(place.ravel(), shares.ravel())
    return nodes.astype(np.int64), sums.astype(np.float64)


def _lengths(corners: Array) -> Array:
    return np.asarray(np.linalg.norm(corners[:, 1] - corners[:, 0], axis=1))


def _bilinear(corners: Array, xi: Array, eta: Array) -> tuple[Array, Array]:
    """Shape functions (q, 4) and |dx/dξ x dx/dη| (f, q) at places (q,) of facets (f, 4, 3)."""
    along, across = 1 + np.outer(xi, _CORNERS[:, 0]), 1 + np.outer(eta, _CORNERS[:, 1])
    tangents = 0.25 * _CORNERS[:, 0] * across, 0.25 * _CORNERS[:, 1] * along
    normal = np.cross(*(np.einsum("fad,qa->fqd", corners, slopes) for slopes in tangents))
    return 0.25 * along * across, np.linalg.norm(normal, axis=2)
