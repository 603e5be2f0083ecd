"""The optional rigid flight: thin rods against closed forms, ANCF's own matrices and the beams."""

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import quad

import hcm
from hcm.assembly.equations import residual
from hcm.assembly.state import StepLimits, initial_totals
from hcm.beam.chain import build_chain
from hcm.contact.law import IN_FLIGHT, contact_law
from hcm.flight.fall import RODS_TOLERANCE, rods_fall
from hcm.flight.rigid_chain import (
    Rods,
    acting_between,
    build_rods,
    clearance,
    rates,
    reactions,
)
from hcm.flight.rigid_flight import ENDED, TOUCHED, RigidFlight, integrate_flight
from hcm.model import rigid_motion
from hcm.simulate import LARGEST_LEFT_OUT, solve_once
from tests.hcm.cases import HARD, HARD_TIP, NO_ESTIMATE, SOFT, SOFT_TIP, SURFACE, finger

G = 9.8
RIGID = hcm.Settings(flight="rigid", flight_step=0.01)


def limits(tolerance: float, step: float = 0.01, end: float = math.inf) -> StepLimits:
    return StepLimits(step, 1e-6, 1, end, tolerance, 0.0, 2.0, 1.0)


def one_rod(
    height: float, tolerance: float, step: float = 0.01, incline: float = 0.0
) -> tuple[Rods, RigidFlight]:
    """It sets out level."""
    drive = hcm.Drive(incline=incline)
    chain = build_rods(finger(SOFT, 1), hcm.Surface(height, 0.5), drive)[0]
    start = np.array([-incline, 0.0])
    return chain, integrate_flight(chain, start, 0.0, limits(tolerance, step), 10_000)


@pytest.mark.parametrize("incline", [0.0, 0.35, -0.35])
def test_a_falling_rod_keeps_its_energy_and_lands_in_time(incline: float) -> None:
    # omega^2 = 3 g sin(theta)/L, theta from the level, t = int dtheta/omega; sqrt(theta) = s takes
    # out the singularity
    height, length = 0.035, SOFT.length
    chain, fall = one_rod(height, 1e-13, incline=incline)
    touch = math.asin(height / length)
    angle = touch + incline
    speed = math.sqrt(3 * G * math.sin(angle) / length)
    time, _ = quad(
        lambda s: 2 * s / math.sqrt(3 * G * math.sin(s * s) / length), 0, math.sqrt(angle)
    )
    assert fall.code == TOUCHED
    assert abs(clearance(fall.states[-1], chain)[0]) < 1e-15
    assert fall.states[-1] == pytest.approx([touch, speed], rel=1e-10)
    assert fall.time[-1] == pytest.approx(time, rel=1e-10)


def test_a_touch_is_located_as_closely_as_its_flight_can_tell() -> None:
    """Two trials, by a cubic and by Newton: down to round-off it took four."""
    tolerance = 2e-4
    rods = build_rods(finger(SOFT), SURFACE, hcm.Drive())[0]
    fall = integrate_flight(rods, np.zeros(6), 0.0, limits(tolerance, 0.03), 10_000)
    assert fall.code == TOUCHED
    assert abs(clearance(fall.states[-1], rods)[0]) <= 1e-6 * tolerance
    assert fall.trials <= 2


def test_fixed_steps_converge_with_order_five() -> None:
    chain = build_rods(finger(SOFT), hcm.Surface(0.1, 0.5), hcm.Drive())[0]
    end = [
        integrate_flight(chain, np.zeros(6), 0.0, limits(0.0, 0.08 / n, 0.08), 999).states[-1]
        for n in (32, 64, 640)
    ]
    coarse, fine = (np.abs(state - end[2]).max() for state in end[:2])
    assert 4.6 < math.log2(coarse / fine) < 5.4


