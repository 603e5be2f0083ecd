"""Settings that follow from an accuracy: line by line."""

import math
from dataclasses import replace
from typing import Any

import pytest
from scipy.optimize import brentq

import hcm
from hcm.accuracy.chosen import (
    INNER_SHARE,
    NEWTON,
    contact_frequency,
    first_bending_frequency,
    settings_for,
)
from hcm.accuracy.chosen_flight import (
    MOST_ELEMENTS,
    _wave,
    choose_flight,
    count_elements,
    followed_frequency,
)
from hcm.accuracy.simulate_within import simulate_within
from hcm.flight.fall import rods_fall
from tests.hcm.accuracies import chosen
from tests.hcm.cases import NO_ESTIMATE, RINGING, SOFT, SOFT_SCENE, SOFT_TIP

# one phalanx that is stiff beside its tip's spring, whose bending limits a step of collocation
STIFF = hcm.Scene(
    hcm.Finger((hcm.Phalanx(0.04, 0.015, 2.882e10, 1400.0),)), hcm.Surface(0.02853, 1.0),
    hcm.Tip(1.4e6), settings=NO_ESTIMATE,
)  # fmt: skip


def test_phalanges_before_the_last_have_a_share_of_its_elements() -> None:
    """A wave returns from them when the tap is nearly over: 0.8 of its number, if all are alike."""
    order_two = {"flight": "elastic", "flight_integrator": "generalized-alpha"}
    *inner, last = (p.elements for p in chosen(1e-6, **order_two).scene.finger.phalanges)
    assert last > 10
    # whole numbers: each is rounded up
    assert inner == pytest.approx([INNER_SHARE * last] * 2, abs=1.0)


@pytest.mark.parametrize(
    ("scene", "accuracy"), [(SOFT_SCENE, 1e-5), (STIFF, 1e-3)], ids=["waves", "bending"]
)
def test_a_step_of_twice_the_stages_is_twice_as_long(scene: hcm.Scene, accuracy: float) -> None:
    """It has as many stages to the turn, whatever the frequency that limits it."""
    few, many = (chosen(accuracy, scene, stages=s).scene.settings.contact_step for s in (4, 8))
    assert many == pytest.approx(2.0 * few, rel=1e-12)


def test_no_accuracy_is_so_loose_that_a_step_or_an_iteration_misses_a_tap() -> None:
    """A step of collocation is below half a turn of the tip's spring, at 0.1 as at 0.01."""
    loose, tight = (chosen(a, contact_integrator="gauss").scene.settings for a in (1e-1, 1e-2))
    assert loose.contact_step == pytest.approx(tight.contact_step, rel=1e-12)
    assert loose.contact_step * contact_frequency(SOFT, SOFT_TIP) < math.pi / 2
    assert loose.newton_tolerance == pytest.approx(tight.newton_tolerance, rel=1e-12)
    assert loose.newton_tolerance <= NEWTON["gauss"][1]


def test_a_mass_swings_faster_on_the_stiffer_spring_of_restitution() -> None:
    """By sqrt(k/m)/e*: a step of half the length with e* = 0.5."""
    rod = hcm.Finger((hcm.Phalanx(0.04, 0.01, 1e11, 1000.0),))
    scene = hcm.Scene(rod, hcm.Surface(0.03, 0.0), hcm.Tip(20.0), settings=NO_ESTIMATE)
    one, half = (
        chosen(1e-3, replace(scene, tip=hcm.Tip(20.0, e))).scene.settings.contact_step
        for e in (1.0, 0.5)
    )
    assert half == pytest.approx(0.5 * one, rel=1e-12)


def test_torques_tighten_the_iterations_of_collocation_alone() -> None:
    """What these leave adds up in an undamped flight; those of order 2 are damped."""
    driven = replace(SOFT_SCENE, drive=hcm.Drive((1e-6, 0.0, 0.0)))
    for accuracy in (1e-6, 1e-4, 1e-2):
        for method, share in (("gauss", 1e-1), ("generalized-alpha", 1.0)):
            fall, whirl = (
                chosen(accuracy, scene, contact_integrator=method).scene.settings.newton_tolerance
                for scene in (SOFT_SCENE, driven)
            )
            assert 0.0 < whirl <= share * fall
            # the iteration's error is no more than a hundredth of the one wanted
            assert fall <= 1e-2 * accuracy * (1.0 + 1e-12)
            if method == "generalized-alpha":
                assert whirl == fall


def test_hertz_tangent_spring_shields_the_tip_at_its_depth() -> None:
    """3/2 K sqrt(v/w)/e*^2 over w is the impedance of the beam's free end, rho A c/sqrt(2)."""
    k, speed, restitution = 3e9, 1.7, 0.6
    omega = contact_frequency(SOFT, replace(SOFT_TIP, restitution=restitution), k, speed)
    waves = (1e9 * SOFT.second_moment / (1400.0 * SOFT.area)) ** 0.25 * omega**0.5
    impedance = 1400.0 * SOFT.area * waves / 2**0.5
    spring = 1.5 * k * math.sqrt(speed / omega) / restitution**2
    assert impedance == pytest.approx(spring / omega, rel=1e-12)


