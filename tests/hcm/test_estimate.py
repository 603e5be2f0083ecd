"""Stated errors cover the true ones, and cost nothing where they are not asked for."""

import math
from dataclasses import fields, replace
from types import SimpleNamespace
from typing import Any, Literal

import numpy as np
import pytest

import hcm
from hcm.contact.law import STICK
from hcm.estimates.companion import first_tap, folded, grazes, lost_energy, rescaled_settings
from hcm.estimates.error_cautions import TITLES, caution, later_taps, relative_errors, tap_peaks
from hcm.estimates.estimate import (
    between_rows,
    companion_errors,
    estimate_errors,
    rival_peaks,
    signed_error,
    turn_band,
)
from hcm.estimates.flight_band import flight_band, tip_motion, touch_band
from tests.hcm.cases import HARD, HARD_TIP, SOFT, SOFT_TIP, SURFACE, finger

ONE = hcm.Finger((replace(SOFT, youngs_modulus=65e6, elements=20),))
LIGHT = finger(SOFT, youngs_modulus=1e8, elements=10)
COARSE = hcm.Settings(contact_tolerance=0.0, contact_step=3e-5)
FEW_STEPS = hcm.Settings(contact_tolerance=0.0, contact_step=1e-5)
TORQUES = hcm.Drive((0.01, 0.008, 0.002112))
# Finger, surface, tip, drive, settings; the least number with a caution, or none.
SCENES = {
    "hard": (finger(HARD, elements=20), SURFACE, HARD_TIP, hcm.Drive(), hcm.Settings(), ""),
    "one element": (
        finger(SOFT, elements=1), SURFACE, SOFT_TIP, hcm.Drive(), hcm.Settings(), "normal impulse",
    ),
    "two driven elements": (
        finger(SOFT, youngs_modulus=1e8, elements=2), SURFACE, SOFT_TIP, TORQUES, hcm.Settings(),
        "contact duration",
    ),
    "a vibration that xi damps": (
        ONE, hcm.Surface(0.03, 0.5), SOFT_TIP, hcm.Drive(), hcm.Settings(), "stress",
    ),
    "driven-1": (LIGHT, SURFACE, SOFT_TIP, TORQUES, hcm.Settings(), "tip velocity"),
    "eight steps in the tap": (
        finger(SOFT), SURFACE, SOFT_TIP, hcm.Drive(), COARSE, "peak normal force",
    ),
    "twenty steps in the tap": (
        finger(SOFT), SURFACE, SOFT_TIP, hcm.Drive(), FEW_STEPS, "peak normal force",
    ),
}  # fmt: skip


def _tight(settings: hcm.Settings) -> hcm.Settings:
    """A hundredth of the tolerances; steps that none controls as their third root."""
    shorter = 1.0 if settings.contact_tolerance else 100 ** (1 / 3)
    return replace(
        settings,
        flight_tolerance=settings.flight_tolerance / 100,
        contact_tolerance=settings.contact_tolerance / 100,
        contact_step=settings.contact_step / shorter,
        estimate=False,
    )


@pytest.mark.parametrize("name", SCENES)
def test_stated_errors_cover_the_true_ones(name: str) -> None:
    body, surface, tip, drive, settings, doubtful = SCENES[name]
    result = hcm.simulate(body, surface, tip, drive, settings)
    assert result.status is hcm.Status.COMPLETED
    fine = hcm.Finger(tuple(replace(p, elements=2 * p.elements) for p in body.phalanges))
    truth = hcm.simulate(fine, surface, tip, drive, _tight(settings)).summary
    assert set(result.errors) == set(TITLES)
    for key, error in result.errors.items():
        wrong = np.subtract(getattr(result.summary, key), getattr(truth, key))
        assert np.abs(wrong).max() <= 2.0 * np.max(error), key
    assert doubtful in "".join(result.cautions)
    assert bool(doubtful) == bool(result.cautions)


