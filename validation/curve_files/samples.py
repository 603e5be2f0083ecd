"""What a reader gives: forces over time as a file states them, in SI units."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from validation.errors import UserError
from validation.scenes.messages import show

Floats = NDArray[np.float64]
FACTORS = {"s": 1.0, "ms": 1e-3, "us": 1e-6, "N": 1.0, "kN": 1e3, "mN": 1e-3}  # to SI
LARGEST = 1e12  # s, N: nothing of a tap is larger


@dataclass(frozen=True)
class Samples:
    """Contact force over time, not yet checked as a tap.

    lines, time_s : (n,), line of the file, and its time.
    forces : (n,) each, N, by the names ``normal_force``, ``tangential_force`` and these with
        ``_sigma``; the first is always there.
    notes : what was taken for granted.
    """

    lines: NDArray[np.int64]
    time_s: Floats
    forces: Mapping[str, Floats]
    notes: tuple[str, ...] = ()


def number(text: str, place: str) -> float:
    """A cell as a finite number; the place begins the refusal."""
    try:
        value = float(text if "_" not in text else "")  # to Python alone 1_000 is a number
    except ValueError:
        value = np.inf
    if not abs(value) <= LARGEST:
        raise UserError(f"{place}: {show(text)} is not a number of up to {LARGEST:g}")
    return value
