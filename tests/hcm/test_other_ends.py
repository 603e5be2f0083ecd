"""Where the rule that parts taps was near to another end, that end is in the errors."""

import math
from dataclasses import replace

import pytest

import hcm
from hcm.estimates.other_ends import (
    ERROR_FACTOR,
    NUMBERS,
    THRESHOLD_SHARE,
    open_ends,
    with_other_ends,
)
from hcm.results.result import Event, OtherEnd
from hcm.taps.tap import TapEndRule, near_ends_when_touched_again, nearest

RULE = TapEndRule(transit=1.0)
TAP = (0.0, 10.0)  # it must stay away for 1, and not come back within 20


def nearly_parted(**settings: float) -> hcm.Scene:
    """A tip that stays away for 4.117 us, where 4.122 end the tap (as a user's had)."""
    lengths, diameters = (0.0339, 0.0459, 0.0275), (0.0041, 0.0038, 0.0079)
    phalanges = [
        hcm.Phalanx(length, diameter, 2.25e9, 809.0, poisson_ratio=0.45)
        for length, diameter in zip(lengths, diameters, strict=True)
    ]
    return hcm.Scene(
        hcm.Finger(tuple(phalanges)),
        hcm.Surface(0.0714, 0.6),
        hcm.Tip(6.82e6, restitution=0.3064),
        settings=replace(hcm.Settings(), **settings),  # type: ignore[arg-type]
        assumptions=hcm.Assumptions("refined"),
    )


@pytest.mark.parametrize(
    ("touch_in", "tip_in", "until", "apart", "threshold"),
    [
        (19.0, 5.0, 10.0, 1.0, 20.0),  # it went on, and nearly ended with the last separation
        (21.0, 5.0, 54.0, 1.0, 20.0),  # it ended, and nearly went on
        (math.inf, 0.05, 12.1, 0.05, 1.0),  # it ended, and the tip came back just after
    ],
)
def test_a_look_that_was_near_to_another_end(
    touch_in: float, tip_in: float, until: float, apart: float, threshold: float
) -> None:
    end = nearest(RULE.near_ends_when_checked(TAP, 11.0, touch_in, tip_in))[0]
    assert end == pytest.approx((until, apart, threshold))


def test_what_never_comes_down_and_held_touches_have_no_other_end() -> None:
    assert RULE.near_ends_when_checked(TAP, 11.0, math.inf, math.inf) == []
    assert replace(RULE, until=3.0).near_ends_when_checked(TAP, 11.0, 19.0, 0.05) == []


@pytest.mark.parametrize(
    ("away", "touch_in", "nearly"),
    [(0.96, math.inf, True), (0.96, 0.0, False), (1.2, math.inf, False)],
)
def test_a_tip_that_comes_back_just_before_it_is_looked_at(
    away: float, touch_in: float, nearly: bool
) -> None:
    """Where its phalanx does not come down, a look would have ended the tap."""
    kinds = ("contact", "separation", "contact", "separation")
    events = [Event(t, kind) for t, kind in zip((0.0, 10.0, 10.0 + away, 15.0), kinds, strict=True)]
    ends = near_ends_when_touched_again(RULE, events, (0.0, 15.0), lambda event: touch_in)
    assert ends == ([pytest.approx((10.0, 1.0 - away, 1.0))] if nearly else [])


def test_ends_are_open_within_what_the_duration_is_known_to() -> None:
    near, far = OtherEnd(1e-5, 2e-9, 1e-6), OtherEnd(2e-5, 9e-9, 1e-6)
    run = hcm.simulate_scene(nearly_parted(estimate=False))
    run = replace(run, other_ends=(far, near))

    def ends(error: float) -> tuple[OtherEnd, ...]:
        return open_ends(replace(run, errors={"contact_duration_s": error}))

    assert ends(1e-9) == (near,)
    assert ends(3e-9) == (near, far)
    assert ends((near.apart_s - THRESHOLD_SHARE * 1e-6) / ERROR_FACTOR * 0.99) == ()
    lasts = run.summary.contact_duration_s or 0.0
    assert (len(ends(0.09 * lasts)), ends(0.11 * lasts)) == (2, ())
    assert ends(math.inf) == ()
    assert open_ends(run) == ()


@pytest.mark.parametrize("accuracy", [1e-2, 1e-3])
def test_an_open_end_is_in_the_errors_and_said(accuracy: float) -> None:
    """75.974 us and 0.53397 mN s are those of 1e-5, 37.90 and 0.46635 those of half a millionth."""
    result = hcm.simulate_within(accuracy, nearly_parted())
    lasts, impulse = result.summary.contact_duration_s, result.summary.normal_impulse_N_s
    assert lasts is not None
    assert impulse is not None
    for others in ((75.974e-6, 0.53397e-3), (37.90e-6, 0.46635e-3)):
        assert abs(lasts - others[0]) < 1.01 * result.errors["contact_duration_s"]
        assert abs(impulse - others[1]) < 1.01 * result.errors["normal_impulse_N_s"]
    assert result.accuracy is not None
    assert result.accuracy.expected > 0.3
    assert any("the first tap may end after" in c for c in result.cautions)
    assert result.errors["peak_normal_force_N"] < 0.01 * result.summary.peak_normal_force_N


def fixed(**settings: float) -> hcm.TapResult:
    """The same with the settings that 1e-3 chooses."""
    scene = hcm.settings_for(1e-3, nearly_parted()).scene
    given = replace(scene.settings, **({"estimate": True} | settings))  # type: ignore[arg-type]
    return hcm.simulate_scene(replace(scene, settings=given))


