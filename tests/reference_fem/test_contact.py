"""Penalty contact and friction against impacts and slides with known answers."""

import math
import sys

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from reference_fem import Material, Settings, Status, Surface
from reference_fem.contact.friction import drag, return_map
from reference_fem.contact.impulse import Stops, impulse_forces
from reference_fem.contact.law import COLUMNS, DISSIPATION, TANGENTIAL, Memory, Motion
from reference_fem.contact.penalty import adjoining_cells, nodal_springs, penalty_contact
from reference_fem.contact.springs import spring_forces
from reference_fem.stable_step import stable_step
from tests.reference_fem.boxes import boxes
from tests.reference_fem.taps import SURFACE, body, throw

finite = st.floats(-1e-3, 1e-3)


@settings(deadline=None)  # the first call compiles
@given(finite, finite, st.floats(0.0, 100.0), st.floats(1e3, 1e9))
def test_return_map_stays_in_the_cone_and_dissipates(
    x: float, z: float, limit: float, k: float
) -> None:
    force_x, force_z, slip_x, slip_z = return_map(k, x, z, limit)
    # offsets whose squares are no normal numbers are as good as none, in each component
    vanishing = k * 2 * math.sqrt(sys.float_info.min)
    assert math.hypot(force_x, force_z) <= limit * (1 + 1e-14) + vanishing
    # The spring that is left carries the force: f = -k (x - a').
    assert force_x == pytest.approx(-k * (x - slip_x), abs=1e-9 * (1 + k * abs(x)))
    assert force_z == pytest.approx(-k * (z - slip_z), abs=1e-9 * (1 + k * abs(z)))
    assert force_x * slip_x + force_z * slip_z <= 0.0


def untouched() -> Memory:
    """One site in the plane that has not touched yet."""
    return Memory(np.zeros(1, dtype=np.bool_), np.zeros((1, 2)), np.zeros((1, 2)))


@settings(deadline=None)
@given(st.tuples(*[finite] * 4), st.tuples(*[st.floats(0.0, 100.0)] * 2), st.floats(1e3, 1e9))
def test_no_slip_gives_energy_back(
    path: tuple[float, ...], limits: tuple[float, float], k: float
) -> None:
    memory, (x, z, further_x, further_z) = untouched(), path
    assert drag(memory, 0, k, x, z, limits[0])[2] >= 0.0
    assert drag(memory, 0, k, further_x, further_z, limits[1])[2] >= 0.0


def test_a_slide_that_turns_round_within_a_step_dissipates_on_its_way_back() -> None:
    memory, k, limit, back = untouched(), 1e6, 3.0, 1e-4
    drag(memory, 0, k, 1e-3, 0.0, limit)
    force, _, loss = drag(memory, 0, k, 1e-3 - back, 0.0, limit)
    assert force == pytest.approx(limit)
    assert loss == pytest.approx(limit * (back - 2 * limit / k))  # the spring turns without slip


@pytest.mark.parametrize(("pull", "loss"), [(0.0, 1e-3), (11.0, 0.0)], ids=["stops", "turns"])
def test_a_node_that_turns_round_gives_nothing_back(pull: float, loss: float) -> None:
    # 1 kg slides at 0.1 m/s for a step of 0.02 s on what it presses with 2 N, mu = 0.5, where the
    # trapezoid takes half the work of 1 N. Pulled back by 11 N, where 5 N would stop it, it turns.
    step, mass, speed, normal, friction = 0.02, 1.0, 0.1, 2.0, 0.5
    motion = Motion(
        np.zeros((1, 2)), np.zeros((1, 2)), np.array([[speed, 0.0]]), np.array([1.0 / mass]),
        (0.0, 0.0), step, 0.0, friction,
    )  # fmt: skip
    memory = Memory(np.ones(1, dtype=np.bool_), np.zeros((1, 1)), np.zeros((1, 1)))
    row = np.zeros(COLUMNS)
    stops = Stops(np.zeros(1, dtype=np.int64), np.ones(1))
    impulse_forces(stops, motion, memory, np.array([[pull, normal]]), row)
    assert row[TANGENTIAL] == pytest.approx(
        math.copysign(friction * normal, pull - mass * speed / step)
    )
    assert row[DISSIPATION] == pytest.approx(loss)


