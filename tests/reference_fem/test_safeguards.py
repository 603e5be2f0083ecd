"""What ends a run that has gone wrong, what refuses one, and what a good one is cautioned for."""

import dataclasses
import math
import re
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

import meshes
import reference_fem as rf
from reference_fem import cautions
from reference_fem.cautions import contact_edge_ratio, spike
from reference_fem.dynamics import guards
from reference_fem.dynamics.guards import touching_det
from reference_fem.dynamics.next_touch import NEVER, next_touch_s
from reference_fem.elements.geometry import geometries
from reference_fem.elements.kinds import EIGHT_POINT, NEO_HOOKE
from reference_fem.estimates.error_cautions import flutter
from reference_fem.model import Model
from reference_fem.workload import check_work
from tests.reference_fem.boxes import boxes
from tests.reference_fem.taps import body, throw

RUBBER = rf.Material(1e7, 0.3, 1000.0)
SIDE = 0.02


def fall(
    speed: float = 1.0, tilt: float = 0.1, dim: int = 3, **changes: object
) -> tuple[rf.TapResult, Model]:
    """A block hits the surface, edge first."""
    mesh = boxes((SIDE,), (SIDE,) * (dim - 1), (4,) * dim, hinged=False)
    turn = np.eye(dim)
    turn[:2, :2] = (math.cos(tilt), -math.sin(tilt)), (math.sin(tilt), math.cos(tilt))
    u = (mesh.points + np.eye(dim)[0] * SIDE / 2) @ turn.T - mesh.points
    v = np.zeros_like(u)
    v[:, :2] = 0.5 * speed, -speed
    lowest = float((mesh.points + u)[:, 1].min())
    surface = rf.Surface(-lowest + speed * 1e-5, 0.3)
    settings = dataclasses.replace(rf.Settings(threads=1), **changes)  # type: ignore[arg-type]
    model = body(mesh, RUBBER, surface, settings, gravity=rf.Drive().gravity)
    return throw(model, settings, v, u), model


@pytest.mark.parametrize("contact", ["penalty", "surface", "impulse"])
def test_a_tap_is_not_over_when_its_first_edge_springs_off(contact: str) -> None:
    result, model = fall(contact=contact, penalty_factor=1.0, surface_factor=100.0)
    assert result.status is rf.Status.COMPLETED
    # A body that leaves has at least been stopped: the impulse is more than its momentum.
    momentum = float(model.mass.sum()) * 1.0
    assert momentum < (result.summary.normal_impulse_N_s or 0.0) < 2.0 * momentum


def test_next_touch_of_a_falling_and_a_turning_block() -> None:
    _, model = fall(step_factor=0.9, max_steps=1)
    still = np.zeros_like(model.points)
    height = model.surface.height - SIDE / 2
    falling = still.copy()
    falling[:, 1] = -2.0
    assert next_touch_s(model, still, falling) == pytest.approx(height / 2.0)
    assert next_touch_s(model, still, -falling) == NEVER * model.transit_s
    # Turning about its centre it goes down on one side only.
    turning, spin = still.copy(), 30.0
    middle = model.points.mean(axis=0)
    turning[:, 0] = -spin * (model.points - middle)[:, 1]
    turning[:, 1] = spin * (model.points - middle)[:, 0]
    assert next_touch_s(model, still, turning) == pytest.approx(height / (spin * SIDE / 2))


