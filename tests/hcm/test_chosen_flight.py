"""The flight that an accuracy needs: as rods, in few steps, or with its vibration in phase."""

import math
from dataclasses import replace

import numpy as np
import pytest

import hcm
from hcm.accuracy.chosen import settings_for
from hcm.accuracy.chosen_flight import (
    BY_WEIGHT,
    FEW_STEPS,
    FOLLOWING_STAGES,
    QUIET,
    followed_frequency,
)
from hcm.accuracy.simulate_within import simulate_within
from hcm.flight.fall import bending_wave_stress, rods_fall
from hcm.model import limits_of
from hcm.parameters import STAGES
from tests.hcm.accuracies import chosen, numbers, once
from tests.hcm.cases import NO_ESTIMATE, RINGING, SOFT, SOFT_SCENE


def test_a_flight_is_rigid_until_what_it_skips_matters() -> None:
    loose, strict, strictest = (chosen(a) for a in (1e-2, 1e-4, 1e-5))
    followed = chosen(1e-5, flight="elastic")
    assert loose.scene.settings.flight == "rigid"
    assert loose.flight_error <= 1e-3
    assert (strict.scene.settings.flight, strict.scene.settings.flight_integrator) == (
        "elastic",
        "gauss",
    )
    skipped = {c.setting for c in (*loose.choices, *strict.choices) if "skipped" in c.reason}
    assert skipped == {"flight", "flight_step", "flight_elements", "contact_tolerance"}
    # the vibration is included at last, as modes or by short steps
    assert (loose.followed, strict.followed, strictest.followed) == (False, False, True)
    assert strictest.scene.settings.flight == "modal"
    assert strictest.scene.settings.flight_step == strict.scene.settings.flight_step
    assert followed.scene.settings.flight_step < 0.2 * strict.scene.settings.flight_step


def test_a_finger_that_meets_the_surface_before_its_tip_falls_as_rods() -> None:
    low = replace(SOFT_SCENE, surface=hcm.Surface(0.04, 0.5))
    skipped = simulate_within(1e-4, low)
    bent = simulate_within(1e-4, replace(low, settings=NO_ESTIMATE), {"flight": "elastic"})
    assert skipped.status is bent.status is hcm.Status.BODY_TOUCHES
    ends = [result.history.time_s[-1] for result in (skipped, bent)]
    # the elastic steps are not longer: each ends with its first step below the surface
    assert ends[0] == pytest.approx(ends[1], rel=1 / 90)
    assert "meets the surface" in {c.setting: c.reason for c in skipped.accuracy.choices}["flight"]
    driven = replace(low, drive=hcm.Drive((0.0, 0.0, 1e-9)))
    kept = {c.setting: c.value for c in settings_for(1e-4, driven).choices}
    assert kept["flight"] == "elastic"


def test_quiet_flights_take_steps_by_the_error_wanted() -> None:
    soft = hcm.Finger((replace(SOFT, diameter=0.01, youngs_modulus=5e7),) * 3)
    scene = replace(SOFT_SCENE, finger=soft)
    fall = rods_fall(scene)
    ringing_share = BY_WEIGHT[0] * fall.ringing / fall.speed

    def steps(accuracy: float, scene: hcm.Scene = scene) -> float:
        chosen = {c.setting: c.value for c in settings_for(accuracy, scene).choices}
        assert chosen["flight"] == "elastic"
        return fall.time / chosen["flight_step"]

    least = 1.01 * ringing_share / QUIET
    assert steps(1e-2) == pytest.approx(steps(least) * (least / 1e-2) ** 0.25)
    assert steps(least) < FEW_STEPS - 1
    assert steps(0.98 * least) == pytest.approx(FEW_STEPS)
    whirled = replace(scene, drive=hcm.Drive((1e-12, 0.0, 0.0)))
    assert steps(1e-2, whirled) == pytest.approx(FEW_STEPS, rel=1e-3)


