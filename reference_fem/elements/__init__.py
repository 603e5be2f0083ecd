"""Element kernels of the explicit reference: one element a file, all behind `ElementKernel`."""