@pytest.mark.parametrize("dim", [2, 3])
def test_inversion_under_pressure_is_the_jacobians(dim: int) -> None:
    _, model = fall(dim=dim, max_steps=1)
    u = 0.002 * np.sin(300.0 * model.points[:, ::-1])
    touched = int(model.contact.nodes[3])
    pressure = np.zeros(len(u))
    pressure[touched] = 1.0
    mine = model.cells[(model.cells == touched).any(axis=1)]
    after = next(geometries(model.points + u, mine)).jacobian
    assert touching_det(model, u, pressure) == pytest.approx(np.linalg.det(after).min(), rel=1e-12)
    assert touching_det(model, u, np.zeros(len(u))) == np.inf
    chosen = np.arange(len(model.cells) - 3)
    model, everywhere = dataclasses.replace(model, contact_cells=chosen), np.ones(len(u))
    after = next(geometries(model.points + u, model.cells[chosen])).jacobian
    found = touching_det(model, u, everywhere)
    assert found == pytest.approx(np.linalg.det(after).min(), rel=1e-12)
    u[model.cells[chosen[-1], 0], 0] = np.nan
    assert np.isnan(touching_det(model, u, everywhere))


def test_a_crushed_element_is_found_between_two_searches(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    # Jelly at half of its wave speed, and all elements searched at the start only.
    monkeypatch.setattr(guards, "FULL_SEARCH", 10**9)
    result, _ = fall(speed=50.0, contact="impulse", energy_tolerance=1.0)
    assert result.status is rf.Status.INVERTED_ELEMENT
    assert result.snapshots


def test_energy_that_plastic_impacts_take_is_called_lost() -> None:
    result, _ = fall(speed=20.0, contact="impulse")
    assert result.status is rf.Status.ENERGY_LOST
    assert "lost" in result.message
    assert "surface" in result.message


@pytest.mark.parametrize(("audits", "end_s"), [(guards.FULL_SEARCH, None), (10**9, 4.5e-3)])
def test_a_phalanx_that_the_contact_does_not_know_is_noticed(
    monkeypatch: pytest.MonkeyPatch, audits: int, end_s: float | None
) -> None:
    """At a search on the way, or where the run ends."""
    monkeypatch.setattr(guards, "FULL_SEARCH", audits)
    mesh = boxes((0.04, 0.03), (0.01,), (8, 2))
    # The first phalanx goes down, the last one points up.
    start = rf.ChainState(np.array([0.4, -0.4]), np.array([40.0, -40.0]), 0.0)
    settings = rf.Settings(flight="explicit", max_flight_time_s=0.01, end_time_s=end_s)
    result = rf.simulate(
        mesh, (RUBBER,) * 2, rf.Surface(0.0215, 0.3), rf.Drive(), settings, start=start
    )
    assert result.status is rf.Status.PASSED_THROUGH
    assert "phalanx 1 is below" in result.message


def test_work_is_limited_and_refused_where_it_is_known() -> None:
    result, _ = fall(max_steps=40, output_interval=8)
    assert result.status is rf.Status.WORK_LIMIT
    assert result.summary.steps == 40
    assert len(result.forces.time_s) == 41  # the block that shows the limit is kept
    mesh = boxes((0.04,), (0.01,), (8, 2))
    for settings in (
        rf.Settings(end_time_s=1e10),
        rf.Settings(flight="explicit", max_flight_time_s=1e10),
        rf.Settings(step_factor=1e-10),  # no end is given, but a tap takes a wave's time
    ):
        with pytest.raises(
            ValueError, match=r"= 1e[+-]10: asks for .* steps .* (years|days|hours)"
        ):
            rf.simulate(mesh, (RUBBER,), rf.Surface(0.02, 0.3), rf.Drive(), settings)


def test_a_spike_is_what_bends_more_than_a_resolved_wave() -> None:
    phase = np.arange(200) / 50.0  # ω Δt = 1/50
    assert spike(np.maximum(np.sin(phase), 0.0), 1) == pytest.approx(1 / 50**2 / 3, rel=1e-2)
    assert spike(np.maximum(np.sin(phase), 0.0), 10) == pytest.approx(0.2**2 / 3, rel=1e-2)
    chatter = 1.0 + 0.5 * np.cos(2.0 * np.pi * np.arange(200) / 10.0)
    chatter[100] += 1e-9  # a top away from the ends; a lag of one whole period shows nothing
    assert spike(chatter, 10) == pytest.approx(2.0 / 4.5, rel=1e-6)
    assert spike(np.zeros(5), 3) == spike(np.empty(0), 3) == 0.0


SOFT_CONTACT = {"penalty_factor": 0.01, "max_contact_time_s": 0.1}
HARD_CONTACT = {"contact": "surface", "surface_factor": 1e4}
ONE_POINT = {"element": "hex8-one-point", "contact": "impulse"}


@pytest.mark.parametrize(
    ("caution", "given", "free"),
    [
        ("springs hold .* solver.fem.penalty_factor", SOFT_CONTACT, HARD_CONTACT),
        ("spike .* use solver.fem.contact = 'impulse'", HARD_CONTACT, SOFT_CONTACT),
        ("spike .* use a finer mesh", {"contact": "impulse", "tilt": 0.0}, HARD_CONTACT),
        ("steps only", {"contact": "impulse"}, HARD_CONTACT),
        ("lost or gained", {"contact": "impulse", "speed": 5.0}, SOFT_CONTACT),
        ("crushed to", {"contact": "surface", "speed": 40.0}, SOFT_CONTACT),
        ("hourglass", ONE_POINT, {"contact": "impulse"}),
    ],
)
def test_cautions(caution: str, given: dict[str, Any], free: dict[str, Any]) -> None:
    """Each is said of a block that needs it, and not of one that doesn't."""
    assert any(re.search(caution, said) for said in fall(**given)[0].cautions)
    assert not any(re.search(caution, said) for said in fall(**free)[0].cautions)


def test_a_tip_that_slides_on_a_fine_mesh_may_flutter() -> None:
    """Where runs held to an accuracy of 1e-2 would relax, by the time that they would take."""
    phase = np.linspace(0.0, math.pi, 50)
    normal = 100.0 * np.sin(phase)

    def said(
        share: float = 1.0, friction: float = 0.3, edge: float = 0.3, relaxes: float = 0.0
    ) -> tuple[str, ...]:
        material = dataclasses.replace(RUBBER, relaxation_time=relaxes)
        forces = rf.ForceRecord(phase, normal, -share * friction * normal, phase)
        return flutter(forces, friction, material, edge * 1e-3, 1e-3)

    # 0.02 a/c: c = 100 m/s
    assert "material.relaxation_time = 2e-07" in said()[0]
    assert not said(share=0.8)
    assert not said(friction=0.1)
    assert not said(edge=0.5)
    assert not said(relaxes=1e-9)


def test_a_contact_beside_the_refined_part_of_the_tip_is_said() -> None:
    edges = np.concatenate([np.full(50, 0.2), np.geomspace(0.2, 2.0, 200)])
    inside = np.arange(250) < 40
    assert contact_edge_ratio(edges, inside) is None
    assert contact_edge_ratio(edges, ~inside & (edges < 0.5)) == pytest.approx(1.6, abs=0.2)
    assert contact_edge_ratio(np.linspace(1.0, 2.0, 250), ~inside) is None  # even
    assert contact_edge_ratio(np.full(250, np.inf), inside) is None  # the lumped law has no area

    geometry = meshes.FingerGeometry((0.03,), (0.015,))
    said = []
    for degrees in (57.0, 20.0):  # it touches 56 degrees off the axis
        sizing = meshes.Sizing(
            2e-3, 4e-3, 4e-4, contact_angle=math.radians(degrees), growth=1.6, patch_size=1e-3
        )
        result = rf.simulate(
            meshes.finger_hexahedra(geometry, sizing),
            (rf.Material(1e9, 0.4, 1400.0),),
            rf.Surface(0.02, 0.5),
            rf.Drive(),
            rf.Settings(contact="impulse"),
        )
        assert result.status is rf.Status.COMPLETED
        said.append([text for text in result.cautions if "those refined for" in text])
    assert (len(said[0]), len(said[1])) == (0, 1)
    away = re.search(r"touches ([\d.]+) mm from the last hinge", said[1][0])
    assert away is not None
    # the ball's lowest point, to an edge there
    place = 30.0 - 7.5 * (1.0 - math.cos(math.radians(56.0)))
    assert float(away[1]) == pytest.approx(place, abs=0.8)


@pytest.mark.parametrize(("height", "rim"), [(0.02, True), (0.035, False)])
def test_a_touch_with_the_shaft_is_called_so(height: float, rim: bool) -> None:
    """Of a finger that lies nearly flat it is the rim at the last hinge that touches."""
    geometry = meshes.FingerGeometry((0.03, 0.02), (0.012, 0.012))
    result = rf.simulate(
        meshes.finger_hexahedra(geometry, meshes.Sizing(3e-3, 5e-3, 1.5e-3)),
        (rf.Material(5e7, 0.4, 1400.0),) * 2, rf.Surface(height, 0.3), rf.Drive(),
        rf.Settings(contact="impulse", estimate=False),
    )  # fmt: skip
    assert result.status is rf.Status.COMPLETED
    assert any("the shaft touches, " in text for text in result.cautions) == rim


def test_a_corner_that_is_pushed_through_its_element_is_called_so() -> None:
    """The one-point element's own determinant, at its middle, is still above 0."""
    _, model = fall(max_steps=1, element="hex8-one-point")
    u, cell = np.zeros_like(model.points), model.cells[model.contact_cells[0]]
    corner = next(node for node in cell if node in model.contact.nodes)
    pressure = np.zeros(len(u))
    pressure[corner] = 1.0
    u[corner] = model.points[cell].mean(axis=0) - model.points[corner]
    while touching_det(model, u, pressure) > 0.0:
        u[corner] *= 1.1
    assert model.kernel.min_det_F(u) > 0.0
    taken = SimpleNamespace(
        finite=True, energy_balance_J=0.0, kinetic_energy_J=1.0, normal_force_N=1.0
    )
    state = SimpleNamespace(displacement=u, step=5, time_s=0.1)
    block = SimpleNamespace(searched=True, pressure=pressure)
    now = SimpleNamespace(state=state, steps=5, audits=1, largest_kinetic_J=1.0)
    found = guards.failure(model, rf.Settings(), now, block, taken)  # type: ignore[arg-type]
    assert found is not None
    assert found[0] is rf.Status.INVERTED_ELEMENT
    assert "below 0 in a part of an element that touches" in found[1]


@pytest.mark.parametrize("start_s", [0.0, 5.0])
def test_a_flights_work_counts_from_its_start(start_s: float) -> None:
    _, model = fall(max_steps=1)
    settings = rf.Settings(flight="explicit", max_flight_time_s=1.0, max_steps=100)
    steps = math.ceil(1.0 / model.step_s)
    with pytest.raises(ValueError, match=re.escape(f"{steps:.3g} steps")):
        check_work(model, settings, start_s)


def test_damped_elements_under_a_torque_set_out() -> None:
    """Damping takes the rates of half a step before: at rest, what a step gains, beside nothing.

    A finger of 1e7 Pa that is driven with 40 times its weight's moment.
    """
    geometry = meshes.FingerGeometry((0.034, 0.023), (0.0094, 0.0094))
    mesh = meshes.finger_hexahedra(geometry, meshes.Sizing(4e-3, 4e-3, 4e-3))
    material = rf.Material(1.5e7, 0.317, 7300.0, relaxation_time=1e-5)
    drive, surface = rf.Drive(torques=(0.028, 0.019)), rf.Surface(0.041, 0.9)
    settings = rf.Settings(flight="explicit", end_time_s=1e-3, estimate=False)
    run = rf.simulate(mesh, (material,) * 2, surface, drive, settings)
    assert run.status is rf.Status.NOT_REACHED, run.message


@pytest.mark.parametrize(("slides_below", "said"), [(0.3, False), (0.7, True)])
def test_a_tip_that_slides_only_where_it_hardly_presses_does_not_flutter(
    slides_below: float, said: bool
) -> None:
    """It sticks at half of Coulomb's ratio above that share of its peak."""
    phase = np.linspace(0.0, math.pi, 50)
    normal = 100.0 * np.sin(phase)
    tangential = -0.3 * normal * np.where(normal < 100.0 * slides_below, 1.0, 0.5)
    forces = rf.ForceRecord(phase, normal, tangential, phase)
    assert bool(flutter(forces, 0.3, RUBBER, 0.3e-3, 1e-3)) is said


def judged(over_s: float = 1.0, **history: list[float]) -> Any:
    """What two samples, 0.5 s before and after the end of a tap, say of it."""
    columns = ("kinetic_energy_J", "energy_balance_J", "strain_energy_J", "contact_energy_J",
               "hourglass_energy_J")  # fmt: skip
    energies = {name: np.array(history.get(name, [1.0, 1.0])) for name in columns}
    samples = SimpleNamespace(time_s=np.array([over_s - 0.5, over_s + 0.5]), **energies)
    settings = rf.Settings(contact="penalty")
    return SimpleNamespace(history=samples, over_s=over_s, settings=settings)


@pytest.mark.parametrize(("share", "said"), [(0.03, True), (-0.03, True), (0.01, False)])
def test_energy_is_missed_as_it_is_lost_or_gained(share: float, said: bool) -> None:
    """Beyond 2 % of the largest kinetic energy, 2 J, at any time."""
    run = judged(kinetic_energy_J=[2.0, 1.0], energy_balance_J=[0.0, 2.0 * share])
    assert bool(cautions.open_energy(run)) is said
    if said:
        assert cautions.open_energy(run).startswith("3 % of the largest kinetic energy")


@pytest.mark.parametrize("during", [True, False])
def test_springs_and_hourglasses_after_the_first_tap_are_no_doubt_of_it(during: bool) -> None:
    """Half of the elastic energy of a first tap, or of a second one, is theirs."""
    held = [1.0, 0.0] if during else [0.0, 1.0]
    run = judged(contact_energy_J=held, hourglass_energy_J=held)
    assert bool(cautions.soft_springs(run)) is during
    assert bool(cautions.hourglassed(run)) is during
    assert cautions.held_by_springs(run.history, run.over_s) == (0.5 if during else 0.0)
    slightly = judged(contact_energy_J=[0.12, 0.0], strain_energy_J=[0.88, 1.0])
    assert "springs hold 12 % of the elastic energy" in cautions.soft_springs(slightly)
    hardly = judged(contact_energy_J=[0.08, 0.0], strain_energy_J=[0.92, 1.0])
    assert cautions.soft_springs(hardly) == ""
    # a law of one's own has no penalty to raise
    run.settings = SimpleNamespace(contact=object())
    assert cautions.soft_springs(run) == ""


@pytest.mark.parametrize(("radii", "said"), [(1.0, False), (1.05, False), (1.2, True)])
def test_a_shaft_touches_beyond_a_tenth_of_its_radius_behind_the_ball(
    radii: float, said: bool
) -> None:
    """A body from -0.1 m on, of 0.01 m, that touches so many radii from its end."""
    body = np.array([[-0.1, 0.0], [-0.09, 0.01], [-0.09, -0.01], [0.0, 0.01]])
    run: Any = SimpleNamespace(body=body, place=-0.1 + radii * 0.01, away_mm=1.0)
    assert bool(cautions.shaft_touches(run)) is said


def test_elements_are_crushed_as_they_are_at_the_peak() -> None:
    """Another snapshot, of a later tap say, is not looked at. Neo-Hookean bodies never soften."""
    for kind, at_peak, other, said in (
        (EIGHT_POINT, 0.5, 0.9, True), (EIGHT_POINT, 0.9, 0.5, False), (NEO_HOOKE, 0.1, 0.9, False)
    ):  # fmt: skip
        model = SimpleNamespace(kernel=SimpleNamespace(min_det_F=lambda volume: volume, kind=kind))
        shots = tuple(
            SimpleNamespace(displacement=volume, at_peak=peak)
            for volume, peak in ((at_peak, True), (other, False))
        )
        for order in (shots, shots[::-1]):
            run: Any = SimpleNamespace(model=model, snapshots=order)
            assert bool(cautions.crushed(run)) is said
            assert ("crushed to 50 % of its volume" in cautions.crushed(run)) is said


@pytest.mark.parametrize(("transit", "steps"), [(5.2, 5), (1.4, 1), (0.2, 1)])
def test_a_wave_crosses_a_cell_in_whole_steps_at_least_one(transit: float, steps: int) -> None:
    model: Any = SimpleNamespace(cell_transit_s=transit * 1e-7, step_s=1e-7)
    assert cautions.steps_per_cell_transit(model) == steps


def test_a_run_without_samples_is_judged_by_its_forces() -> None:
    """It was interrupted before the first: two steps of force are few, the rest is not known."""
    record = np.array([0.0, 1.0, 1.0, 0.0])
    samples = SimpleNamespace(time_s=np.empty(0))
    run: Any = SimpleNamespace(
        history=samples, forces=SimpleNamespace(time_s=record, normal_force_N=record),
        model=SimpleNamespace(
            cell_transit_s=1.0, step_s=1.0, kernel=SimpleNamespace(relaxation=np.zeros(1))
        ),
        settings=rf.Settings(contact="impulse"),
    )  # fmt: skip
    assert any("in 2 steps only" in said for said in cautions.cautions(run))


def audited(balance_J: float, kinetic_J: float = 0.0, **changes: Any) -> rf.Status | None:
    """What the energy audit says of 2 kg that hang 0.5 m above the surface, 1e-4 m3 of 1e6 Pa."""
    given = {"contact": "penalty", "gravity": (0.0, -9.8), **changes}
    model = SimpleNamespace(
        kernel=SimpleNamespace(cell_volume=np.full(4, 2.5e-5), mu=np.full(4, 1e6)),
        mass=np.full(8, 0.125), symmetry_factor=2, surface=rf.Surface(0.5, 0.3),
        gravity_vector=given["gravity"], step_s=1e-6,
    )  # fmt: skip
    settings = SimpleNamespace(contact=given["contact"], energy_tolerance=0.1)
    taken = SimpleNamespace(finite=True, energy_balance_J=balance_J, kinetic_energy_J=kinetic_J)
    found = guards._energy(model, settings, SimpleNamespace(step=1, time_s=0.0), taken, 0.0)  # type: ignore[arg-type]
    return found and found[0]


@pytest.mark.parametrize(
    ("balance", "contact", "status"),
    [
        (0.11, "penalty", rf.Status.UNSTABLE),
        (-0.11, "penalty", rf.Status.UNSTABLE),
        (0.11, "impulse", rf.Status.UNSTABLE),
        (-0.11, "impulse", rf.Status.ENERGY_LOST),
        (-0.09, "impulse", None),
    ],
)
def test_only_impulses_lose_energy(balance: float, contact: str, status: rf.Status | None) -> None:
    assert audited(balance, 1.0, contact=contact) is status


@pytest.mark.parametrize(
    ("gravity", "scale"),
    [((0.0, -9.8), 1e-6 * 2.0 * 9.8 * 0.5), ((0.0, 0.0), 1e-20 * 1e-4 * 1e6)],
    ids=["weight", "strains of 1e-10"],
)
def test_a_body_at_rest_is_judged_by_its_weight_or_its_round_off(
    gravity: tuple[float, float], scale: float
) -> None:
    assert audited(0.099 * scale, gravity=gravity) is None
    assert audited(0.101 * scale, gravity=gravity) is rf.Status.UNSTABLE