def test_the_first_bending_of_a_hinged_beam_is_the_root_of_its_equation() -> None:
    """tan b = tanh b, b = 3.927, of a hinge and a free end (Blevins 1979)."""
    b = brentq(lambda x: math.tan(x) - math.tanh(x), 3.5, 4.5)
    exact = (b / SOFT.length) ** 2 * math.sqrt(SOFT.bending_stiffness / SOFT.line_density)
    # b^2 is given with five digits
    assert first_bending_frequency(SOFT) == pytest.approx(exact, rel=5e-5)


def test_a_refined_beams_steps_of_order_two_are_longer() -> None:
    """Its elements' errors outweigh theirs: w h = 2 sqrt(eps), of a lumped tip sqrt(eps)."""
    assumed = hcm.Assumptions("paper", rotary_inertia=True)
    of = {"contact_integrator": "generalized-alpha", "flight": "elastic"}
    omega = contact_frequency(SOFT, SOFT_TIP)
    for scene, turn in ((SOFT_SCENE, 1.0), (replace(SOFT_SCENE, assumptions=assumed), 2.0)):
        found = chosen(1e-3, scene, **of)
        assert not found.followed
        assert found.scene.settings.contact_step * omega == pytest.approx(
            turn * math.sqrt(1e-3), rel=1e-12
        )


def test_an_elastic_flight_that_is_stated_is_not_solved_as_rods() -> None:
    """Not even of a finger that meets the surface before its tip does."""
    found = chosen(1e-4, replace(SOFT_SCENE, surface=hcm.Surface(0.04, 0.5)), flight="elastic")
    assert found.scene.settings.flight == "elastic"
    assert found.scene.settings.flight_integrator == "gauss"


def test_a_vibration_changes_a_refined_tap_by_twice_as_much() -> None:
    """Half its share of the approach's speed; a quarter where the tip is lumped."""
    assumed = hcm.Assumptions("paper", rotary_inertia=True)
    for scene, share in ((SOFT_SCENE, 0.25), (replace(SOFT_SCENE, assumptions=assumed), 0.5)):
        found = chosen(1e-3, scene, flight="elastic")
        assert not found.followed
        assert found.fall is not None
        told = share * found.fall.ringing / found.fall.speed
        assert found.flight_error == pytest.approx(told, rel=1e-12)


def test_a_start_at_speed_stretches_a_phalanx_suddenly() -> None:
    """w^2 x rho A stretches a rod that turns at w by rho w^2 L^3/(3 E); of the largest of these
    loads along all of it the speed is w^2 L^2 pi/(4 c), 1.5 times as much. All of it moves the tip,
    which meets the surface at 56 degrees: a rigid flight with 0.17 % stated was 0.46 % off at 3e-3.
    """
    rod, spin = hcm.Phalanx(0.072257, 0.00979449, 4.48304e9, 2933.96), 53.2252
    scene = hcm.Scene(
        hcm.Finger((rod,)), hcm.Surface(0.0598835, 0.855867), hcm.Tip(2.44163e6, 0.765989),
        hcm.Drive(gravity=0.0), start=hcm.RigidStart((0.0,), (spin,)),
    )  # fmt: skip
    fall = rods_fall(scene)
    assert fall is not None
    wave = math.sqrt(rod.youngs_modulus / rod.density)
    expected = spin**2 * rod.length**2 * math.pi / (4 * wave)
    assert fall.stretching == pytest.approx(expected, rel=1e-12)
    assert fall.ringing == fall.stretching  # nothing bends it
    given = {"flight": "rigid"}
    own = settings_for(3e-3, scene, given).flight_error
    assert own == pytest.approx(expected / fall.speed, rel=1e-12)
    limit = simulate_within(1e-4, scene).summary.normal_impulse_N_s
    result = simulate_within(3e-3, scene)
    assert result.given["settings"].flight == "elastic"
    error = result.errors["normal_impulse_N_s"]
    assert result.summary.normal_impulse_N_s == pytest.approx(limit, abs=error)
    level = rods_fall(SOFT_SCENE)
    assert level is not None
    assert level.stretching == 0.0


def test_a_loose_accuracy_takes_no_fewer_steps_of_flight() -> None:
    """In less than a dozen Newton's method fails: 0.1 takes as many as 0.01."""
    loose, tight = (chosen(a, flight="elastic").scene.settings for a in (1e-1, 1e-2))
    assert loose.flight_step == pytest.approx(tight.flight_step, rel=1e-12)


