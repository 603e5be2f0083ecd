"""Torques over time: closed forms, an independent integrator, and the order kept across kinks."""

import math
from dataclasses import replace

import numpy as np
import pytest

import hcm
from hcm.accuracy.chosen import settings_for
from hcm.flight.rigid_chain import acting_between, build_rods
from hcm.reference_solution import solve
from tests.hcm.cases import SOFT, SOFT_TIP, SURFACE, finger, order_of

# s and N m: a ramp, a jump, a plateau, a ramp to the other side; then held
RAMPS = hcm.TorqueTable(
    (0.004, 0.012, 0.012, 0.02, 0.033), ((0.0,), (8e-3,), (4e-3,), (4e-3,), (-6e-3,))
)
ROD = finger(SOFT, 1)
OVER = 0.04
ENDS = hcm.Settings(
    flight="rigid", end_time=OVER, flight_tolerance=1e-12, frame_times=(0.01, 0.03), estimate=False
)


def ramped(time: np.ndarray) -> np.ndarray:
    """RAMPS by a formula of their own."""
    up = 8e-3 * np.clip((time - 0.004) / 0.008, 0.0, 1.0) - 4e-3 * (time >= 0.012)
    return up - 1e-2 * np.clip((time - 0.02) / 0.013, 0.0, 1.0)


def turned(times: np.ndarray, start: float = 0.0) -> tuple[np.ndarray, np.ndarray]:
    """Angle and rate of a rod that only RAMPS turn: two sums over J w' = tau."""
    fine = np.linspace(0.0, OVER, 400_001)
    inertia = SOFT.density * SOFT.area * SOFT.length**3 / 3
    rate = np.concatenate([[0.0], np.cumsum(0.5 * np.diff(fine) * (
        ramped(fine)[1:] + ramped(fine)[:-1]))]) / inertia  # fmt: skip
    angle = start + np.concatenate([[0.0], np.cumsum(0.5 * np.diff(fine) * (rate[1:] + rate[:-1]))])
    return np.interp(times, fine, angle), np.interp(times, fine, rate)


@pytest.mark.parametrize(
    ("changes", "off"),
    [
        # the sums' own error where the torque jumps: a step of 1e-7 s times half the jump
        ({"flight": "rigid"}, 1e-5),
        # the beam bends by tau L/(E I), 1e-5 rad, and swings about that
        ({"flight": "elastic", "flight_tolerance": 1e-8}, 1e-4),
        ({"flight": "elastic", "flight_integrator": "gauss", "flight_tolerance": 1e-8}, 1e-4),
    ],
    ids=["rods", "generalized-alpha", "Gauss"],
)
def test_a_rod_turns_by_its_torque_table(changes: dict[str, object], off: float) -> None:
    drive, surface = hcm.Drive(gravity=0.0, table=RAMPS), hcm.Surface(0.0399, 0.5)
    run = hcm.simulate(ROD, surface, SOFT_TIP, drive, replace(ENDS, **changes))
    assert run.status is hcm.Status.COMPLETED
    history, inertia = run.history, SOFT.density * SOFT.area * SOFT.length**3 / 3
    angle, rate = turned(history.time_s)
    assert angle.max() > 0.1
    found = np.arctan2(-history.tip_position_m[:, 1], -history.tip_position_m[:, 0])
    assert np.abs(found - angle).max() < off
    # of 1e-3 J; what the beam stores is 2e-7 J at most
    assert history.drive_work_J == pytest.approx(0.5 * inertia * rate**2, abs=off * 1e-2)
    assert run.summary.energy_residual < 3e-5  # of damping: measured 1.5e-5
    # a kink is a step's end
    assert all(np.abs(history.time_s - kink).min() < 1e-14 for kink in RAMPS.time)
    assert [f.time_s for f in run.frames] == [0.01, 0.03]


def test_beams_follow_a_table_as_the_independent_integrator_says() -> None:
    body = finger(SOFT, 2, elements=2, youngs_modulus=1e7)
    table = hcm.TorqueTable((0.0, 0.002, 0.002), ((0.0, 0.0), (1.0, -0.2), (0.0, 0.15)))
    drive, end = hcm.Drive(reaction=True, table=table, incline=0.3), 0.004
    settings = hcm.Settings(end_time=end, flight_step=5e-7, flight_tolerance=0.0, estimate=False,
                            spectral_radius=1.0)  # fmt: skip
    surface = hcm.Surface(0.079, 0.5)
    own = hcm.simulate(body, surface, SOFT_TIP, drive, settings).history
    truth = solve(body, surface, SOFT_TIP, drive, end_time=end).end
    place = truth.coordinates[-4:-2]
    moved = np.linalg.norm(place - [-0.08, 0.0])
    assert moved > 1e-3
    # a jump of 1 N m swings the finger by all its might, which steps of 0.5 us follow to 1e-4
    assert np.linalg.norm(own.tip_position_m[-1] - place) < 2e-4 * moved


