"""Runs that can't be relied on say so, and no other run pays for it."""

from dataclasses import replace

import pytest

import hcm
from hcm.repeatable import LARGEST_CHANGE, change, factors, folded, repetition
from validation.models.hcm import translate
from validation.scenes.load import load_scene

SOFT = hcm.Phalanx(0.04, 0.015, 1e9, 1400.0, elements=5)
FINGER = hcm.Finger((SOFT,) * 3)


def _driven(torque: float, gravity: float, repeat: bool) -> hcm.TapResult:
    return hcm.simulate(
        FINGER, hcm.Surface(0.1, 0.5), hcm.Tip(0.78e6), hcm.Drive((torque,) * 3, gravity),
        hcm.Settings(repeat=repeat),
    )  # fmt: skip


# (torque, gravity) of cells that completed with peak or impulse off by 17 and 64 % in silence
@pytest.mark.parametrize(("torque", "gravity"), [(0.00631, 1.233), (0.001848, 0.231)])
def test_a_chaotic_tap_says_so(torque: float, gravity: float) -> None:
    """Two runs of chaos may agree by chance, and which do changes with a rounding: most differ."""
    torques = [torque * (1.0 + 1e-4 * nudge) for nudge in range(5)]
    unsafe = [
        tau for tau in torques
        if _driven(tau, gravity, repeat=True).status is hcm.Status.UNREPEATABLE
    ]  # fmt: skip
    assert len(unsafe) >= 3
    torque = unsafe[0]
    silent = _driven(torque, gravity, repeat=False)
    assert silent.status is hcm.Status.COMPLETED
    told = _driven(torque, gravity, repeat=True)
    assert told.status is hcm.Status.UNREPEATABLE
    assert told.status.advice
    assert "times the tolerances change" in told.message
    # what was computed is kept
    assert told.summary == silent.summary
    assert told.statistics.newton_iterations == silent.statistics.newton_iterations


def test_agreement_by_chance_is_not_enough() -> None:
    """The coarser run agrees to 0.3 %, one with a hundredth of the tolerances is 50 % away."""
    result = hcm.simulate(
        FINGER, hcm.Surface(0.1, 0.5), hcm.Tip(0.78e6),
        hcm.Drive((0.001624, -0.001624, 0.001624), 0.1),
    )  # fmt: skip
    assert result.status is hcm.Status.UNREPEATABLE


def test_a_folded_finger_whose_motion_repeats_completes() -> None:
    result = _driven(0.04, 1.2, repeat=True)
    assert folded(result.history, result.summary, FINGER.length)
    assert result.status is hcm.Status.COMPLETED


@pytest.mark.parametrize("name", ["hard", "soft", "driven-1", "driven-2", "driven-3"])
def test_the_papers_fingers_stay_stretched(name: str) -> None:
    """They are not repeated: the check costs them a look at the tip's path."""
    given = translate(load_scene(name, ("finger.elements=3",)))
    result = hcm.simulate(**given)
    assert result.status is hcm.Status.COMPLETED
    length = given["finger"].length
    assert factors(result.history, result.events, result.summary, length) == ()


def test_what_changes_is_named() -> None:
    one = hcm.simulate(hcm.Finger((SOFT,)), hcm.Surface(0.03, 0.5), hcm.Tip(0.78e6))
    assert change(one.summary, one)[1] == 0.0
    stronger = replace(one, summary=replace(one.summary, normal_impulse_N_s=1.0))
    assert change(one.summary, stronger)[0] == "the normal impulse"
    vx, vy = one.summary.tip_velocity_at_contact_m_per_s or (0.0, 0.0)
    faster = replace(one, summary=replace(
        one.summary, tip_velocity_at_contact_m_per_s=(vx - 0.1 * vy, vy)))  # fmt: skip
    what, share = change(one.summary, faster)
    assert what == "the velocity at contact"
    assert share == pytest.approx(0.1)
    lost = replace(one, status=hcm.Status.NOT_REACHED)
    assert change(one.summary, lost)[1] > LARGEST_CHANGE


def test_a_tap_that_barely_ends_says_so() -> None:
    """F_n falls to a thousandth of its peak: whether it ends there decides on half the impulse."""
    scene = (FINGER, hcm.Surface(0.1, 5.337), hcm.Tip(0.78e6, 0.05, 284.8))
    silent = hcm.simulate(*scene, settings=hcm.Settings(repeat=False))
    assert silent.status is hcm.Status.COMPLETED
    assert not folded(silent.history, silent.summary, FINGER.length)
    told = hcm.simulate(*scene)
    assert told.status is hcm.Status.UNREPEATABLE
    assert "0.1 times the tolerances change the normal impulse by 65 %" in told.message


def test_the_repetition_differs_in_any_case() -> None:
    settings = hcm.Settings(flight_tolerance=0.0, end_time=1.0)
    fixed = repetition(settings, 8.0)
    assert fixed.flight_step == pytest.approx(2 * settings.flight_step)
    assert fixed.contact_tolerance == 8 * settings.contact_tolerance
    assert fixed.end_time is None
    assert not fixed.repeat
    assert repetition(hcm.Settings(), 0.1).flight_tolerance == 0.1 * hcm.Settings().flight_tolerance
