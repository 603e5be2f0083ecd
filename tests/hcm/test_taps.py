"""Whole taps of the paper's fingers: known-good values, friction, restitution, energy, symmetry."""

from dataclasses import replace

import numpy as np
import pytest

import hcm
from hcm.reference_solution import ChainStart
from tests.hcm.cases import (
    HARD,
    HARD_TIP,
    SOFT,
    SOFT_LAW,
    SOFT_TIP,
    SURFACE,
    finger,
    integrate,
    straight_links,
)

WHOLE_TAP = ["contact", "compression_to_restitution", "separation"]


def kinds(result: hcm.TapResult) -> list[str]:
    return [event.kind for event in result.events]


@pytest.fixture(scope="module")
def soft() -> hcm.TapResult:
    return hcm.simulate(finger(SOFT), SURFACE, SOFT_TIP)


@pytest.fixture(scope="module")
def hard() -> hcm.TapResult:
    return hcm.simulate(finger(HARD), SURFACE, HARD_TIP)


def test_soft_finger(soft: hcm.TapResult) -> None:
    """Values of two other solvers, and the spread between these."""
    summary = soft.summary
    assert soft.status is hcm.Status.COMPLETED
    assert kinds(soft) == WHOLE_TAP
    assert summary.contact_time_s == pytest.approx(0.136107, abs=1e-6)
    np.testing.assert_allclose(
        summary.tip_velocity_at_contact_m_per_s, (1.8136, -1.6544), atol=1e-4
    )
    tip = soft.history.tip_position_m[np.searchsorted(soft.history.time_s, summary.contact_time_s)]
    np.testing.assert_allclose(tip, (-0.0586, -0.1), atol=5e-5)
    assert summary.peak_normal_force_N == pytest.approx(64.46, abs=0.02)
    assert summary.peak_normal_force_time_s == pytest.approx(102.3e-6, abs=0.5e-6)
    assert summary.contact_duration_s == pytest.approx(232.4e-6, abs=0.1e-6)
    # R lies in an element's middle at 5 elements: 2 % off the value at 20
    assert summary.peak_stress_R_Pa == pytest.approx(2.24e6, rel=0.03)
    assert summary.compression_to_restitution == 1
    assert (summary.stick_to_slip, summary.slip_to_stick, summary.reverse_slip) == (0, 0, False)


def test_hard_finger(hard: hcm.TapResult) -> None:
    summary = hard.summary
    assert kinds(hard) == WHOLE_TAP
    assert summary.peak_normal_force_N == pytest.approx(173.0, abs=0.1)
    assert summary.peak_normal_force_time_s == pytest.approx(35.9e-6, abs=0.1e-6)
    assert summary.contact_duration_s == pytest.approx(70.9e-6, abs=0.1e-6)


@pytest.mark.parametrize("scene", ["soft", "hard"])
def test_gross_slip_keeps_coulombs_ratio(scene: str, request: pytest.FixtureRequest) -> None:
    result = request.getfixturevalue(scene)
    history, summary = result.history, result.summary
    np.testing.assert_allclose(
        history.tangential_force_N, -0.5 * history.normal_force_N, rtol=1e-12, atol=1e-12
    )
    ratio = summary.peak_tangential_force_N / summary.peak_normal_force_N
    # Ft is a sample, Fn the parabola's vertex through three
    assert ratio == pytest.approx(-0.5, abs=1e-6)
    assert np.all(history.normal_force_N >= -1e-6)


@pytest.mark.parametrize("elements", [10, pytest.param(20, marks=pytest.mark.slow),
                                      pytest.param(40, marks=pytest.mark.slow)])  # fmt: skip
@pytest.mark.parametrize("scene", ["soft", "hard"])
def test_peak_hardly_depends_on_the_mesh(
    scene: str, elements: int, request: pytest.FixtureRequest
) -> None:
    coarse = request.getfixturevalue(scene).summary.peak_normal_force_N
    phalanx, tip = (SOFT, SOFT_TIP) if scene == "soft" else (HARD, HARD_TIP)
    fine = hcm.simulate(finger(phalanx, elements=elements), SURFACE, tip)
    assert fine.summary.peak_normal_force_N == pytest.approx(coarse, rel=2e-4)


def test_restitution_lowers_the_impulse(soft: hcm.TapResult) -> None:
    """7.7 % at e* = 0.8; up to the turn the tap is the same."""
    lossy = hcm.simulate(finger(SOFT), SURFACE, replace(SOFT_TIP, restitution=0.8))
    ratio = lossy.summary.normal_impulse_N_s / soft.summary.normal_impulse_N_s
    assert 1 - ratio == pytest.approx(0.077, abs=5e-4)
    assert lossy.summary.first_peak_normal_force_N == pytest.approx(
        soft.summary.first_peak_normal_force_N, rel=1e-12
    )
    # F_n has a kink at its peak: the located turn, not the vertex of a parabola across it
    assert lossy.summary.peak_normal_force_N == lossy.summary.first_peak_normal_force_N
    lost = lossy.history.restitution_dissipation_J
    stored = 0.5 * lossy.summary.first_peak_normal_force_N**2 / SOFT_TIP.normal_stiffness
    assert lost[-1] == pytest.approx(stored * (1 - 0.8**2), rel=1e-9)


def test_no_friction_by_either_parameter() -> None:
    free = hcm.simulate(finger(SOFT), replace(SURFACE, friction=0.0), SOFT_TIP)
    slack = hcm.simulate(finger(SOFT), SURFACE, replace(SOFT_TIP, tangential_ratio=0.0))
    np.testing.assert_array_equal(free.history.normal_force_N, slack.history.normal_force_N)
    assert kinds(free) == kinds(slack)
    assert np.all(free.history.tangential_force_N == 0.0)
    assert np.all(free.history.mode % 3 == 0)
    # without friction and with e* = 1 nothing is lost: 1e-4 is the promise, 3e-6 measured
    assert free.summary.energy_residual < 1e-4


