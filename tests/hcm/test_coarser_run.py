"""A run held to an accuracy is judged by a coarser one: hand-made pairs of runs."""

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

import hcm
from hcm.accuracy import coarser_run
from hcm.accuracy import simulate_within as accuracy_module
from hcm.accuracy.chosen import Chosen, settings_for
from hcm.accuracy.simulate_within import simulate_within
from hcm.estimates.companion import GRAZE
from hcm.simulate import solve_once
from tests.hcm.cases import RINGING, SOFT, SOFT_SCENE

# Short last phalanges, with their stress at R on 48 elements, Pa.
SHORT = [
    (hcm.Scene(hcm.Finger((hcm.Phalanx(*first), hcm.Phalanx(*last))), surface, tip), limit)
    for first, last, surface, tip, limit in (
        ((0.0790593, 0.00773657, 4.07478e7, 7841.0), (0.0371415, 0.0107649, 1.13124e8, 7841.0),
         hcm.Surface(0.0857344, 1.14803), hcm.Tip(380.908), 202180.0),
        ((0.0874104, 0.00432677, 1.01367e7, 2939.4), (0.0144677, 0.00431999, 1.31373e7, 2939.4),
         hcm.Surface(0.0816131, 0.188633), hcm.Tip(187.247), 72914.0),
    )
]  # fmt: skip


@pytest.fixture(scope="module")
def judged() -> tuple[Chosen, hcm.TapResult]:
    """The soft finger, which falls as rods, with the settings for 1e-2; nothing judges it yet."""
    of = settings_for(1e-2, SOFT_SCENE)
    assert of.scene.settings.flight == "rigid"
    return of, solve_once(of.scene, None, of.fall)[0]


def summarized(run: hcm.TapResult, **numbers: Any) -> hcm.TapResult:
    return replace(run, summary=replace(run.summary, **numbers))


def test_what_a_flight_leaves_out_is_expected_of_two_equal_runs(
    judged: tuple[Chosen, hcm.TapResult],
) -> None:
    """Both leave it out alike: three tenths of the tap; where it is unknown they tell the rest."""
    of, run = judged
    for share, least in ((0.3, 0.3), (math.inf, 0.0)):
        found, expected = coarser_run.compared(run, run, replace(of, flight_error=share), 1e-2)
        # two equal runs have no other error than that of the energy's audit, below 1e-2
        assert least <= expected < least + 1e-2
        for name in ("peak_normal_force_N", "normal_impulse_N_s", "contact_duration_s"):
            number = getattr(run.summary, name)
            assert least * number <= found.errors[name] < (2.0 * least + 1e-2) * number


@pytest.mark.parametrize(
    ("elements", "followed", "flown", "told"),
    [(10, False, 1, 2.0), (10, True, 2, 2.0), (10, True, 1, 0.75), (1, False, 2, 0.75)],
)
def test_a_coarser_runs_difference_is_twice_the_error_or_three_quarters_of_a_single_elements(
    judged: tuple[Chosen, hcm.TapResult], elements: int, followed: bool, flown: int, told: float
) -> None:
    """Errors of 1 and 3 differ by 2, those of one element and two by 3/4; a stress by a half."""
    of, run = judged
    body = hcm.Finger((SOFT, replace(SOFT, elements=elements), SOFT))
    settings = replace(of.scene.settings, flight_elements=flown)
    of = replace(of, followed=followed, scene=replace(of.scene, finger=body, settings=settings))
    apart, stress = 0.1, run.history.stress_R_Pa
    coarse = summarized(run, contact_duration_s=(1.0 + apart) * run.summary.contact_duration_s)
    coarse = replace(coarse, history=replace(run.history, stress_R_Pa=(1.0 - apart) * stress))
    found, expected = coarser_run.compared(run, coarse, of, 1e-2)
    # a safety factor of 2 at most
    assert apart / told <= expected <= 2.0 * apart / told
    missing = (2.0 if told < 1.0 else 1.0) * apart * abs(run.summary.peak_stress_R_Pa)
    assert missing <= found.errors["peak_stress_R_Pa"] < 2.0 * missing


@pytest.mark.parametrize("speed", ["ringing", "bending"])
def test_each_speed_that_rods_leave_out_is_in_the_stress_of_two_equal_runs(
    judged: tuple[Chosen, hcm.TapResult], speed: str
) -> None:
    """A wave of 1 m/s, 2 v sqrt(E rho), of a fall that has the one or the other."""
    of, run = judged
    assert of.fall is not None
    none = {"ringing": 0.0, "bending": 0.0, "largest": 0.0}
    fall = replace(of.fall, **(none | {speed: 1.0}))
    found, _ = coarser_run.compared(run, run, replace(of, fall=fall), 1e-2)
    wave = 2.0 * math.sqrt(SOFT.youngs_modulus * SOFT.density)
    assert found.errors["peak_stress_R_Pa"] == pytest.approx(wave, rel=1e-12)


