"""The explicit loop without contact: parabola, momentum, order, couples and hinges."""

import math
import signal
from dataclasses import replace
from itertools import pairwise
from typing import Any

import numpy as np
import pytest

from meshes import FingerMesh
from reference_fem import ChainState, Material, Settings, TorqueTable
from reference_fem.dynamics.energy import sample
from reference_fem.dynamics.recorder import Recorder
from reference_fem.dynamics.step import advance, lowest_gap, start_state
from reference_fem.elements.section import build_section
from reference_fem.flight.rigid_flight import fly
from reference_fem.model import Model
from reference_fem.rigid.rigid_chain import pose
from tests.reference_fem.boxes import boxes
from tests.reference_fem.taps import body

RUBBER = Material(1e7, 0.3, 1000.0)


def model_of(
    mesh: FingerMesh,
    torques: tuple[float, ...] = (),
    gravity: float = 0.0,
    material: Material = RUBBER,
    **drive: Any,
) -> Model:
    return body(mesh, material, torques=torques, gravity=gravity, **drive)


SOLIDS = {
    "3D": ((0.03,), (0.01, 0.02), (3, 1, 2)),
    "2D": ((0.03,), (0.01,), (3, 2)),
}


@pytest.mark.parametrize("shape", SOLIDS.values(), ids=SOLIDS.keys())
def test_free_fall_is_the_parabola(shape: tuple) -> None:
    incline = 0.35
    model = model_of(boxes(*shape, hinged=False), gravity=9.8, incline=incline)
    velocity = np.zeros_like(model.points)
    velocity[:, :2] = 0.3, 0.5
    state = start_state(model, np.zeros_like(velocity), velocity, 0.0)
    state, block = advance(model, state, 500, False)
    t = state.time_s
    # Central differences are exact for quadratics.
    down, along = 4.9 * t * t * math.cos(incline), 4.9 * t * t * math.sin(incline)
    assert state.displacement[:, 1] == pytest.approx(0.5 * t - down, rel=1e-11)
    assert state.displacement[:, 0] == pytest.approx(0.3 * t - along, rel=1e-11)
    # The block's velocity is that at its start.
    assert np.allclose(block.velocity, velocity, rtol=0, atol=1e-14)


@pytest.mark.parametrize("shape", SOLIDS.values(), ids=SOLIDS.keys())
def test_spinning_body_keeps_both_momenta(shape: tuple) -> None:
    model = model_of(boxes(*shape, hinged=False))
    spin = 40.0
    velocity = np.zeros_like(model.points)
    velocity[:, 0] = -spin * model.points[:, 1] + 0.2
    velocity[:, 1] = spin * model.points[:, 0]
    velocity += 0.05 * np.sin(900.0 * model.points)  # and it vibrates
    state = start_state(model, np.zeros_like(velocity), velocity, 0.0)

    def momenta(now: object) -> np.ndarray:
        v, x = now.velocity, model.points + now.displacement  # type: ignore[attr-defined]
        turn = model.mass @ (x[:, 0] * v[:, 1] - x[:, 1] * v[:, 0])
        return np.append(model.mass @ v, turn)

    before = momenta(state)
    state, _ = advance(model, state, 2000, False)
    size = model.mass.sum() * np.array([1.0] * model.points.shape[1] + [0.03])
    # Internal forces sum to zero and have no moment in the current configuration: round-off only.
    assert np.abs((momenta(state) - before) / size).max() < 1e-12
    whole = build_section(model.points, np.arange(len(model.mass)), model.mass)
    assert abs(whole.angle(state.displacement)) > 0.1