@pytest.mark.parametrize(
    ("mu", "restitution", "ratio"), [(0.5, 1.0, 0.75), (1.0, 0.8, 0.75), (1.3, 0.6, 0.75),
                                     (0.7, 0.9, 1.5)]
)  # fmt: skip
def test_audit_closes_and_dissipation_only_grows(
    mu: float, restitution: float, ratio: float
) -> None:
    result = hcm.simulate(
        finger(SOFT), replace(SURFACE, friction=mu),
        replace(SOFT_TIP, restitution=restitution, tangential_ratio=ratio),
    )  # fmt: skip
    assert result.status is hcm.Status.COMPLETED
    history = result.history
    largest = history.kinetic_energy_J.max()
    assert np.abs(history.energy_balance_J).max() < 1e-4 * largest  # 1e-3 promised
    # an event that is located to 1e-15 s may step back by round-off
    for loss in (history.friction_dissipation_J, history.restitution_dissipation_J):
        assert np.diff(loss).min() > -1e-12 * largest
    assert history.friction_dissipation_J[-1] > 1e-3 * largest or mu > 1


def test_mirrored_scene_gives_the_mirrored_tap() -> None:
    """X -> -X of the state at impact: same normal force, opposite tangential force."""
    chain, start = straight_links(finger(SOFT, elements=3))
    flip = np.ones(chain.scale.size)
    for place in {*chain.first, *chain.second}:
        flip[[place, place + 2]] = -1.0
    mirrored = ChainStart(flip * start.coordinates, flip * start.velocities)
    one, two = (integrate(chain, SOFT_LAW, s, 1e-7) for s in (start, mirrored))
    assert one.kinds() == two.kinds()
    signs = {"normal_force": 1, "tangential_force": -1, "tip_x": -1, "tip_y": 1}
    for column, sign in signs.items():
        expected = sign * one[column]
        np.testing.assert_allclose(two[column], expected, atol=1e-12 * np.abs(expected).max())


def test_further_taps_to_an_end_time() -> None:
    """After separation the finger flies on, rises, falls and taps again; the audit goes on."""
    short = hcm.Finger((replace(HARD, elements=2),))
    settings = hcm.Settings(end_time=0.25)
    result = hcm.simulate(
        short, hcm.Surface(0.03, 0.2), replace(HARD_TIP, restitution=0.6), settings=settings
    )
    assert result.status is hcm.Status.COMPLETED
    history = result.history
    assert history.time_s[-1] == pytest.approx(0.25, rel=1e-9)
    touches = [e.time_s for e in result.events if e.kind == "contact"]
    leaves = [e.time_s for e in result.events if e.kind == "separation"]
    assert len(touches) >= 2
    assert all(a < b for a, b in zip(touches, leaves, strict=False))
    between = (history.time_s > leaves[0]) & (history.time_s < touches[1])
    assert history.tip_position_m[between, 1].max() > -0.03
    assert np.all(history.normal_force_N[between] == 0.0)
    # the summary is the first tap's
    assert result.summary.contact_time_s == touches[0]
    assert result.summary.contact_duration_s == pytest.approx(leaves[0] - touches[0])


def test_taps_ends_at_the_last_wanted_separation() -> None:
    short = hcm.Finger((replace(HARD, elements=2),))
    result = hcm.simulate(
        short, hcm.Surface(0.03, 0.0), replace(HARD_TIP, restitution=0.6),
        settings=hcm.Settings(taps=2),
    )  # fmt: skip
    assert kinds(result).count("separation") == 2
    assert kinds(result)[-1] == "separation"


def test_factors_that_serve_again_change_no_result() -> None:
    """`reuse_factors` is a shortcut of Newton's method: the root is the same to its tolerance."""
    runs = [
        hcm.simulate(finger(SOFT), SURFACE, SOFT_TIP, settings=hcm.Settings(reuse_factors=reuse))
        for reuse in (True, False)
    ]
    with_it, without = (run.statistics for run in runs)
    assert with_it.factorizations < 0.6 * with_it.newton_iterations
    assert without.factorizations >= without.newton_iterations
    for name in ("contact_time_s", "peak_normal_force_N", "contact_duration_s"):
        values = [getattr(run.summary, name) for run in runs]
        # Newton's tolerance of 1e-9 on accelerations, over thousands of steps of a tap that
        # amplifies little
        assert values[0] == pytest.approx(values[1], rel=1e-5)


def test_a_smaller_finger_takes_as_many_steps() -> None:
    """Lengths, times and k times s, gravity over s, the same E: the same motion, s times as fast.

    Powers of 2 leave every rounding as it is; the flight's tolerance is none of the scaled.
    """
    found = []
    for s in (1.0, 2.0**-7):
        phalanx = replace(SOFT, length=SOFT.length * s, diameter=SOFT.diameter * s)
        settings = hcm.Settings(
            flight_step=1e-4 * s, contact_step=1e-6 * s, contact_tolerance=1e-11 * s, estimate=False
        )
        tap = hcm.simulate(
            finger(phalanx, youngs_modulus=1e8), hcm.Surface(0.1 * s, 0.5), hcm.Tip(0.78e6 * s),
            hcm.Drive(gravity=9.8 / s), settings,
        )  # fmt: skip
        assert tap.summary.contact_time_s is not None
        assert tap.summary.peak_normal_force_N is not None
        found.append(
            (
                tap.statistics.steps,
                tap.summary.contact_time_s / s,
                tap.summary.peak_normal_force_N / s**2,
            )
        )
    assert found[1] == pytest.approx(found[0], rel=1e-9)
