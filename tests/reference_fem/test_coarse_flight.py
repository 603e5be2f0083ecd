"""A flight on fewer elements: what the run's mesh takes over, and runs that fly so."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import meshes
import reference_fem as rf
from reference_fem.arrays import Array
from reference_fem.coarse_flight import (
    REACH,
    CoarseFlight,
    coarse_flight,
    joint_momenta,
    moving_least_squares,
)
from reference_fem.dynamics.energy import sample
from reference_fem.dynamics.loop_state import LoopState, first_loop_state
from reference_fem.dynamics.step import advance
from reference_fem.model import Model, build_model
from reference_fem.rigid_chain import chain_and_start, pose
from tests.reference_fem.taps import GEOMETRY, SOFT, SURFACE
from tests.reference_fem.test_restart import Counter, assert_same_bits

COARSE = meshes.Sizing(4e-3, 4e-3, 4e-3)
FINE = meshes.Sizing(2e-3, 3e-3, 5e-4, growth=1.4, halvings=1)
RUBBER = (rf.Material(2e6, 0.4, 1400.0, 1e-5),) * 3


def meshed(dim: int, sizing: meshes.Sizing) -> meshes.FingerMesh:
    return (meshes.finger_quadrilaterals if dim == 2 else meshes.finger_hexahedra)(GEOMETRY, sizing)


def handing_over(dim: int, materials: Any = SOFT) -> CoarseFlight:
    given = materials, SURFACE, rf.Drive((1e-3, 0.0, 0.0)), rf.Settings(contact="impulse")
    return coarse_flight(*(build_model(meshed(dim, s), *given) for s in (COARSE, FINE)))


@pytest.fixture(scope="module", params=[2, 3])
def over(request: pytest.FixtureRequest) -> CoarseFlight:
    return handing_over(request.param)


def closed(model: Model, field: Array) -> Array:
    """What is left open in the hinges, (P, 2)."""
    hinges = model.hinges
    parts = hinges.weights[:, None] * field[hinges.nodes, :2]
    return np.add.reduceat(parts, hinges.starts[:-1])


def momenta(model: Model, displacement: Array, velocity: Array) -> Array:
    motions = joint_momenta(model, displacement)[1]
    return np.einsum("i,kid,id->k", model.mass, motions, velocity[:, :2])


def test_a_rigid_motion_is_handed_on_exactly(over: CoarseFlight) -> None:
    chain, _ = chain_and_start(over.to.chain, None)
    state = rf.ChainState(np.array([0.4, 1.7, 3.0]), np.array([9.0, -20.0, 31.0]), 0.0)
    motions = [pose(chain, state, m.points, m.body_of_point) for m in (over.model, over.to)]
    for found, wanted in zip(over.motion(*motions[0]), motions[1], strict=True):
        scale = np.abs(wanted).max()
        assert found == pytest.approx(wanted, abs=1e-11 * scale)  # round-off of the fits
    kinetic = [
        m.mass @ (v**2).sum(axis=1)
        for m, (_, v) in zip((over.model, over.to), motions, strict=True)
    ]
    assert kinetic[1] == pytest.approx(kinetic[0], rel=1e-10)  # of one chain, by `mass_factors`


def test_fields_of_second_order_are_exact_where_nothing_hangs(over: CoarseFlight) -> None:
    """Bending with its sections' change, an even strain, and motion out of the plane."""

    def field(points: Array) -> Array:
        x, y, z = np.column_stack([points, np.zeros((len(points), 3 - points.shape[1]))]).T
        values = np.stack([x * y + 0.1 * x, -0.5 * x**2 + 0.2 * y**2 - 0.1 * z**2, 0.3 * y * z + z])
        return values.T[:, : points.shape[1]]

    off = over.on_run(field(over.model.points)) - field(over.to.points)
    # but for shifts that close the hinges; a hanging node is the mean of its neighbours
    off[over.to.ties.nodes] = off[over.to.ties.of].mean(axis=1)
    for w in range(3):
        assert np.ptp(off[over.to.body_of_point == w], axis=0) == pytest.approx(0.0, abs=1e-14)


