"""The caution about torques that change during a tap sooner than its last phalanx bends."""

import math

import pytest

from hcm.accuracy.chosen import first_bending_frequency
from validation.models.hcm import HCM, HCM_REFINED, hcm_scene
from validation.models.sudden_torques import bending_period, sudden_torques
from validation.scenes.load import load_scene

# a tap from 0.1 to 0.1002 s with a peak of 100 N, whose moment about the last hinge is 4 N m
TAP = {"contact_time_s": 0.1, "contact_duration_s": 2e-4, "peak_normal_force_N": 100.0}


def driven(time: list[float], last: list[float]) -> str:
    """What is said of TAP where a torque of the last phalanx of soft takes these values."""
    values = [[0.0, 0.0, torque] for torque in last]
    return sudden_torques(
        load_scene("soft", (f"drive.torques={{time={time}, values={values}}}",)).tables, TAP
    )


def test_the_period_is_the_reduced_models() -> None:
    scene = load_scene("soft")
    phalanx = hcm_scene(scene, estimate=False).finger.phalanges[-1]
    period = 2.0 * math.pi / first_bending_frequency(phalanx)
    assert bending_period(scene.tables) == pytest.approx(period, rel=1e-12)
    assert 2e-4 < period < 3e-4  # as the next test has it


@pytest.mark.parametrize(
    ("time", "last", "said"),
    [
        ([0.1001, 0.1001], [0.0, 1.0], True),
        ([0.1001, 0.10015], [0.0, -1.0], True),
        ([0.09995, 0.10005], [0.0, 1.0], True),
        ([0.09, 0.09], [0.0, 1.0], False),  # before the tap
        ([0.11, 0.11], [0.0, 1.0], False),  # after it
        ([0.0999, 0.1003], [0.0, 1.0], False),  # slower than the bending
        ([0.1001, 0.1001], [0.5, 0.55], False),  # 1.3 % of the peak's moment
    ],
)
def test_only_a_sudden_change_during_the_tap_is_said(
    time: list[float], last: list[float], said: bool
) -> None:
    text = driven(time, last)
    assert bool(text) is said
    if said and time[0] == time[1]:
        assert "changes by 1 N m within 0 us of the tap, sooner" in text


def test_runs_say_so_but_for_those_that_have_no_such_error() -> None:
    """The paper's model is compared with the same equations alone."""
    for model, at, said in ((HCM_REFINED, 0.134, True), (HCM, 0.1362, False)):
        jump = f"drive.torques={{time=[{at}, {at}], values=[[0, 0, 0], [0, 0, 1]]}}"
        scene = load_scene("soft", (jump, "solver.hcm.estimate=false", "finger.elements=5"))
        record = model.run(scene).record
        assert 0.0 < at - record.summary["contact_time_s"] < record.summary["contact_duration_s"]
        assert ("sooner than the last phalanx bends" in record.message) is said
    assert sudden_torques(load_scene("soft").tables, TAP) == ""
    assert sudden_torques(scene.tables, {}) == ""