@pytest.mark.parametrize("few", [1, 2])
def test_few_elements_in_flight_have_their_error_stated(few: int) -> None:
    """The companion flies on another number of them; on the same it stated a fifth of the error."""
    how = hcm.Settings(flight_integrator="gauss", flight_step=1e-3, flight_elements=few)
    scene = finger(SOFT, youngs_modulus=1e7, elements=10), SURFACE, SOFT_TIP, TORQUES
    found, whole = (hcm.simulate(*scene, s) for s in (how, replace(how, flight_elements=0)))
    late = abs(found.summary.contact_time_s - whole.summary.contact_time_s)
    assert late > 1e-6
    assert found.errors["contact_time_s"] > late


def test_a_whole_tap_grazes_where_it_ends() -> None:
    """It goes on after its other separations, however slowly its tip moves there."""
    history = SimpleNamespace(
        time_s=np.arange(5.0),
        tip_velocity_m_per_s=np.array([[0, -1.0], [0, 0.001], [0, -0.1], [0, 0.5], [0, 0.5]]),
        normal_force_N=np.zeros(5),
    )
    events = [hcm.Event(t, kind) for t, kind in enumerate(["contact", "separation"] * 2)]
    for lasts, wanted in ((3.0, False), (1.0, True)):
        taps = ((0.0, lasts),)
        run = SimpleNamespace(history=history, events=events, taps=taps, summary=SimpleNamespace(
            contact_time_s=0.0, contact_duration_s=lasts, peak_normal_force_N=1.0,
            tip_velocity_at_contact_m_per_s=(0.0, -1.0),
        ))  # fmt: skip
        assert grazes(run) is wanted


def test_a_run_without_an_estimate_is_the_same_run() -> None:
    scene = SCENES["driven-1"][:4]
    asked, plain = (hcm.simulate(*scene, hcm.Settings(estimate=e)) for e in (True, False))
    assert asked.errors
    assert plain.errors == {}
    assert plain.cautions == ()
    assert plain.summary == asked.summary
    assert replace(plain.statistics, wall_time_s=0.0) == replace(asked.statistics, wall_time_s=0.0)
    for field in fields(hcm.History):
        assert np.array_equal(
            getattr(plain.history, field.name), getattr(asked.history, field.name)
        )


@pytest.fixture(scope="module")
def one() -> hcm.TapResult:
    return hcm.simulate(
        ONE, hcm.Surface(0.03, 0.5), SOFT_TIP, settings=hcm.Settings(estimate=False)
    )


def test_a_flight_that_vibrates_differs_by_its_amplitude(one: hcm.TapResult) -> None:
    """v = A cos w t: twice the root mean square is sqrt(2) A; half a contact averages fast ones."""
    time, amplitude = one.history.time_s, 0.01
    half = 0.5 * (one.summary.contact_duration_s or 0.0)
    for omega in (2e3, 2 * np.pi / half):
        swing = amplitude * np.stack([np.cos(omega * time), np.cos(omega * time)], axis=1)
        path = amplitude / omega * np.stack([np.sin(omega * time), np.sin(omega * time)], axis=1)
        history = replace(
            one.history,
            tip_velocity_m_per_s=one.history.tip_velocity_m_per_s + swing,
            tip_position_m=one.history.tip_position_m + path,
        )
        band = flight_band(one, replace(one, history=history))
        if omega == 2e3:
            assert band.velocity == pytest.approx((2**0.5 * amplitude,) * 2, rel=0.05)
            lasting = abs(np.sinc(omega * half / (2 * np.pi)))
            assert band.approach == pytest.approx(2**0.5 * amplitude * lasting, rel=0.05)
        else:
            assert band.approach < 0.2 * amplitude  # as far as the steps resolve it


def test_rows_miss_the_largest_value_between_them() -> None:
    time = np.array([0.0, 0.2, 0.7, 1.0])
    parabola = -3.0 + (time - 0.5) ** 2
    assert between_rows(time, parabola) == pytest.approx(0.04, rel=1e-12)
    assert between_rows(time, time) == 0.0


