"""Scenes at the edge: every one ends with a result or a clear status, and never with NaN."""

import math
from dataclasses import fields, replace

import numpy as np
import pytest

import hcm
from tests.hcm.cases import HARD, HARD_TIP, SOFT, SOFT_TIP, SURFACE, finger

QUICK = hcm.Settings(max_flight_time=0.3, max_steps=60_000)


def assert_finite(result: hcm.TapResult) -> None:
    history = result.history
    for field in fields(history):
        assert np.isfinite(getattr(history, field.name)).all(), field.name
    assert np.diff(history.time_s).min(initial=0.0) >= 0
    for field in fields(result.summary):
        value = getattr(result.summary, field.name)
        assert value is None or np.all(np.isfinite(value)), field.name
    if result.status is not hcm.Status.COMPLETED:
        assert result.message
        assert result.status.advice


@pytest.mark.parametrize(
    ("body", "height"),
    [
        (finger(HARD, 1), 0.03),
        (finger(HARD, 5), 0.16),
        (finger(HARD, 2, elements=1), 0.05),
        (
            hcm.Finger(
                (
                    replace(HARD, length=0.05, diameter=0.02),
                    replace(SOFT, length=0.02, elements=3),
                    replace(SOFT, length=0.03, diameter=0.01, elements=7),
                )
            ),
            0.08,
        ),
    ],
    ids=["one", "five", "coarsest", "unequal"],
)
def test_any_number_of_phalanges(body: hcm.Finger, height: float) -> None:
    result = hcm.simulate(body, hcm.Surface(height, 0.5), SOFT_TIP)
    assert result.status is hcm.Status.COMPLETED
    assert result.history.hinge_reactions_N.shape[1:] == (len(body.phalanges), 2)
    assert_finite(result)
    assert result.summary.energy_residual < 1e-4


def test_surface_never_reached() -> None:
    result = hcm.simulate(finger(SOFT), SURFACE, SOFT_TIP, hcm.Drive((), -9.8), QUICK)
    assert result.status is hcm.Status.NOT_REACHED
    assert result.summary.peak_normal_force_N is None
    assert result.events == ()
    assert_finite(result)


def test_nothing_moves_without_gravity() -> None:
    result = hcm.simulate(finger(SOFT), SURFACE, SOFT_TIP, hcm.Drive((), 0.0), QUICK)
    assert result.status is hcm.Status.NOT_REACHED
    # the slopes' round-off strains the bar by 1e-16
    assert np.abs(result.history.tip_position_m[:, 1]).max() < 1e-12
    # two round-offs, one over the other, say nothing: the audit's error counts against what strains
    # of 1e-8 would hold, as `simulate` does when it judges a run
    assert result.summary.energy_residual < 1e-9
    assert_finite(result)


def test_permanent_contact() -> None:
    """A torque that holds the tip down: bounces die out, and the time in contact runs out."""
    settings = hcm.Settings(end_time=1.0, max_contact_time=2e-3, contact_step=1e-6)
    result = hcm.simulate(
        finger(HARD, 1, elements=2), hcm.Surface(0.03, 0.0), replace(SOFT_TIP, restitution=0.5),
        hcm.Drive((0.5,)), settings,
    )  # fmt: skip
    assert result.status is hcm.Status.STILL_IN_CONTACT
    assert result.history.normal_force_N[-1] > 0
    assert_finite(result)


def test_contact_that_lasts_too_long_keeps_its_history() -> None:
    settings = hcm.Settings(max_contact_time=5e-5)
    result = hcm.simulate(finger(SOFT), SURFACE, SOFT_TIP, settings=settings)
    assert result.status is hcm.Status.STILL_IN_CONTACT
    assert result.summary.contact_duration_s is None
    assert result.history.time_s[-1] - result.summary.contact_time_s == pytest.approx(
        5e-5, abs=2e-7
    )
    assert_finite(result)


def test_work_limit_keeps_the_history() -> None:
    result = hcm.simulate(finger(SOFT), SURFACE, SOFT_TIP, settings=hcm.Settings(max_steps=100))
    assert result.status is hcm.Status.WORK_LIMIT
    assert result.statistics.steps == 100
    assert result.history.time_s.size == 101
    assert_finite(result)


