"""A flight on fewer elements: what the run's mesh takes over, and runs that fly so."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import meshes
import reference_fem as rf
from reference_fem.arrays import Array
from reference_fem.dynamics.coarse_flight import (
    REACH,
    CoarseFlight,
    coarse_flight,
    joint_momenta,
    moving_least_squares,
)
from reference_fem.dynamics.energy import sample
from reference_fem.dynamics.flight_block import FLIGHT_BLOCK
from reference_fem.dynamics.state import LoopState
from reference_fem.dynamics.step import advance, start_state
from reference_fem.estimates.flight_error import OmittedMotion
from reference_fem.model import build_model
from reference_fem.rigid.rigid_chain import chain_and_start, pose
from reference_fem.scene import Scene
from tests.reference_fem.taps import GEOMETRY, SURFACE
from tests.reference_fem.test_restart import Counter, assert_same_bits

COARSE, RUN = meshes.Sizing(4e-3, 4e-3, 4e-3), meshes.Sizing(2e-3, 3e-3, 1.5e-3)
HALVED = meshes.Sizing(2e-3, 3e-3, 5e-4, growth=1.4, halvings=1)
RUBBER_10 = (rf.Material(1e7, 0.4, 1400.0),) * 3
RUBBER = (rf.Material(2e6, 0.4, 1400.0, 1e-5),) * 3


def meshed(sizing: meshes.Sizing, dim: int = 3) -> meshes.FingerMesh:
    return (meshes.finger_quadrilaterals if dim == 2 else meshes.finger_hexahedra)(GEOMETRY, sizing)


@pytest.fixture(scope="module", params=[2, 3])
def over(request: pytest.FixtureRequest) -> CoarseFlight:
    given = RUBBER, SURFACE, rf.Drive((1e-3, 0.0, 0.0)), rf.Settings(contact="impulse")
    pair = (build_model(meshed(sizing, request.param), *given) for sizing in (COARSE, HALVED))
    return coarse_flight(*pair)


def test_a_rigid_motion_is_handed_on_exactly(over: CoarseFlight) -> None:
    chain, _ = chain_and_start(over.to.chain, None)
    state = rf.ChainState(np.array([0.4, 1.7, 3.0]), np.array([9.0, -20.0, 31.0]), 0.0)
    motions = [pose(chain, state, m.points, m.body_of_point) for m in (over.model, over.to)]
    for found, wanted in zip(over.motion(*motions[0]), motions[1], strict=True):
        assert found == pytest.approx(wanted, abs=1e-11 * np.abs(wanted).max())  # round-off


def test_fields_of_second_order_are_exact(over: CoarseFlight) -> None:
    """Bending with its sections' change, an even strain, and motion out of the plane."""

    def field(points: Array) -> Array:
        x, y, z = np.column_stack([points, np.zeros((len(points), 3 - points.shape[1]))]).T
        values = np.stack([x * y + 0.1 * x, -0.5 * x**2 + 0.2 * y**2 - 0.1 * z**2, 0.3 * y * z + z])
        return values.T[:, : points.shape[1]]

    found, ties = over.on_run(field(over.model.points)), over.to.ties
    off = found - field(over.to.points)
    # but for shifts that close the hinges; a hanging node is the mean of its neighbours
    assert found[ties.nodes] == pytest.approx(found[ties.of].mean(axis=1), abs=1e-15)
    off[over.to.ties.nodes] = off[over.to.ties.of].mean(axis=1)
    for w in range(3):
        assert np.ptp(off[over.to.body_of_point == w], axis=0) == pytest.approx(0.0, abs=1e-14)


@pytest.mark.parametrize(("dim", "counts"), [(2, (8, 16, 32)), (3, (8, 16))])
def test_a_bending_wave_is_taken_over_in_third_order(dim: int, counts: tuple[int, ...]) -> None:
    """A rod's ends and sides included, where fits are one-sided."""

    def wave(points: Array) -> Array:
        return np.stack([points[:, 1] * np.cos(3.0 * points[:, 0]), np.sin(3.0 * points[:, 0])])

    places, errors = np.random.default_rng(1).random((300, dim)), []
    for count in counts:
        axes = np.meshgrid(*[np.linspace(0.0, 1.0, count + 1)] * dim)
        nodes = np.stack(axes, axis=-1).reshape(-1, dim)
        near, weights = moving_least_squares(nodes, places, REACH / count)
        off = (wave(nodes)[:, near] * weights).sum(axis=-1) - wave(places)
        errors.append(float(np.abs(off).max()))
    assert (np.log2(np.array(errors[:-1]) / errors[1:]) > 2.7).all(), errors