def test_the_other_end_may_take_longer_than_the_run() -> None:
    """In steps, and where an end time had lifted the limit of a flight."""
    steps = fixed().statistics.steps
    for run in (fixed(max_steps=steps + 8), fixed(end_time=0.1156, max_flight_time=0.1)):
        assert run.status is hcm.Status.COMPLETED
        assert 30e-6 < run.errors["contact_duration_s"] < 40e-6
        assert run.errors["peak_normal_force_N"] < 0.01 * run.summary.peak_normal_force_N
    held = hcm.simulate_within(1e-3, nearly_parted(end_time=0.1156, max_flight_time=0.1))
    assert held.accuracy is not None
    assert held.accuracy.expected < 2.0


def test_of_an_end_whose_run_fails_nothing_is_known() -> None:
    run = fixed(estimate=False)
    failed = replace(run, status=hcm.Status.NEWTON_FAILED)
    known = replace(run, errors=dict.fromkeys((*NUMBERS, "contact_time_s"), 1e-8))
    found = with_other_ends(known, lambda scene: failed)
    assert found.status is hcm.Status.COMPLETED
    assert all(math.isinf(found.errors[name]) for name in NUMBERS)
    assert found.errors["contact_time_s"] == 1e-8
    assert "those ended as" in found.cautions[-1]


def test_an_end_that_agrees_leaves_the_errors() -> None:
    run = replace(fixed(estimate=False), errors=dict.fromkeys(NUMBERS, 1e-8))
    found = with_other_ends(run, lambda _: replace(run, other_ends=()))
    assert found.errors == run.errors


def test_an_interrupt_leaves_no_errors() -> None:
    run = replace(fixed(estimate=False), errors=dict.fromkeys(NUMBERS, 1e-8))
    cut = replace(run, status=hcm.Status.INTERRUPTED)
    found = with_other_ends(run, lambda scene: cut)
    assert (found.status, found.errors, found.cautions) == (cut.status, {}, run.cautions)
    assert f"t = {run.history.time_s[-1]:.9g} s" in found.message


def test_touches_after_which_the_rule_goes_on_are_no_end() -> None:
    """Two thirds of a tap were stated for all of it (found by bisection, at 1e-2)."""
    run = fixed(estimate=False)
    (end, *_) = run.other_ends
    later = replace(
        run, errors=dict.fromkeys(NUMBERS, 1e-8), other_ends=(end._replace(until_s=1e-4),)
    )
    longer = replace(run, other_ends=(OtherEnd(math.inf, 0.0, 1e-5),))
    found = with_other_ends(later, lambda _: longer)
    assert all(math.isinf(error) for error in found.errors.values())
    assert "last beyond" in found.cautions[-1]
    down = [Event(t, kind) for t, kind in ((0.0, "contact"), (10.0, "separation"))]
    held = replace(RULE, until=12.0)
    assert near_ends_when_touched_again(held, down, TAP, lambda event: 19.0) == [
        OtherEnd(math.inf, 0.0, 20.0)
    ]
    assert near_ends_when_touched_again(held, down, TAP, lambda event: 21.0) == []


def test_an_end_that_is_far_from_a_threshold_is_open_where_little_is_known() -> None:
    """At 1e-2 the duration is known to 2 %, 16 % of what a tip must stay away: 1.925 mN s was known
    to 0.8 %, and is 4.089."""
    phalanx = hcm.Phalanx(0.0515, 0.00917, 5.77e7, 2082.0, poisson_ratio=0.34)
    scene = hcm.Scene(
        hcm.Finger((phalanx,)),
        hcm.Surface(0.0265, 0.0),
        hcm.Tip(1e6, restitution=0.85),
        assumptions=hcm.Assumptions("refined"),
    )
    result = hcm.simulate_within(1e-2, scene)
    lasts, impulse = result.summary.contact_duration_s, result.summary.normal_impulse_N_s
    assert abs(lasts - 1967.29e-6) <= result.errors["contact_duration_s"]
    assert abs(impulse - 4.08894e-3) <= result.errors["normal_impulse_N_s"]


def test_many_looks_are_one_end() -> None:
    looks = [OtherEnd(1e-5, apart, 1e-6) for apart in (3e-9, 1e-9, 2e-9)]
    assert nearest([OtherEnd(2e-5, 2e-9, 1e-6), *looks]) == (looks[1], OtherEnd(2e-5, 2e-9, 1e-6))


def test_held_touches_are_known_again() -> None:
    """What the caution says to do."""
    durations = []
    for accuracy in (1e-3, 1e-4):
        result = hcm.simulate_within(accuracy, nearly_parted(tap_until=1e-4))
        durations.append(result.summary.contact_duration_s)
        assert result.accuracy is not None
        assert result.accuracy.expected < accuracy
        assert not any("first tap may end" in caution for caution in result.cautions)
    assert durations[0] == pytest.approx(durations[1], rel=1e-3)


def test_fixed_settings_state_it_too() -> None:
    result = fixed()
    assert result.errors["contact_duration_s"] > 30e-6
    assert any("first tap may end" in caution for caution in result.cautions)


def test_of_several_open_ends_the_two_nearest_are_solved() -> None:
    ends = [OtherEnd(n * 1e-5, n * 1e-9, 1e-6) for n in (3, 1, 2)]
    run = hcm.simulate_scene(nearly_parted(estimate=False))
    run = replace(run, other_ends=tuple(ends), errors={"contact_duration_s": 1e-6})
    assert open_ends(run) == (ends[1], ends[2])