def test_extremes_of_either_sign_are_rivals() -> None:
    own = np.array([0.0, 10.6, -10.5])
    assert signed_error(own, own) == 0.0
    assert signed_error(own, np.array([10.6, -10.2])) == pytest.approx(21.1)
    assert signed_error(np.array([0.0, -5.0]), np.array([0.0, -4.0])) == pytest.approx(1.0)
    assert signed_error(np.array([0.0, -5.0]), np.array([0.0, -4.0]), 2.0) == pytest.approx(2.0)
    assert signed_error(np.array([0.0, 1.0]), np.array([0.0, 6.0])) == pytest.approx(5.0)


def test_the_stress_of_more_elements_counts_double(one: hcm.TapResult) -> None:
    """Its order may be as low as 1: twice the elements show half of the error."""
    history = replace(one.history, stress_R_Pa=0.9 * one.history.stress_R_Pa)
    other, peak = replace(one, history=history), abs(one.summary.peak_stress_R_Pa or 0.0)
    for factor in (1.0, 2.0):
        stress = companion_errors(one, other, factor)["peak_stress_R_Pa"]
        assert stress == pytest.approx(factor * 0.1 * peak)


def test_peaks_that_an_error_may_raise_are_rivals() -> None:
    force, time = np.array([0.0, 9.0, 5.0, 10.0, 5.0, 8.0, 0.0]), np.arange(7.0)
    assert rival_peaks(force, time, 10.0, 0.4).tolist() == [3.0]
    assert rival_peaks(force, time, 10.0, 0.5).tolist() == [1.0, 3.0]


def test_a_peaks_time_is_known_as_the_tip_turns(one: hcm.TapResult) -> None:
    """A tap that is late by d turns late by d, by the mean slope, which waves make a fifth less."""
    late, velocity = 1e-6, one.history.tip_velocity_m_per_s
    shifted = np.interp(one.history.time_s - late, one.history.time_s, velocity[:, 1])
    history = replace(one.history, tip_velocity_m_per_s=np.stack([velocity[:, 0], shifted], axis=1))
    assert turn_band(one, one) == 0.0
    assert turn_band(one, replace(one, history=history)) == pytest.approx(late, rel=0.25)


def test_a_companion_that_fails_gives_way_to_a_damped_one(one: hcm.TapResult) -> None:
    """Which is tolerance-controlled as the run is; where that fails too nothing is known."""
    asked: list[hcm.Settings] = []

    def fails(scene: hcm.Scene) -> hcm.TapResult:
        asked.append(scene.settings)
        return replace(one, status=hcm.Status.UNBALANCED)

    found = estimate_errors(one, fails)
    assert [(s.spectral_radius, s.flight_tolerance > 0) for s in asked] == [
        (1.0, False),
        (0.8, True),
    ]
    assert not any(s.estimate for s in asked)
    assert found.status is hcm.Status.COMPLETED
    assert {np.max(error) for error in found.errors.values()} == {np.inf}
    assert "unknown" in found.cautions[0]


def test_later_taps_are_left_out_and_named() -> None:
    """The second tap depends on the vibration that the first leaves."""
    taps = hcm.simulate(finger(SOFT, elements=10), SURFACE, SOFT_TIP, settings=hcm.Settings(taps=2))
    assert "tap 2" in taps.cautions[-1]
    peaks = tap_peaks(taps)
    assert peaks[0] == pytest.approx(taps.summary.peak_normal_force_N, rel=1e-3)
    assert peaks.size == 2
    assert "forces at most 0 % apart in two runs, which may agree" in later_taps(peaks, peaks)[0]
    three, other = np.array([9.0, 8.0, 7.0]), np.array([9.0, 8.04, 9.1])
    assert "peak normal force of tap 3: 30 % apart in two runs)" in later_taps(three, other)[0]
    other[1] = 16.0
    first = "of tap 2: 100 % apart in two runs, and what follows is as unknown)"
    assert first in later_taps(three, other)[0]
    other[1] = 960.0
    assert "of tap 2: a factor of 120 apart in two runs" in later_taps(three, other)[0]
    assert "tap 2: a second run has no such tap" in later_taps(peaks, peaks[:1])[0]
    assert later_taps(peaks[:1], peaks) == ()
    other = np.array([18.0, 8.0, 7.0])  # the first tap's errors are stated
    assert "forces at most 0 % apart in two runs, which may agree" in later_taps(three, other)[0]


