"""The same finger in other units of length, time and mass: no constant has a unit of its own."""

import math
from typing import Literal

import numpy as np
import pytest

import meshes
import reference_fem as rf

# factors of a length, a time and a mass: powers of two, by which numbers scale to the last bit
UNITS = [(2.0**-7, 2.0**-5, 2.0**-18), (8.0, 4.0, 512.0), (1.0, 2.0**-6, 1.0)]
DIMENSIONS = {  # of length, time and mass
    "contact_time_s": (0, 1, 0),
    "contact_duration_s": (0, 1, 0),
    "peak_normal_force_N": (1, -2, 1),
    "peak_tangential_force_N": (1, -2, 1),
    "normal_impulse_N_s": (1, -1, 1),
    "peak_stress_R_Pa": (-1, -2, 1),
}


def tapped(
    units: tuple[float, float, float], contact: Literal["impulse", "surface"], torque: float
) -> rf.TapResult:
    length, time, mass = units
    pressure = mass / (length * time**2)
    geometry = meshes.FingerGeometry((0.04 * length,) * 2, (0.015 * length,) * 2)
    mesh, light = (
        meshes.finger_quadrilaterals(geometry, meshes.Sizing(*(edge * length for edge in edges)))
        for edges in ((2e-3, 3e-3, 1e-3), (3.75e-3, 3.75e-3, 3.75e-3))
    )
    material = rf.Material(1e8 * pressure, 0.4, 1400.0 * mass / length**3, 1e-7 * time)
    settings = rf.Settings(
        contact=contact,
        flight="coarse" if torque else "rigid",
        max_flight_time_s=2.0 * time,
        max_contact_time_s=0.02 * time,
    )
    drive = rf.Drive((torque * pressure * length**3,) * 2, 9.8 * length / time**2)
    surface = rf.Surface(0.06 * length, 0.3)
    return rf.simulate(
        mesh, (material,) * 2, surface, drive, settings, flight_mesh=light if torque else None
    )


@pytest.mark.parametrize("units", UNITS)
@pytest.mark.parametrize(
    ("contact", "torque"), [("impulse", 0.0), ("surface", 0.0), ("impulse", 0.01)]
)
def test_a_tap_in_other_units_is_the_same_tap(
    units: tuple[float, float, float], contact: Literal["impulse", "surface"], torque: float
) -> None:
    own, other = (tapped(of, contact, torque) for of in ((1.0, 1.0, 1.0), units))
    assert own.status is other.status is rf.Status.COMPLETED
    for name, powers in DIMENSIONS.items():
        factor = math.prod(np.power(units, powers))
        value, its = (getattr(run.summary, name) for run in (own, other))
        assert its == pytest.approx(value * factor, rel=1e-5), name
        assert other.errors[name] == pytest.approx(own.errors[name] * factor, rel=1e-2), name
