"""Cells of the reduced model's maps are judged: by tighter runs, closed form, DOP853."""

import math
from dataclasses import replace

import pytest

import hcm
from tests.validation.studies.stress.taps import SOFT, TAP
from validation.studies.stated_errors import StatedError
from validation.studies.stress.hcm.judge import judge_by_dop853, judge_by_tighter_run
from validation.studies.stress.hcm.maps import hcm_maps
from validation.studies.stress.hcm.rigid_rod import closed_form, judge_by_closed_form
from validation.studies.stress.stability_map import Answer, CellVerdict, Map


@pytest.fixture(scope="module", autouse=True)
def warm() -> None:
    """Compile before any test counts seconds."""
    for scene in (TAP, refined_map().scene(1.2, 1e7, 0.5)):
        hcm.simulate_scene(scene)


def refined_map() -> Map:
    return next(m for m in hcm_maps(quick=True) if m.name == "refined-restitution")


def test_cells_are_judged() -> None:
    verdict = judge_by_tighter_run(TAP)
    assert verdict.answer in (Answer.RIGHT, Answer.SMALLER)
    assert verdict.error is not None
    assert verdict.error < 1e-3
    stopped = judge_by_tighter_run(replace(TAP, settings=hcm.Settings(max_steps=50)))
    assert stopped.answer == Answer.STOPPED
    assert "50 steps" in stopped.reason
    many = replace(TAP, settings=hcm.Settings(end_time=1e3, flight_step=1e-9))
    refused = judge_by_tighter_run(many)
    assert refused.answer == Answer.REFUSED
    assert "end_time" in refused.reason


def test_refined_taps_are_judged_by_what_holds_for_them() -> None:
    wanted = refined_map()
    expected = {0.02: Answer.STOPPED, 0.5: Answer.RIGHT}
    for restitution, answer in expected.items():
        verdict = wanted.judge(wanted.scene(1.2, 1e7, restitution))
        assert verdict.answer is answer, verdict.reason
    assert verdict.checked_by.startswith("mechanics of its states, contact law, a run with")


NUMBERS: list[tuple[float, float, bool, Answer]] = [
    (0.01, 0.019, False, Answer.RIGHT),
    (0.2, 0.3, True, Answer.RIGHT),
    (1e-3, 3e-3, False, Answer.UNDERSTATED),
    (0.015, 0.04, False, Answer.WRONG),
    (0.015, 0.04, True, Answer.UNDERSTATED),
    (math.inf, 0.01, True, Answer.RIGHT),
    (math.inf, 0.04, True, Answer.FLAGGED),
    (math.inf, 0.04, False, Answer.WRONG),
]


@pytest.mark.parametrize(("stated", "true", "cautioned", "answer"), NUMBERS)
def test_right_is_within_what_the_run_states(
    stated: float, true: float, cautioned: bool, answer: Answer
) -> None:
    good = StatedError(1e-3, 1e-4, 100.0)
    peak = StatedError(100.0 * stated, 100.0 * true, 100.0)
    judged = CellVerdict(Answer.RIGHT, "").within_stated(
        "a tighter run", {"impulse": good, "peak": peak}, cautioned
    )
    assert (judged.answer, judged.checked_by) == (answer, ", a tighter run")
    # an unknown error that is small is not the farthest beyond what is stated: the other one is
    shown = good.shares if (stated, true) == (math.inf, 0.01) else (stated, true)
    assert (judged.stated, judged.error) == pytest.approx(shown)
    assert ("peak differs by" in judged.reason) == (answer != Answer.RIGHT)


def test_steps_too_long_are_wrong_and_not_silent() -> None:
    fixed = hcm.Settings(contact_step=2e-4, contact_tolerance=0.0, flight_tolerance=0.0)
    assert judge_by_tighter_run(replace(TAP, settings=fixed)).answer is Answer.FLAGGED


@pytest.mark.parametrize(
    ("finger", "settings", "words"),
    [
        (hcm.Finger((replace(SOFT, elements=10**9),)), hcm.Settings(), ("GiB", "elements")),
        (hcm.Finger((SOFT,)), hcm.Settings(max_steps=10**12), ("GiB", "max_steps")),
        (hcm.Finger((SOFT,)), hcm.Settings(end_time=1e8), ("1e+12 steps", "end_time")),
    ],
)
def test_hopeless_sizes_are_refused_before_allocation(
    finger: hcm.Finger, settings: hcm.Settings, words: tuple[str, ...]
) -> None:
    with pytest.raises(hcm.ParameterError) as caught:
        hcm.simulate(finger, TAP.surface, TAP.tip, TAP.drive, settings)
    for word in words:
        assert word in str(caught.value)


def test_a_rod_is_compared_with_its_closed_form() -> None:
    """A stiff rod on a soft spring; another mass in the closed form is seen."""
    rod = next(m for m in hcm_maps(quick=True) if m.name == "rigid-rod")
    scene = rod.scene(1e4, 1e12, 0.008)
    verdict = judge_by_closed_form(scene)
    assert verdict.answer == Answer.RIGHT
    assert verdict.error is not None
    # the closed form's lever arm is constant: it shortens by 0.28 mm/L tan(11.5 degrees) = 1.4e-3
    assert verdict.error < 1.5e-3
    result = hcm.simulate_scene(scene)
    heavier = replace(scene.finger.phalanges[0], density=1.2 * 1400.0)
    other = closed_form(replace(scene, finger=hcm.Finger((heavier,))))
    peak = result.summary.peak_normal_force_N
    assert peak is not None
    assert abs(peak / other["peak_normal_force_N"] - 1) > 0.05


def test_a_tap_is_compared_with_another_integrator() -> None:
    verdict = judge_by_dop853(TAP)
    assert verdict.answer in (Answer.RIGHT, Answer.SMALLER)
    assert "DOP853" in verdict.checked_by
    assert verdict.error is not None
    assert 0 < verdict.error < 1e-4


def test_maps_cover_the_ranges() -> None:
    maps = {wanted.name: wanted for wanted in hcm_maps(quick=False)}
    assert sum(1 for wanted in maps.values() for _ in wanted.cells()) > 10_000
    stiffness = maps["stiffness-step"].axes["normal_stiffness (N/m)"]
    assert (stiffness[0], stiffness[-1]) == (1e2, 1e10)
    assert maps["phalanges"].axes["phalanges"][-1] == 30
    assert maps["slenderness-elements"].axes["elements"][-1] == 320