def test_a_tap_that_has_not_ended_has_no_peak_and_its_end_counts() -> None:
    taps = hcm.simulate(finger(SOFT, elements=10), SURFACE, SOFT_TIP)
    time, force = np.array([0.0, 1.0, 2.0, 3.0, 4.0]), np.array([0.0, 5.0, 6.0, 0.0, 9.0])
    history = replace(taps.history, time_s=time, normal_force_N=force)
    run = replace(taps, history=history, taps=((0.0, 2.0), (3.0, math.inf)))
    assert tap_peaks(run).tolist() == [6.0]


def test_a_velocitys_error_is_relative_to_the_speed() -> None:
    taps = hcm.simulate(finger(SOFT, elements=10), SURFACE, SOFT_TIP)
    name = "tip_velocity_at_contact_m_per_s"
    summary = replace(taps.summary, **{name: (3.0, -4.0), "normal_impulse_N_s": -2.0})
    found = relative_errors(summary, {name: (0.05, 0.01), "normal_impulse_N_s": 0.1})
    assert found == {name: 0.01, "normal_impulse_N_s": 0.05}


def test_flights_as_rods_are_compared_where_they_end() -> None:
    """Their rows are 15 ms apart: read between them, two equal flights would differ by 0.1 %."""
    rods = hcm.Settings(
        flight="rigid", flight_step=1.0, flight_tolerance=1e-7, contact_step=5e-7,
        contact_tolerance=0.0,
    )  # fmt: skip
    result = hcm.simulate(finger(SOFT, elements=10), SURFACE, SOFT_TIP, settings=rods)
    vn = abs(result.summary.tip_velocity_at_contact_m_per_s[1])
    # what the companion's tolerance, 27 times as large, leaves wrong, beside 0.1 % of vibration
    assert max(result.errors["tip_velocity_at_contact_m_per_s"]) < 2e-3 * vn
    assert result.errors["contact_time_s"] < 1e-5 * result.summary.contact_time_s


@pytest.mark.parametrize(
    ("assumptions", "modulus", "friction", "height", "stiffness"),
    [
        ("refined", 1.873e9, 0.928, 0.01624, 0.0),
        ("refined", 1.136e9, 0.428, 0.01728, 0.0),
        ("refined", 6.912e8, 0.919, 0.02317, 0.0),
        ("paper", 1.495e10, 0.760, 0.02158, 1.95e6),
    ],
)
def test_what_rods_leave_out_is_in_the_friction_of_a_tip_that_sticks(
    assumptions: Literal["paper", "refined"],
    modulus: float, friction: float, height: float, stiffness: float,
) -> None:  # fmt: skip
    """Both runs that are compared fly as rods: up to 2.3 times the stated error were left out."""
    rod = hcm.Phalanx(0.04, 0.015, modulus, 1400.0, poisson_ratio=0.4)
    scene = hcm.Scene(
        hcm.Finger((rod,)), hcm.Surface(height, friction), hcm.Tip(stiffness or 1e6),
        assumptions=hcm.Assumptions(assumptions),
    )  # fmt: skip
    result, close = (hcm.simulate_within(accuracy, scene) for accuracy in (1e-3, 5e-5))
    assert result.given["settings"].flight == "rigid"
    stated, known = (run.errors["peak_tangential_force_N"] for run in (result, close))
    off = abs(result.summary.peak_tangential_force_N - close.summary.peak_tangential_force_N)
    assert known < 0.6 * off, "the closer run must be able to tell"
    assert off < stated + known
    assert stated < 10 * off


