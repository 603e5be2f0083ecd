"""Element kernels of the explicit reference: one element a file, all behind `ElementKernel`."""

from reference_fem.elements.base import ElementKernel
from reference_fem.elements.hexahedron.eight_point import hex8
from reference_fem.elements.hexahedron.one_point import hex8_one_point
from reference_fem.elements.quadrilateral.plane_stress import (
    quad4_plane_stress,
    quad4_quadrature_points,
)

__all__ = [
    "ElementKernel",
    "hex8",
    "hex8_one_point",
    "quad4_plane_stress",
    "quad4_quadrature_points",
]
