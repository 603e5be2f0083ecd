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
from hcm.beam.chain import build_chain
from hcm.beam.outline import build_outline, depth
from hcm.flight.fall import (
    RODS_TOLERANCE,
    bending_wave_stress,
    omitted_time,
    rods_fall,
    slowest_frequency,
)
from hcm.flight.rigid_chain import body_depth, build_rods
from hcm.model import limits_of, rigid_motion
from hcm.parameters import STAGES
from hcm.simulate import solve_once
from tests.hcm.accuracies import chosen, numbers, once
from tests.hcm.cases import NO_ESTIMATE, RINGING, SOFT, SOFT_SCENE, finger


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


def test_a_round_tip_lifts_no_surface_for_the_sections() -> None:
    """They were measured against where its centre touches: rods fell "as the finger meets the
    surface before its tip does", and were too flexible for it.
    """
    thin, thick = (hcm.Phalanx(0.04, d, 2e7, 1100.0, poisson_ratio=0.47) for d in (0.01, 0.02))
    scene = hcm.Scene(
        hcm.Finger((thin, thick)), hcm.Surface(0.027362, 0.2), hcm.Tip(2e4),
        settings=NO_ESTIMATE, start=hcm.RigidStart((0.10472, 0.174533), (0.0, 0.0)),
        assumptions=hcm.Assumptions("refined"),
    )  # fmt: skip
    fall = rods_fall(scene)
    assert fall is not None
    assert fall.sunk == 0.0
    result = simulate_within(1e-3, scene)
    assert result.status is hcm.Status.COMPLETED, result.message


def test_sections_sink_as_those_of_straight_beams() -> None:
    body, surface = finger(SOFT, elements=1), hcm.Surface(0.04, 0.5)
    rods, radius = build_rods(body, surface, hcm.Drive())[0], np.full(3, SOFT.diameter / 2)
    for angles in ((0.9, 0.5, 0.7), (0.3, 1.4, 0.2), (0.4, -0.6, 1.2), (0.6, 0.9, -0.3)):
        state = np.array([*angles, 0.0, 0.0, 0.0])
        chain = build_chain(body, hcm.Drive())[0]
        q, _ = rigid_motion(body, chain, hcm.RigidStart(angles, (0.0,) * 3))
        below = depth(q, chain, build_outline(body, surface.height))[0]
        sunk = body_depth(state, radius, surface.height, rods)
        assert max(sunk, 0.0) == pytest.approx(below, abs=1e-12)


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


def test_the_rods_fall_as_a_rigid_flight_does() -> None:
    fall = rods_fall(SOFT_SCENE)
    rigid = replace(SOFT_SCENE, settings=replace(NO_ESTIMATE, flight="rigid"))
    result = hcm.simulate_scene(rigid)
    assert fall is not None
    assert fall.time == pytest.approx(result.summary.contact_time_s, rel=1e-6)
    assert -fall.speed == pytest.approx(result.summary.tip_velocity_at_contact_m_per_s[1], rel=1e-5)
    assert fall.ringing < fall.bending <= fall.largest
    # where the steps are those that it fell by, a run takes it as its own
    alike = replace(rigid.settings, flight_step=1.0, flight_tolerance=RODS_TOLERANCE)
    marked = replace(fall, flight=fall.flight._replace(repeats=fall.flight.repeats + 77))
    taken, own = (
        solve_once(replace(rigid, settings=alike), fall=known)[0] for known in (marked, None)
    )
    assert taken.summary == own.summary
    assert taken.statistics.rejected_steps == own.statistics.rejected_steps + 77
    other, _ = solve_once(rigid, fall=fall)
    assert (other.summary, other.statistics.steps) == (result.summary, result.statistics.steps)


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


def test_what_rods_leave_out_is_in_the_time_of_their_touch() -> None:
    """After a jump of the torques the beams touch 0.5 us later, and 0.06 us were stated."""
    rows = ((0.0597, 0.01646, 4.75e9, 2661.0), (0.0569, 0.0152, 1.93e9, 3471.0),
            (0.0346, 0.01253, 3.75e9, 1651.0), (0.027, 0.00603, 1.58e10, 1001.0))  # fmt: skip
    still = (0.0,) * 4
    jump = hcm.TorqueTable(
        (0.0, 0.0138, 0.0138), (still, still, (4.36e-3, -1.8e-3, 2.4e-4, 3.5e-4))
    )
    scene = hcm.Scene(
        hcm.Finger(tuple(hcm.Phalanx(*row, 20) for row in rows)), hcm.Surface(0.1618, 0.813),
        hcm.Tip(8.126e6, 0.511, 0.75), hcm.Drive(table=jump),
    )  # fmt: skip
    true = simulate_within(1e-4, scene).summary.contact_time_s  # known to 14 ns
    fixed = replace(scene, settings=hcm.Settings(flight="rigid", flight_tolerance=1e-9))
    assert true is not None
    for run in (simulate_within(1e-3, scene), hcm.simulate_scene(fixed)):
        found, stated = run.summary.contact_time_s, run.errors["contact_time_s"]
        assert isinstance(stated, float)
        assert found is not None
        assert 1e-7 < abs(found - true) < stated < 1e-5


def test_a_short_flight_leaves_out_no_more_than_its_time_holds() -> None:
    """A start 10 um above the surface at 10 rad/s: 2.4 % of its time of contact were stated."""
    rod = hcm.Phalanx(0.04, 0.015, 1e9, 1400.0)
    speed_share = 0.1
    finger_of_one = hcm.Finger((rod,))
    longest = 2.0 * speed_share / slowest_frequency(finger_of_one)
    assert omitted_time(speed_share, finger_of_one, 1e-5) == speed_share * 1e-5
    assert omitted_time(speed_share, finger_of_one, 1.0) == pytest.approx(longest, rel=1e-15)


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
