"""``[start]``: the same state in every model, and a motion that goes on where it was left."""

import math

import numpy as np
import pytest

from tests.validation.commands import Run
from validation.models import adapter, solid_mesh
from validation.models.impact import impact_of
from validation.scenes.load import load_scene
from validation.scenes.schema import scene_schema

ROD = ("finger.phalanges=1", "finger.length=0.12", "surface.height=0.11")
RIGID = "solver.hcm.flight='rigid'"


def closed_form(angle: float, height: float) -> tuple[float, float]:
    """Time and rate at which a thin rod of 0.12 m, at rest at `angle`, has its end at -height.

    w^2 = 3 g/L (sin a - sin a_0); t = integral da/w, by a - a_0 = u^2.
    """
    length, gravity = 0.12, 9.8
    last = math.asin(height / length)
    step = math.sqrt(last - angle) / 20_000
    u = (np.arange(20_000) + 0.5) * step
    rates = np.sqrt(3.0 * gravity / length * (np.sin(angle + u**2) - math.sin(angle)))
    rate = math.sqrt(3.0 * gravity / length * (math.sin(last) - math.sin(angle)))
    return float(np.sum(2.0 * u / rates) * step), rate


@pytest.mark.parametrize("angle", [-math.pi / 3, 0.3])
def test_rod_falls_from_its_angle_by_the_closed_form(angle: float) -> None:
    scene = load_scene("soft", (*ROD, f"start.angles={angle}", RIGID))
    run = adapter("hcm").run(scene).record
    time, rate = closed_form(angle, 0.11)
    assert run.value("contact_time_s") == pytest.approx(time, rel=1e-5)  # its flight's tolerance
    vx, vy = run.summary["tip_velocity_at_contact_m_per_s"]
    assert math.hypot(vx, vy) == pytest.approx(0.12 * rate, rel=1e-5)


@pytest.mark.parametrize(
    ("model", "rel"),
    [
        ("hcm", 1e-5),  # tolerances of two rigid flights
        ("fem2d", 1e-4),  # its steps fall elsewhere: (omega dt)^2 of the tap's oscillation
    ],
)
def test_motion_goes_on_from_a_state_in_mid_flight(model: str, rel: float) -> None:
    alone = (
        RIGID,
        "solver.hcm.estimate=false",
        "solver.fem.estimate=false",
        "solver.fem.preset=fast",  # its springs are smooth; impulses stop nodes step by step
    )
    whole = load_scene("soft", alone)
    left = impact_of(whole) if model == "hcm" else solid_mesh.impact_state(whole.tables, 2)
    angles, rates = ([float(x) for x in part] for part in (left.angles, left.rates))
    state = (f"start.angles={angles}", f"start.rates={rates}")
    again = load_scene("soft", (*alone, *state))
    first, second = (adapter(model).run(scene).record for scene in (whole, again))
    later = (second.value("contact_time_s") or 0.0) + left.time_s
    assert later == pytest.approx(first.value("contact_time_s"), rel=rel)
    for key in ("peak_normal_force_N", "normal_impulse_N_s", "contact_duration_s"):
        assert second.value(key) == pytest.approx(first.value(key), rel=rel)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ("start.angles=[0.1, 0.2]", "2 numbers for 3 phalanges"),
        ("start.angles=4.0", "<= 3.14"),
        ("start.angles='60 deg'", "without unit"),
        ("start.rates=true", "must be a number"),
        ("start.rate=1.0", "did you mean start.rates?"),
        ("start=1", "must be a table"),
        ("start.angles=1.2", "at the start the finger reaches this low"),
    ],
)
def test_bad_start_is_refused(change: str, words: str, fingertap: Run) -> None:
    assert words in fingertap("run", "soft", "--model", "hcm", "--set", change).refusal


def test_schema_has_the_start() -> None:
    assert scene_schema()["$defs"]["StartTable"]["properties"]["angles"]["unit"] == "rad"


def test_a_tiny_finger_has_its_impact_at_the_same_angles() -> None:
    """A finger of 2 um, 4,096 times as fast: a state 1 us before the touch was 10 degrees off."""
    soft = load_scene("soft")
    size, time, mass = 2.0**-16, 2.0**-12, 2.0**-48
    given = soft.tables
    scaled = {
        "finger.length": given.per_phalanx(given.finger.length)[0] * size,
        "finger.diameter": given.per_phalanx(given.finger.diameter)[0] * size,
        "surface.height": given.surface.height * size,
        "drive.gravity": given.drive.gravity * size / time**2,
        "material.density": given.per_phalanx(given.material.density)[0] * mass / size**3,
        "material.youngs_modulus": 1e9 * mass / size / time**2,
    }
    tiny = load_scene("soft", [f"{key}={value!r}" for key, value in scaled.items()])
    # a lead of 1e-4 of the fall for 7e-6 of it
    assert impact_of(tiny).angles == pytest.approx(impact_of(soft).angles, abs=1e-3)
