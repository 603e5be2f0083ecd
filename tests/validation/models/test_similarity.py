"""A scene in other units of length, time and mass is the same scene: every number follows.

What would not: a constant with a unit that a solver has of its own, and a key or a result whose
stated unit is not its own.
"""

import re
from collections.abc import Iterator
from typing import Any

import pytest

import hcm
from validation.harness.quantities import unit_of
from validation.runs.execute import solve
from validation.scenes.load import load_scene
from validation.sweep.axis import scene_number_of
from validation.sweep.plan import assignment

LENGTH, TIME, MASS = 2.0**-6, 2.0**-4, 2.0**-16  # their powers change no bit of a number
FORCE = MASS * LENGTH / TIME**2
SCALES = {"m": LENGTH, "s": TIME, "kg": MASS, "N": FORCE, "Pa": FORCE / LENGTH**2, "rad": 1.0}
NOT_THE_SCENES = ("wall_time_s", "peak_memory_MB", "energy_residual")  # the last is round-off
# 60 random taps are apart by 1e-9 at most, in the time that the tip takes to its peak
ROUND_OFF = 1e-7
DAMPED = ("material.relaxation_time=1e-6", "surface.incline=0.1")
STEPS = tuple(
    f"solver.hcm.{name}={getattr(hcm.Settings(), name)}"
    for name in ("flight_step", "contact_step", "contact_tolerance")
)


def factor(unit: str) -> float:
    """By what a number of that unit grows, for example of ``m/s2``."""
    found = 1.0
    for sign, part in zip((1, -1), unit.partition("/")[::2], strict=True):
        for name, power in re.findall(r"([A-Za-z]+)(\d*)", part):
            found *= SCALES[name] ** (sign * int(power or 1))
    return found


def leaves(tables: dict[str, Any], prefix: str = "") -> Iterator[tuple[str, Any]]:
    for name, value in tables.items():
        if isinstance(value, dict):
            yield from leaves(value, f"{prefix}{name}.")
        else:
            yield f"{prefix}{name}", value


def scaled(value: Any, by: float) -> Any:
    return [scaled(v, by) for v in value] if isinstance(value, list | tuple) else value * by


@pytest.mark.parametrize(
    ("scene", "model", "settings"),
    [
        ("soft", "hcm", ("solver.accuracy=1e-3",)),
        ("soft", "hcm", ("solver.accuracy=1e-5", "tip.restitution=0.8")),
        ("hard", "hcm", ("solver.accuracy=1e-3", "solver.hcm.assumptions=refined")),
        ("driven-1", "hcm", ("solver.accuracy=1e-3",)),
        ("soft", "hcm", (*DAMPED, *STEPS)),
        ("soft", "fem3d", ("solver.fem.preset=fast",)),
        ("driven-1", "fem2d", ("solver.fem.preset=fast",)),
    ],
)
def test_other_units_change_no_number(scene: str, model: str, settings: tuple[str, ...]) -> None:
    # keys whose defaults have a unit
    stated = ("drive.gravity=9.81", "solver.hcm.max_flight_time=1.0")
    own = load_scene(scene, (*stated, *settings))
    changes = [
        assignment(key, scaled(value, factor(number.unit)))
        for key, value in leaves(own.document)
        if (number := scene_number_of(key)) and number.unit not in ("", "rad")
    ]
    assert len(changes) > 6
    other = load_scene(scene, (*stated, *settings, *changes))
    one, two = (solve(s, model, None, warm=True).record for s in (own, other))
    assert one.status == two.status == "COMPLETED"
    numbers = {
        key: value
        for key, value in one.summary.items()
        if key not in NOT_THE_SCENES and not isinstance(value, bool | str | None)
    }
    assert numbers["peak_normal_force_N"] > 0.0
    for key, value in numbers.items():
        by = factor(unit_of(key).removeprefix("1"))
        assert two.summary[key] == pytest.approx(scaled(value, by), rel=ROUND_OFF), key
    for key, error in one.errors.items():
        by = factor(unit_of(key).removeprefix("1"))
        assert two.errors[key] == pytest.approx(scaled(error, by), rel=1e3 * ROUND_OFF), key
