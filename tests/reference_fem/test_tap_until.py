"""Taps over the touches that begin within a given time: a soft phalanx touches three times."""

import numpy as np
import pytest

import meshes
import reference_fem as rf
from tests.reference_fem.taps import tap

MESH = meshes.finger_quadrilaterals(
    meshes.FingerGeometry((0.0933,), (0.015,)), meshes.SIZINGS["fast"]
)


def fallen(until_s: float, **settings: float) -> rf.TapResult:
    rubber, surface = (rf.Material(4.4e7, 0.44, 1000.0),), rf.Surface(0.0387, 0.27)
    return tap(MESH, rubber, surface, estimate=False, tap_until_s=until_s, **settings)


@pytest.fixture(scope="module")
def touches() -> list[tuple[float, float]]:
    """Begin and end of each after the first one's begin, s, more than ten steps apart."""
    run = fallen(0.0, end_time_s=0.088)
    time = run.forces.time_s[run.forces.normal_force_N > 0.0]
    parts = np.split(time, np.flatnonzero(np.diff(time) > 10.5 * run.summary.time_step_s) + 1)
    return [(part[0] - time[0], part[-1] - time[0]) for part in parts]


def test_a_tap_has_the_touches_that_begin_until_then(touches: list[tuple[float, float]]) -> None:
    assert len(touches) == 3
    for count, (begin, end) in enumerate(touches, 1):
        following = touches[count][0] if count < len(touches) else end + 2e-3
        for until_s in (0.5 * (begin + end), 0.5 * (end + following)):
            run = fallen(until_s)
            assert run.status is rf.Status.COMPLETED
            lasts = run.summary.contact_duration_s
            # it begins between two steps
            assert lasts == pytest.approx(end, abs=1.01 * run.summary.time_step_s)


def test_a_tip_that_its_bending_brings_back_is_told_of(touches: list[tuple[float, float]]) -> None:
    wait = 1e3 * (touches[1][0] - touches[0][1])
    told = [c for c in fallen(0.0).cautions if "may touch again" in c]
    assert len(told) == 1
    assert float(told[0].split("within ")[1].split()[0]) > wait
    assert f"touches again {wait:.2g} ms" in " ".join(fallen(0.0, end_time_s=0.088).cautions)
    until_s = float(told[0].split("tap_until = ")[1].split()[0])
    both = fallen(until_s)
    assert both.summary.contact_duration_s > touches[1][0]
    assert not any("touch again" in c for c in both.cautions)


def test_a_time_beyond_the_longest_contact_is_waited_for(
    touches: list[tuple[float, float]],
) -> None:
    """It ended as "in contact" after `max_contact_time_s`, while nothing touched."""
    until_s = touches[1][1]
    run, wanted = fallen(until_s, max_contact_time_s=0.5 * until_s), fallen(until_s)
    assert run.status is rf.Status.COMPLETED
    assert run.summary.contact_duration_s == wanted.summary.contact_duration_s


def test_within_one_touch_it_is_the_tap_of_the_rule(touches: list[tuple[float, float]]) -> None:
    rule, held = fallen(0.0).summary, fallen(0.9 * touches[0][1]).summary
    assert held.contact_duration_s == rule.contact_duration_s
    assert held.normal_impulse_N_s == rule.normal_impulse_N_s


def test_a_tap_whose_touches_are_given_has_no_other_ends(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """By the rule this one's next touch is near, and all of its numbers are open."""
    monkeypatch.setattr(
        "reference_fem.estimates.estimate.other_ends",
        lambda *_: ({"contact_duration_s": 9.0}, ("open",)),
    )
    for until_s, told in ((0.0, True), (1e-3, False)):
        scene = (MESH, (rf.Material(4.4e7, 0.44, 1000.0),), rf.Surface(0.0387, 0.27))
        run = rf.simulate(*scene, rf.Drive(), rf.Settings(tap_until_s=until_s))
        assert ("open" in run.cautions) == told
        assert (run.errors["contact_duration_s"] == pytest.approx(9.0, abs=1e-5)) == told