def test_stiffness_is_f_k_a2_over_v_and_spread_by_area() -> None:
    mesh = boxes((0.06,), (0.01, 0.02), (3, 2, 2), hinged=False)
    volume = np.full(len(mesh.cells), 0.02 * 0.005 * 0.01)
    facets = mesh.facet_sets["surface"]
    surface = penalty_contact(mesh, facets, volume, np.full(len(volume), 2e9), 0.1)
    area = 0.02 * 0.01
    assert surface.stiffness.sum() == pytest.approx(len(facets) * 0.1 * 2e9 * area**2 / volume[0])
    assert surface.area.sum() == pytest.approx(0.06 * 0.02)
    assert np.ptp(surface.stiffness / surface.area) < 1e-6 * 0.1 * 2e9 / 0.005
    inner = np.array([[*mesh.cells[0, :2], mesh.cells[-1, 5], mesh.cells[-1, 4]]])
    with pytest.raises(ValueError, match="surface"):
        adjoining_cells(mesh.cells, inner)


def test_stable_step_bounds_the_true_frequency_with_penalty() -> None:
    mesh = boxes((0.03,), (0.01, 0.01), (3, 1, 1), hinged=False)
    for factor in (0.1, 10.0, 1000.0):
        settings = Settings(penalty_factor=factor)
        model = body(mesh, Material(1e7, 0.3, 1000.0), SURFACE, settings)
        size = model.points.size
        stiffness, tiny = np.empty((size, size)), 1e-9
        force = np.empty_like(model.points)
        for column in range(size):
            u = np.zeros(size)
            u[column] = tiny
            model.kernel.internal_force(u.reshape(model.points.shape), force)
            stiffness[:, column] = force.ravel() / tiny
        diagonal = np.zeros_like(model.points)
        diagonal[model.contact.nodes] = model.contact.stiffness[:, None]
        stiffness = 0.5 * (stiffness + stiffness.T) + np.diag(diagonal.ravel())
        root = np.repeat(np.sqrt(model.mass), 3)
        highest = math.sqrt(np.linalg.eigvalsh(stiffness / np.outer(root, root))[-1])
        contact = model.contact
        none = np.empty(0, dtype=np.int64)
        used = 2.0 / stable_step(model.kernel, contact.nodes, contact.stiffness, none)
        # Never below the true frequency, but for the linearization's 1e-6, and close above it:
        # the safeguard is the residual of 24 Lanczos steps.
        assert highest * (1 - 1e-5) <= used <= 1.01 * highest
        assert model.step_s == pytest.approx(0.9 * 2.0 / used)
        # Free vibration in contact: bounded at the step that is used, and not 2 % above its bound.
        operator = stiffness / np.outer(root, root)
        assert growth(operator, model.step_s) < 10.0
        assert growth(operator, 1.02 * 2.0 / used) > 1e6


def growth(operator: np.ndarray, step: float) -> float:
    """How far central differences take x'' = -A x in 500 steps, over where they start."""
    before = np.random.default_rng(1).standard_normal(len(operator))
    now, first = before.copy(), float(np.linalg.norm(before))
    for _ in range(500):
        before, now = now, 2.0 * now - before - step * step * (operator @ now)
    return float(np.linalg.norm(now)) / first


def rebound(share: float, phase: float) -> float:
    """Speed of a node that leaves a spring it met at speed 1, `phase` of a step before a step.

    share is the step over the stable one, so that the spring takes π/(2 share) steps.
    """
    motion = Motion(
        np.zeros((1, 2)), np.array([[0.0, -phase]]), np.array([[0.0, -1.0]]), np.ones(1),
        (0.0, 0.0), 1.0, 0.0, 0.0,
    )  # fmt: skip
    memory = Memory(np.zeros(1, dtype=np.bool_), np.zeros((1, 1)), np.zeros((1, 1)))
    spring, row = np.array([4.0 * share * share]), np.zeros(COLUMNS)
    law = nodal_springs(np.zeros(1, np.int64), np.ones(1), spring)
    while motion.displacement[0, 1] < 0.0:
        residual = np.zeros((1, 2))
        spring_forces(law.parts, motion, memory, residual, row)
        motion.velocity[:] -= residual
        motion.displacement[:] += motion.velocity
    return float(motion.velocity[0, 1])