def test_a_caution_has_no_more_digits_than_the_error_is_worth() -> None:
    (text,) = caution({"peak_normal_force_N": 4.6e8}, hcm.Settings())
    assert "peak normal force more than 1000 %" in text


@pytest.fixture(scope="module", params=[1, 20])
def alone(request: pytest.FixtureRequest) -> hcm.TapResult:
    settings = hcm.Settings(estimate=False)
    return hcm.simulate(finger(SOFT, elements=request.param), SURFACE, SOFT_TIP, settings=settings)


def test_a_force_has_half_the_error_of_the_energy(alone: hcm.TapResult) -> None:
    """|dF|/F = |dE|/2E, E the kinetic energy at the touch; a fifth of it is lost here."""
    summary, history = alone.summary, alone.history
    touched = summary.contact_time_s
    kinetic = history.kinetic_energy_J[history.time_s.searchsorted(touched)]
    work = history.drive_work_J + 0.2 * kinetic * (history.time_s > touched)
    lost = replace(alone, history=replace(history, drive_work_J=work))
    for name in ("peak_normal_force_N", "normal_impulse_N_s"):
        # its own balance adds 1e-4
        assert companion_errors(lost, alone)[name] == pytest.approx(
            0.1 * getattr(summary, name), rel=0.02
        )


def test_a_companion_of_more_elements_counts_double(alone: hcm.TapResult) -> None:
    """Its difference is half the error, at order 1."""
    few = alone.given["finger"].phalanges[-1].elements == 1
    stress = replace(alone.history, stress_R_Pa=0.9 * alone.history.stress_R_Pa)
    found = estimate_errors(alone, lambda scene: replace(alone, history=stress)).errors
    expected = (0.2 if few else 0.1) * abs(alone.summary.peak_stress_R_Pa)
    assert found["peak_stress_R_Pa"] == pytest.approx(expected)


def test_tolerances_of_a_repetition_go_with_the_cube_of_its_steps(alone: hcm.TapResult) -> None:
    """A local error is of order 3 in the step."""
    settings = hcm.Settings(flight_tolerance=1e-9, contact_tolerance=1e-10)
    found = rescaled_settings(settings, alone, 3.0, 10**6)
    tolerances = found.flight_tolerance, found.contact_tolerance
    assert tolerances == pytest.approx((27e-9, 27e-10), rel=1e-12)


def alike(run: hcm.TapResult, **columns: np.ndarray) -> hcm.TapResult:
    """The run with other columns in its history."""
    return replace(run, history=replace(run.history, **columns))


def test_a_speed_that_both_runs_leave_out_is_in_every_error_of_the_first_tap(
    one: hcm.TapResult,
) -> None:
    """|dF|/F = |dv|/v, and a vibration as long as the tap shifts its touch by a share of it."""
    share, summary = 0.1, one.summary
    errors = companion_errors(one, one, omitted_speed_share=share)
    vn = abs(summary.tip_velocity_at_contact_m_per_s[1])
    assert errors["tip_velocity_at_contact_m_per_s"] == pytest.approx((share * vn,) * 2)
    names = ("peak_normal_force_N", "normal_impulse_N_s", "contact_duration_s")
    assert [errors[name] for name in names] == pytest.approx(
        [share * getattr(summary, name) for name in names]
    )
    assert errors["contact_time_s"] == pytest.approx(share * summary.contact_duration_s)


