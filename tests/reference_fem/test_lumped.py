"""The lumped law on the solid: closed forms of the law, energy of the tap, bad input."""

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

import meshes
import reference_fem as rf
from reference_fem.contact.law import COLUMNS, GAP, Motion
from reference_fem.contact.lumped import (
    ANCHOR,
    ENERGIES,
    FRICTION_LOSS,
    HYSTERESIS_LOSS,
    MEMORY,
    STORED,
    TURN,
    lumped_force,
)
from reference_fem.contact.lumped_law import LumpedLaw, lumped_point_forces
from reference_fem.model import build_model
from tests.reference_fem.taps import GEOMETRY, SURFACE, tap

K, SPEED, MASS = 0.78e6, 1.6, 0.003
LAW = rf.LumpedContact(K)
FLAT = replace(GEOMETRY, tip="flat")
COARSE = meshes.Sizing(2.5e-3, 3.5e-3, 2.5e-3)
# The thin-rod chain right above the surface: 2 us before its end touches.
IMPACT = rf.ChainState(
    np.radians([70.19583608, 70.07814664, 38.23606225]),
    np.array([10.64117657, 8.30017146, 44.46820547]),
    0.136105036,
)


class Drop:
    """A mass on the law, by the same central differences as the solid."""

    def __init__(
        self, law: rf.LumpedContact, friction: float, slide: float, step: float = 2e-8
    ) -> None:
        memory, energies = np.zeros(MEMORY), np.zeros(ENERGIES)
        x, y, vx, vy = 0.0, 0.3 * SPEED * step, slide, -SPEED
        self.time, self.normal, self.tangential, self.speed = [], [], [], []
        self.loss, self.balance = np.zeros(ENERGIES), []
        for number in range(200_000):
            ft, fn = lumped_force(x, y, vx, vy, *law.constants, friction, memory, energies)
            self.loss += energies
            middle = (vx + 0.5 * step * ft / MASS, vy + 0.5 * step * fn / MASS)
            self.time.append(number * step)
            self.normal.append(fn)
            self.tangential.append(ft)
            self.speed.append(middle)
            kinetic = 0.5 * MASS * (middle[0] ** 2 + middle[1] ** 2)
            losses = self.loss[FRICTION_LOSS] + self.loss[HYSTERESIS_LOSS]
            self.balance.append(kinetic + energies[STORED] + losses)
            if number > 10 and fn == 0.0:
                break
            vx, vy = vx + step * ft / MASS, vy + step * fn / MASS
            x, y = x + step * vx, y + step * vy


def test_a_mass_on_the_linear_law_is_a_half_sine() -> None:
    drop = Drop(LAW, 0.0, 0.0)
    omega = math.sqrt(K / MASS)
    # Second order in the step: (omega h)^2/24 is 4e-9 here; the sampling of the peak dominates.
    assert max(drop.normal) == pytest.approx(SPEED * math.sqrt(K * MASS), rel=1e-6)
    assert drop.time[-1] == pytest.approx(math.pi / omega, abs=2.5e-8)
    assert drop.speed[-1][1] == pytest.approx(SPEED, rel=1e-6)


@pytest.mark.parametrize("restitution", [0.5, 0.8])
def test_restitution_is_energetic(restitution: float) -> None:
    drop = Drop(rf.LumpedContact(K, restitution), 0.0, 0.0)
    assert drop.speed[-1][1] == pytest.approx(restitution * SPEED, rel=1e-3)
    energy = 0.5 * MASS * SPEED**2
    lost = drop.loss[HYSTERESIS_LOSS]
    assert lost == pytest.approx((1 - restitution**2) * energy, rel=1e-4)
    assert max(drop.balance) - min(drop.balance) < 1e-4 * energy


def test_hertz_variant_stores_the_same_energy_at_its_force() -> None:
    force = 60.0
    depth = 1.25 * force / K
    memory, energies = np.zeros(MEMORY), np.zeros(ENERGIES)
    law = rf.LumpedContact(K, hertz_force=force)
    lumped_force(0.0, 0.0, 0.0, -1.0, *law.constants, 0.0, memory, energies)
    _, fn = lumped_force(0.0, -depth, 0.0, -1.0, *law.constants, 0.0, memory, energies)
    assert fn == pytest.approx(force, rel=1e-12)
    assert energies[STORED] == pytest.approx(force**2 / (2 * K), rel=1e-12)


