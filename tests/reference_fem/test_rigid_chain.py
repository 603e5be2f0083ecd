"""The rigid flight against the pendulum, conservation laws and independent solvers."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.special import ellipk

import meshes
import reference_fem as rf
from reference_fem.flight.rigid_flight import descent, first_closing, fly, inner_gap
from reference_fem.model import build_model
from reference_fem.rigid.rigid_chain import ChainState, RigidChain, chain_and_start, pose
from reference_fem.rigid.true_body import mass_factors, true_chain
from reference_fem.torques import Torques
from tests.reference_fem.taps import SOFT

LENGTH, RADIUS, DENSITY, GRAVITY = 0.04, 0.0075, 1400.0, 9.8
MASS = DENSITY * np.pi * RADIUS**2 * LENGTH
ROD = MASS * LENGTH**2 / 12
ROTARY = MASS * RADIUS**2 / 4


def chain(links: int, inertia: float, torques: tuple[float, ...] = ()) -> RigidChain:
    arms = np.zeros((links, links, 2))
    for w in range(links):
        arms[w, :w, 0] = -LENGTH
        arms[w, w, 0] = -LENGTH / 2
    origins = np.stack([-LENGTH * np.arange(links), np.zeros(links)], axis=1)
    load = Torques(np.zeros(1), np.array([torques or (0.0,) * links]))
    fall = np.array([0.0, -GRAVITY])
    return RigidChain(np.full(links, MASS), np.full(links, inertia), arms, origins, load, fall)


def rest(links: int) -> ChainState:
    return ChainState(np.zeros(links), np.zeros(links), 0.0)


def never(_angles: np.ndarray) -> float:
    return 1.0


@pytest.mark.parametrize(
    ("angles", "rates", "time", "said"),
    [
        ([[0.1, 0.2]], [0.0, 0.0], 0.0, r"shape \(1, 2\) .* for 2 phalanges; give one of each"),
        ([0.1], [0.0], 0.0, "for 2 phalanges"),
        ([0.1, np.nan], [0.0, 0.0], 0.0, "must be finite numbers"),
        ([0.1, 0.2], [0.0, np.inf], 0.0, "must be finite numbers"),
        ([0.1, 0.2], [0.0, 0.0], -1.0, "time_s = -1.0: .* not below 0"),
    ],
)
def test_a_start_that_is_none(angles: list, rates: list, time: float, said: str) -> None:
    with pytest.raises(ValueError, match=said):
        chain_and_start(chain(2, ROD), ChainState(angles, rates, time))


def test_a_start_may_be_lists() -> None:
    _, first = chain_and_start(chain(2, ROD), ChainState([0.1, 0], (0, 0), 1))
    np.testing.assert_array_equal(first.angles, np.array([0.1, 0.0]))
    assert first.rates.dtype == float


def test_pendulum_period_from_the_elliptic_integral() -> None:
    # Released at 90 degrees from its equilibrium: T = 4 sqrt(J/(m g l/2)) K(sin^2 45 deg).
    body = chain(1, ROD)
    about_hinge = ROD + MASS * LENGTH**2 / 4
    period = 4 * np.sqrt(about_hinge / (MASS * GRAVITY * LENGTH / 2)) * ellipk(0.5)
    state_at, hit = fly(body, rest(1), never, 1.1 * period)
    assert hit is None
    # At the turning points the angle's error is quadratic in that of the time; the rate's is not.
    # The integrator's relative tolerance is 1e-11, over some 50 steps.
    assert state_at(period).angles[0] == pytest.approx(0.0, abs=1e-9)
    assert state_at(period).rates[0] == pytest.approx(0.0, abs=1e-7)
    assert state_at(period / 2).angles[0] == pytest.approx(np.pi, abs=1e-9)


def test_a_slow_fall_has_no_more_steps() -> None:
    """In a millionth of gravity it takes a thousand times as long (it had a thousand times the
    steps, of at most 5 ms)."""
    asked = [0, 0]

    def touch(which: int, gravity: float) -> float:
        def gap(angles: np.ndarray) -> float:
            asked[which] += 1
            return 0.1 - LENGTH * float(np.sin(angles).sum())

        body = replace(chain(3, ROD), gravity_vector=np.array([0.0, -gravity]))
        return fly(body, rest(3), gap, 1e3)[1] or 0.0

    assert touch(1, 1e-6 * GRAVITY) == pytest.approx(1e3 * touch(0, GRAVITY), rel=1e-9)
    assert asked[1] < 1.5 * asked[0]


def test_energy_of_a_driven_chain_is_constant_to_1e9() -> None:
    body = chain(3, ROD + ROTARY, (1e-3, -2e-3, 3e-3))
    state_at, _ = fly(body, rest(3), never, 0.3)
    scale = 3 * MASS * GRAVITY * LENGTH
    for time in np.linspace(0, 0.3, 31):
        assert abs(body.energy(state_at(time))) < 1e-9 * scale


def test_torques_over_time_turn_a_rod_by_the_closed_form() -> None:
    # J w' = t: a ramp from 0.01 s, that jumps at 0.03 s, and is held from there on; no gravity
    top, about_hinge = 2e-4, ROD + MASS * LENGTH**2 / 4
    table = Torques(np.array([0.01, 0.03, 0.03]), np.array([[0.0], [top], [-top]]))
    body = replace(chain(1, ROD), torques=table, gravity_vector=np.zeros(2))
    state_at, _ = fly(body, rest(1), never, 0.1)
    rate, angle = top * 0.02 / 2, top * 0.02**2 / 6
    for time in (0.005, 0.02, 0.03, 0.05, 0.1):
        since, up = max(time - 0.03, 0.0), min(max(time - 0.01, 0.0), 0.02) / 0.02
        state = state_at(time)
        expected = rate * up**2 - top * since, angle * up**3 + rate * since - 0.5 * top * since**2
        assert state.rates[0] * about_hinge == pytest.approx(expected[0], rel=1e-9, abs=1e-18)
        assert state.angles[0] * about_hinge == pytest.approx(expected[1], rel=1e-9, abs=1e-18)
        torque_change_work = table.torque_change_work(lambda when: state_at(when).angles, 0.0, time)
        assert body.energy(state) + torque_change_work == pytest.approx(0.0, abs=1e-9 * top)


def test_thin_rods_arrive_as_two_independent_solvers_say() -> None:
    # Two independent solvers: t_c = 0.136107 s, v = (+1.8136, -1.6544) m/s for flexible beams
    # without rotary inertia; flexibility changes neither in the digits given.
    def tip_gap(angles: np.ndarray) -> float:
        return 0.1 - LENGTH * float(np.sin(angles).sum())

    state_at, contact = fly(chain(3, ROD), rest(3), tip_gap, 1.0)
    assert contact == pytest.approx(0.136107, abs=1e-6)
    impact = state_at(contact or 0.0)
    v_x = LENGTH * np.sum(np.sin(impact.angles) * impact.rates)
    v_y = -LENGTH * np.sum(np.cos(impact.angles) * impact.rates)
    assert (v_x, v_y) == (pytest.approx(1.8136, abs=1e-4), pytest.approx(-1.6544, abs=1e-4))
    later = fly(chain(3, ROD + ROTARY), rest(3), tip_gap, 1.0)[1]
    # Rotary inertia delays the fall by 0.5 %.
    assert later == pytest.approx(1.005 * 0.136107, rel=5e-4)


def test_unreached_surface_is_no_hit() -> None:
    assert fly(chain(2, ROD), rest(2), lambda a: 0.081 - LENGTH * np.sin(a).sum(), 1.0)[1] is None


@pytest.mark.parametrize("turns", [0.4, 1.0, 3.7])
@pytest.mark.parametrize("past", [1e-4, 1e-2])
def test_a_whirling_end_touches_within_a_step(turns: float, past: float) -> None:
    """θ = ω t of a free rod: the gap H - l sin θ first closes at arcsin(H/l)/ω.

    It takes steps of 5 ms, the longest ones, of several turns each; one that is a whole turn has
    the same gap at all of its ends.
    """
    spin = 2.0 * np.pi * turns / 5e-3
    body = replace(chain(1, ROD), gravity_vector=np.zeros(2))
    start = ChainState(np.array([-0.3]), np.array([spin]), 0.0)
    top = 1.0 - past
    _, contact = fly(body, start, lambda a: LENGTH * (top - np.sin(a[0])), 0.02)
    # the angle is a straight line in time: rounding alone, which arcsin magnifies near 1
    assert contact == pytest.approx((0.3 + np.arcsin(top)) / spin, rel=1e-9)
    never = fly(body, start, lambda a: LENGTH * (1.0 + past - np.sin(a[0])), 0.02)
    assert never[1] is None


@pytest.mark.parametrize("later", [0.5, 0.7, 0.75, 0.9])
def test_of_two_touches_within_a_step_the_first_counts(later: float) -> None:
    """Wherever halving finds the later one: dips 3/2 exp(-x²), x = (θ - θ_i)/0.1, of a gap of 1."""

    def flown(time: float | np.ndarray) -> np.ndarray:
        return np.array([time, np.ones_like(time)])

    def gap(angles: np.ndarray) -> float:
        return 4e-3 * (
            1.0 - 1.5 * max(np.exp(-(((angles[0] - at) / 0.1) ** 2)) for at in (0.2, later))
        )

    closing = first_closing(chain(1, ROD), flown, np.array([0.0, 1.0]), gap)
    assert closing == pytest.approx(0.2 - 0.1 * np.sqrt(np.log(1.5)), rel=1e-12)


def test_pose_keeps_hinges_together_and_velocity_is_its_derivative() -> None:
    body = chain(3, ROD)
    points = np.repeat(body.origins, 2, axis=0) + np.array([[0.0, 0.0], [-LENGTH, 0.0]] * 3)
    bodies = np.repeat(np.arange(3), 2)
    state = ChainState(np.array([0.7, 1.1, -0.4]), np.array([3.0, -5.0, 8.0]), 0.0)
    u, v = pose(body, state, points, bodies)
    now = points + u
    assert np.allclose(now[1:-1:2], now[2::2], rtol=0, atol=1e-16)
    assert np.allclose(v[1:-1:2], v[2::2], rtol=0, atol=1e-15)
    h = 1e-6
    ahead, _ = pose(
        body, ChainState(state.angles + h * state.rates, state.rates, h), points, bodies
    )
    back, _ = pose(
        body, ChainState(state.angles - h * state.rates, state.rates, -h), points, bodies
    )
    # Central difference: error h^2 w^3 L / 6 = 4e-13, round-off 1e-17/h = 1e-11.
    assert np.allclose((ahead - back) / (2 * h), v, rtol=0, atol=1e-10)


def test_nodes_on_a_circle_keep_their_masses() -> None:
    """Mass, centre and inertia can't be chosen apart: a singular matrix, or rounding alone."""
    geometry = meshes.FingerGeometry((0.04,), (0.015,), "flat")
    corners = np.array([[0.0, 0.0, -0.04, -0.04], [0.0075, -0.0075, 0.0075, -0.0075]]).T
    true = true_chain(geometry, (SOFT[0],), rf.Drive(), 2)
    mass = np.full(4, 0.25 * true.mass[0])
    assert (mass_factors(corners, mass, [np.arange(4)], true, 1) == 1.0).all()


