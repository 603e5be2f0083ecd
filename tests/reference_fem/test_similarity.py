"""The finite elements in other units of length, time and mass."""

from typing import Literal

import pytest

import meshes
import reference_fem as rf
from tests.similarity import OWN, UNITS, Units, check_same_tap


def tapped(units: Units, contact: Literal["impulse", "surface"], torque: float) -> rf.TapResult:
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
    units: Units, contact: Literal["impulse", "surface"], torque: float
) -> None:
    own, other = (tapped(of, contact, torque) for of in (OWN, units))
    assert own.status is other.status is rf.Status.COMPLETED
    check_same_tap(own, other, units, 1e-5, 1e-2)