@pytest.mark.parametrize("accuracy", [0.1, 1e-2, 1e-3])
def test_the_fall_that_predicts_a_flight_as_rods_is_that_flight(accuracy: float) -> None:
    of = chosen(accuracy)
    assert of.scene.settings.flight == "rigid"
    assert of.fall is not None
    assert of.fall.serves(limits_of(of.scene.settings, of.scene.surface.height))


def test_a_vibration_is_followed_as_far_as_its_spectrum_asks_for() -> None:
    """Speeds ~ w^-p: twice the share takes 2^(1/p) times the frequency, 2^(1/(1+p)) above w_c."""
    slowest = (math.pi / SOFT.length) ** 2 * math.sqrt(
        SOFT.youngs_modulus * SOFT.second_moment / (SOFT.density * SOFT.area)
    )
    for decay in (0.5, 1.5):
        contact = 16.0 * slowest
        at_contact = 16.0**decay
        for share, times in ((1.0, 1.0), (at_contact, 16.0)):
            found = followed_frequency(SOFT_SCENE.finger, contact, share, decay)
            assert found == pytest.approx(times * slowest, rel=1e-12)
        above = followed_frequency(SOFT_SCENE.finger, contact, 2.0 * at_contact, decay)
        assert above == pytest.approx(contact * 2.0 ** (1.0 / (1.0 + decay)), rel=1e-12)


def test_a_followed_vibration_is_as_far_out_of_phase_by_any_stages() -> None:
    """T = (s!)^2/((2 s)! (2 s + 1)!) (w h)^(2 s): T and w by two s, h by a third."""

    def error(stages: int) -> float:
        f = math.factorial
        return f(stages) ** 2 / (f(2 * stages) * f(2 * stages + 1))

    assert chosen(1e-5, flight="elastic").scene.settings.stages == 8
    assert chosen(1e-3).scene.settings.stages == 5
    steps = {
        s: chosen(1e-5, flight="elastic", stages=s).scene.settings.flight_step for s in (4, 6, 8)
    }
    rows = {s: math.log(error(s)) + 2 * s * math.log(steps[s]) for s in steps}
    # log T = row + 2 s log w
    slope = (rows[4] - rows[8]) / 8.0
    assert rows[6] + 12 * slope == pytest.approx(rows[4] + 8 * slope, rel=1e-9)
    assert steps[8] > 2.0 * steps[4]


def test_a_vibration_that_shortens_no_step_is_followed_with_few_stages() -> None:
    limp = hcm.Finger((replace(SOFT, youngs_modulus=6e6),) * 3)
    scene = replace(SOFT_SCENE, finger=limp)
    fall = rods_fall(scene)
    assert fall is not None
    ringing_share = BY_WEIGHT[0] * fall.ringing / fall.speed
    few, many = (
        chosen(0.9 * ringing_share, scene),
        chosen(0.9 * ringing_share, scene, stages=FOLLOWING_STAGES),
    )
    assert few.followed
    assert few.scene.settings.stages == STAGES
    steps = (few.scene.settings.flight_step, many.scene.settings.flight_step)
    assert steps == (fall.time / FEW_STEPS,) * 2
    assert chosen(0.1 * ringing_share, scene).scene.settings.stages == FOLLOWING_STAGES


def test_a_ringing_finger_arrives_in_phase_and_its_error_is_measured() -> None:
    """A single element, stated, brings the vibration out of phase: that is found out, and said."""
    exact = numbers(once(5e-5, RINGING))
    for accuracy in (1e-2, 1e-3):
        assert settings_for(accuracy, RINGING).followed
        result = simulate_within(accuracy, RINGING)
        assert np.abs(numbers(result) / exact - 1.0).max() <= accuracy
        assert result.accuracy.expected <= accuracy
    phalanx = replace(RINGING.finger.phalanges[0], elements=1)
    few = simulate_within(1e-3, replace(RINGING, finger=hcm.Finger((phalanx,))), {"elements": 1})
    wrong = np.abs(numbers(few) / exact - 1.0).max()
    assert wrong > 5e-3
    assert few.accuracy.expected > wrong
    assert any("was wanted" in caution for caution in few.cautions)


