"""The array types that the package's functions take, and the callback that they report to."""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Index = NDArray[np.int64]
ComplexArray = NDArray[np.complex128]
Flags = NDArray[np.bool_]

Progress = Callable[[float, str], None]  # share done, from 0 to 1, and what is going on