def test_leapfrog_has_order_two() -> None:
    mesh = boxes((0.02,), (0.01, 0.01), (2, 1, 1), hinged=False)
    # The stable step is 6.8e-5 s: at divisor 8 already far below it.
    step = 3e-5

    def end(divisor: int) -> np.ndarray:
        model = replace(model_of(mesh), step_s=step / divisor)
        velocity = np.zeros_like(model.points)
        velocity[:, 0] = 1.0 * np.sin(80.0 * model.points[:, 0])
        state = start_state(model, np.zeros_like(velocity), velocity, 0.0)
        state, _ = advance(model, state, 40 * divisor, False)
        return state.displacement

    ends = [end(divisor) for divisor in (8, 16, 32, 64)]
    changes = [np.abs(a - b).max() for a, b in pairwise(ends)]
    orders = np.log2(np.array(changes[:-1]) / changes[1:])
    # The order's own error is of second order too and falls by 4 from pair to pair: measured
    # 0.003 and 0.0008.
    assert orders == pytest.approx([2.0, 2.0], abs=0.01)
    assert orders[1] == pytest.approx(2.0, abs=0.003)


def test_a_couple_turns_a_free_body_and_does_not_push_it() -> None:
    torque = 2e-3
    model = model_of(boxes((0.03,), (0.01, 0.02), (6, 2, 2), hinged=False, half=True), (torque,))
    zero = np.zeros_like(model.points)
    state = start_state(model, zero, zero, 0.0)
    for _ in range(40):
        state, _ = advance(model, state, 100, False)
    x = model.points + state.displacement
    turn = model.mass @ (x[:, 0] * state.velocity[:, 1] - x[:, 1] * state.velocity[:, 0])
    # dL/dt = t exactly; the velocity is half a step behind. Half the torque on half the body.
    assert turn == pytest.approx(0.5 * torque * (state.time_s - 0.5 * model.step_s), rel=1e-10)
    assert np.abs(model.mass @ state.velocity[:, :2]).max() < 1e-12 * model.mass.sum()
    assert np.abs(state.velocity[model.symmetry, 2]).max() == 0.0
    assert state.face_angles[0] > 2 * np.pi  # the couple follows, and full turns are counted
    taken = sample(model, state, advance(model, state, 1, False)[1], 0.0)
    assert taken.drive_work_J == pytest.approx(torque * state.face_angles[0])
    # An O(dt^2) error of the kinetic energy at t_n is all that the balance may show.
    assert abs(taken.energy_balance_J) < 1e-4 * taken.kinetic_energy_J


def test_an_interrupt_while_steps_run_is_one_after_them() -> None:
    """Of arrays that a kernel returned numba would make Python's, and raise a SystemError."""
    model = model_of(boxes((0.03,), (0.01,), (3, 2), hinged=False))
    zero = np.zeros_like(model.points)
    state = start_state(model, zero, zero, 0.0)
    advance(model, state, 1, False)  # compiles
    before = signal.signal(signal.SIGALRM, signal.default_int_handler)
    try:
        signal.setitimer(signal.ITIMER_REAL, 0.02)
        with pytest.raises(KeyboardInterrupt):
            advance(model, state, 100_000, False)
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0.0)
        signal.signal(signal.SIGALRM, before)


def test_torques_over_time_give_their_integral_and_their_work() -> None:
    # a ramp, a jump in it, and a plateau, in steps of 2.6e-5 s
    table = TorqueTable((0.01, 0.03, 0.03, 0.05), ((0.0,), (4e-4,), (1e-4,), (2e-4,)))
    model = model_of(boxes((0.03,), (0.01,), (6, 2), hinged=False), table=table)
    zero = np.zeros_like(model.points)
    state = start_state(model, zero, zero, 0.0)
    while state.time_s < 0.06:
        state, _ = advance(model, state, 100, False)
    x, v = model.points + state.displacement, state.velocity
    turn = model.mass @ (x[:, 0] * v[:, 1] - x[:, 1] * v[:, 0])
    now = state.time_s - 0.5 * model.step_s
    given = 0.5 * 4e-4 * 0.02 + 0.5 * (1e-4 + 2e-4) * 0.02 + 2e-4 * (now - 0.05)
    # the jump falls into a step
    assert turn == pytest.approx(given, abs=3e-4 * model.step_s)
    taken = sample(model, state, advance(model, state, 1, False)[1], 0.0)
    assert taken.drive_work_J < 0.97 * 2e-4 * state.face_angles[0]
    # An O(dt^2) error of the kinetic energy at t_n is all that the balance may show.
    assert abs(taken.energy_balance_J) < 1e-4 * taken.kinetic_energy_J


