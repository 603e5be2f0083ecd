"""Element kernels of the explicit reference: one element a file, all behind `ElementKernel`."""

from reference_fem.elements.hex8 import Hex8, hex8
from reference_fem.elements.protocol import ElementKernel

__all__ = ["ElementKernel", "Hex8", "hex8"]