def test_the_largest_speed_that_rods_leave_out_is_in_the_time_of_the_touch(
    judged: tuple[Chosen, hcm.TapResult],
) -> None:
    """A share r of the approach shifts it by 2 r/w_1; both ends of the flight have none of it."""
    of, run = judged
    assert of.fall is not None
    share = 100.0
    fall = replace(of.fall, ringing=0.0, bending=0.0, largest=share * of.fall.speed)
    found, expected = coarser_run.compared(run, run, replace(of, fall=fall), 1e-2)
    rate = math.sqrt(SOFT.bending_stiffness / SOFT.line_density)
    late = 2.0 * share / ((math.pi / SOFT.length) ** 2 * rate)
    assert late < of.fall.time
    assert found.errors["contact_time_s"] == pytest.approx(late, rel=1e-9)
    assert expected == pytest.approx(late / run.summary.contact_time_s, rel=1e-9)


def test_a_run_that_lost_energy_expects_half_of_it(judged: tuple[Chosen, hcm.TapResult]) -> None:
    """|dF|/F = |dE|/2E, a fifth of the kinetic energy at the touch, though two runs agree."""
    of, run = judged
    history, touched = run.history, run.summary.contact_time_s
    kinetic = history.kinetic_energy_J[history.time_s.searchsorted(touched)]
    work = history.drive_work_J + 0.2 * kinetic * (history.time_s > touched)
    lost = replace(run, history=replace(history, drive_work_J=work))
    # the run's own balance adds less than 1e-3
    assert coarser_run.compared(lost, lost, of, 1e-2)[1] == pytest.approx(0.1, abs=1e-3)


def test_a_coarser_run_that_failed_or_was_cut_leaves_the_error_unknown(
    judged: tuple[Chosen, hcm.TapResult],
) -> None:
    """Its numbers, here the run's own, are not to be compared."""
    of, run = judged
    failed = replace(run, status=hcm.Status.NEWTON_FAILED)
    cut = replace(summarized(run, contact_duration_s=None), status=hcm.Status.STILL_IN_CONTACT)
    for coarse in (failed, cut):
        assert coarser_run.compared(run, coarse, of, 1e-2)[1] == math.inf
    unresolved = replace(run, status=hcm.Status.UNRESOLVED)
    assert coarser_run.compared(run, unresolved, of, 1e-2)[1] < 1e-2


def test_each_component_of_the_tips_velocity_has_its_own_error(
    judged: tuple[Chosen, hcm.TapResult],
) -> None:
    """Two touches as rods differ by 0.1 m/s along the surface alone, or across it alone."""
    of, run = judged
    velocity = np.array(run.summary.tip_velocity_at_contact_m_per_s)
    for apart in ((0.1, 0.0), (0.0, 0.1)):
        coarse = summarized(run, tip_velocity_at_contact_m_per_s=tuple(velocity + apart))
        errors = coarser_run.compared(run, coarse, of, 1e-2)[0].errors
        found = np.array(errors["tip_velocity_at_contact_m_per_s"])
        # the run leaves out less than 1e-2 of its speed besides
        slack = 1e-2 * np.hypot(*velocity)
        assert (found >= apart).all()
        assert (found <= 2.0 * np.array(apart) + slack).all()


def test_doubts_about_later_taps_and_transitions_are_said_of_the_run(
    judged: tuple[Chosen, hcm.TapResult],
) -> None:
    """The coarser run has one tap of two, or two changes to slip more; an equal one has neither."""
    of, run = judged
    twice = replace(run, taps=(*run.taps, *run.taps))
    slips = summarized(run, stick_to_slip=run.summary.stick_to_slip + 2)
    for own, coarse, said in ((twice, run, "no such tap"), (run, slips, "are not resolved")):
        cautions = coarser_run.compared(own, coarse, of, 1e-2)[0].cautions
        assert any(said in caution for caution in cautions)
    assert coarser_run.compared(run, run, of, 1e-2)[0].cautions == ()


