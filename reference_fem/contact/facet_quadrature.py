"""Gauss points on the facets that may touch."""

from dataclasses import dataclass

import numpy as np

from reference_fem.arrays import Array, Index

# Points per direction. A patch's rim crosses facets; the force then follows it in steps of one
# point's share.
POINTS = 3
_CORNERS = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]], dtype=np.float64)


@dataclass(frozen=True)
class FacetQuadrature:
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
        nodes, place = np.unique(self.facets, return_inverse=True)
        area = np.bincount(place.ravel(), (self.weight @ self.shape).ravel())
        return nodes.astype(np.int64), area.astype(np.float64)


def facet_quadrature(
    points: Array, facets: Index, thickness: Array | float = 1.0
) -> FacetQuadrature:
    """Gauss-Legendre rule of POINTS per direction on every facet.

    points : (n_points, dim). facets : (n_facets, 4 | 2). thickness : (n_facets,), of edges, m.
    """
    places, weights = np.polynomial.legendre.leggauss(POINTS)
    corners = points[facets]
    if facets.shape[1] == 2:
        length = np.linalg.norm(corners[:, 1] - corners[:, 0], axis=1)
        shape = 0.5 * np.stack([1.0 - places, 1.0 + places], axis=1)
        return FacetQuadrature(facets, shape, 0.5 * (length * thickness)[:, None] * weights)
    xi, eta = (grid.ravel() for grid in np.meshgrid(places, places, indexing="ij"))
    weight = np.outer(weights, weights).ravel()
    shape = 0.25 * (1 + np.outer(xi, _CORNERS[:, 0])) * (1 + np.outer(eta, _CORNERS[:, 1]))
    along_xi = 0.25 * _CORNERS[:, 0] * (1 + np.outer(eta, _CORNERS[:, 1]))
    along_eta = 0.25 * _CORNERS[:, 1] * (1 + np.outer(xi, _CORNERS[:, 0]))
    normal = np.cross(
        np.einsum("fad,qa->fqd", corners, along_xi), np.einsum("fad,qa->fqd", corners, along_eta)
    )
    return FacetQuadrature(facets, shape, np.linalg.norm(normal, axis=2) * weight)