@pytest.mark.parametrize(
    ("longest", "end", "touches"),
    [(0.05, None, False), (0.2, None, True), (0.05, 1.2, False), (0.2, 1.05, False),
     (0.2, 1.15, True), (0.2, 0.9, False)],
)  # fmt: skip
def test_a_descent_ends_at_the_earlier_of_the_longest_flight_and_the_end_time(
    longest: float, end: float | None, touches: bool
) -> None:
    """A free rod that spins at 10 rad/s from 1 s on meets the surface at 1 rad, after 0.1 s."""
    body = replace(chain(1, ROD), gravity_vector=np.zeros(2))
    start = ChainState(np.zeros(1), np.array([10.0]), 1.0)
    settings = rf.Settings(max_flight_time_s=longest, end_time_s=end)
    found = descent(body, lambda a: LENGTH * (1.0 - a[0]), start, settings)
    assert (found is not None) is touches
    if found is not None:
        assert found.touch_s == pytest.approx(1.1, rel=1e-9)
        assert found.before(0.03).angles == pytest.approx([0.7], rel=1e-9)
        # no state is known from before the start
        assert found.before(5.0).time_s == 1.0


def test_the_inner_phalanges_lowest_rims_are_those_of_cylinders() -> None:
    """Of two: the lower end's centre, less R |cos| of the phalanx; the last one has no part."""
    radius, length, height = 0.006, 0.03, 0.1
    geometry = meshes.FingerGeometry((length, length, 0.02), (2 * radius,) * 3)
    mesh = meshes.finger_quadrilaterals(geometry, meshes.Sizing(3e-3, 5e-3, 3e-3))
    model = build_model(mesh, (SOFT[0],) * 3, rf.Surface(height, 0.3), rf.Drive(), rf.Settings())
    own, _ = chain_and_start(model.chain, None)
    gap = inner_gap(model, own)
    for angles in ((0.4, -0.7, 1.2), (1.3, 0.2, 0.0), (-0.5, 2.5, 1.0), (2.0, -1.0, -3.0)):
        first, second, _ = angles
        middle = -length * np.sin(first)
        end = middle - length * np.sin(second)
        lowest = min(
            min(0.0, middle) - radius * abs(np.cos(first)),
            min(middle, end) - radius * abs(np.cos(second)),
        )
        assert gap(np.array(angles)) == pytest.approx(lowest + height, rel=1e-12)