@pytest.mark.parametrize(
    ("accuracy", "again", "times", "folds", "by", "divisor"),
    [
        (1e-3, 1.0, 1.0, False, 1.0, 1.0),
        (1e-3, 1.0, 1.1, False, 1.0, 3.0),
        (1e-3, 1.0, 5.0, False, 1.0, 5.0),
        (1e-3, 1.0, 100.0, False, 1.0, 9.0),
        (1e-3, 1.0, math.inf, False, 1.0, 9.0),
        (1e-3, 1.0, 0.5, True, 1.0, 3.0),
        # ten times the run's own accuracy, at most 5 % or that accuracy, may be another tap
        (1e-3, 1.0, 0.5, False, 0.0099, 9.0),
        (1e-3, 1.0, 0.5, False, 0.011, 1.0),
        (1e-2, 1.0, 0.5, False, 0.049, 9.0),
        (1e-2, 1.0, 0.5, False, 0.051, 1.0),
        (0.1, 1.0, 0.5, False, 0.099, 9.0),
        (0.1, 1.0, 0.5, False, 0.101, 1.0),
        (1e-4, 1.0, 0.5, False, 0.0099, 3.0),
        (1e-4, 1.0, 0.5, False, 0.0009, 9.0),
        # a run that was one again: only if that may still be so, or its own coarser run has it
        (1e-2, 9.0, 0.5, False, 0.0111, 9.0),
        (1e-2, 9.0, 0.5, False, 0.012, 1.0),
        (1e-2, 9.0, 100.0, False, 0.049, 9.0),
        (1e-2, 9.0, 100.0, False, 0.051, 1.0),
        (1e-2, 9.0, 100.0, True, 0.049, 1.0),
        (1e-3, 9.0, 5.0, False, 0.049, 1.0),
    ],
)
def test_another_run_is_for_an_accuracy_3_to_9_times_smaller(
    judged: tuple[Chosen, hcm.TapResult], monkeypatch: pytest.MonkeyPatch,
    accuracy: float, again: float, times: float, folds: bool, by: float, divisor: float,
) -> None:  # fmt: skip
    """As the first one's expected error, `times` the accuracy, asks for, or a tap that may end
    otherwise, as it grazes by less than a share. by : that share. An error at the accuracy itself
    asks for no other. again : how much smaller than wanted the run's own accuracy was.
    """
    monkeypatch.setattr(accuracy_module, "grazes", lambda _, share=GRAZE: by < share)
    attempt = accuracy_module._Attempt(*judged, times * accuracy, folds)
    target, reason = accuracy_module._finer(attempt, accuracy, accuracy / again)
    assert bool(reason) is (divisor > 1.0)
    assert ("folds up" in reason) is (bool(reason) and (folds or by < 1.0))
    if reason:
        assert target == pytest.approx(accuracy / again / divisor, rel=1e-12)
    # where another end is open nothing of this is by chance
    several = replace(attempt, several=True, expected=0.5 * accuracy)
    assert accuracy_module._finer(several, accuracy, accuracy / again)[1] == ""


def test_a_coarser_run_of_a_followed_vibration_has_three_times_the_error() -> None:
    """Of steps in flight, h^(3/2), in contact, h^2, of tolerances and of elements in flight, l^4.

    In contact there are no fewer elements than in flight.
    """
    of = settings_for(1e-4, RINGING)
    assert of.followed
    own = of.scene.settings
    run = solve_once(replace(of.scene, settings=replace(own, estimate=False)), None, of.fall)[0]
    coarse = coarser_run.coarser_scene(of, replace(run, taps=run.taps * 3))
    its = coarse.settings
    assert (its.flight_step / own.flight_step) ** 1.5 == pytest.approx(3.0, rel=1e-12)
    assert (its.contact_step / own.contact_step) ** 2 == pytest.approx(3.0, rel=1e-12)
    assert its.flight_tolerance / own.flight_tolerance == pytest.approx(3.0, rel=1e-12)
    # whole numbers: half an element off
    wanted = own.flight_elements / 3.0**0.25
    assert abs(its.flight_elements - wanted) <= 0.5
    assert all(p.elements >= its.flight_elements for p in coarse.finger.phalanges)
    assert (its.taps, its.estimate) == (3, False)


@pytest.mark.parametrize(("folds", "barely"), [(True, False), (False, True), (False, False)])
def test_a_tap_of_a_folded_finger_or_one_that_barely_ends_may_end_otherwise(
    monkeypatch: pytest.MonkeyPatch, folds: bool, barely: bool
) -> None:
    monkeypatch.setattr(accuracy_module, "grazes", lambda _, share=GRAZE: barely)
    monkeypatch.setattr(accuracy_module, "folded", lambda *_: folds)
    of = settings_for(1e-2, replace(SOFT_SCENE, settings=hcm.Settings()))
    attempt = accuracy_module._attempt(of, 1e-2, None)
    assert (attempt.chance, attempt.grazes()) == (folds or barely, barely)
    assert not replace(attempt, several=True).chance