@pytest.mark.parametrize(("dim", "counts"), [(2, (8, 16, 32)), (3, (8, 16))])
def test_a_bending_wave_is_taken_over_in_third_order(dim: int, counts: tuple[int, ...]) -> None:
    """A rod of three sections' length, its ends and sides included, where fits are one-sided."""

    def wave(points: Array) -> Array:
        return np.stack([points[:, 1] * np.cos(3.0 * points[:, 0]), np.sin(3.0 * points[:, 0])])

    rng, errors = np.random.default_rng(1), []
    places = rng.random((300, dim)) * [3.0, *(1.0,) * (dim - 1)]
    for count in counts:
        axes = [np.linspace(0.0, 1.0 + 2.0 * (d == 0), count * (3 - 2 * (d > 0)) + 1)
                for d in range(dim)]  # fmt: skip
        nodes = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, dim)
        near, weights = moving_least_squares(nodes, places, REACH / count)
        off = (wave(nodes)[:, near] * weights).sum(axis=-1) - wave(places)
        errors.append(float(np.abs(off).max()))
    assert (np.log2(np.array(errors[:-1]) / errors[1:]) > 2.7).all(), errors


def swung(over: CoarseFlight, steps: int) -> LoopState:
    """The finger of the flight's model after so many steps of its fall."""
    model = over.model
    rest = np.zeros_like(model.points)
    now = first_loop_state(model, rest, rest, 0.0)
    return replace(now, state=advance(model, now.state, steps, False)[0], coarse=True)


@pytest.mark.parametrize("dim", [2, 3])
def test_momenta_and_hinges_are_kept_and_energy_almost(dim: int) -> None:
    over = handing_over(dim, RUBBER)
    now = swung(over, 3000)
    state, block = now.state, advance(over.model, now.state, 1, False)[1]
    displacement, velocity = over.motion(state.displacement, block.velocity)
    scale = np.abs(velocity).max()
    assert closed(over.to, displacement) == pytest.approx(0.0, abs=1e-15)
    assert closed(over.to, velocity) == pytest.approx(0.0, abs=1e-14 * scale)
    before = momenta(over.model, state.displacement, block.velocity)
    after = momenta(over.to, displacement, velocity)
    assert after == pytest.approx(before, rel=1e-12)
    linear = [m.mass @ v[:, :2] for m, v in ((over.model, block.velocity), (over.to, velocity))]
    # whose hinge at the origin takes up what the finger's own does not keep
    assert linear[1] == pytest.approx(linear[0], abs=1e-4 * np.abs(linear[0]).max())
    bent = (one := sample(over.model, state, block, 0.0)).strain_energy_J
    other = over.handed_over(now)
    assert other.state.time_s == state.time_s
    assert not other.coarse
    two = sample(over.to, other.state, advance(over.to, other.state, 1, False)[1], 0.0)
    assert two.material_dissipation_J == one.material_dissipation_J > 0.0
    assert two.drive_work_J == pytest.approx(one.drive_work_J, rel=1e-3)
    # measured over the energy of bending: strain -0.5 % (2D) and +1.7 % (3D), kinetic -0.04 %
    assert two.strain_energy_J == pytest.approx(bent, rel=0.03)
    assert two.kinetic_energy_J == pytest.approx(one.kinetic_energy_J, abs=1e-3 * bent)
    assert abs(two.energy_balance_J) < 0.03 * bent


RUN = meshes.Sizing(2e-3, 3e-3, 1.5e-3)
FLYING: dict[str, Any] = {
    "mesh": meshed(3, RUN),
    "flight_mesh": meshed(3, COARSE),
    "materials": (rf.Material(2e7, 0.4, 1400.0),) * 3,
    "surface": rf.Surface(0.02, 0.5),
    "drive": rf.Drive(table=rf.TorqueTable((0.0, 0.2), ((0.0, 0.0, 1e-3), (0.0, 0.0, 4e-3)))),
    "settings": rf.Settings(flight="coarse", contact="impulse", estimate=False),
}