@pytest.mark.parametrize("reaction", [False, True])
def test_rods_move_as_beams_that_neither_bend_nor_stretch(reaction: bool) -> None:
    # the beams' forces at a rigid state, projected on the directions of rigid motion, vanish
    body = hcm.Finger((
        replace(SOFT, length=0.05, elements=2), replace(SOFT, diameter=0.02, elements=3),
        replace(SOFT, density=900.0, elements=1, relaxation_time=1e-3),
    ))  # fmt: skip
    drive = hcm.Drive((0.01, -0.02, 0.005), G, reaction, incline=0.4)
    chain, _ = build_chain(body, drive)
    law = contact_law(SURFACE, SOFT_TIP)
    rng = np.random.default_rng(5)
    angles, spins = rng.uniform(-1.5, 1.5, 3), rng.uniform(-20, 20, 3)
    state, out = np.array([*angles, *spins]), np.empty(6)
    rates(0.0, state, build_rods(body, SURFACE, drive)[0], out)

    def velocity(turn: np.ndarray, spin: np.ndarray) -> np.ndarray:
        return rigid_motion(body, chain, hcm.RigidStart(tuple(turn), tuple(spin)))[1]

    step = 1e-6
    later = velocity(angles + step * spins, spins + step * out[3:])
    before = velocity(angles - step * spins, spins - step * out[3:])
    q, v = rigid_motion(body, chain, hcm.RigidStart(tuple(angles), tuple(spins)))
    forces = np.empty_like(q)
    contact = IN_FLIGHT
    residual(q, v, (later - before) / (2 * step), chain, contact, law, forces)
    for w in range(3):
        power = forces @ velocity(angles, np.eye(3)[w])
        # differences of step 1e-6 leave 1e-9 of the accelerations, of 1e4 rad/s^2 here
        assert abs(power) < 1e-7 * np.abs(forces).max()


def test_reactions_carry_the_rods_beyond_them() -> None:
    drive = hcm.Drive((0.01, 0.0, 0.002), incline=0.3)
    chain = build_rods(finger(SOFT), SURFACE, drive)[0]
    fall = integrate_flight(chain, np.zeros(6), 0.0, limits(0.0, 1e-4), 400)
    pull = np.empty((3, 6))
    for row in range(3):
        reactions(fall.states[300 + row], fall.accelerations[300 + row], chain, pull[row])

    def momentum(state: np.ndarray) -> np.ndarray:
        """Of each rod, N s: (3, 2)."""
        across = np.stack([np.sin(state[:3]), -np.cos(state[:3])], axis=1)
        turned = (chain.length * state[3:])[:, None] * across
        return chain.mass[:, None] * (turned.cumsum(axis=0) - 0.5 * turned)

    change = (momentum(fall.states[302]) - momentum(fall.states[300])) / 2e-4
    weight = chain.mass[:, None] * np.array(drive.gravity_vector)
    beyond = (weight - change)[::-1].cumsum(axis=0)[::-1]
    # central differences over 1e-4 s: 2e-6 of the force
    assert pull[1].reshape(3, 2) == pytest.approx(beyond, abs=1e-5 * np.abs(beyond).max())


@pytest.mark.parametrize(("phalanx", "tip"), [(SOFT, SOFT_TIP), (HARD, HARD_TIP)])
def test_a_tap_after_a_rigid_flight_is_nearly_that_after_an_elastic_one(
    phalanx: hcm.Phalanx, tip: hcm.Tip
) -> None:
    tight = hcm.Settings(flight_tolerance=1e-8)
    elastic = hcm.simulate(finger(phalanx), SURFACE, tip, settings=tight)
    rigid = hcm.simulate(finger(phalanx), SURFACE, tip, settings=replace(tight, flight="rigid"))
    assert rigid.status is hcm.Status.COMPLETED
    assert [e.kind for e in rigid.events] == [e.kind for e in elastic.events]
    found, known = rigid.summary, elastic.summary
    # left out: sagging and vibration, 1e-4 of the soft tap's force (measured 6e-5 to 1.3e-4)
    for name in ("peak_normal_force_N", "normal_impulse_N_s", "contact_duration_s"):
        assert getattr(found, name) == pytest.approx(getattr(known, name), rel=3e-4)
    assert found.contact_time_s == pytest.approx(known.contact_time_s, abs=2e-7)
    # the rigid flight is part of the audit, and of the history
    assert found.energy_residual < 1e-5
    assert rigid.history.time_s[0] == 0.0
    # round-off of a slope times E
    assert np.abs(rigid.history.stress_R_Pa[:5]).max() < 1e-15 * phalanx.youngs_modulus * 10
    assert (np.diff(rigid.history.time_s) >= 0).all()