@pytest.mark.parametrize("scene", [scene for scene, _ in SHORT])
def test_a_coarser_run_has_no_phalanx_of_as_many_elements(scene: hcm.Scene) -> None:
    """A short phalanx has no more than the flight needs: its error would cancel."""
    of = settings_for(1e-4, scene)
    assert of.followed
    run = solve_once(replace(of.scene, settings=replace(of.scene.settings, estimate=False)))[0]
    own, its = (
        [p.elements for p in body.finger.phalanges]
        for body in (of.scene, coarser_run.coarser_scene(of, run))
    )
    assert its[0] < own[0]
    assert its[1] == 2 * own[1]


@pytest.mark.parametrize(("scene", "limit"), SHORT)
def test_the_stress_of_a_short_last_phalanx_is_as_far_off_as_stated(
    scene: hcm.Scene, limit: float
) -> None:
    """The first was 19 times what it stated away from its limit, at 1e-3."""
    for accuracy in (3e-3, 1e-3, 1e-4):
        result = simulate_within(accuracy, scene)
        error = result.errors["peak_stress_R_Pa"]
        assert isinstance(error, float)
        assert result.summary.peak_stress_R_Pa == pytest.approx(limit, abs=error)
        assert error < 0.35 * limit


def test_a_run_that_is_solved_again_took_the_time_of_both(monkeypatch: pytest.MonkeyPatch) -> None:
    """Of 100 s and 200 s, where the first one's audit does not close."""
    lasted = [200.0, 100.0]

    def timed(scene: hcm.Scene, *given: Any) -> tuple[hcm.TapResult, float]:
        result, left_out = solve_once(scene, *given)
        status = hcm.Status.UNBALANCED if len(lasted) == 2 else result.status
        statistics = replace(result.statistics, wall_time_s=lasted.pop())
        return replace(result, status=status, statistics=statistics), left_out

    monkeypatch.setattr(accuracy_module, "solve_once", timed)
    result = simulate_within(1e-2, SOFT_SCENE)
    assert lasted == []
    # choosing settings takes the rest
    assert 300.0 <= result.statistics.wall_time_s < 310.0


def test_an_interrupt_of_the_coarser_run_leaves_no_errors(monkeypatch: pytest.MonkeyPatch) -> None:
    """The run is kept as it is, and called interrupted."""
    solved = list[hcm.Scene]()

    def cut(scene: hcm.Scene, *given: Any) -> tuple[hcm.TapResult, float]:
        solved.append(scene)
        result, left_out = solve_once(scene, *given)
        stopped = hcm.Status.INTERRUPTED if len(solved) == 2 else result.status
        return replace(result, status=stopped), left_out

    monkeypatch.setattr(accuracy_module, "solve_once", cut)
    result = simulate_within(1e-2, replace(SOFT_SCENE, settings=hcm.Settings()))
    assert len(solved) == 2
    assert (result.status, result.errors) == (hcm.Status.INTERRUPTED, {})
    assert result.accuracy is not None
    assert result.accuracy.expected is None


@pytest.mark.parametrize("method", ["gauss", "generalized-alpha"])
def test_a_coarser_run_has_a_vibration_that_is_not_followed_in_another_phase(method: str) -> None:
    """Collocation's is taken in shorter steps, with no other error; of order 2 in longer ones."""
    how = {"flight": "elastic", "flight_integrator": method}
    scene = replace(SOFT_SCENE, settings=replace(SOFT_SCENE.settings, **how))
    of = settings_for(1e-3, scene, how)
    assert not of.followed
    run = solve_once(of.scene, None, of.fall)[0]
    ratio = coarser_run.coarser_scene(of, run).settings.flight_step / of.scene.settings.flight_step
    # order 2: 3 times the error
    assert 0.5 < ratio < 0.9 if method == "gauss" else ratio**2 == pytest.approx(3.0, rel=1e-12)


@pytest.mark.parametrize(("accuracy", "stated"), [(1e-6, False), (1e-6, True), (1e-3, False)])
def test_the_smallest_accuracy_is_a_reason_only_where_nothing_is_stated(
    judged: tuple[Chosen, hcm.TapResult], accuracy: float, stated: bool
) -> None:
    """A duration that is known to a tenth has a remedy, unless all is as fine as it may be."""
    of, run = judged
    own = (*of.choices, hcm.Choice("contact_step", 1e-5, "stated")) if stated else of.choices
    coarse = summarized(run, contact_duration_s=1.1 * run.summary.contact_duration_s)
    found, _ = coarser_run.compared(run, coarse, replace(of, choices=own), accuracy)
    (said,) = (caution for caution in found.cautions if "contact duration" in caution)
    assert ("is the smallest accuracy" in said) is (accuracy == 1e-6 and not stated)
    assert said.endswith("; leave out solver.hcm.contact_step") is stated