def fly(progress: Any = None, restart: rf.Restart | None = None, **changes: Any) -> rf.TapResult:
    settings = replace(FLYING["settings"], **changes)
    return rf.simulate(**FLYING | {"settings": settings}, progress=progress, restart=restart)


@pytest.fixture(scope="module")
def flown() -> tuple[rf.TapResult, int]:
    counter = Counter()
    return fly(counter), counter.reports


def test_a_coarse_flight_comes_to_the_tap_of_the_explicit_one(
    flown: tuple[rf.TapResult, int],
) -> None:
    found = flown[0].summary
    assert flown[0].status is rf.Status.COMPLETED
    plain = {key: value for key, value in FLYING.items() if key != "flight_mesh"}
    whole, rigid = (
        rf.simulate(**plain | {"settings": replace(FLYING["settings"], flight=flight)}).summary
        for flight in ("explicit", "rigid")
    )
    assert found.steps < whole.steps / 20
    # off the explicit flight, measured, and of the rigid one: arrival 0.2 and 1.6 us, impulse
    # 0.01 and 0.55 %, duration 0.05 and 0.8 %; 0.14 and 0.16 % in the peak, where a mesh of
    # four elements over the diameter has its vibration in another phase
    assert abs(rigid.contact_time_s - whole.contact_time_s) > 1e-6
    assert found.contact_time_s == pytest.approx(whole.contact_time_s, abs=4e-7)
    assert found.normal_impulse_N_s == pytest.approx(whole.normal_impulse_N_s, rel=1e-3)
    assert found.contact_duration_s == pytest.approx(whole.contact_duration_s, rel=2e-3)
    assert found.peak_normal_force_N == pytest.approx(whole.peak_normal_force_N, rel=3e-3)
    assert found.energy_residual == pytest.approx(whole.energy_residual, abs=2e-4)


# Of the set-up and some 30 blocks of the flight, and of the contact.
@pytest.mark.parametrize("share", [0.1, 0.9])
def test_an_interrupted_flight_or_contact_resumes_to_the_same_bits(
    share: float, flown: tuple[rf.TapResult, int], tmp_path: Path
) -> None:
    path = tmp_path / "restart.npz"
    whole, reports = flown
    stopped = fly(Counter(round(share * reports)), rf.Restart(path, every_s=0.0))
    assert stopped.status is rf.Status.INTERRUPTED
    with np.load(path) as kept:
        on = FLYING["flight_mesh" if share < 0.5 else "mesh"]
        assert kept["state.displacement"].shape == on.points.shape
    assert_same_bits(fly(restart=rf.Restart(path, resume=True)), whole)
    with pytest.raises(rf.RestartError, match="other flight mesh"):
        rf.simulate(
            **FLYING | {"flight_mesh": meshed(3, RUN)}, restart=rf.Restart(path, resume=True)
        )


def test_a_flight_that_ends_before_the_touch_has_no_contact() -> None:
    found = fly(end_time_s=0.01)
    assert found.status is rf.Status.NOT_REACHED
    assert "no contact up to t = 0.01" in found.message
    assert found.summary.peak_normal_force_N is None
    assert fly(max_flight_time_s=0.01).status is rf.Status.NOT_REACHED
    with pytest.raises(ValueError, match="max_flight_time = 2: asks for"):
        fly(max_steps=100)


LONGER = replace(GEOMETRY, lengths=(0.04, 0.05, 0.03))


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"flight_mesh": None}, "flight = 'coarse': a flight_mesh is for"),
        ({"settings": rf.Settings()}, "flight = 'rigid': a flight_mesh is for"),
        ({"flight_mesh": meshed(2, COARSE)}, "flight_mesh: is another finger"),
        ({"flight_mesh": meshes.finger_hexahedra(LONGER, COARSE)}, "flight_mesh: is another"),
        ({"flight_mesh": meshed(3, meshes.Sizing(4e-3, 0.04, 4e-3))}, "too few nodes"),
    ],
)
def test_meshes_that_do_not_fit_are_refused(changes: dict[str, Any], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        rf.simulate(**FLYING | changes)