@pytest.mark.parametrize(("beside", "sticks"), [(-1, True), (0, True), (1, True), (2, False)])
def test_a_tip_that_sticks_beside_its_largest_friction_feels_the_speed_along_the_surface(
    one: hcm.TapResult, beside: int, sticks: bool
) -> None:
    """An impedance of peak/v_n times the velocity's error; a tip that slides does not feel it."""
    tap, summary = first_tap(one), one.summary
    largest = tap.start + int(np.abs(one.history.tangential_force_N[tap]).argmax())
    mode = one.history.mode.copy()
    mode[largest + beside] = 3 + STICK  # compression
    vx, vy = summary.tip_velocity_at_contact_m_per_s
    faster = replace(summary, tip_velocity_at_contact_m_per_s=(vx + 0.1, vy))
    stated = companion_errors(alike(one, mode=mode), replace(one, summary=faster))
    felt = 0.1 * summary.peak_normal_force_N / abs(vy)
    # without it what is left is the share of the lost energy, below 1e-3 of the force
    assert (stated["peak_tangential_force_N"] > 0.99 * felt) is sticks
    if sticks:
        assert stated["peak_tangential_force_N"] == pytest.approx(felt)


def test_friction_that_differs_in_two_runs_is_known_to_the_difference(one: hcm.TapResult) -> None:
    """One run has nine tenths of the other's: a tenth of the largest is its error."""
    other = alike(one, tangential_force_N=0.9 * one.history.tangential_force_N)
    stated = companion_errors(one, other)["peak_tangential_force_N"]
    assert stated == pytest.approx(0.1 * abs(one.summary.peak_tangential_force_N))


@pytest.mark.parametrize(
    ("column", "number"),
    [
        ("tangential_force_N", "peak_tangential_force_N"),
        ("stress_R_Pa", "peak_stress_R_Pa"),
    ],
)
def test_two_equal_runs_do_not_know_what_lies_between_their_rows(
    one: hcm.TapResult, column: str, number: str
) -> None:
    """A parabola with its top midway between two rows h apart exceeds both by c h²/4."""
    tap, time = first_tap(one), one.history.time_s
    row = (tap.start + tap.stop) // 2
    step, top = time[row + 1] - time[row], 1e6
    # at three halves of a step away nine times as much is missing, a half of the top
    missing = top / 18
    since = (time - 0.5 * (time[row] + time[row + 1])) / (0.5 * step)
    values = np.maximum(top - missing * since**2, 0.0)
    run = alike(one, **{column: values})
    assert companion_errors(run, run)[number] == pytest.approx(missing, rel=1e-6)


def test_a_stress_in_which_two_flights_differ_has_that_error(one: hcm.TapResult) -> None:
    """By a constant A up to the touch: twice its root mean square."""
    apart, start = 1e5, first_tap(one).start
    stress = one.history.stress_R_Pa.copy()
    stress[: start - 1] += apart
    stated = companion_errors(one, alike(one, stress_R_Pa=stress))["peak_stress_R_Pa"]
    # the last step before the touch, in which the two meet, is a small part of a tenth of it
    assert stated == pytest.approx(2.0 * apart, rel=0.05)


def test_a_second_hump_that_may_be_the_peak_leaves_its_time_open(one: hcm.TapResult) -> None:
    """Humps of 1 and 0.95, known to 0.1, as another run has nine tenths of both."""
    tap, time = first_tap(one), one.history.time_s
    quarter = (tap.stop - tap.start) // 4
    rows = tap.start + quarter, tap.start + 3 * quarter
    force = np.zeros(time.size)
    force[rows[0]], force[rows[1]] = 1.0, 0.95
    peak_time = float(time[rows[0]]) - one.summary.contact_time_s
    summary = replace(one.summary, peak_normal_force_N=1.0, peak_normal_force_time_s=peak_time)
    run = replace(alike(one, normal_force_N=force), summary=summary)
    lower = replace(
        alike(one, normal_force_N=0.9 * force), summary=replace(summary, peak_normal_force_N=0.9)
    )
    stated = companion_errors(run, lower)["peak_normal_force_time_s"]
    assert stated == pytest.approx(float(time[rows[1]] - time[rows[0]]))