def test_the_drives_work_and_the_frames_of_the_flight_are_kept() -> None:
    drive, wanted = hcm.Drive((0.02, 0.0, 0.001), reaction=True), (0.0, 0.01, 0.03, 0.0301)
    elastic, rigid, loose = (
        hcm.simulate(finger(SOFT), SURFACE, SOFT_TIP, drive,
                     hcm.Settings(frame_times=wanted, flight=flight, flight_step=step,
                                  flight_tolerance=tolerance))
        for flight, step, tolerance in (
            ("elastic", 1e-4, 1e-9), ("rigid", 1e-4, 1e-9), ("rigid", 1e-2, 1e-5))
    )  # fmt: skip
    assert [frame.time_s for frame in rigid.frames] == list(wanted)
    for bent, stiff, coarse in zip(elastic.frames, rigid.frames, loose.frames, strict=True):
        # bending under the torque: some micrometres; the cubic in steps of 2 ms: less
        assert np.abs(bent.positions_m[-1] - stiff.positions_m[-1]).max() < 2e-5
        assert np.abs(coarse.positions_m[-1] - stiff.positions_m[-1]).max() < 2e-5
    assert rigid.history.drive_work_J[-1] == pytest.approx(
        elastic.history.drive_work_J[-1], rel=1e-3
    )
    assert rigid.summary.energy_residual < 1e-4


def test_a_tip_that_dips_below_the_surface_inside_a_step_is_seen() -> None:
    # it is below, by 4 nm at most, for 30 us
    _, fall = one_rod(SOFT.length * (1 - 1e-7), 0.0, 1e-3)
    assert fall.code == TOUCHED
    assert fall.states[-1][0] == pytest.approx(math.pi / 2, abs=1e-3)
    assert fall.states[-1][0] < math.pi / 2


@pytest.mark.parametrize(
    ("young", "torque", "trusted"),
    [(1e9, 0.0, True), (3e8, 0.0, True), (1e7, 0.0, False), (1e9, 0.015, False)],
)
def test_a_finger_that_bends_on_its_way_is_not_relied_on(
    young: float, torque: float, trusted: bool
) -> None:
    # measured changes of peak, impulse or duration: 8e-5, 2e-4, 3e-3 and 2.1e-2; the estimates are
    # 3.3e-3, 6e-3, 3.3e-2 and more than the change in the last
    body, drive = finger(SOFT, youngs_modulus=young), hcm.Drive((torque, 0.0, 0.0))
    both = [
        hcm.simulate(body, SURFACE, SOFT_TIP, drive, hcm.Settings(flight=flight))
        for flight in ("elastic", "rigid")
    ]
    assert both[0].status is hcm.Status.COMPLETED
    expected = hcm.Status.COMPLETED if trusted else hcm.Status.TOO_FLEXIBLE
    assert both[1].status is expected
    names = ("peak_normal_force_N", "normal_impulse_N_s", "contact_duration_s")
    elastic, rigid = ([getattr(r.summary, name) for name in names] for r in both)
    change = max(abs(a / b - 1) for a, b in zip(rigid, elastic, strict=True))
    if trusted:
        assert change < LARGEST_LEFT_OUT
    else:
        told = float(both[1].message.split("up to ")[1].split(" %")[0]) / 100
        assert change < told