def test_momenta_and_hinges_are_kept_and_energy_almost(over: CoarseFlight) -> None:
    rest, hinges = np.zeros_like(over.model.points), over.to.hinges
    now = LoopState(start_state(over.model, rest, rest, 0.0), 0.0)
    now = replace(now, state=advance(over.model, now.state, 3000, False)[0], coarse=True)
    block = advance(over.model, now.state, 1, False)[1]
    before, after = (now.state.displacement, block.velocity), over.handed_over(now)
    motion = over.motion(*before)
    for field in motion:
        parts = hinges.weights[:, None] * field[hinges.nodes, :2]
        assert np.abs(np.add.reduceat(parts, hinges.starts[:-1])).max() < 1e-15
    momenta, linear = [], []
    for model, (displacement, velocity) in ((over.model, before), (over.to, motion)):
        turns = joint_momenta(model, displacement)[1]
        momenta.append(np.einsum("i,kid,id->k", model.mass, turns, velocity[:, :2]))
        linear.append(model.mass @ velocity[:, :2])
    assert momenta[1] == pytest.approx(momenta[0], rel=1e-12)
    assert linear[1] == pytest.approx(linear[0], rel=2e-5)  # measured 2e-6 to 6e-6
    one = sample(over.model, now.state, block, 0.0)
    two = sample(over.to, after.state, advance(over.to, after.state, 1, False)[1], 0.0)
    assert (after.state.time_s, after.coarse) == (now.state.time_s, False)
    assert two.material_dissipation_J == one.material_dissipation_J > 0.0
    assert two.drive_work_J == pytest.approx(one.drive_work_J, rel=1e-4)
    # measured over the energy of bending: strain -0.5 % (2D) and +1.7 % (3D), kinetic -0.04 %
    bent = one.strain_energy_J
    assert two.strain_energy_J == pytest.approx(bent, rel=0.03)
    assert two.kinetic_energy_J == pytest.approx(one.kinetic_energy_J, abs=1e-3 * bent)
    assert abs(two.energy_balance_J) < 0.03 * bent
    # a flight that has come apart goes on to the audit that says so
    lost = replace(now.state, velocity=np.full_like(rest, np.nan))
    assert over.steps_ahead(lost, 2) == FLIGHT_BLOCK
    assert over.steps_ahead(now.state, 2) > 0


FLYING: dict[str, Any] = {
    "mesh": meshed(RUN),
    "flight_mesh": meshed(COARSE),
    "materials": (rf.Material(2e7, 0.4, 1400.0),) * 3,
    "surface": rf.Surface(0.02, 0.5),
    "drive": rf.Drive(table=rf.TorqueTable((0.0, 0.2), ((0.0, 0.0, 1e-3), (0.0, 0.0, 4e-3)))),
    "settings": rf.Settings(flight="coarse", contact="impulse", estimate=False),
}


def fly(progress: Any = None, restart: rf.Restart | None = None, **changes: Any) -> rf.TapResult:
    settings = replace(FLYING["settings"], **changes)
    mesh = FLYING["flight_mesh"] if settings.flight == "coarse" else None
    given = FLYING | {"settings": settings, "flight_mesh": mesh}
    return rf.simulate(**given, progress=progress, restart=restart)


@pytest.fixture(scope="module")
def flown() -> tuple[rf.TapResult, int]:
    return fly(counter := Counter()), counter.reports


def test_a_coarse_flight_comes_to_the_explicit_ones_tap(flown: tuple[rf.TapResult, int]) -> None:
    assert flown[0].status is rf.Status.COMPLETED
    found, whole, rigid = flown[0].summary, fly(flight="explicit").summary, fly(flight="rigid")
    on_the_runs_mesh = flown[0].forces.time_s.size
    assert on_the_runs_mesh < whole.steps / 20 < found.steps < whole.steps
    # off the explicit flight, measured, and of the rigid one: arrival 0.2 and 1.6 us, impulse
    # 0.01 and 0.55 %; 0.14 and 0.16 % in the peak, where four elements over the diameter have
    # their vibration in another phase
    assert abs(rigid.summary.contact_time_s - whole.contact_time_s) > 1e-6
    assert found.contact_time_s == pytest.approx(whole.contact_time_s, abs=4e-7)
    assert found.normal_impulse_N_s == pytest.approx(whole.normal_impulse_N_s, rel=1e-3)
    assert found.peak_normal_force_N == pytest.approx(whole.peak_normal_force_N, rel=3e-3)
    assert found.energy_residual == pytest.approx(whole.energy_residual, abs=2e-4)