@pytest.mark.parametrize(
    ("share", "least", "most"),
    [(0.1, 0.995, 1.005), (0.3, 0.97, 1.03), (0.9, 0.4, 0.9**2 * 4 - 1)],
)
def test_a_node_bounces_off_within_the_error_of_its_steps(
    share: float, least: float, most: float
) -> None:
    # A stable step bounds vibration in contact, not the energy of an impact that it does not
    # resolve: a node that is stopped and thrown back by one force leaves at 4 share² s - 1 times
    # its speed, s the phase. What stiff penalties give or take so is round-off's to decide.
    speeds = [rebound(share, phase) for phase in np.linspace(0.001, 0.999, 200)]
    assert min(speeds) > least
    assert max(speeds) <= most
    assert max(speeds) > 0.99 * most


def test_stable_step_refuses_nonsense() -> None:
    mesh = boxes((0.03,), (0.01, 0.01), (3, 1, 1), hinged=False)
    model = body(mesh, Material(1e7, 0.3, 1000.0), SURFACE)
    stiffness = np.full_like(model.contact.stiffness, np.nan)
    with pytest.raises(ValueError, match="frequency"):
        stable_step(model.kernel, model.contact.nodes, stiffness, np.empty(0, dtype=np.int64))


@pytest.mark.parametrize("dim", [2, 3])
def test_stiff_body_on_a_linear_spring(dim: int) -> None:
    # F = v sqrt(k m), T = pi sqrt(m/k), J = 2 m v for a rigid body on a spring k. With the penalty
    # 1e-4 of the body's own stiffness the body's share of the compliance is some 1e-4.
    section = (0.01, 0.01)[: dim - 1]
    mesh = boxes((0.01,), section, (2,) * dim, hinged=False)
    settings = Settings(penalty_factor=1e-4, max_contact_time_s=1.0)
    model = body(mesh, Material(1e8, 0.3, 1000.0), Surface(0.0050001, 0.0), settings)
    v, m, k = 0.1, model.mass.sum(), model.contact.stiffness.sum()
    result = throw(model, settings, (0.0, -v))
    summary = result.summary
    assert result.status is Status.COMPLETED
    assert summary.peak_normal_force_N == pytest.approx(v * math.sqrt(k * m), rel=1e-3)
    # The end is known to the step: a few hundred of them make the tap.
    duration = math.pi * math.sqrt(m / k)
    known = 2 * model.step_s + 1e-3 * duration
    assert summary.contact_duration_s == pytest.approx(duration, abs=known)
    assert summary.normal_impulse_N_s == pytest.approx(2 * m * v, rel=1e-3)
    assert summary.compression_to_restitution == 1
    assert summary.stick_to_slip is None  # no friction, no stick
    assert summary.reverse_slip is None
    assert (summary.energy_residual or 1.0) < 1e-4
    half = 0.5 * (summary.contact_duration_s or 0.0)
    assert summary.peak_normal_force_time_s == pytest.approx(half, rel=0.02)


def test_sticking_block_comes_back() -> None:
    # Under a shallow throw with a high mu the tangential springs give the energy back: an
    # oblique impact of a body that sticks from start to end dissipates nothing.
    mesh = boxes((0.01,), (0.01, 0.01), (2, 2, 2), hinged=False)
    settings = Settings(penalty_factor=1e-3, output_interval=2)
    model = body(mesh, Material(1e8, 0.3, 1000.0), Surface(0.0050001, 50.0), settings)
    result = throw(model, settings, (0.01, -0.1))
    spent = result.history.friction_dissipation_J[-1]
    assert 0.0 <= spent < 1e-3 * result.history.kinetic_energy_J[0]
    assert (result.summary.energy_residual or 1.0) < 1e-3