@pytest.mark.parametrize(
    ("settings", "kind"),
    [
        (hcm.Settings(), "tolerance"),
        (hcm.Settings(contact_tolerance=0.0), "step"),
        (hcm.Settings(flight_tolerance=0.0), "step"),
    ],
)
def test_a_caution_asks_for_what_controls_the_steps_and_names_the_worst_first(
    settings: hcm.Settings, kind: str
) -> None:
    """Smaller tolerances do nothing where one of the two is not controlled by them."""
    shares = {"peak_normal_force_N": 0.1, "normal_impulse_N_s": 0.3, "contact_time_s": 1e-3}
    (text,) = caution(shares, settings)
    assert "known" not in text
    assert ": normal impulse 30 %, peak normal force 10 %; " in text
    assert f"reduce solver.hcm.flight_{kind} and solver.hcm.contact_{kind}" in text


def test_an_interrupt_of_the_tighter_run_is_no_lack_of_repeatability(
    one: hcm.TapResult, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("hcm.estimates.estimate.grazes", lambda run: True)
    runs = [one, replace(one, status=hcm.Status.INTERRUPTED)]
    found = estimate_errors(one, lambda scene: runs.pop(0))
    assert runs == []
    assert (found.status, found.errors) == (hcm.Status.INTERRUPTED, {})


def test_what_rods_leave_out_is_a_bending_wave_of_its_share_of_the_approach(
    one: hcm.TapResult,
) -> None:
    """A wave of speed V has a stress of 2 V sqrt(E rho) in a round rod."""
    share, rod = 0.1, ONE.phalanges[-1]
    speed = share * abs(one.summary.tip_velocity_at_contact_m_per_s[1])
    stated = estimate_errors(one, lambda scene: one, share).errors["peak_stress_R_Pa"]
    assert stated == pytest.approx(2.0 * speed * (rod.youngs_modulus * rod.density) ** 0.5)


def test_what_follows_the_first_tap_is_no_part_of_its_energys_error(one: hcm.TapResult) -> None:
    """A tenth of the kinetic energy at the touch is lost in the tap, or after it."""
    # the run ends with its tap: one of half its duration has rows after it
    shorter = replace(one.summary, contact_duration_s=0.5 * one.summary.contact_duration_s)
    run, history = replace(one, summary=shorter), one.history
    tap = first_tap(run)
    assert tap.stop < history.time_s.size
    kinetic = history.kinetic_energy_J[tap.start]
    own = lost_energy(run)
    rows = np.arange(history.time_s.size)
    for since, lost in ((tap.start + 1, 0.1), (tap.stop, 0.0)):
        work = history.drive_work_J + 0.1 * kinetic * (rows >= since)
        # its own balance is off by less than 1e-3
        assert lost_energy(alike(run, drive_work_J=work)) == pytest.approx(lost + own, abs=2e-3)


@pytest.mark.parametrize(("before", "folds"), [(True, True), (False, False)])
def test_a_finger_folds_up_only_on_its_way_to_the_surface(
    one: hcm.TapResult, before: bool, folds: bool
) -> None:
    """The tip comes to the hinge a row before the touch, or a row after it."""
    touch, position = first_tap(one).start, one.history.tip_position_m.copy()
    assert folded(one, 0.04) is False
    position[touch - 1 if before else touch + 1] = 0.0
    assert folded(alike(one, tip_position_m=position), 0.04) is folds


@pytest.mark.parametrize(("force", "grazed"), [(0.005, True), (0.02, False)])
def test_a_tap_grazes_where_its_tip_turned_back_almost_without_force(
    force: float, grazed: bool
) -> None:
    """Below a hundredth of the peak, it nearly ended there; it leaves at half its speed later."""
    history = SimpleNamespace(
        time_s=np.arange(5.0),
        tip_velocity_m_per_s=np.array([[0, -1.0], [0, 0.2], [0, -0.1], [0, 0.5], [0, 0.5]]),
        normal_force_N=np.array([0.0, 1.0, force, 0.0, 0.0]),
    )
    kinds = {0.0: "contact", 1.0: "compression_to_restitution", 2.0: "restitution_to_compression",
             3.0: "separation"}  # fmt: skip
    run = SimpleNamespace(
        history=history, events=[hcm.Event(t, kind) for t, kind in kinds.items()],
        taps=((0.0, 3.0),), summary=SimpleNamespace(
            contact_time_s=0.0, contact_duration_s=3.0, peak_normal_force_N=1.0,
            tip_velocity_at_contact_m_per_s=(0.0, -1.0),
        ),
    )  # fmt: skip
    assert grazes(run) is grazed


def test_two_flights_as_rods_differ_by_the_time_and_velocity_of_their_touch() -> None:
    """A touch 1 us later at 2 m/s is 2 um away; each component has its own difference."""
    band = touch_band(1e-6, (1.0, -2.0), (1.3, -2.1))
    assert band.height == pytest.approx(2e-6, rel=1e-12)
    assert band.velocity == pytest.approx((0.3, 0.1), rel=1e-12)
    assert band.approach == pytest.approx(0.1, rel=1e-12)
    assert band.stress == 0.0


def path(time: np.ndarray, height: np.ndarray, speed: np.ndarray, touch: float) -> Any:
    """A run of a tip that sinks, whose tap of 0.1 s begins at `touch`."""
    history = SimpleNamespace(
        time_s=time, stress_R_Pa=0.0 * time,
        tip_position_m=np.stack([0.0 * time, height], axis=1),
        tip_velocity_m_per_s=np.stack([0.0 * time, speed], axis=1),
    )  # fmt: skip
    summary = SimpleNamespace(contact_time_s=touch, contact_duration_s=0.1)
    return SimpleNamespace(history=history, summary=summary)


def test_a_path_of_third_order_is_known_between_its_rows() -> None:
    """By heights and velocities at rows of uneven steps, one of them double."""
    rows = np.array([0.0, 0.3, 0.3, 0.7, 1.5])
    cubic = np.polynomial.Polynomial([0.2, -1.0, 0.7, -0.4])
    run = path(rows, cubic(rows), cubic.deriv()(rows), 1.5)
    time = np.linspace(0.0, 1.5, 31)
    at, rate = tip_motion(run.history, time)
    assert at[:, 1] == pytest.approx(cubic(time), abs=1e-14)
    assert rate[:, 1] == pytest.approx(cubic.deriv()(time), abs=1e-14)
    assert (at[:, 0] == 0.0).all()


@pytest.mark.parametrize("first", ["own", "other"])
def test_flights_are_compared_up_to_the_earlier_of_two_touches(first: str) -> None:
    """What the tip does in its tap, while the other run still flies, is no part of it."""
    time = np.linspace(0.0, 1.2, 1201)
    bounces = np.abs(time - 1.0)
    early = path(time, bounces, np.where(time <= 1.0, -1.0, 1.0), 1.0)
    late = path(time, 1.0 - time, np.full(time.size, -1.0), 1.2)
    band = flight_band(*((early, late) if first == "own" else (late, early)))
    assert (band.height, band.approach) == pytest.approx((0.0, 0.0), abs=1e-12)
    assert band.velocity == pytest.approx((0.0, 0.0), abs=1e-12)


def test_a_difference_that_lasts_half_a_contact_is_one_of_the_approach() -> None:
    """d = a t: the band of its rate is 2 a, however short a part of the flight is looked at."""
    time, apart = np.linspace(0.0, 1.0, 1001), 0.01
    own = path(time, 1.0 - time, np.full(time.size, -1.0), 1.0)
    speed = np.full(time.size, apart - 1.0)
    other = path(time, 1.0 - (1.0 - apart) * time, speed, 1.0)
    for lasts in (1e-3, 0.1, 3.0):
        own.summary.contact_duration_s = lasts
        band = flight_band(own, other)
        assert band.approach == pytest.approx(2.0 * apart, rel=1e-9)
        assert band.velocity[1] == pytest.approx(2.0 * apart, rel=1e-9)