def test_a_torque_and_its_reaction_turn_two_bodies_apart() -> None:
    torque = 2e-4
    mesh = boxes((0.03, 0.02), (0.01,), (6, 2), hinged=False)
    model = model_of(mesh, (0.0, torque), reaction=True)
    zero = np.zeros_like(model.points)
    state = start_state(model, zero, zero, 0.0)
    for _ in range(20):
        state, _ = advance(model, state, 100, False)
    x, v = model.points + state.displacement, state.velocity
    turn = model.mass * (x[:, 0] * v[:, 1] - x[:, 1] * v[:, 0])
    given = torque * (state.time_s - 0.5 * model.step_s)
    for phalanx, sign in ((0, -1.0), (1, 1.0)):
        own = model.body_of_point == phalanx
        assert turn[own].sum() == pytest.approx(sign * given, rel=1e-10)
        assert np.abs(model.mass[own] @ v[own]).max() < 1e-12 * model.mass.sum()
    taken = sample(model, state, advance(model, state, 1, False)[1], 0.0)
    assert taken.drive_work_J == pytest.approx(torque * (state.face_angles @ [1.0, -1.0]))
    assert abs(taken.energy_balance_J) < 1e-4 * taken.kinetic_energy_J


@pytest.mark.parametrize(
    "drive",
    [
        {"torques": (2e-4, -1e-4)},
        {"torques": (2e-4, -1e-4), "reaction": True, "incline": 0.6},
        {"table": TorqueTable((0.0, 0.02, 0.03), ((0.0, 0.0), (3e-4, -1e-4), (0.0, 2e-4)))},
    ],
    ids=["constant", "motors", "over time"],
)
def test_hinged_boxes_follow_the_rigid_chain(drive: dict[str, Any]) -> None:
    # Stiff boxes, so that flexibility is small: its effect falls with E.
    mesh = boxes((0.04, 0.03), (0.01, 0.01), (4, 1, 1))
    errors = []
    for young in (1e8, 4e8):
        model = model_of(mesh, gravity=9.8, material=Material(young, 0.3, 1000.0), **drive)
        begin = ChainState(np.array([0.2, 0.5]), np.array([4.0, -6.0]), 0.0)
        state = start_state(
            model, *pose(model.chain, begin, model.points, model.body_of_point), 0.0
        )
        state, _ = advance(model, state, 4000 if young == 1e8 else 8000, False)
        hinges = model.hinges
        for h in range(hinges.size):
            own = slice(hinges.starts[h], hinges.starts[h + 1])
            violation = hinges.weights[own] @ state.displacement[hinges.nodes[own], :2]
            assert np.abs(violation).max() < 1e-15  # round-off of displacements of 0.05 m
        state_at, _ = fly(model.chain, begin, lambda _angles: 1.0, 1.01 * state.time_s)
        rigid, _ = pose(model.chain, state_at(state.time_s), model.points, model.body_of_point)
        errors.append(np.abs(state.displacement - rigid)[:, :2].max())
    assert errors[0] < 1e-4  # of a motion of centimetres
    assert errors[1] < 0.5 * errors[0]


def test_hinge_closes_an_open_gap_in_one_step() -> None:
    # What keeps round-off from drifting, seen on a gap far above round-off.
    model = model_of(boxes((0.04, 0.03), (0.01,), (4, 2)))
    zero = np.zeros_like(model.points)
    state = start_state(model, zero, zero, 0.0)
    open_hinge = state.displacement.copy()
    open_hinge[model.body_of_point == 1, 0] = 1e-7
    state, _ = advance(model, replace(state, displacement=open_hinge), 1, False)
    hinges = model.hinges
    for h in range(hinges.size):
        own = slice(hinges.starts[h], hinges.starts[h + 1])
        assert abs(hinges.weights[own] @ state.displacement[hinges.nodes[own], 0]) < 1e-21