# Of some 50 reports those of the contact come last.
@pytest.mark.parametrize(("share", "on"), [(0.1, "flight_mesh"), (0.9, "mesh")])
def test_an_interrupted_flight_or_contact_resumes_to_the_same_bits(
    share: float, on: str, flown: tuple[rf.TapResult, int], tmp_path: Path
) -> None:
    again = rf.Restart(tmp_path / "restart.npz", resume=True, every_s=0.0)
    stopped = fly(Counter(round(share * flown[1])), again)
    assert stopped.status is rf.Status.INTERRUPTED
    with np.load(again.path) as kept:
        assert kept["state.displacement"].shape == FLYING[on].points.shape
    assert_same_bits(fly(restart=replace(again, every_s=1e9)), flown[0])
    with pytest.raises(rf.RestartError, match="different flight_mesh"):
        rf.simulate(**FLYING | {"flight_mesh": meshed(RUN)}, restart=again)


def test_a_flight_that_ends_before_the_touch_has_no_contact() -> None:
    for ends in ({"end_time_s": 0.01}, {"max_flight_time_s": 0.01}):
        found = fly(**ends)
        assert found.status is rf.Status.NOT_REACHED
        assert "no contact up to t = 0.01" in found.message
    with pytest.raises(ValueError, match="max_flight_time = 2: asks for"):
        fly(max_steps=100)


def test_a_tip_that_rises_is_not_handed_over(over: CoarseFlight) -> None:
    """It was, and flew on on the run's mesh; one that sinks as fast is."""
    still = np.zeros_like(over.model.points)
    near = still + [0.0, -0.09, 0.0][: still.shape[1]]  # 2.5 mm above the surface
    for speed, handed_over in ((3.0, False), (-3.0, True)):
        moving = still + [0.0, speed, 0.0][: still.shape[1]]
        state = start_state(over.model, near, moving, 0.0)
        assert (over.steps_ahead(state, 2) < FLIGHT_BLOCK) == handed_over


def test_steps_before_the_touch_are_left_to_the_runs_mesh(over: CoarseFlight) -> None:
    """Half of them at most is flown ahead: a lead of n steps takes n/2 of the run's off it."""
    near = np.zeros_like(over.model.points) + [0.0, -0.09, 0.0][: over.model.points.shape[1]]
    moving = np.zeros_like(near) + [0.0, -3.0, 0.0][: near.shape[1]]
    state = start_state(over.model, near, moving, 0.0)
    none = over.steps_ahead(state, 0)
    assert 10 < none < FLIGHT_BLOCK
    lead = round(none * over.model.step_s / over.to.step_s)
    # whole steps, both rounded
    assert over.steps_ahead(state, lead) == pytest.approx(none / 2, abs=1.5)


def test_a_driven_phalanxs_turns_are_handed_over(over: CoarseFlight) -> None:
    """After a whole turn and more its torque has done the work of all of it."""
    chain, _ = chain_and_start(over.model.chain, None)
    turned = rf.ChainState(np.array([8.0, 0.5, 0.5]), np.zeros(3), 0.0)
    motion = pose(chain, turned, over.model.points, over.model.body_of_point)
    state = start_state(over.model, *motion, 0.0, turned.angles)
    after = over.handed_over(LoopState(state, 0.0, coarse=True)).state
    assert state.face_angles == pytest.approx([8.0], abs=1e-3)
    # a step of the flight's apart
    assert after.face_angles == pytest.approx(state.face_angles, abs=1e-3)


def test_nodes_of_the_symmetry_plane_stay_in_it(over: CoarseFlight) -> None:
    """Exactly, whatever the flight's nodes do off it."""
    field = np.random.default_rng(2).normal(size=over.model.points.shape)
    assert (over.on_run(field)[over.to.symmetry, 2:] == 0.0).all()


