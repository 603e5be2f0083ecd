"""What the reference is given from Python is refused by name where it is of another kind."""

from typing import Any

import numpy as np
import pytest

import meshes
import reference_fem as rf
from tests.reference_fem.boxes import boxes

MESH = boxes((0.02,), (0.02,) * 2, (2,) * 3)
STEEL = rf.Material(2e11, 0.3, 7800.0)
GIVEN: dict[str, Any] = {
    "mesh": MESH,
    "materials": (STEEL,),
    "surface": rf.Surface(0.1, 0.3),
    "drive": rf.Drive(),
}


def test_an_incline_in_degrees_is_refused() -> None:
    with pytest.raises(ValueError, match=r"^incline = 20: must be .* rad"):
        rf.Drive(incline=20)


@pytest.mark.parametrize(
    ("name", "value", "allowed"),
    [
        ("mesh", None, "a FingerMesh"),
        ("materials", STEEL, "a tuple; each a Material"),
        ("materials", (2e11,), "a Material"),
        ("surface", 0.1, "a Surface"),
        ("drive", None, "a Drive"),
        ("settings", {"threads": 1}, "a Settings"),
        ("start", (0.0, 1.0), "a ChainState"),
        ("restart", "run.npz", "a Restart"),
        ("progress", 3, r"a function of \(fraction, text\)"),
        ("companion", "fast", "a FingerMesh"),
        ("compared", {}, "a TapResult"),
        ("flight_mesh", 3, "a FingerMesh"),
    ],
)
def test_parts_of_another_kind(name: str, value: Any, allowed: str) -> None:
    with pytest.raises(ValueError, match=f"^{name} = .*: must be {allowed}$"):
        rf.simulate(**(GIVEN | {name: value}))


@pytest.mark.parametrize(
    ("make", "given", "refusal"),
    [
        (rf.Drive, {"table": 3}, "table = 3: must be a TorqueTable"),
        (rf.Drive, {"torques": [0.1]}, r"torques = \[0.1\]: must be a tuple; each a finite"),
        (rf.TorqueTable, {"time": (0.0,), "values": (1.0,)}, r"values = \(1.0,\): must be a tuple"),
        (rf.Settings, {"contact": 3}, "contact = 3: must be 'penalty' or .* or a LumpedContact"),
        (rf.Settings, {"estimate": "no"}, "estimate = 'no': must be False or True"),
        (rf.Settings, {"estimate": np.array([1, 2])}, "must be False or True"),
        (rf.Settings, {"threads": 2.0}, "threads = 2.0: must be a whole number"),
        (rf.Surface, {"height": True, "friction": 0.3}, "height = True: must be a finite number"),
        (rf.Surface, {"height": 10**400, "friction": 0.3}, "height = 1.*: must be a finite number"),
        (rf.Material, {"youngs_modulus": 10**400, "poisson_ratio": 0.3, "density": 1.0}, "youngs"),
        (meshes.FingerGeometry, {"lengths": (10**400,), "diameters": (0.01,)}, r"lengths\[1\] = 1"),
        (meshes.FingerGeometry, {"lengths": 0.04, "diameters": (0.01,)}, "lengths = 0.04: must be"),
        (meshes.finger_hexahedra, {"geometry": 3, "sizing": 4}, "geometry = 3: must be a Finger"),
    ],
)
def test_fields_of_another_kind(make: Any, given: dict[str, Any], refusal: str) -> None:
    with pytest.raises(ValueError, match=refusal):
        make(**given)


def test_numbers_of_numpy_count_and_are_kept_as_plain_ones() -> None:
    surface = rf.Surface(np.float32(0.5), np.float64(0.25))  # type: ignore[arg-type]
    assert surface == rf.Surface(0.5, 0.25)
    assert (type(surface.height), type(surface.friction)) == (float, float)
    assert type(rf.Settings(threads=np.int64(2)).threads) is int  # type: ignore[arg-type]
    lengths = meshes.FingerGeometry((np.float32(0.5),), (0.01,)).lengths  # type: ignore[arg-type]
    assert [type(length) for length in lengths] == [float]