def test_a_sudden_torques_vibration_is_not_left_to_a_rigid_flight() -> None:
    """Its speed at the start is 0.3 % of the approach's, its bending's at the touch 0.09 %."""
    scene = hcm.Scene(
        hcm.Finger((hcm.Phalanx(0.01794, 0.002349, 1.48e9, 2063.0),)),
        hcm.Surface(0.0060659, 0.856), hcm.Tip(4.714e5, 0.385), hcm.Drive((3.468e-6,)), NO_ESTIMATE,
    )  # fmt: skip
    fall = rods_fall(scene)
    assert fall is not None
    ringing_share = fall.ringing / fall.speed
    assert 0.25 * fall.bending / fall.speed < 1e-3 < ringing_share
    assert settings_for(1e-2, scene).flight_error == pytest.approx(ringing_share)
    assert settings_for(1e-3, scene).followed
    exact = numbers(hcm.simulate_scene(settings_for(1e-4, scene).scene))
    assert np.abs(numbers(simulate_within(1e-3, scene)) / exact - 1.0).max() < 1e-3


def test_the_stress_of_what_rods_leave_out_is_stated() -> None:
    """Both runs that are compared fly as rods: what these leave out is not in their difference.

    E kappa d/2 of a half sine of amplitude a, whose speed is a (pi/L)^2 sqrt(E I/(rho A)).
    """
    rod = hcm.Phalanx(0.02702, 0.00634, 3.14e9, 4821.0, poisson_ratio=0.442)
    a, wave = 1e-6, math.pi / rod.length
    speed = a * wave**2 * math.sqrt(rod.bending_stiffness / rod.line_density)
    bent = rod.youngs_modulus * a * wave**2 * rod.diameter / 2
    assert bending_wave_stress(speed, rod) == pytest.approx(bent, rel=1e-12)
    scene = hcm.Scene(
        hcm.Finger((rod,)), hcm.Surface(0.014075, 0.0), hcm.Tip(1.173e6),
        start=hcm.RigidStart((-0.0263,), (0.0,)), assumptions=hcm.Assumptions("refined"),
    )  # fmt: skip
    result = simulate_within(1e-3, scene)
    stress = once(1e-4, scene, {"flight": "elastic"}).summary.peak_stress_R_Pa
    assert result.given["settings"].flight == "rigid"
    off = abs(result.summary.peak_stress_R_Pa - stress)
    fall = rods_fall(scene)
    assert fall is not None
    omitted = bending_wave_stress(fall.ringing + fall.bending, rod)
    assert result.errors["peak_stress_R_Pa"] == pytest.approx(omitted)
    assert off < omitted


def test_a_vibration_that_is_not_followed_is_in_the_errors() -> None:
    """It moves the end of a tap that fades out by 1 %: two runs in equal steps do not see it."""
    phalanges = tuple(
        hcm.Phalanx(length, diameter, modulus, density, poisson_ratio=0.323)
        for length, diameter, modulus, density in (
            (0.009186, 0.001508, 7.723e9, 1400.0),
            (0.0529, 0.001508, 51.19e9, 1337.0),
            (0.04692, 0.0008933, 17.29e9, 1172.0),
            (0.0282, 0.001508, 68.73e9, 1400.0),
            (0.0156, 0.002183, 9.027e9, 1400.0),
        )
    )
    scene = hcm.Scene(
        hcm.Finger(phalanges), hcm.Surface(0.143587, 0.052), hcm.Tip(418400.0, 0.305, 0.914),
        start=hcm.RigidStart((0.0,) * 5, (2.046, 3.451, 5.157, 3.552, 10.022), 0.0),
        assumptions=hcm.Assumptions("refined"),
    )  # fmt: skip
    run, fine = (simulate_within(accuracy, scene) for accuracy in (1e-3, 1e-4))
    names = ("peak_normal_force_N", "normal_impulse_N_s", "contact_duration_s", "contact_time_s")
    for name in (*names, "peak_normal_force_time_s", "peak_stress_R_Pa"):
        apart = abs(getattr(run.summary, name) - getattr(fine.summary, name))
        assert apart <= run.errors[name] + fine.errors[name], name