def test_a_flight_without_a_touch_ends_as_an_elastic_one_does() -> None:
    up = hcm.Drive(gravity=-G)
    gone = hcm.simulate(finger(SOFT), SURFACE, SOFT_TIP, up, replace(RIGID, max_flight_time=0.05))
    assert gone.status is hcm.Status.NOT_REACHED
    assert gone.history.time_s[-1] == pytest.approx(0.05, abs=0.011)
    early = hcm.simulate(finger(SOFT), SURFACE, SOFT_TIP, settings=replace(RIGID, end_time=0.05))
    assert early.status is hcm.Status.COMPLETED
    assert early.history.time_s[-1] == pytest.approx(0.05, rel=1e-12)
    assert early.summary.contact_time_s is None
    stopped = hcm.simulate(finger(SOFT), SURFACE, SOFT_TIP, settings=replace(RIGID, max_steps=5))
    assert stopped.status is hcm.Status.WORK_LIMIT
    # the start, five steps, and the beams' row where they would take over
    assert len(stopped.history.time_s) == 7


@pytest.mark.parametrize("links", [1, 3])
@pytest.mark.parametrize("gravity", [0.0, 1e-9])
def test_a_rod_that_no_load_slows_touches_in_its_first_turn(links: int, gravity: float) -> None:
    """Without an error to limit them its steps grew to several turns, over the touch."""
    phalanges = finger(SOFT, links)
    reach, spin = sum(p.length for p in phalanges.phalanges), 20.0
    scene = hcm.Scene(
        phalanges, hcm.Surface(2 / 3 * reach, 0.5), SOFT_TIP, hcm.Drive(gravity=gravity),
        start=hcm.RigidStart((0.0,) * links, (spin,) * links),
    )  # fmt: skip
    fall = rods_fall(scene)
    assert fall is not None
    assert fall.time == pytest.approx(math.asin(2 / 3) / spin, rel=1e-6)


@pytest.mark.parametrize("rate", [0.0, 1.0])
@pytest.mark.parametrize("order", [0, 1, 2])
def test_a_rod_under_a_torque_alone_touches_in_its_first_turn(rate: float, order: int) -> None:
    """I theta'' = tau, I = rho A L^3/3: exact steps, which started from (almost) rest, and over
    the touch. Order 2 begins upwards and comes down again within such a step."""
    body, torque, length = finger(SOFT, 1), 0.004, SOFT.length
    inertia = SOFT.line_density * length**3 / 3
    loads = {
        0: hcm.Drive((torque,), gravity=0.0),
        1: hcm.Drive(gravity=0.0, table=hcm.TorqueTable((0.0, 1.0), ((0.0,), (torque,)))),
        2: hcm.Drive(gravity=0.0, table=hcm.TorqueTable((0.0, 1.0), ((-torque,), (3 * torque,)))),
    }  # fmt: skip
    down = np.array({0: [0.5, 0.0], 1: [0.0, 1 / 6], 2: [-0.5, 4 / 6]}[order]) * torque / inertia
    scene = hcm.Scene(
        body, hcm.Surface(length / 2, 0.5), SOFT_TIP, loads[order],
        start=hcm.RigidStart((0.3,), (rate,)),
    )  # fmt: skip
    # the first of theta = pi/6 or, swung over upwards, 7/6 pi
    touches = [
        root.real
        for level in (math.pi / 6, -7 / 6 * math.pi)
        for root in np.roots([down[1], down[0], rate, 0.3 - level])
        if abs(root.imag) < 1e-9 and root.real > 0
    ]
    fall = rods_fall(scene)
    assert fall is not None
    assert fall.time == pytest.approx(min(touches), rel=1e-6)