def test_half_model_moves_as_the_full_one() -> None:
    ends = []
    for half, width in ((False, 4), (True, 2)):
        mesh = boxes((0.04, 0.03), (0.01, 0.02), (4, 1, width), half=half)
        model = replace(model_of(mesh, (1e-3, -2e-3), 9.8), step_s=1e-5)
        zero = np.zeros_like(model.points)
        state, _ = advance(model, start_state(model, zero, zero, 0.0), 1000, False)
        upper = mesh.points[:, 2] >= 0.0
        ends.append(state.displacement[upper][np.lexsort(mesh.points[upper].T)])
        ends.append(model.symmetry_factor * model.mass.sum())
    assert ends[1] == pytest.approx(ends[3])
    # The same equations in another order: round-off, which 1000 steps may add up.
    assert np.abs(ends[0]).max() > 1e-3
    assert np.allclose(ends[0], ends[2], rtol=0, atol=1e-12)


def test_hinge_carries_the_weight() -> None:
    # Hanging straight down at rest: the reaction of hinge w is the weight below it.
    mesh = boxes((0.04, 0.03), (0.01, 0.02), (4, 1, 2), half=True)
    model = model_of(mesh, gravity=9.8)
    down = ChainState(np.full(2, np.pi / 2), np.zeros(2), 0.0)
    state = start_state(model, *pose(model.chain, down, model.points, model.body_of_point), 0.0)
    mean, count = np.zeros((2, 2)), 400
    for _ in range(count):
        state, block = advance(model, state, 20, False)
        mean += sample(model, state, block, 0.0).hinge_reactions_N / count
    weight = 9.8 * 1000.0 * 0.01 * 0.02 * np.array([0.07, 0.03])
    # It rings about the static value, as the weight comes on suddenly; the mean is left.
    assert mean[:, 1] == pytest.approx(weight, rel=0.02)
    assert np.abs(mean[:, 0]).max() < 1e-3 * weight[0]


def test_blocks_of_steps_compose_bit_for_bit() -> None:
    model = model_of(boxes((0.04, 0.03), (0.01,), (4, 2)), (1e-4, 0.0), 9.8)
    zero = np.zeros_like(model.points)
    begin = start_state(model, zero, zero, 0.0)
    whole, _ = advance(model, begin, 30, True)
    part, _ = advance(model, begin, 13, True)
    assert part.step == 13
    pieces, _ = advance(model, part, 17, True)
    assert np.array_equal(whole.displacement, pieces.displacement)
    assert np.array_equal(whole.velocity, pieces.velocity)
    assert np.array_equal(begin.displacement, zero)  # what goes in stays as it is


@pytest.mark.parametrize("half", [False, True])
def test_a_half_models_gap_is_not_doubled(half: bool) -> None:
    """Its forces are."""
    model = model_of(boxes((0.04,), (0.01, 0.02), (4, 1, 2), half=half))
    zero = np.zeros_like(model.points)
    state = start_state(model, zero, zero, 0.0)
    _, block = advance(model, state, 1, True)
    recorder = Recorder(Settings())
    recorder.add(model, state, block, sample(model, state, block, 0.0), False)
    gap = recorder.forces().lowest_gap_m[0]
    assert gap == pytest.approx(lowest_gap(model, zero), rel=1e-12)


def test_the_work_of_a_ramp_is_of_second_order() -> None:
    """To first order 2/(3 N) of the kinetic energy would be missing, 3e-3 in N = 200 steps; 2.5e-5
    measured.
    """
    table = TorqueTable((0.0, 1.0), ((0.0,), (0.1,)))
    model = model_of(boxes((0.03,), (0.01,), (6, 2), hinged=False), table=table)
    zero = np.zeros_like(model.points)
    state, _ = advance(model, start_state(model, zero, zero, 0.0), 200, False)
    taken = sample(model, state, advance(model, state, 1, False)[1], 0.0)
    assert abs(taken.energy_balance_J) < 2e-4 * taken.kinetic_energy_J
