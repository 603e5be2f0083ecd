"""Every refusal names the field, the value and what is allowed."""

import dataclasses
import itertools
import math
from collections.abc import Callable
from fractions import Fraction
from typing import Any

import numpy as np
import pytest

import hcm
from hcm.beam.chain import build_chain
from tests.hcm.cases import SOFT, SOFT_TIP, SURFACE, finger

SIZE = "a finite number in m, >= 1e-20 and <= 1e+20"
COUNT = "a whole number, >= 1"
REFUSED: list[tuple[Any, str, Any, str]] = [
    (SOFT, "length", -0.04, SIZE),
    (SOFT, "length", math.nan, SIZE),
    (SOFT, "length", "40 mm", SIZE),
    (SOFT, "diameter", 0.0, SIZE),
    (SOFT, "youngs_modulus", math.inf, "a finite number in Pa, >= 1e-40 and <= 1e+40"),
    (SOFT, "density", -1.0, "a finite number in kg/m3, >= 1e-40 and <= 1e+40"),
    (SOFT, "length", 1e300, SIZE),
    (SOFT, "length", 10**400, SIZE),
    (SOFT, "density", 1e-320, "a finite number in kg/m3, >= 1e-40 and <= 1e+40"),
    (SOFT, "elements", 10**400, COUNT),
    (SOFT, "elements", 0, COUNT),
    (SOFT, "elements", 2.5, COUNT),
    (SOFT, "elements", True, COUNT),
    (SOFT, "elements", np.float64(5.0), COUNT),
    (SURFACE, "height", -0.1, SIZE),
    (SURFACE, "height", True, SIZE),
    (SURFACE, "friction", -1.0, "a finite number, >= 0"),
    (SURFACE, "friction", math.nan, "a finite number, >= 0"),
    (SOFT_TIP, "normal_stiffness", 0.0, "a finite number in N/m, > 0"),
    (SOFT_TIP, "normal_stiffness", Fraction(10**400), "a finite number in N/m, > 0"),
    (SOFT_TIP, "normal_stiffness", 10**400, "a finite number in N/m, > 0"),
    (SURFACE, "friction", 10**400, "a finite number, >= 0"),
    (hcm.Drive(), "gravity", 10**400, "a finite number in m/s2"),
    (hcm.Drive(), "gravity", -(10**400), "a finite number in m/s2"),
    (SOFT_TIP, "restitution", 0.0, "a finite number, >= 0.001 and <= 1"),
    (SOFT_TIP, "restitution", 1.01, "a finite number, >= 0.001 and <= 1"),
    (SOFT_TIP, "tangential_ratio", -0.1, "a finite number, >= 0"),
    (hcm.Drive(), "gravity", math.nan, "a finite number in m/s2"),
    (hcm.Settings(), "flight_step", 0.0, "a finite number in s, > 0 and <= 1"),
    (hcm.Settings(), "contact_step", -1e-7, "a finite number in s, > 0 and <= 1"),
    (hcm.Settings(), "max_flight_time", math.inf, "a finite number in s, > 0"),
    (hcm.Settings(), "max_contact_time", 0.0, "a finite number in s, > 0"),
    (hcm.Settings(), "flight_tolerance", -1e-9, "a finite number, >= 0 and <= 1"),
    (hcm.Settings(), "spectral_radius", 1.5, "a finite number, >= 0 and <= 1"),
    (hcm.Settings(), "newton_tolerance", 1.0, "a finite number, >= 1e-13 and <= 0.001"),
    (hcm.Settings(), "taps", 0, COUNT),
    (hcm.Settings(), "taps", True, COUNT),
    (hcm.Settings(), "max_steps", 1.5, COUNT),
    (hcm.Settings(), "max_steps", 10**400, COUNT),
    (hcm.Settings(), "end_time", -1.0, "a finite number in s, > 0"),
    (hcm.Settings(), "estimate", "no", "False or True"),
    (hcm.Drive(), "incline", 20, "a finite number in rad, >= -1.5708 and <= 1.5708"),
    (hcm.Drive(), "reaction", "no", "False or True"),
    (hcm.Drive(), "reaction", 1.0, "False or True"),
    (hcm.Settings(), "flight", np.array([1, 2]), "'elastic' or 'modal' or 'rigid'"),
    (hcm.Assumptions(), "hertz", "false", "False or True"),
]


@pytest.mark.parametrize(("given", "field", "value", "allowed"), REFUSED)
def test_refusals_name_field_value_and_range(
    given: Any, field: str, value: Any, allowed: str
) -> None:
    with pytest.raises(hcm.ParameterError) as refusal:
        dataclasses.replace(given, **{field: value})
    text = str(refusal.value)
    assert text.startswith(field)
    assert repr(value) in text
    assert allowed in text
    assert "\n" not in text


def test_numbers_are_kept_as_the_plain_ones_that_are_asked_for() -> None:
    half = hcm.Surface(np.float32(0.5), np.float64(0.25))  # type: ignore[arg-type]
    assert half == hcm.Surface(0.5, 0.25)
    assert (type(half.height), type(half.friction)) == (float, float)
    torques = hcm.Drive((np.float32(0.5), 1)).torques  # type: ignore[arg-type]
    assert [type(torque) for torque in torques] == [float, float]
    phalanx = dataclasses.replace(SOFT, elements=np.int64(5))
    assert phalanx == SOFT
    assert type(phalanx.elements) is int
    assert type(hcm.Settings(taps=np.int32(2)).taps) is int  # type: ignore[arg-type]