@pytest.mark.parametrize("below", [0.03, 0.1, 0.25])
@pytest.mark.parametrize("depth", [1e-4, 1e-3])
def test_a_rod_from_rest_finds_a_shallow_touch(depth: float, below: float) -> None:
    """theta = theta_0 + tau t^2/2I swings through the vertical, where it reaches `depth` (over L)
    below the surface: the cubic through a step's ends is off by more."""
    torque, length = 0.004, SOFT.length
    inertia = SOFT.line_density * length**3 / 3
    way = math.acos(1 - depth) + below
    scene = hcm.Scene(
        finger(SOFT, 1), hcm.Surface(length * (1 - depth), 0.5), SOFT_TIP,
        hcm.Drive((torque,), gravity=0.0), start=hcm.RigidStart((math.pi / 2 - way,), (0.0,)),
    )  # fmt: skip
    fall = rods_fall(scene)
    assert fall is not None
    assert fall.time == pytest.approx(math.sqrt(2 * below * inertia / torque), rel=1e-6)


@pytest.mark.parametrize("before", [0.15, 0.05, 0.11])
@pytest.mark.parametrize("depth", [1.9e-5, 1e-5, 3e-6])
def test_a_turning_rod_finds_a_touch_within_the_cubics_error(depth: float, before: float) -> None:
    """Steps of 0.3 rad, one of which passes the lowest point so far after its start: the tip of
    L sin(omega t) is below the surface for 2 sqrt(2 depth), but no cubic through the ends is."""
    spin, way = 30.0, 4 * 0.3 + before
    scene = hcm.Scene(
        finger(SOFT, 1), hcm.Surface(SOFT.length * (1 - depth), 0.5), SOFT_TIP,
        hcm.Drive(gravity=0.0), start=hcm.RigidStart((math.pi / 2 - way,), (spin,)),
    )  # fmt: skip
    fall = rods_fall(scene)
    assert fall is not None
    assert fall.time == pytest.approx((way - math.acos(1 - depth)) / spin, rel=1e-7)


def test_vibrations_of_several_torque_changes_add_up() -> None:
    """Jumps by what they change, kinks by the change of rate over w; one torque is as it was."""
    body, end = finger(SOFT, 1), 1.0
    slow = (math.pi / SOFT.length) ** 2 * math.sqrt(SOFT.bending_stiffness / SOFT.line_density)

    def moment(times: list[float], torques: list[float]) -> float:
        table = hcm.TorqueTable(tuple(times), tuple((t,) for t in torques))
        rods, pieces = build_rods(body, SURFACE, hcm.Drive(table=table))
        return float(acting_between(rods, pieces, 0.0, end).moment[0])

    assert moment([0.0], [3.0]) == 3.0
    assert moment([0.0, 0.2, 0.2], [3.0, 3.0, -1.0]) == pytest.approx(3 + 4, rel=1e-12)
    times = np.repeat(np.arange(1, 10) / 10, 2).tolist()
    square = [0.0, *np.repeat([1.0, -1.0] * 5, 2).tolist()][: len(times)]
    assert moment(times, square) == pytest.approx(1 + 2 * 8, rel=1e-12)
    # a saw of kinks is as large as its torque or, if faster than the beam, its kinks
    rate = 100.0 * slow
    period = 1e-3 / slow
    saw = moment((np.arange(5) * period).tolist(), [0.0, rate * period, 0.0, rate * period, 0.0])
    assert saw == pytest.approx(100.0 * (1 + 2 + 2 + 2 + 1), rel=1e-9)


def test_a_torque_that_jumps_late_is_in_a_rigid_flights_error() -> None:
    """It balances the weight for half a second: 0.9 % of the peak at 1 GPa, 0.2 % at 3 GPa."""

    def taps(modulus: float) -> tuple[hcm.TapResult, hcm.TapResult]:
        rod = hcm.Phalanx(0.05, 0.008, modulus, 1400.0)
        weight = rod.line_density * rod.length * G
        table = hcm.TorqueTable((0.5, 0.5), ((-weight * rod.length / 2,), (0.0,)))
        own = hcm.Finger((rod,)), hcm.Surface(0.03, 0.3), SOFT_TIP, hcm.Drive(table=table)
        scene = hcm.Scene(*own, settings=NO_ESTIMATE)
        stiff = hcm.simulate(*own, settings=hcm.Settings(flight="rigid"))
        return stiff, hcm.simulate_within(1e-3, scene)

    assert taps(1e9)[0].status is hcm.Status.TOO_FLEXIBLE
    stiff, exact = taps(3e9)
    off = abs(stiff.summary.peak_normal_force_N - exact.summary.peak_normal_force_N)
    stated = stiff.errors["peak_normal_force_N"]
    assert stated / 8 < off < stated