def test_hertz_impact_lasts_as_long_as_hertz_says() -> None:
    force = 60.0
    drop = Drop(rf.LumpedContact(K, hertz_force=force), 0.0, 0.0)
    # F = c d^1.5 with c of an E* and R: T = 2.8683 (m^2/(R E*^2 v))^(1/5) = 2.8683 (16 m^2 /
    # (9 c^2 v))^(1/5), since c = 4/3 E* sqrt(R).
    c = force / (1.25 * force / K) ** 1.5
    duration = 2.8683 * (16 * MASS**2 / (9 * c**2 * SPEED)) ** 0.2
    assert drop.time[-1] == pytest.approx(duration, rel=2e-4)


def test_gross_slip_follows_coulomb_and_its_loss_is_force_times_way() -> None:
    drop = Drop(LAW, 0.3, 20.0)
    normal, tangential = np.array(drop.normal), np.array(drop.tangential)
    assert np.allclose(tangential, -0.3 * normal, rtol=1e-12)
    assert max(drop.balance) - min(drop.balance) < 1e-6 * drop.balance[0]
    change = MASS * (20.0 - drop.speed[-1][0])
    assert change == pytest.approx(0.3 * 2 * MASS * SPEED, rel=1e-6)


def test_stick_then_slip_inside_the_cone() -> None:
    # |Vt/Vn| < mu eta^2 starts in stick (paper eq. 21): Ft/Fn = eta^-2 |Vt/Vn| at first.
    law = rf.LumpedContact(K, tangential_ratio=0.75)
    drop = Drop(law, 0.5, 0.4)
    ratio = -np.array(drop.tangential[2:400]) / np.array(drop.normal[2:400])
    assert ratio[100] == pytest.approx(0.75 * 0.4 / SPEED, rel=1e-3)
    assert np.abs(drop.tangential).max() <= 0.5 * max(drop.normal)
    assert max(drop.balance) - min(drop.balance) < 1e-6 * drop.balance[0]


@pytest.fixture(scope="module")
def flat() -> meshes.FingerMesh:
    return meshes.finger_hexahedra(FLAT, COARSE)


def lumped(mesh: meshes.FingerMesh, **changes: Any) -> rf.TapResult:
    """A tap of the law, by default from right above the surface."""
    return tap(mesh, **{"contact": LAW, "start": IMPACT} | changes)


def test_the_solid_taps_like_the_beam_and_keeps_its_energy(flat: meshes.FingerMesh) -> None:
    result = lumped(flat)
    s, h = result.summary, result.history
    assert result.status is rf.Status.COMPLETED
    # A prototype on finer meshes: 63.4 to 64.7 N and 0.247 to 0.251 ms; 1 % for this mesh.
    assert s.peak_normal_force_N == pytest.approx(64.4, rel=0.015)
    assert s.contact_duration_s == pytest.approx(247e-6, rel=0.015)
    assert s.contact_time_s == pytest.approx(0.136107036, abs=1e-8)
    assert np.allclose(h.tangential_force_N, -0.5 * h.normal_force_N, rtol=1e-12)
    # Central differences at 0.9 of the stable step: the balance is of order (omega h)^2.
    assert s.energy_residual < 2e-4
    assert h.friction_dissipation_J[-1] > 0.0


@pytest.mark.parametrize(("restitution", "tip"), [(0.7, "flat"), (1.0, "hemisphere")])
def test_energy_of_lossy_and_rolling_taps(restitution: float, tip: str) -> None:
    mesh = meshes.finger_hexahedra(replace(GEOMETRY, tip=tip), COARSE)
    surface = SURFACE if tip == "flat" else rf.Surface(0.1028617, 0.5)
    result = lumped(mesh, surface=surface, contact=rf.LumpedContact(K, restitution))
    assert result.status is rf.Status.COMPLETED
    assert result.summary.energy_residual < 2e-4
    lost = float(result.history.contact_damping_J[-1])
    assert (lost > 1e-4) is (restitution < 1.0)


