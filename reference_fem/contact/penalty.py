"""Node-to-plane penalty contact: springs at the nodes, as stiff as the cells behind them."""

import numpy as np

from meshes import FingerMesh
from meshes.topology import numbered, sides
from reference_fem.arrays import Array, Index
from reference_fem.contact.springs import SpringContact, Springs
from reference_fem.elements.facet_quadrature import facet_areas, nodal_sums


def nodal_springs(nodes: Index, area: Array, stiffness: Array) -> SpringContact:
    """Springs k_i between nodes (k,), of tributary areas (k,), and the surface."""
    none = np.zeros(nodes.size)
    columns = (values[:, None] for values in (area, none, stiffness, none))
    springs = Springs(nodes[:, None], np.ones((1, 1)), *columns)
    return SpringContact(nodes, area, stiffness, none, springs)


def adjoining_cells(cells: Index, facets: Index) -> Index:
    """Cell behind each facet, (n_facets,).

    Raises ValueError: a facet is not a face of exactly one cell.
    """
    touched = np.flatnonzero(np.isin(cells, np.unique(facets)).any(axis=1))
    of_cells = sides(cells[touched])
    faces, wanted = numbered(of_cells.reshape(-1, facets.shape[1]), facets)
    count = np.bincount(np.concatenate([faces, wanted]))
    cell_of = np.full(count.size, -1, dtype=np.int64)
    cell_of[faces] = np.repeat(touched, of_cells.shape[1])
    result = cell_of[wanted]
    if (result < 0).any() or (count[wanted] != 2).any():
        raise ValueError(
            "facet set 'surface': holds a facet that is not an outer face of one cell; "
            "write the facets of the mesh's boundary"
        )
    return result


def penalty_contact(
    mesh: FingerMesh, facets: Index, cell_volume: Array, cell_bulk_modulus: Array, factor: float
) -> SpringContact:
    """k_i = Σ_facets f K A_i / h,  h = V/A, over the facets around node i.

    A is the facet's area, V and K the volume and bulk modulus of the cell behind it, A_i the
    node's share of A. Summed over one facet this is LS-DYNA's solid segment stiffness f K A²/V
    (LS-DYNA Theory Manual, 2006, eq. 26.5), spread by area so that k_i/A_i, and with it the
    traction at a given penetration, does not depend on the node count.

    In two dimensions an edge's area is its length times the mean thickness of its cell: the round
    section's own thickness vanishes at the outline, and the stiffness would with it.

    facets : (n_facets, 4 | 2). cell_volume, cell_bulk_modulus : (n_cells,). factor : f.
    """
    cell = adjoining_cells(mesh.cells, facets)
    area, share = facet_areas(mesh.points, facets)
    if mesh.dim == 2:
        thickness = edge_thickness(mesh.points, mesh.cells[cell], cell_volume[cell])
        area = area * thickness
        share = share * thickness[:, None]
    depth = cell_volume[cell] / area
    spring = (factor * cell_bulk_modulus[cell] / depth)[:, None] * share
    return nodal_springs(*nodal_sums(facets, share), nodal_sums(facets, spring)[1])


def edge_thickness(points: Array, cells: Index, cell_volume: Array) -> Array:
    """Mean thickness (n,) of the plane cells (n, 4) behind edges, m: volume over shoelace area."""
    x, y = points[cells][..., 0], points[cells][..., 1]
    area = 0.5 * np.abs(
        (x[:, 2] - x[:, 0]) * (y[:, 3] - y[:, 1]) - (x[:, 3] - x[:, 1]) * (y[:, 2] - y[:, 0])
    )
    return np.asarray(cell_volume / area)