@pytest.mark.parametrize(("flight", "height"), [("explicit", 0.0245), ("coarse", 0.02)])
def test_a_torque_does_not_turn_the_tip_through_the_surface_between_two_looks(
    flight: Any, height: float
) -> None:
    """The tip gains 4 m/s within a flight block of 8 ms, and touches as it does after a rigid one
    (of the finger's bending on its way, an eighth of the peak).
    """
    scene = (RUBBER_10, rf.Surface(height, 0.5), rf.Drive((0.0, 0.0, 0.15)))
    mesh, runs = meshed(meshes.Sizing(2.5e-3, 3e-3, 1e-3), 2), []
    for way in ("rigid", flight):
        light = meshed(meshes.Sizing(3.75e-3, 3.75e-3, 3.75e-3), 2) if way == "coarse" else None
        settings = rf.Settings(flight=way, contact="impulse", estimate=False)
        runs.append(rf.simulate(mesh, *scene, settings, flight_mesh=light))
    assert [run.status for run in runs] == [rf.Status.COMPLETED] * 2
    assert runs[1].forces.lowest_gap_m.min() == pytest.approx(0.0, abs=1e-16)  # round-off
    rigid, own = (run.summary for run in runs)
    assert own.contact_time_s == pytest.approx(rigid.contact_time_s, rel=0.03)
    assert own.peak_normal_force_N == pytest.approx(rigid.peak_normal_force_N, rel=0.12)


@pytest.mark.parametrize("torque", [0.66, 0.8])
def test_a_swing_through_the_surface_within_a_block_is_a_touch(torque: float) -> None:
    """The tip passed the surface and came up again between two looks: an arrival of 10.55 +- 0.02
    ms; or a turn of its torque's work was lost, and the run was unstable. Explicit flights on this
    mesh touch at 3.906 and 3.547 ms, rigid ones 0.2 and 0.1 % from that.
    """
    geometry = meshes.FingerGeometry((0.04,), (0.015,))
    sizes = (meshes.Sizing(edge, edge, edge) for edge in (1.5e-3, 3.75e-3))
    mesh, light = (meshes.finger_quadrilaterals(geometry, sizing) for sizing in sizes)
    scene = (rf.Material(1e8, 0.4, 1400.0),), rf.Surface(0.035, 0.1), rf.Drive((torque,))
    touches = []
    for way, flight_mesh in (("rigid", None), ("explicit", None), ("coarse", light)):
        settings = rf.Settings(flight=way, contact="impulse", estimate=False)
        run = rf.simulate(mesh, *scene, settings, flight_mesh=flight_mesh)
        assert run.status is rf.Status.COMPLETED
        touches.append(run.summary.contact_time_s)
    assert touches[1:] == pytest.approx(touches[:1] * 2, rel=0.01)


def test_a_flight_misses_what_its_own_cells_do(monkeypatch: pytest.MonkeyPatch) -> None:
    """Edges of a third of the diameter, not the run's."""
    sections = []

    def omitted(*given: Any) -> OmittedMotion:
        sections.append(given[-1])
        return OmittedMotion(0.0, np.zeros(2))

    monkeypatch.setattr("reference_fem.estimates.estimate.omitted_motion", omitted)
    sizes = (meshes.Sizing(edge, edge, edge) for edge in (2e-3, 5e-3))
    mesh, light = (meshed(sizing, 2) for sizing in sizes)
    settings = replace(FLYING["settings"], estimate=True)
    rf.simulate(mesh, RUBBER_10, SURFACE, rf.Drive(), settings, flight_mesh=light)
    assert sections == [pytest.approx(1 / 3, rel=0.01)]  # those at the round end are skewed


def test_a_result_names_its_meshes_by_what_they_are() -> None:
    """Equal ones alike, others not; a flight on the run's own mesh names no other."""
    run, light = meshed(RUN, 2), meshed(COARSE, 2)

    def given(mesh: meshes.FingerMesh, flight_mesh: meshes.FingerMesh | None) -> dict[str, Any]:
        settings = rf.Settings(flight="rigid" if flight_mesh is None else "coarse")
        return Scene(mesh, RUBBER, SURFACE, rf.Drive(), settings, None, flight_mesh).given

    one = given(run, light)
    assert one == given(meshed(RUN, 2), meshed(COARSE, 2))
    assert one["mesh"] != given(light, light)["mesh"]
    assert one["flight_mesh"] != given(run, run)["flight_mesh"]
    assert "flight_mesh" not in given(run, None)


LONGER = meshes.finger_hexahedra(replace(GEOMETRY, lengths=(0.04, 0.05, 0.03)), COARSE)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"flight_mesh": None}, "flight = 'coarse': a flight_mesh is for"),
        ({"settings": rf.Settings()}, "flight = 'rigid': a flight_mesh is for"),
        ({"flight_mesh": meshed(COARSE, 2)}, "flight_mesh: is not the finger"),
        ({"flight_mesh": LONGER}, "flight_mesh: is not the"),
        ({"flight_mesh": meshed(meshes.Sizing(4e-3, 0.04, 4e-3))}, "too few nodes"),
    ],
)
def test_meshes_that_do_not_fit_are_refused(changes: dict[str, Any], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        rf.simulate(**FLYING | changes)