def test_a_followed_vibration_is_a_known_angle_out_of_phase_at_the_touch() -> None:
    """0.3 rad by the steps of w_f: of r = V_0/(v eps) by a torque, of 1.5/4 of that by weight."""
    light = hcm.Finger((hcm.Phalanx(0.01794, 0.002349, 1.48e9, 2063.0),))
    driven = hcm.Scene(
        light, hcm.Surface(0.0060659, 0.856), hcm.Tip(4.714e5, 0.385), hcm.Drive((3.468e-6,))
    )
    torque, weight = (driven, 1e-3, 1.0, 0.5), (SOFT_SCENE, 1e-5, 1.5 * 0.25, 1.5)
    for scene, accuracy, share, decay in (torque, weight):
        found, body = settings_for(accuracy, scene, {"flight": "elastic"}), scene.finger
        assert found.followed
        assert found.fall is not None
        contact = contact_frequency(body.phalanges[-1], scene.tip)
        excess = share * found.fall.ringing / (found.fall.speed * accuracy)
        highest = followed_frequency(body, contact, excess, decay)
        own, f = found.scene.settings, math.factorial
        s, turn = own.stages, highest * own.flight_step
        off = f(s) ** 2 / (f(2 * s) * f(2 * s + 1)) * turn ** (2 * s)
        assert off * highest * found.fall.time == pytest.approx(0.3, rel=1e-9)


@pytest.mark.parametrize("more", [{"taps": 2}, {"end_time": 0.5}])
def test_a_flight_after_a_tap_is_controlled_by_the_accuracy(more: dict[str, Any]) -> None:
    """Equal steps lose the energy of the vibration that the tap leaves."""
    for accuracy in (1e-2, 1e-4):
        longer = replace(SOFT_SCENE, settings=replace(NO_ESTIMATE, **more))
        found = settings_for(accuracy, longer, {"flight": "elastic"}).scene.settings
        assert found.flight_tolerance == pytest.approx(1e-3 * accuracy, rel=1e-12)


def test_waves_in_flight_are_resolved_to_their_phases_error() -> None:
    """(kappa l)^4/720 with shear, 3e-5 (kappa l)^6 without; no element has a wave's quarter."""
    for turn in (1e-6, 1e-5):
        assert _wave(turn, True) ** 4 / 720.0 == pytest.approx(turn, rel=1e-12)
        assert 3e-5 * _wave(turn, False) ** 6 == pytest.approx(turn, rel=1e-12)
    for sheared in (True, False):
        assert _wave(1e9, sheared) < math.pi / 2


def test_elements_are_counted_by_the_wave_that_each_may_have() -> None:
    """A wave number of 10/L in elements of 1 rad, 4 rad and 1e-6 rad: 10, 3, and as many as go."""
    frequency = (10.0 / SOFT.length) ** 2 * math.sqrt(SOFT.bending_stiffness / SOFT.line_density)
    counts = [count_elements(SOFT, frequency, turn) for turn in (1.0 + 1e-9, 4.0, 1e-6, 1e3)]
    assert counts == [10, 3, MOST_ELEMENTS, 1]


def test_a_flight_has_elements_for_its_longest_phalanx_and_the_contact_has_no_fewer() -> None:
    """A short limp phalanx needs few, a long one many; the tip's soft spring excites less."""
    short = replace(RINGING.finger.phalanges[0], length=0.01)
    body = hcm.Finger((*RINGING.finger.phalanges, short))
    scene = replace(
        RINGING, finger=body, tip=hcm.Tip(4.0), surface=hcm.Surface(0.015, 0.5),
        drive=hcm.Drive((0.0106, 0.0)),
    )  # fmt: skip
    fall = rods_fall(scene)
    assert fall is not None
    flight = choose_flight(1e-3, scene, fall, contact_frequency(short, scene.tip), True, {})
    told = {c.setting: c.value for c in flight.choices}
    assert flight.followed
    assert flight.elements[0] > flight.elements[1]
    assert told["flight_elements"] == max(flight.elements)
    found = settings_for(1e-3, scene).scene.finger.phalanges
    assert all(p.elements >= n for p, n in zip(found, flight.elements, strict=True))


@pytest.mark.parametrize(
    ("length", "count", "height", "gravity"),
    [(0.04, 3, 0.1, 9.8), (0.04, 3, 0.1, 0.0), (0.02, 1, 0.01, 9.8)],
    ids=["tap", "no fall", "bending limits a step of collocation"],
)
def test_a_spring_that_is_not_assumed_changes_nothing(
    length: float, count: int, height: float, gravity: float
) -> None:
    """Also where the rods' fall says nothing of the speed."""
    phalanx = replace(SOFT, length=length, poisson_ratio=0.4)
    refined = hcm.Scene(
        hcm.Finger((phalanx,) * count), hcm.Surface(height, 0.5), hcm.Tip(),
        hcm.Drive(gravity=gravity), settings=NO_ESTIMATE, assumptions=hcm.Assumptions("refined"),
    )  # fmt: skip
    assert (rods_fall(refined) is None) == (gravity == 0.0)
    for k in (1.0, 1e9):
        sprung = replace(refined, tip=hcm.Tip(k))
        for stated in ({}, {"contact_integrator": "gauss"}):
            without, with_spring = (settings_for(1e-2, of, stated) for of in (refined, sprung))
            assert without.choices == with_spring.choices
    if gravity > 0.0:
        ends = (hcm.simulate_scene(of).summary for of in (refined, sprung))
        assert len({end.normal_impulse_N_s for end in ends}) == 1
