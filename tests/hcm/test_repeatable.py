"""Runs that can't be relied on say so, and no other run pays for it."""

from dataclasses import replace

import pytest

import hcm
from hcm.estimates.companion import folded, grazes, rescaled_settings
from hcm.estimates.error_cautions import relative_errors
from hcm.estimates.estimate import companion_errors
from hcm.workload import check_size, most_steps
from tests.hcm.cases import HARD, HARD_TIP, SOFT, SOFT_TIP, SURFACE, finger

FINGER = finger(SOFT)


@pytest.fixture(scope="module")
def one() -> hcm.TapResult:
    """A tap that ends, of one phalanx."""
    return hcm.simulate(hcm.Finger((SOFT,)), hcm.Surface(0.03, 0.5), SOFT_TIP)


def _driven(torque: float, gravity: float, estimate: bool, **settings: float) -> hcm.TapResult:
    return hcm.simulate(
        FINGER, SURFACE, SOFT_TIP, hcm.Drive((torque,) * 3, gravity),
        hcm.Settings(estimate=estimate, **settings),  # type: ignore[arg-type]
    )  # fmt: skip


# (torque, gravity) of cells that completed with peak or impulse off by 17 and 64 % in silence
@pytest.mark.parametrize(("torque", "gravity"), [(0.00631, 1.233), (0.001848, 0.231)])
def test_a_chaotic_tap_says_so(torque: float, gravity: float) -> None:
    """Two runs of chaos may agree by chance, and which do changes with a rounding: most differ."""
    torques = [torque * (1.0 + 1e-4 * nudge) for nudge in range(5)]
    unsafe = [
        tau for tau in torques
        if _driven(tau, gravity, estimate=True).status is hcm.Status.UNREPEATABLE
    ]  # fmt: skip
    assert len(unsafe) >= 3
    torque = unsafe[0]
    silent = _driven(torque, gravity, estimate=False)
    assert silent.status is hcm.Status.COMPLETED
    told = _driven(torque, gravity, estimate=True)
    assert told.status is hcm.Status.UNREPEATABLE
    assert told.status.advice
    assert "times the tolerances change" in told.message
    # what was computed is kept
    assert told.summary == silent.summary
    assert told.statistics.newton_iterations == silent.statistics.newton_iterations


def test_agreement_by_chance_is_not_enough() -> None:
    """The coarser run agrees to 0.3 %, one with a hundredth of the tolerances is 50 % away."""
    result = hcm.simulate(
        FINGER, SURFACE, SOFT_TIP,
        hcm.Drive((0.001624, -0.001624, 0.001624), 0.1),
    )  # fmt: skip
    assert result.status is hcm.Status.UNREPEATABLE


def test_a_folded_finger_whose_motion_repeats_completes() -> None:
    result = _driven(0.04, 1.2, estimate=True)
    assert folded(result, FINGER.length)
    assert result.status is hcm.Status.COMPLETED


LIGHT = replace(SOFT, youngs_modulus=1e8)
# torques of 1 N m that act at once: fixed steps without numerical damping
STEADY = hcm.Settings(flight_step=3e-7, flight_tolerance=0.0, contact_step=1e-7,
                      contact_tolerance=0.0, spectral_radius=1.0)  # fmt: skip


@pytest.mark.parametrize(
    ("phalanx", "tip", "torques", "settings"),
    [
        (HARD, HARD_TIP, (), hcm.Settings()),
        (SOFT, SOFT_TIP, (), hcm.Settings()),
        (LIGHT, SOFT_TIP, (0.01, 0.008, 0.002112), hcm.Settings()),
        (LIGHT, SOFT_TIP, (1.0, 0.8, 0.2112), STEADY),
        (LIGHT, SOFT_TIP, (1.0, 0.9, 0.3872), STEADY),
    ],
    ids=["hard", "soft", "driven-1", "driven-2", "driven-3"],
)
def test_the_papers_fingers_stay_stretched(
    phalanx: hcm.Phalanx, tip: hcm.Tip, torques: tuple[float, ...], settings: hcm.Settings
) -> None:
    """They are not solved a third time: the check costs them a look at the tip's path."""
    body = finger(phalanx, elements=3)
    settings = replace(settings, estimate=False)
    result = hcm.simulate(body, SURFACE, tip, hcm.Drive(torques), settings)
    assert result.status is hcm.Status.COMPLETED
    assert not folded(result, body.length)
    assert not grazes(result)