def test_start_from_zero_acceleration_costs_half_a_short_step() -> None:
    """A fuzzed scene, cut down: in a fall of nine flight steps half of the first one was lost.

    With half of the first step's weight left out the finger is late by half of that step.
    """
    body, start = finger(HARD, 2, elements=4), hcm.RigidStart((0.5, 0.5), (0.0, 0.0))
    low = hcm.Surface(body.length * math.sin(0.5) + 3e-6, 0.0)
    prompt, late = (
        hcm.simulate(
            body, low, HARD_TIP, settings=hcm.Settings(consistent_start=consistent), start=start
        )
        for consistent in (True, False)
    )
    delay = late.summary.contact_time_s - prompt.summary.contact_time_s
    # 0.90 measured; the two runs do not take the same steps
    assert delay == pytest.approx(hcm.Settings().contact_step / 2, rel=0.2)


def test_interrupt_keeps_the_history() -> None:
    def stop(fraction: float, doing: str) -> None:
        assert 0 <= fraction <= 1
        assert doing
        raise KeyboardInterrupt

    # more steps than one table of the loop holds, so that the callback comes before the end
    settings = hcm.Settings(flight_step=1e-5)
    result = hcm.simulate(finger(SOFT), SURFACE, SOFT_TIP, settings=settings, progress=stop)
    assert result.status is hcm.Status.INTERRUPTED
    assert result.history.time_s.size == result.statistics.steps + 1 > 1000
    assert_finite(result)


@pytest.mark.parametrize("torques", [(0.0, 0.0, 3.0), (-3.0, 0.0, 0.0), (5.0, -5.0, 5.0)])
def test_torque_that_winds_the_finger_up(torques: tuple[float, ...]) -> None:
    result = hcm.simulate(finger(SOFT), SURFACE, SOFT_TIP, hcm.Drive(torques), QUICK)
    assert isinstance(result.status, hcm.Status)
    assert_finite(result)


@pytest.mark.parametrize(
    ("phalanx", "tip", "friction"),
    [
        (replace(SOFT, youngs_modulus=1e5), SOFT_TIP, 0.5),
        (replace(HARD, youngs_modulus=1e14), HARD_TIP, 0.5),
        (replace(SOFT, density=1e-2), SOFT_TIP, 0.5),
        (replace(SOFT, density=1e6), SOFT_TIP, 0.5),
        (replace(SOFT, diameter=1e-4), SOFT_TIP, 0.5),
        (SOFT, hcm.Tip(1e-3), 0.5),
        (SOFT, hcm.Tip(1e12), 0.5),
        (SOFT, replace(SOFT_TIP, restitution=1e-2), 0.5),
        (SOFT, replace(SOFT_TIP, tangential_ratio=1e6), 0.5),
        (SOFT, replace(SOFT_TIP, tangential_ratio=1e-9), 0.5),
        (SOFT, SOFT_TIP, 1e9),
        (SOFT, SOFT_TIP, 1e-12),
    ],
)
def test_extreme_parameters(phalanx: hcm.Phalanx, tip: hcm.Tip, friction: float) -> None:
    body = finger(phalanx, 1, elements=3)
    result = hcm.simulate(body, hcm.Surface(0.03, friction), tip, settings=QUICK)
    assert isinstance(result.status, hcm.Status)
    assert_finite(result)


@pytest.mark.parametrize("height", [0.00750001, 0.1199999])
def test_surface_at_the_ends_of_reach(height: float) -> None:
    result = hcm.simulate(finger(SOFT), hcm.Surface(height, 0.5), SOFT_TIP, settings=QUICK)
    assert_finite(result)


def test_steps_too_long_for_the_motion_are_not_a_result() -> None:
    """A millisecond per step under a torque that rings at kilohertz: the audit says so."""
    driven = hcm.Finger((hcm.Phalanx(0.04, 0.015, 1e8, 1400.0, 20),) * 3)
    settings = hcm.Settings(flight_step=1e-3, flight_tolerance=0.0)
    drive = hcm.Drive((1.0, 0.8, 0.2112))
    result = hcm.simulate(driven, hcm.Surface(0.1, 0.5), hcm.Tip(0.78e6), drive, settings)
    assert result.status is hcm.Status.UNBALANCED
    assert "flight_tolerance" in result.status.advice
    assert result.summary.energy_residual > 0.1
    assert result.history.time_s.size > 1


@pytest.mark.parametrize(("tolerance", "first"), [(0.0, 1e-4), (1e-6, 1e-6)])
def test_a_controlled_start_from_no_acceleration_is_short(tolerance: float, first: float) -> None:
    """The first step leaves out half its loads; equal steps stay equal."""
    settings = hcm.Settings(
        consistent_start=False, flight_tolerance=tolerance, flight_step=1e-4, contact_step=1e-6,
        end_time=5e-4, estimate=False,
    )  # fmt: skip
    time = hcm.simulate(finger(SOFT), SURFACE, SOFT_TIP, settings=settings).history.time_s
    assert time[1] == pytest.approx(first, rel=1e-9)
