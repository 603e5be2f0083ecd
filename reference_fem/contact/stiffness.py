"""Nodal penalty stiffness and tributary area of the surface that may touch."""

import numpy as np

from meshes.topology import local_facets
from reference_fem.arrays import Array, Index
from reference_fem.contact.penalty import PenaltyContact


def adjoining_cells(cells: Index, facets: Index) -> Index:
    """Cell behind each facet, (n_facets,).

    Raises ValueError: a facet is not a face of exactly one cell.
    """
    local = local_facets(3 if cells.shape[1] == 8 else 2)
    touched = np.flatnonzero(np.isin(cells, np.unique(facets)).any(axis=1))
    faces = np.sort(cells[touched][:, local].reshape(-1, local.shape[1]), axis=1)
    owner = np.repeat(touched, local.shape[0])
    wanted = np.sort(facets, axis=1)
    both, inverse, count = np.unique(
        np.concatenate([faces, wanted]), axis=0, return_inverse=True, return_counts=True
    )
    inverse = inverse.ravel()
    cell_of = np.full(both.shape[0], -1, dtype=np.int64)
    cell_of[inverse[: len(faces)]] = owner
    result = cell_of[inverse[len(faces) :]]
    if (result < 0).any() or (count[inverse[len(faces) :]] != 2).any():
        raise ValueError(
            "facet set 'surface': holds a facet that is not an outer face of one cell; "
            "write the facets of the mesh's boundary"
        )
    return result


def facet_areas(points: Array, facets: Index) -> tuple[Array, Array]:
    """Area of each facet (n_facets,) and its nodes' shares ∫ N_i dA (n_facets, 4 | 2).

    Bilinear quadrilaterals by 2 x 2 Gauss points; edges exactly (per unit thickness).
    """
    corners = points[facets]
    if facets.shape[1] == 2:
        length = np.linalg.norm(corners[:, 1] - corners[:, 0], axis=1)
        return length, np.repeat(0.5 * length[:, None], 2, axis=1)
    sign = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]], dtype=np.float64)
    share = np.zeros(facets.shape)
    for xi, eta in sign / np.sqrt(3.0):
        shape = 0.25 * (1 + sign[:, 0] * xi) * (1 + sign[:, 1] * eta)
        along_xi = 0.25 * sign[:, 0] * (1 + sign[:, 1] * eta)
        along_eta = 0.25 * sign[:, 1] * (1 + sign[:, 0] * xi)
        normal = np.cross(
            np.einsum("fad,a->fd", corners, along_xi), np.einsum("fad,a->fd", corners, along_eta)
        )
        share += np.linalg.norm(normal, axis=1)[:, None] * shape
    return share.sum(axis=1), share


def penalty_contact(
    points: Array,
    cells: Index,
    facets: Index,
    cell_volume: Array,
    cell_bulk_modulus: Array,
    penalty_factor: float,
) -> PenaltyContact:
    """k_i = Σ_facets f K A_i / h,  h = V/A, over the facets around node i.

    A is the facet's area, V and K the volume and bulk modulus of the cell behind it, A_i the
    node's share of A. Summed over one facet this is LS-DYNA's solid segment stiffness f K A²/V
    (LS-DYNA Theory Manual, 2006, eq. 26.5), spread by area so that k_i/A_i, and with it the
    traction at a given penetration, does not depend on the node count.

    In two dimensions an edge's area is its length times the mean thickness of its cell: the round
    section's own thickness vanishes at the outline, and the stiffness would with it.

    points : (n_points, dim). cells : (n_cells, 8 | 4). facets : (n_facets, 4 | 2).
    cell_volume, cell_bulk_modulus : (n_cells,). penalty_factor : f.
    """
    cell = adjoining_cells(cells, facets)
    area, share = facet_areas(points, facets)
    if points.shape[1] == 2:
        thickness = edge_thickness(points, cells[cell], cell_volume[cell])
        area = area * thickness
        share = share * thickness[:, None]
    depth = cell_volume[cell] / area
    spring = (penalty_factor * cell_bulk_modulus[cell] / depth)[:, None] * share
    nodes, place = np.unique(facets, return_inverse=True)
    place = place.ravel()
    return PenaltyContact(
        nodes=nodes.astype(np.int64),
        stiffness=np.bincount(place, spring.ravel()).astype(np.float64),
        area=np.bincount(place, share.ravel()).astype(np.float64),
    )


def edge_thickness(points: Array, cells: Index, cell_volume: Array) -> Array:
    """Mean thickness (n,) of the plane cells (n, 4) behind edges, m: volume over shoelace area."""
    x, y = points[cells][..., 0], points[cells][..., 1]
    area = 0.5 * np.abs(
        (x[:, 2] - x[:, 0]) * (y[:, 3] - y[:, 1]) - (x[:, 3] - x[:, 1]) * (y[:, 2] - y[:, 0])
    )
    return np.asarray(cell_volume / area)
