"""The fall of the phalanges as rods: what it predicts of a tap, and what it leaves out."""

from dataclasses import replace

import numpy as np
import pytest

import hcm
from hcm.accuracy.simulate_within import simulate_within
from hcm.beam.chain import build_chain
from hcm.beam.outline import build_outline, depth
from hcm.flight.fall import RODS_TOLERANCE, magnified, omitted_time, rods_fall, slowest_frequency
from hcm.flight.rigid_chain import body_depth, build_rods
from hcm.model import rigid_motion
from hcm.simulate import solve_once
from tests.hcm.cases import NO_ESTIMATE, SOFT, SOFT_SCENE, finger


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


def test_a_falls_time_is_counted_from_its_start() -> None:
    """The same fall a second later."""
    still = (0.0,) * 3
    one, other = (
        rods_fall(replace(SOFT_SCENE, start=hcm.RigidStart(still, still, at))) for at in (0.0, 1.0)
    )
    assert one is not None
    assert other is not None
    # the touch is located to the surface's tolerance, 1e-6 of its height
    assert other.time == pytest.approx(one.time, rel=1e-5)


def test_a_fall_that_magnifies_its_start_says_so() -> None:
    """From upright a chain tumbles, to another touch for 1e-5 rad more. A plain fall does not,
    nor does a turn about one hinge by more than π.
    """
    upright = hcm.RigidStart((-1.6,) * 3, (0.0,) * 3)
    about = replace(SOFT_SCENE, start=hcm.RigidStart((-3.6,) * 3, (1.0,) * 3))
    tumbles = replace(SOFT_SCENE, start=upright)
    told = [magnified(scene, fall) for scene in (SOFT_SCENE, about, tumbles)
            if (fall := rods_fall(scene))]  # fmt: skip
    assert told[:2] == [(), ()]
    ((caution,),) = told[2:]
    assert "angles changed by 1e-05 rad change which touch it comes to" in caution
    judged = replace(tumbles, settings=replace(tumbles.settings, estimate=True))
    stated = simulate_within(1e-2, judged)
    assert caution in stated.cautions


def test_a_falls_sections_sink_as_those_of_straight_beams() -> None:
    """Where the tip is above the surface by as much at least, in any state of the fall."""
    scene = replace(SOFT_SCENE, surface=hcm.Surface(0.04, 0.5))
    fall = rods_fall(scene)
    assert fall is not None
    chain, _ = build_chain(scene.finger, hcm.Drive())
    outline, sunk = build_outline(scene.finger, scene.surface.height), []
    for state in fall.flight.states:
        start = hcm.RigidStart(tuple(state[:3].tolist()), (0.0,) * 3)
        below = depth(rigid_motion(scene.finger, chain, start)[0], chain, outline)[0]
        tip = scene.surface.height - SOFT.length * np.sin(state[:3]).sum()
        sunk.append(min(below, tip))
    assert fall.sunk == pytest.approx(max(sunk), abs=1e-12)  # round-off