def test_sphere_with_friction_that_sticks_rolls_without_loss() -> None:
    mesh = meshes.finger_hexahedra(replace(GEOMETRY, tip="hemisphere"), COARSE)
    result = lumped(mesh, surface=rf.Surface(0.1028617, 50.0))
    assert result.status is rf.Status.COMPLETED
    kinetic = result.history.kinetic_energy_J.max()
    # It sticks until F_n vanishes, where the tangential spring lets go what it still holds.
    held = result.history.normal_force_N > 0.05 * result.history.normal_force_N.max()
    assert result.history.friction_dissipation_J[held].max() < 1e-9 * kinetic
    assert np.abs(result.history.energy_balance_J[held]).max() < 2e-4 * kinetic
    # That goes within a step or two, over which the audit's trapezoid knows it to some percent.
    let_go = result.history.friction_dissipation_J[-1]
    assert np.abs(result.history.energy_balance_J).max() < 0.02 * let_go


def test_own_flight_lands_where_the_rigid_chain_does(flat: meshes.FingerMesh) -> None:
    result = lumped(flat, start=None)
    # Rotary inertia delays the thin rods' 0.136107 s by 0.5 %.
    assert result.summary.contact_time_s == pytest.approx(0.136107 * 1.005, rel=1e-3)


def test_never_reached_and_too_long_keep_what_they_have(flat: meshes.FingerMesh) -> None:
    short = lumped(flat, start=None, max_flight_time_s=0.01)
    assert short.status is rf.Status.NOT_REACHED
    assert short.summary.peak_normal_force_N is None
    cut = lumped(flat, max_contact_time_s=5e-5)
    assert cut.status is rf.Status.STILL_IN_CONTACT
    assert cut.summary.contact_duration_s is None
    assert cut.history.normal_force_N[-1] > 0.0


def test_too_long_a_step_is_noticed(flat: meshes.FingerMesh) -> None:
    wild = lumped(flat, step_factor=1.2)
    assert wild.status is rf.Status.UNSTABLE
    assert "step_factor" in wild.message


def test_a_stiff_spring_enters_the_stable_step(flat: meshes.FingerMesh) -> None:
    def highest(stiffness: float) -> float:
        # Nothing is solved: the end lies out of reach.
        law = rf.LumpedContact(stiffness)
        none = lumped(flat, start=None, contact=law, max_flight_time_s=1e-3)
        return (2 * 0.9 / none.summary.time_step_s) ** 2

    # omega^2 = omega_e^2 + k/m with the end face's own mass, half an element's length deep.
    layer = 0.04 / 11 / 2
    # Lumping adds 2/n² to a rod's inertia; f = 1 + λ (ξ² - 1/12), which takes it off again, is
    # this less at the ends: Σ m ξ² (f - 1) = -2/n²/12, and ξ² varies by 1/80 - 1/144.
    less = 2 / 11**2 / 12 / (1 / 80 - 1 / 144) * (1 / 4 - 1 / 12)
    mass = 1400.0 * math.pi * 0.0075**2 * layer * (1 - less)
    added = (highest(1e10) - highest(1e9)) / 9e9
    assert added == pytest.approx(1 / mass, rel=0.02)


@pytest.mark.parametrize(
    ("changes", "named"),
    [
        ({"normal_stiffness": 0.0}, "normal_stiffness"),
        ({"normal_stiffness": math.nan}, "normal_stiffness"),
        ({"restitution": 1.1}, "restitution"),
        ({"tangential_ratio": -1.0}, "tangential_ratio"),
        ({"hertz_force": -3.0}, "hertz_force"),
        ({"hertz_force": 60.0, "restitution": 0.9}, "restitution = 1"),
    ],
)
def test_impossible_laws_are_refused(changes: dict[str, float], named: str) -> None:
    with pytest.raises(ValueError, match=named):
        rf.LumpedContact(**({"normal_stiffness": K} | changes))


@pytest.mark.parametrize("dim", [2, 3])
def test_the_law_acts_on_the_equator_of_an_end_whose_nodes_stand_out(dim: int) -> None:
    """Nodes beyond the sphere, for its whole volume, leave its radius as it is."""
    mesher = meshes.finger_quadrilaterals if dim == 2 else meshes.finger_hexahedra
    given = (rf.Material(1e9, 0.4, 1400.0),) * 3, SURFACE, rf.Drive(), rf.Settings(contact=LAW)
    for whole in (False, True):
        law = build_model(mesher(GEOMETRY, replace(COARSE, full_volume=whole)), *given).contact
        assert isinstance(law, LumpedLaw)
        assert law.parts.radius == 0.5 * GEOMETRY.diameters[-1]
        assert law.parts.rest[0] == pytest.approx(
            -sum(GEOMETRY.lengths) + law.parts.radius, abs=1e-12
        )