def tap(surface: hcm.Surface = SURFACE, **drive: Any) -> hcm.TapResult:
    return hcm.simulate(finger(SOFT), surface, SOFT_TIP, hcm.Drive(**drive))


@pytest.mark.parametrize(
    ("make", "given", "refusal"),
    [
        (
            hcm.Drive,
            {"torques": (0.0, math.nan, 1.0)},
            "torques = nan: must be a finite number in N m",
        ),
        (
            hcm.Drive,
            {"torques": 0.1},
            r"torques = 0\.1: must be a tuple; each a f",
        ),
        (hcm.Settings, {"frame_times": (-0.1, 0.2)}, r"frame_times = -0\.1: .* in s, >= 0"),
        (hcm.Settings, {"frame_times": (0.2, 0.1)}, r"frame_times = 0\.1: must be in rising order"),
        (hcm.Finger, {"phalanges": ()}, "at least one phalanx"),
        (hcm.Finger, {"phalanges": SOFT}, r"phalanges = Phalanx\(.*: must be a tuple"),
        (hcm.Finger, {"phalanges": (SOFT, 3)}, "phalanges = 3: must be a Phalanx"),
        (hcm.Drive, {"table": (0.0, 1.0)}, r"table = \(.*: must be a TorqueTable"),
        (hcm.TorqueTable, {"time": (0.0,), "values": (1.0,)}, "values = 1.0: must be a tuple"),
        (hcm.TorqueTable, {"time": (0.0,), "values": 1.0}, "values = 1.0: must be a tuple"),
        (hcm.RigidStart, {"angles": ("a",), "rates": (0.0,)}, "angles = 'a': .* number in rad"),
        (hcm.RigidStart, {"angles": 0.1, "rates": (0.0,)}, r"angles = 0\.1: must be a tuple"),
        (hcm.RigidStart, {"angles": (0.1,), "rates": (0.0,), "time_s": -1.0}, "time_s = -1.0: "),
        (
            hcm.RigidStart,
            {"angles": (0.1,), "rates": (0.0,), "time_s": 1.7e9},
            r"time_s = 1700000000\.0: ",
        ),
        (tap, {"surface": 0.1}, r"surface = 0\.1: must be a Surface"),
        (tap, {"torques": (1.0, 2.0)}, r"torques has 2 values.*one per phalanx \(3\)"),
        (tap, {"surface": hcm.Surface(0.12, 0.5)}, r"height = 0\.12.*0\.12 m"),
    ],
)
def test_what_does_not_fit_together_is_refused(
    make: Callable[..., Any], given: dict[str, Any], refusal: str
) -> None:
    with pytest.raises(hcm.ParameterError, match=refusal):
        make(**given)


@pytest.mark.parametrize(
    ("part", "kind"),
    [("settings", "Settings"), ("drive", "Drive"), ("start", "RigidStart"), ("tip", "Tip")],
)
def test_parts_of_another_kind_are_refused(part: str, kind: str) -> None:
    scene = hcm.Scene(finger(SOFT), SURFACE, SOFT_TIP)
    given = vars(scene) | {part: [1.0]}
    for make in (hcm.simulate, hcm.Scene):
        with pytest.raises(hcm.ParameterError, match=rf"{part} = \[1\.0\]: must be a {kind}"):
            make(**given)
    with pytest.raises(hcm.ParameterError, match=r"scene = 3: must be a Scene"):
        hcm.simulate_within(1e-2, 3)  # type: ignore[arg-type]
    with pytest.raises(hcm.ParameterError, match=r"stated = \['taps'\]: must be a Mapping"):
        hcm.simulate_within(1e-2, scene, ["taps"])  # type: ignore[arg-type]


def test_what_is_no_part_of_the_scene_is_checked_too() -> None:
    given = vars(hcm.Scene(finger(SOFT), SURFACE, SOFT_TIP)) | {"progress": 3}
    with pytest.raises(hcm.ParameterError, match="progress = 3: must be a function"):
        hcm.simulate(**given)


def test_beams_at_the_ends_of_the_bounds_are_made_of_numbers() -> None:
    sizes, per_size = (1e-20, 1e20), (1e-40, 1e40)
    for given in itertools.product(sizes, sizes, per_size, per_size, (1, 1000)):
        chain, q = build_chain(hcm.Finger((hcm.Phalanx(*given),)), hcm.Drive())
        for numbers in (chain.mass, chain.bending, chain.weight, chain.roundoff, q):
            assert np.isfinite(numbers).all(), given


@pytest.mark.parametrize(
    "given", [SOFT, finger(SOFT), SURFACE, SOFT_TIP, hcm.Drive(), hcm.Settings()]
)
def test_given_things_are_frozen(given: Any) -> None:
    name = dataclasses.fields(given)[0].name
    with pytest.raises(dataclasses.FrozenInstanceError):
        setattr(given, name, 1.0)


def test_every_status_but_success_gives_advice() -> None:
    for status in hcm.Status:
        assert bool(status.advice) == (status is not hcm.Status.COMPLETED)


@pytest.mark.parametrize("switches", [{}, {"hertz": True}])
def test_assumptions_with_a_spring_need_its_stiffness(switches: dict[str, bool]) -> None:
    """Hertz's F_n has none, the tangential element of a patch that slips as a whole has."""
    assumed = hcm.Assumptions("paper", **switches)  # type: ignore[arg-type]
    with pytest.raises(
        hcm.ParameterError, match=r"tip\.normal_stiffness is missing: .* > 0, unless partial_slip"
    ):
        hcm.Scene(finger(SOFT), SURFACE, hcm.Tip(), assumptions=assumed)
