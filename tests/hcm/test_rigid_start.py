"""The reduced model from a given rigid state."""

import math
from dataclasses import replace
from typing import Literal

import numpy as np
import pytest

import hcm
from hcm.beam.chain import build_chain
from hcm.model import rigid_motion
from tests.hcm.cases import SOFT, SOFT_TIP, SURFACE, finger

FINGER = finger(SOFT)
# The thin-rod chain's state 2 us before it touches (angles in rad, rates in rad/s).
IMPACT = hcm.RigidStart(
    (1.2251485, 1.2230944, 0.6673452), (10.6411766, 8.3001715, 44.4682055), 0.136105036
)


def test_rest_is_the_start_at_zero_angles() -> None:
    chain, rest = build_chain(FINGER, hcm.Drive())
    q, v = rigid_motion(FINGER, chain, hcm.RigidStart((0.0,) * 3, (0.0,) * 3))
    assert np.allclose(q, rest, rtol=0, atol=1e-17)
    assert not v.any()


def test_phalanges_are_unstrained_and_the_hinges_hold() -> None:
    chain, _ = build_chain(FINGER, hcm.Drive())
    q, v = rigid_motion(FINGER, chain, IMPACT)
    for inner, outer in zip(chain.hinge_inner[1:], chain.hinge_outer[1:], strict=True):
        assert np.array_equal(q[inner : inner + 2], q[outer : outer + 2])
        assert np.array_equal(v[inner : inner + 2], v[outer : outer + 2])
    assert q[chain.tip + 1] == pytest.approx(-0.04 * np.sin(IMPACT.angles).sum(), rel=1e-14)
    speed = -0.04 * np.cos(IMPACT.angles) @ np.array(IMPACT.rates)
    assert v[chain.tip + 1] == pytest.approx(speed, rel=1e-14)
    # A unit tangent that turns keeps its length: r'.v' = 0.
    places = [*chain.first, chain.second[-1]]
    assert all(abs(q[p + 2 : p + 4] @ v[p + 2 : p + 4]) < 1e-12 for p in places)


def test_an_impact_state_gives_the_tap_of_the_whole_fall() -> None:
    fall = hcm.simulate(FINGER, SURFACE, SOFT_TIP).summary
    skipped = hcm.simulate(FINGER, SURFACE, SOFT_TIP, start=IMPACT).summary
    assert skipped.contact_time_s == pytest.approx(0.136107036, abs=1e-7)
    # Vibrations that the fall excites move the peak by less than 1e-3.
    assert skipped.peak_normal_force_N == pytest.approx(fall.peak_normal_force_N, rel=1e-3)
    assert skipped.contact_duration_s == pytest.approx(fall.contact_duration_s, rel=1e-3)


@pytest.mark.parametrize("assumptions", ["paper", "refined"])
def test_an_inclined_frame_changes_no_motion(assumptions: Literal["paper", "refined"]) -> None:
    incline = 0.5
    body = finger(SOFT, 2, elements=4, youngs_modulus=1e6, poisson_ratio=0.4)
    assumed = hcm.Assumptions(assumptions)
    settings = hcm.Settings(end_time=0.05, flight_tolerance=0.0, newton_tolerance=1e-12)
    drive = hcm.Drive((1e-3, -2e-4), reaction=True)
    surface = hcm.Surface(0.079, 0.5)
    level = hcm.simulate(
        body, surface, SOFT_TIP, drive, settings, assumptions=assumed
    ).history  # fmt: skip
    tilted = hcm.simulate(
        body, surface, SOFT_TIP, replace(drive, incline=incline), settings,
        start=hcm.RigidStart((-incline,) * 2, (0.0,) * 2), assumptions=assumed,
    ).history  # fmt: skip
    turn = math.cos(incline) + 1j * math.sin(incline)
    places = (h.tip_position_m @ [1.0, 1.0j] for h in (level, tilted))
    seen, own = places
    assert abs(own[-1] - own[0]) > 0.01
    # Newton's tolerance of 1e-12 of the accelerations, in 500 steps
    assert np.abs(own * turn - seen).max() < 1e-11
    assert np.abs(level.gravity_energy_J - tilted.gravity_energy_J).max() < 1e-11


@pytest.mark.parametrize(
    ("start", "named"),
    [
        (((0.1, 0.2), (0.0, 0.0, 0.0)), "2 angles and 3 rates"),
        (((0.1, 0.2, math.nan), (0.0,) * 3), "angles = nan: must be a finite number in rad"),
        (((1.57,) * 3, (0.0,) * 3), "below the surface"),
    ],
)
def test_impossible_starts_are_refused(
    start: tuple[tuple[float, ...], tuple[float, ...]], named: str
) -> None:
    with pytest.raises(hcm.ParameterError, match=named):
        hcm.simulate(FINGER, SURFACE, SOFT_TIP, start=hcm.RigidStart(*start))


def test_a_tip_that_starts_on_the_surface_is_refused() -> None:
    on = hcm.Surface(0.04 * math.sin(0.5), 0.5)
    with pytest.raises(hcm.ParameterError, match="put the tip 0 m below the surface"):
        hcm.simulate(finger(SOFT, 1), on, SOFT_TIP, start=hcm.RigidStart((0.5,), (30.0,)))


def test_a_single_phalanx_has_no_hinge_below_its_line() -> None:
    settings = hcm.Settings(flight="rigid", end_time=1e-3, frame_times=(5e-4,))
    run = hcm.simulate(finger(SOFT, 1), hcm.Surface(0.03, 0.5), SOFT_TIP, settings=settings)
    assert not run.frames[0].is_concave


def test_progress_counts_from_the_start() -> None:
    fractions = list[float]()
    settings = hcm.Settings(
        end_time=100.005, flight_step=1e-6, flight_tolerance=0.0, estimate=False
    )
    start = hcm.RigidStart((0.1,), (0.0,), 100.0)
    hcm.simulate(
        finger(SOFT, 1), hcm.Surface(0.03, 0.5), SOFT_TIP, settings=settings, start=start,
        progress=lambda part, _: fractions.append(part),
    )  # fmt: skip
    assert fractions[-1] == pytest.approx(1.0)
    assert 0.0 < fractions[0] < 0.999  # 100/100.005 is more
