"""The contact laws by name."""

from dataclasses import dataclass

import numpy as np

import meshes
from reference_fem.arrays import Array, Index
from reference_fem.contact.impulse import impulse_contact
from reference_fem.contact.law import ContactLaw
from reference_fem.contact.lumped_law import lumped_law
from reference_fem.contact.penalty import (
    adjoining_cells,
    edge_thickness,
    nodal_springs,
    penalty_contact,
)
from reference_fem.contact.surface import contact_modulus, standing_out, surface_contact
from reference_fem.elements.facet_quadrature import FacetQuadrature, facet_quadrature
from reference_fem.settings import LumpedContact, Material, Settings
from reference_fem.ties import ties_of


@dataclass(frozen=True)
class TouchingBody:
    """What contact laws are built from.

    facets : (n_facets, 4 | 2), of the mesh, that may touch
    mass : (n_points,), of the mesh as given, corrected by `mass_factors`
    symmetry_factor : 2 for a half model, else 1
    cell_volume, cell_bulk_modulus : (n_cells,)
    material, radius : of the phalanx that touches; R of its end, m.
    """

    mesh: meshes.FingerMesh
    facets: Index
    mass: Array
    symmetry_factor: int
    cell_volume: Array
    cell_bulk_modulus: Array
    material: Material
    radius: float

    def quadrature(self) -> FacetQuadrature:
        """Gauss points on the facets; an edge is as thick as the cell behind it."""
        points, cells = self.mesh.points, self.mesh.cells
        if points.shape[1] == 3:
            return facet_quadrature(points, self.facets)
        owner = adjoining_cells(cells, self.facets)
        thickness = edge_thickness(points, cells[owner], self.cell_volume[owner])
        return facet_quadrature(points, self.facets, thickness)

    def free(self, nodes: Index, values: Array) -> tuple[Index, Array]:
        """The nodes that do not hang, and their values (k,) plus the shares of hanging ones."""
        of_all = np.zeros(len(self.mesh.points))
        of_all[nodes] = values
        ties = ties_of(self.mesh.ties)
        kept = np.setdiff1d(nodes, ties.nodes)
        return kept, ties.sums(of_all)[kept]


def contact_law(body: TouchingBody, settings: Settings) -> ContactLaw:
    """The law that `settings.contact` names or, as a `LumpedContact`, gives the constants of."""
    if isinstance(settings.contact, LumpedContact):
        return lumped_law(body.mesh, body.mass, body.symmetry_factor, settings.contact)
    if settings.contact == "penalty":
        of_cells = body.cell_volume, body.cell_bulk_modulus
        law = penalty_contact(body.mesh, body.facets, *of_cells, settings.penalty_factor)
        nodes, area = body.free(law.nodes, law.area)
        return nodal_springs(nodes, area, body.free(law.nodes, law.stiffness)[1])
    quadrature = body.quadrature()
    if settings.contact == "impulse":
        nodes, area = body.free(*quadrature.nodal_area())
        return impulse_contact(nodes, area)
    material = body.material
    modulus = contact_modulus(settings.surface_factor, material.plane_strain_modulus, body.radius)
    impedance = material.density * material.bar_speed
    out = standing_out(body.mesh, body.facets, quadrature.shape)
    return surface_contact(quadrature, out, modulus, settings.contact_damping * impedance)
