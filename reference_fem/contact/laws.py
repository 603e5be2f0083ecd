"""The contact laws by name."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from reference_fem.contact.facet_quadrature import FacetQuadrature, facet_quadrature
from reference_fem.contact.impulse import ImpulseContact
from reference_fem.contact.law import ContactLaw
from reference_fem.contact.stiffness import adjoining_cells, contact_surface, edge_thickness
from reference_fem.contact.surface import contact_modulus, surface_contact
from reference_fem.settings import Settings

Array = NDArray[np.float64]
Index = NDArray[np.int64]


@dataclass(frozen=True)
class TouchingSurface:
    """What laws are built from.

    Attributes
    ----------
    points, cells, facets
        Of the mesh; facets that may touch.
    cell_volume, cell_bulk_modulus : (n_cells,)
    plane_modulus
        E* of the body that touches, Pa.
    radius
        R of its end, m.
    impedance
        ρ c of the body that touches, c = sqrt(E/ρ), Pa s/m.
    """

    points: Array
    cells: Index
    facets: Index
    cell_volume: Array
    cell_bulk_modulus: Array
    plane_modulus: float
    radius: float
    impedance: float

    def quadrature(self) -> FacetQuadrature:
        """Gauss points on the facets; an edge is as thick as the cell behind it."""
        if self.points.shape[1] == 3:
            return facet_quadrature(self.points, self.facets, None)
        owner = adjoining_cells(self.cells, self.facets)
        thickness = edge_thickness(self.points, self.cells[owner], self.cell_volume[owner])
        return facet_quadrature(self.points, self.facets, thickness)


def _penalty(surface: TouchingSurface, settings: Settings) -> ContactLaw:
    return contact_surface(
        surface.points,
        surface.cells,
        surface.facets,
        surface.cell_volume,
        surface.cell_bulk_modulus,
        settings.penalty_factor,
    )


def _surface(surface: TouchingSurface, settings: Settings) -> ContactLaw:
    modulus = contact_modulus(settings.surface_factor, surface.plane_modulus, surface.radius)
    viscosity = settings.contact_damping * surface.impedance
    return surface_contact(surface.quadrature(), modulus, viscosity)


def _impulse(surface: TouchingSurface, _settings: Settings) -> ContactLaw:
    return ImpulseContact(*surface.quadrature().nodal_area())


_LAWS: Mapping[str, Callable[[TouchingSurface, Settings], ContactLaw]] = {
    "penalty": _penalty,
    "surface": _surface,
    "impulse": _impulse,
}


def contact_law(surface: TouchingSurface, settings: Settings) -> ContactLaw:
    """The law that `settings.contact` names."""
    return _LAWS[settings.contact](surface, settings)
