"""Element kernels of the explicit reference: one element a file, all behind `ElementKernel`."""

from reference_fem.elements.hex8 import Hex8, hex8
from reference_fem.elements.protocol import ElementKernel
from reference_fem.elements.quad4 import (
    Quad4PlaneStress,
    quad4_plane_stress,
    quad4_quadrature_points,
)

__all__ = [
    "ElementKernel",
    "Hex8",
    "Quad4PlaneStress",
    "hex8",
    "quad4_plane_stress",
    "quad4_quadrature_points",
]