def test_impossible_taps_are_refused(flat: meshes.FingerMesh) -> None:
    with pytest.raises(ValueError, match="height"):
        lumped(flat, surface=rf.Surface(0.09, 0.5))
    short = rf.ChainState(np.zeros(2), np.zeros(3), 0.0)
    with pytest.raises(ValueError, match=r"angles of shape \(2,\)"):
        lumped(flat, start=short)
    sets = {k: v for k, v in flat.node_sets.items() if k != "distal_face_3"}
    with pytest.raises(ValueError, match="equator"):
        lumped(replace(flat, node_sets=sets))


def test_a_lumped_contact_has_no_mesh_beside_it(flat: meshes.FingerMesh) -> None:
    """Its spring is no error of the mesh, and it has no patch: forces known to 0.4 % by three
    meshes had errors of 73 to 500 %.
    """
    with pytest.raises(ValueError, match="companion: a lumped contact has no patch"):
        rf.simulate(
            flat, (rf.Material(1e9, 0.4, 1400.0),) * 3, SURFACE, rf.Drive(),
            rf.Settings(contact=LAW), companion=flat,
        )  # fmt: skip


def test_one_point_lets_go_on_the_line_of_two_steps() -> None:
    found = LumpedLaw.separation_s(None, np.array([1.0, 2.0]), np.array([3.0, 1.0]))
    assert found == pytest.approx(2.5)


@pytest.fixture
def sphere_law() -> Any:
    settings, materials = rf.Settings(contact=rf.LumpedContact(1e6)), (rf.Material(1e9, 0.4, 1e3),)
    mesh = meshes.finger_hexahedra(GEOMETRY, COARSE)
    law = build_model(mesh, materials * 3, SURFACE, rf.Drive(), settings).contact
    assert isinstance(law, LumpedLaw)
    assert law.parts.radius > 0.0
    return law


def test_a_rolling_sphere_turns_its_section_too(sphere_law: Any) -> None:
    """The contact's stiffness is K = k c c^T, so its largest eigenvalue with M is k c^T M^-1 c."""
    point = sphere_law.parts
    section = point.section
    inertia = section.masses @ (section.arms**2).sum(axis=1)
    along, up = point.radius * section.masses * section.arms.T / inertia
    c = np.column_stack([point.weights - up, along])
    exact = sphere_law.stiffest * ((c**2).sum(axis=1) / section.masses).sum()
    assert sphere_law.coupled_eigenvalue == pytest.approx(exact / point.symmetry_factor)


def test_a_rolling_sphere_is_anchored_where_it_crossed_the_surface(sphere_law: Any) -> None:
    """It falls by 1 m/s and turns by 300 rad/s, without friction: C moves on by R times that."""
    point, turned, since, rate = sphere_law.parts, 0.5, 1e-6, 300.0
    nodes = point.section.nodes.max() + 1
    displacement, velocity = np.zeros((2, nodes, 3))
    c, s = math.cos(turned) - 1.0, math.sin(turned)
    displacement[point.section.nodes, :2] = point.section.arms @ np.array([[c, s], [-s, c]])
    velocity[:, 1] = -1.0
    step, height = 2.0 * since, point.radius - point.rest[1] - since
    free = np.zeros((nodes, 3)), displacement, velocity, np.ones(nodes), (0.0, 0.0)
    memory = sphere_law.new_memory(displacement, turned)
    memory.anchor[0, TURN] -= rate * step
    row, residual = np.zeros(COLUMNS), np.zeros((nodes, 3))
    lumped_point_forces(point, Motion(*free, step, height, 0.0), memory, residual, row)
    assert row[GAP] == pytest.approx(-since)
    crossed = point.rest[0] + point.radius * (turned - rate * since)
    assert memory.anchor[0, ANCHOR] == pytest.approx(crossed, rel=1e-12)
    assert memory.anchor[0, TURN] == pytest.approx(turned)