@pytest.mark.parametrize("jump", [False, True])
def test_the_order_is_kept_across_a_kink(jump: bool) -> None:
    body = finger(SOFT, 1, elements=2, youngs_modulus=1e6)
    last = ((5e-4,),) * 2 if jump else ()
    table = hcm.TorqueTable((0.0, 0.0101, *(0.0101,) * jump, 0.0153),
                            ((0.0,), (1e-3,), *last, (-1e-3,))[: 3 + jump])  # fmt: skip
    drive, surface = hcm.Drive(gravity=0.0, table=table), hcm.Surface(0.0399, 0.5)
    # below them the fastest vibration is not yet in phase
    steps = np.array([5e-6, 2.5e-6, 1.25e-6])
    truth = solve(body, surface, SOFT_TIP, drive, end_time=0.02).end.coordinates[-3]

    def error(step: float) -> float:
        settings = hcm.Settings(end_time=0.02, flight_step=step, flight_tolerance=0.0,
                                estimate=False, newton_tolerance=1e-12)  # fmt: skip
        run = hcm.simulate(body, surface, SOFT_TIP, drive, settings)
        return abs(float(run.history.tip_position_m[-1, 1] - truth))

    # measured 2.05 and 1.98
    assert order_of(steps, [error(step) for step in steps]) == pytest.approx(2.0, abs=0.1)


def test_a_table_of_one_row_is_a_constant_torque() -> None:
    row = (0.02, 0.0, 0.002)
    runs = [
        hcm.simulate(finger(SOFT), SURFACE, SOFT_TIP, drive, hcm.Settings(estimate=False))
        for drive in (
            hcm.Drive(row, reaction=True),
            hcm.Drive(reaction=True, table=hcm.TorqueTable((0.0,), (row,))),
            hcm.Drive(reaction=True, table=hcm.TorqueTable((0.0, 0.0), ((9.0,) * 3, row))),
        )
    ]
    for run in runs[1:]:
        assert run.summary == runs[0].summary
        assert np.array_equal(run.history.drive_work_J, runs[0].history.drive_work_J)


@pytest.mark.parametrize("reaction", [False, True])
@pytest.mark.parametrize(
    ("time", "first", "last"),
    [
        ((0.2, 0.2), 0.0, -2.0),  # after the tap at 0.136 s
        ((0.0, 0.0), -2.0, 0.0),
    ],
)
def test_torques_that_act_after_the_tap_or_never_change_no_choice(
    time: tuple[float, float], first: float, last: float, reaction: bool
) -> None:
    """They made the loads that rods leave out of it: 42,000 steps for 54, or a refused flight."""
    table = hcm.TorqueTable(time, ((first,) * 3, (last,) * 3))
    drives = hcm.Drive(), hcm.Drive(table=table, reaction=reaction)
    free, driven = (hcm.Scene(finger(SOFT), SURFACE, SOFT_TIP, drive) for drive in drives)
    own, other = (settings_for(1e-3, scene).scene for scene in (free, driven))
    assert other.finger == own.finger
    alike = replace(other.settings, newton_tolerance=own.settings.newton_tolerance)
    assert alike == own.settings
    rigid = replace(driven.settings, flight="rigid", estimate=False)
    run = hcm.simulate_scene(replace(driven, settings=rigid))
    assert run.status is hcm.Status.COMPLETED


@pytest.mark.parametrize("reaction", [False, True])
def test_largest_torques_at_a_rods_ends_are_those_of_the_time(reaction: bool) -> None:
    table = hcm.TorqueTable(
        (0.0, 0.1, 0.1, 0.3), ((1.0, -2.0), (3.0, 4.0), (0.0, 0.0), (-8.0, 6.0))
    )
    scene = finger(SOFT, 2), SURFACE, hcm.Drive(table=table, reaction=reaction)
    rods, pieces = build_rods(*scene)
    for end, joints in ((0.05, (2.0, 2.0)), (0.1, (3.0, 4.0)), (0.2, (4.0, 2.0 + 4.0))):
        # at 0.05 s (2, 1), at 0.2 s (-4, 3): linear between kinks; far longer than a vibration.
        # At 0.2 s the second joint has two jumps, of 2 and 4, whose vibrations may be in phase.
        found = acting_between(rods, pieces, 0.0, end).moment
        both = {0.05: 3.0, 0.1: 7.0, 0.2: 3.0 + 7.0}[end]
        # kinks add their change of rate over the frequency, some 60 N m/s over 2e4 1/s each
        assert found == pytest.approx([both if reaction else joints[0], joints[1]], rel=5e-3)


