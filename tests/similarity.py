"""Taps in other units of length, time and mass: no constant may have a unit of its own."""

import math
from typing import Any

import numpy as np
import pytest

Units = tuple[float, float, float]
OWN: Units = (1.0, 1.0, 1.0)
# factors of a length, a time and a mass: powers of two, by which numbers scale to the last bit
UNITS: list[Units] = [(2.0**-7, 2.0**-5, 2.0**-18), (8.0, 4.0, 512.0), (1.0, 2.0**-6, 1.0)]
DIMENSIONS = {  # of length, time and mass
    "contact_time_s": (0, 1, 0),
    "contact_duration_s": (0, 1, 0),
    "peak_normal_force_N": (1, -2, 1),
    "peak_tangential_force_N": (1, -2, 1),
    "normal_impulse_N_s": (1, -1, 1),
    "peak_stress_R_Pa": (-1, -2, 1),
}


def check_same_tap(own: Any, other: Any, units: Units, known: float, errors: float) -> None:
    """The numbers and the stated errors of a run in other `units` are those of the own one, to
    these relative differences.
    """
    for name, powers in DIMENSIONS.items():
        factor = math.prod(np.power(units, powers))
        value, its = (getattr(run.summary, name) for run in (own, other))
        assert its == pytest.approx(value * factor, rel=known), name
        assert other.errors[name] == pytest.approx(own.errors[name] * factor, rel=errors), name