def test_what_changes_is_what_is_uncertain(one: hcm.TapResult) -> None:
    assert max(relative_errors(one.summary, companion_errors(one, one)).values()) < 1e-3
    summary = one.summary
    vx, vy = summary.tip_velocity_at_contact_m_per_s or (0.0, 0.0)
    faster = replace(one, summary=replace(summary, tip_velocity_at_contact_m_per_s=(vx, 1.1 * vy)))
    assert companion_errors(one, faster)["tip_velocity_at_contact_m_per_s"] == pytest.approx(
        (0.0, 0.1 * abs(vy)), abs=1e-9
    )
    lost = replace(one, summary=replace(summary, tip_velocity_at_contact_m_per_s=None))
    assert set(relative_errors(summary, companion_errors(one, lost)).values()) == {float("inf")}


def test_a_tap_that_barely_ends_says_so() -> None:
    """F_n falls to a thousandth of its peak: whether it ends there decides on half the impulse."""
    scene = (FINGER, hcm.Surface(0.1, 5.337), hcm.Tip(0.78e6, 0.05, 284.8))
    silent = hcm.simulate(*scene, settings=hcm.Settings(estimate=False))
    assert silent.status is hcm.Status.COMPLETED
    assert not folded(silent, FINGER.length)
    told = hcm.simulate(*scene)
    assert told.status is hcm.Status.UNREPEATABLE
    assert "0.1 times the tolerances change the normal impulse by" in told.message


def test_the_repetition_differs_in_any_case(one: hcm.TapResult) -> None:
    settings = hcm.Settings(flight_tolerance=0.0, end_time=1.0)
    fixed = rescaled_settings(settings, one, 2.0, 10**6)
    assert fixed.flight_step == pytest.approx(2 * settings.flight_step)
    assert fixed.contact_tolerance == 8 * settings.contact_tolerance
    assert fixed.end_time is None
    assert not fixed.estimate


def test_a_run_is_as_long_as_it_lasts_since_its_start() -> None:
    settings = hcm.Settings(end_time=100.2, max_steps=10_000)
    check_size(FINGER, settings, 100.0)
    with pytest.raises(hcm.ParameterError, match="end_time"):
        check_size(FINGER, settings, 0.0)


def test_a_completed_run_is_not_refused_for_its_repetition(one: hcm.TapResult) -> None:
    """Four times its steps would need more memory than allowed: as many as fit are asked for."""
    most = most_steps(FINGER)
    check_size(FINGER, hcm.Settings(max_steps=most))
    with pytest.raises(hcm.ParameterError):
        check_size(FINGER, hcm.Settings(max_steps=most + 1))
    assert rescaled_settings(hcm.Settings(max_steps=most), one, 0.5, most).max_steps == most
    assert rescaled_settings(hcm.Settings(max_steps=10), one, 0.5, most).max_steps == 40
    result = _driven(0.04, 1.2, estimate=True, max_steps=most)
    assert result.status is hcm.Status.COMPLETED


def test_an_end_time_is_no_sensitivity() -> None:
    """After a flight longer than others may be."""
    whole = _driven(0.04, 1.2, estimate=False).summary
    assert whole.contact_time_s is not None
    assert whole.contact_duration_s is not None
    end, patience = (
        whole.contact_time_s + 1.5 * whole.contact_duration_s,
        0.9 * whole.contact_time_s,
    )
    cut = _driven(0.04, 1.2, estimate=True, end_time=end, max_flight_time=patience)
    assert cut.status is hcm.Status.COMPLETED, cut.message
