"""Hinges formed by nodes on shaft holes: they hold and turn freely, and couples act as given."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import meshes
import reference_fem as rf
from reference_fem.dynamics.step import advance, start_state
from reference_fem.joints.couples import apply_couples
from reference_fem.joints.hinges import mean_weights
from reference_fem.model import Model, build_model
from reference_fem.rigid.rigid_chain import ChainState, pose

MATERIALS = (rf.Material(1e8, 0.4, 1400.0),) * 3
GEOMETRY = meshes.FingerGeometry((0.04,) * 3, (0.015,) * 3, shaft_radius=2.5e-3)
SIZING = meshes.Sizing(3e-3, 6e-3, 3e-3)
DRIVE = rf.Drive(torques=(0.02, 0.01, 0.004))


@pytest.fixture(scope="module", params=[3, 2])
def mesh(request: pytest.FixtureRequest) -> meshes.FingerMesh:
    build = meshes.finger_hexahedra if request.param == 3 else meshes.finger_quadrilaterals
    return build(GEOMETRY, SIZING)


@pytest.fixture(scope="module")
def model(mesh: meshes.FingerMesh) -> Model:
    return build_model(mesh, MATERIALS, rf.Surface(0.1, 0.5), DRIVE, rf.Settings())


def test_couples_have_the_torque_and_no_force_on_a_bent_face(model: Model) -> None:
    state = ChainState(np.array([0.4, 1.1, 2.0]), np.zeros(3), 0.0)
    displacement, _ = pose(model.chain, state, model.points, model.body_of_point)
    rng = np.random.default_rng(1)
    displacement += 1e-5 * rng.standard_normal(displacement.shape)
    assert model.couples.joints.tolist() == [0, 1, 2]
    for face, torque in enumerate(DRIVE.torques):
        residual = np.zeros_like(displacement)
        of_joints = np.where(np.arange(3) == face, model.torques.values[0], 0.0)
        apply_couples(model.couples, model.couples.torques(of_joints), displacement, residual)
        force = -residual  # residual is internal less external force
        x = model.points + displacement
        moment = np.sum(x[:, 0] * force[:, 1] - x[:, 1] * force[:, 0])
        assert moment * model.symmetry_factor == pytest.approx(torque, rel=1e-12)
        assert np.abs(force.sum(axis=0)).max() < 1e-12 * np.abs(force).sum()


def test_hinges_close_and_turning_about_the_shafts_costs_nothing(model: Model) -> None:
    state = ChainState(np.array([0.3, -0.8, 2.5]), np.zeros(3), 0.0)
    displacement, _ = pose(model.chain, state, model.points, model.body_of_point)
    hinges = model.hinges
    for h in range(hinges.size):
        own = slice(hinges.starts[h], hinges.starts[h + 1])
        gap = hinges.weights[own] @ displacement[hinges.nodes[own], :2]
        assert np.abs(gap).max() < 1e-15
    assert model.kernel.energies(displacement)[0] < 1e-20


def test_driven_finger_moves_as_its_rigid_chain(model: Model) -> None:
    still = np.zeros_like(model.points)
    state = start_state(model, still, still, 0.0)
    for _ in range(8):
        state, _ = advance(model, state, 1000, search=False)
    chain = model.chain
    fall = solve_ivp(
        lambda _, y: chain.rates_of_change(y, model.chain.torques.at(0.0)),
        (0.0, state.time_s),
        np.zeros(6),
        rtol=1e-9,
    )
    rigid = fall.y[:3, -1]
    assert np.abs(rigid).min() > 0.1
    # The driven faces twist elastically as well, by some t L/(E I) = 3e-3 rad.
    assert state.face_angles == pytest.approx(rigid, abs=5e-3)


def test_whole_tap_keeps_joints_and_energy(mesh: meshes.FingerMesh) -> None:
    settings = rf.Settings(flight="explicit")
    # torques under which the last phalanx, which alone may touch, arrives first
    drive = rf.Drive(torques=(0.005, 0.005, 0.004))
    result = rf.simulate(mesh, MATERIALS, rf.Surface(0.02, 0.5), drive, settings)
    assert result.status is rf.Status.COMPLETED
    assert result.summary.energy_residual < 1e-3
    for snapshot in result.snapshots:
        for w in (1, 2, 3):
            near = mesh.node_sets[f"hinge_{w}_proximal"]
            moved = mean_on_plane(mesh, near, snapshot.displacement)
            if w == 1:
                assert np.abs(moved).max() < 1e-12
            else:
                far = mesh.node_sets[f"hinge_{w - 1}_distal"]
                assert moved == pytest.approx(
                    mean_on_plane(mesh, far, snapshot.displacement), abs=1e-12
                )


def mean_on_plane(mesh: meshes.FingerMesh, nodes: np.ndarray, field: np.ndarray) -> np.ndarray:
    """Mean over a hinge's edges, as the model takes it."""
    nodes, weights = mean_weights(mesh.points, mesh.cells, nodes, GEOMETRY.radii[0])
    mean: np.ndarray = weights @ field[nodes, :2]
    return mean