def test_a_torque_that_begins_just_before_the_end_has_bent_little() -> None:
    """The beam vibrates at sin(w t) of its full speed, w = (pi/L)^2 sqrt(E I/(rho A))."""
    frequency = (math.pi / SOFT.length) ** 2 * math.sqrt(SOFT.bending_stiffness / SOFT.line_density)
    table = hcm.TorqueTable((0.1, 0.1), ((0.0,), (-2.0,)))
    rods, pieces = build_rods(ROD, SURFACE, hcm.Drive(table=table))
    for passed in (1e-9, 1e-6, 1e-5):
        found = acting_between(rods, pieces, 0.0, 0.1 + passed).moment
        assert found == pytest.approx(2.0 * frequency * passed, rel=1e-6)


@pytest.mark.parametrize("early", [1e-6, 1e-5])
def test_a_kink_ends_no_flight_on_few_elements(early: float) -> None:
    """A torque that is up before the finger has moved is the constant one, to 1e-3 of the peak."""
    up = (1e-3, 0.0, 0.0)
    table = hcm.TorqueTable((0.0, early, 0.01), ((0.0, 0.0, 0.0), up, up))
    runs = [
        hcm.simulate_within(1e-3, hcm.Scene(finger(SOFT), SURFACE, SOFT_TIP, drive))
        for drive in (hcm.Drive(table=table), hcm.Drive(up))
    ]
    assert [run.status for run in runs] == [hcm.Status.COMPLETED] * 2
    peaks = [run.summary.peak_normal_force_N for run in runs]
    assert peaks[0] == pytest.approx(peaks[1], rel=1e-3)


def test_a_tap_goes_on_across_a_kink() -> None:
    # in the middle of the tap, with a torque that cannot move the finger in its 0.2 ms
    table = hcm.TorqueTable((0.0, 0.1362, 0.1362), ((0.0,) * 3, (0.0,) * 3, (1e-9,) * 3))
    free, kinked = (
        hcm.simulate(finger(SOFT), SURFACE, SOFT_TIP, drive, hcm.Settings(estimate=False))
        for drive in (hcm.Drive(), hcm.Drive(table=table))
    )
    assert kinked.status is hcm.Status.COMPLETED
    assert np.abs(kinked.history.time_s - 0.1362).min() < 1e-14
    assert [e.kind for e in kinked.events] == [e.kind for e in free.events]
    for name in ("peak_normal_force_N", "normal_impulse_N_s", "contact_duration_s"):
        assert getattr(kinked.summary, name) == pytest.approx(getattr(free.summary, name), rel=1e-5)


@pytest.mark.parametrize(
    ("time", "values", "named"),
    [
        ((), (), "at least one"),
        ((0.0, 1.0), ((0.0,),), "2 times and 1 rows"),
        ((0.0, math.nan), ((0.0,), (0.0,)), "time = nan"),
        ((-1.0,), ((0.0,),), "time = -1.0"),
        ((1.0, 0.5), ((0.0,), (0.0,)), "must not be before 1.0"),
        ((1.0, 1.0, 1.0), ((0.0,),) * 3, "third equal"),
        ((0.0,), ((math.inf,),), "values = inf"),
        ((0.0, 1.0), ((0.0, 0.0), ()), "rows of 0 and 2 values: each must have one"),
    ],
)
def test_impossible_tables_are_refused(
    time: tuple[float, ...], values: tuple[tuple[float, ...], ...], named: str
) -> None:
    with pytest.raises(hcm.ParameterError, match=named):
        hcm.TorqueTable(time, values)


def test_a_table_that_does_not_fit_is_refused() -> None:
    table = hcm.TorqueTable((0.0,), ((0.0, 0.0),))
    with pytest.raises(hcm.ParameterError, match="one per phalanx"):
        hcm.simulate(finger(SOFT), SURFACE, SOFT_TIP, hcm.Drive(table=table))
    empty = hcm.TorqueTable((0.0,), ((),))
    with pytest.raises(hcm.ParameterError, match=r"0 values: must be one per phalanx \(3\)$"):
        hcm.simulate(finger(SOFT), SURFACE, SOFT_TIP, hcm.Drive(table=empty))
    with pytest.raises(hcm.ParameterError, match="where a table is given"):
        hcm.Drive((1.0, 1.0), table=table)