def test_a_rigid_flight_goes_on_from_a_given_start() -> None:
    whole = hcm.simulate(finger(SOFT), SURFACE, SOFT_TIP, settings=RIGID)
    chain = build_rods(finger(SOFT), SURFACE, hcm.Drive())[0]
    part = integrate_flight(chain, np.zeros(6), 0.0, limits(1e-13, 0.01, 0.1), 999)
    assert part.code == ENDED
    angles, spins = part.states[-1][:3], part.states[-1][3:]
    start = hcm.RigidStart(tuple(angles), tuple(spins), float(part.time[-1]))
    late = hcm.simulate(finger(SOFT), SURFACE, SOFT_TIP, settings=RIGID, start=start)
    assert late.history.time_s[0] == 0.1
    # steps to 1e-7 m leave 5e-8 s
    assert late.summary.contact_time_s == pytest.approx(whole.summary.contact_time_s, abs=2e-7)


def test_another_flight_is_refused_by_name() -> None:
    allowed = "'elastic' or 'modal' or 'rigid'"
    with pytest.raises(hcm.ParameterError, match=f"flight = 'stiff': must be {allowed}"):
        hcm.Settings(flight="stiff")  # type: ignore[arg-type]


def test_a_clock_has_counted_nothing() -> None:
    totals = initial_totals(1.0, 2.0)
    assert (totals.time, totals.phase_start, totals.step) == (1.0, 1.0, 2.0)
    assert not any(totals[3:])


def test_a_level_rods_hinge_carries_a_quarter_of_its_weight() -> None:
    """As it is let go; at theta below the level it carries m g cos(theta)/4 across the rod, and
    5/2 m g sin(theta) along it, as the rate's square is 3 g sin(theta)/L.
    """
    run = hcm.simulate(
        finger(SOFT, 1), hcm.Surface(0.035, 0.5), SOFT_TIP, settings=replace(RIGID, end_time=0.05)
    )
    assert run.summary.contact_time_s is None
    x, y = run.history.tip_position_m.T
    weight = SOFT.line_density * SOFT.length * G
    sine, cosine = -y / SOFT.length, -x / SOFT.length
    along, across = 2.5 * weight * sine, 0.25 * weight * cosine
    wanted = np.column_stack([along * cosine - across * sine, along * sine + across * cosine])
    # but for the last row, the beams' own; the flight keeps 1e-5 of the surface's depth
    found = run.history.hinge_reactions_N[:-1].reshape(-1, 2)
    assert found == pytest.approx(wanted[:-1], abs=1e-4 * weight)


def test_what_a_flight_leaves_out_is_its_largest_not_its_last() -> None:
    """Of a torque that ends long before the touch; `Fall.largest` is found by another kernel."""
    table = hcm.TorqueTable((0.0, 0.01, 0.01), ((0.02, 0.0, 0.0), (0.02, 0.0, 0.0), (0.0,) * 3))
    alike = replace(NO_ESTIMATE, flight="rigid", flight_step=1.0, flight_tolerance=RODS_TOLERANCE)
    scene = hcm.Scene(finger(SOFT), SURFACE, SOFT_TIP, hcm.Drive(table=table), alike)
    fall = rods_fall(scene)
    assert fall is not None
    assert fall.largest > 1.2 * fall.bending
    # the same steps
    assert solve_once(scene)[1] == pytest.approx(fall.largest / fall.speed, rel=1e-9)
