"""The 1-point hexahedron against mathematics: patches, rotations, gradients, hourglass modes."""

from itertools import product

import numpy as np
import pytest

import reference_fem as rf
from reference_fem.elements import hex8
from reference_fem.elements.hexahedron.one_point import (
    Hex8OnePoint,
    hex8_one_point,
    hourglass_signs,
)
from tests.reference_fem.boxes import boxes
from tests.reference_fem.elements.bodies import (
    DENSITY,
    SIZE,
    YOUNG,
    force,
    grid,
    material,
    rotation,
)


def body(counts: tuple[int, int, int], distortion: float = 0.0) -> Hex8OnePoint:
    points, cells = grid(*counts, distortion=distortion, seed=1)
    return hex8_one_point(points, cells, *material(len(cells)))


def test_patch_of_distorted_elements_has_one_stress_and_no_hourglass_energy() -> None:
    """The mean gradients integrate grad N_a exactly, so forces inside vanish for any F."""
    k = body((5, 4, 3), 0.15)
    f = np.eye(3) + np.array([[0.1, 0.2, 0.0], [0.0, -0.1, 0.3], [0.1, 0.0, 0.05]])
    u = k.points @ (f - np.eye(3)).T
    strain = 0.5 * (f.T @ f - np.eye(3))
    piola = k.lame[0] * np.trace(strain) * np.eye(3) + 2 * k.mu[0] * strain
    cauchy = f @ piola @ f.T / np.linalg.det(f)
    expected = cauchy[[0, 1, 2, 0, 1, 0], [0, 1, 2, 1, 2, 2]]
    assert np.allclose(k.cell_stress(u), expected, rtol=1e-11, atol=0)
    energy = 0.5 * np.sum(piola * strain) * k.cell_volume.sum()
    assert k.strain_energy(u) == pytest.approx(energy, rel=1e-12)
    assert k.hourglass_energy(u) < 1e-20 * energy
    assert k.min_det_F(u) == pytest.approx(np.linalg.det(f), rel=1e-12)
    inside = np.zeros((6, 5, 4), dtype=bool)
    inside[1:-1, 1:-1, 1:-1] = True
    nodal = force(k, u)
    assert np.abs(nodal[inside.ravel()]).max() < 1e-12 * np.abs(nodal).max()


@pytest.mark.parametrize("degrees", [30, 90, 200])
def test_rotation_costs_nothing_and_turns_the_forces(degrees: int) -> None:
    k = body((3, 3, 2), 0.15)
    turn = rotation(np.radians(degrees))
    u = 0.05 * SIZE * np.random.default_rng(0).standard_normal(k.points.shape)
    turned = (k.points + u) @ turn.T - k.points
    scale = np.abs(force(k, u)).max()
    assert np.abs(force(k, k.points @ turn.T - k.points)).max() < 1e-10 * scale
    assert np.allclose(force(k, turned), force(k, u) @ turn.T, atol=1e-11 * scale)
    assert k.strain_energy(turned) == pytest.approx(k.strain_energy(u), rel=1e-11)


def test_force_is_the_gradient_of_the_energy() -> None:
    """Central differences: error (eps/h)^2 of the cubic part, about 1e-8, above round-off."""
    k = body((4, 3, 3), 0.15)
    rng = np.random.default_rng(2)
    u, d = (0.05 * SIZE * rng.standard_normal(k.points.shape) for _ in range(2))
    slope = (k.strain_energy(u + 1e-4 * d) - k.strain_energy(u - 1e-4 * d)) / 2e-4
    assert slope == pytest.approx(np.sum(force(k, u) * d), rel=1e-7)


@pytest.mark.parametrize(("mode", "axis"), list(product(range(4), range(3))))
def test_every_hourglass_mode_is_held(mode: int, axis: int) -> None:
    """One cube: u_i = a h^n strains nothing at the centre; its energy is k/2 (8 a)^2."""
    k = body((1, 1, 1))
    signs = np.zeros((8, 3))
    signs[k.cells[0], axis] = hourglass_signs()[mode]
    a = 1e-4 * SIZE
    control = YOUNG * SIZE**3 * (24 / (4 * SIZE) ** 2) / 72
    assert np.abs(k.cell_stress(a * signs)).max() < 1e-6 * YOUNG * 1e-4
    assert k.hourglass_energy(a * signs) == pytest.approx(0.5 * control * 64 * a**2, rel=1e-6)
    assert np.allclose(force(k, a * signs), 8 * a * control * signs, atol=1e-9 * control * a)


def test_pure_bending_of_a_cube_has_the_beams_energy() -> None:
    """u_x = a xi eta: curvature 4 a/h^2, energy E V (curvature)^2 h^2/24, exactly (c = 1)."""
    k = body((1, 1, 1))
    u = np.zeros((8, 3))
    a = 1e-5 * SIZE
    u[k.cells[0], 0] = a * hourglass_signs()[0]
    curvature = 4 * a / SIZE**2
    exact = 0.5 * YOUNG * SIZE**3 * curvature**2 * SIZE**2 / 12
    assert k.strain_energy(u) == pytest.approx(exact, rel=1e-8)


def test_stiffness_has_no_mode_without_energy_but_the_rigid_ones() -> None:
    k: Hex8OnePoint = body((1, 1, 1), 0.2)
    (stiffness, mass), *_ = k._stiffness_and_mass()
    values = np.linalg.eigvalsh(stiffness[0])
    assert np.abs(values[:6]).max() < 1e-9 * values[-1]
    assert values[6] > 1e-3 * values[-1]
    unit = np.zeros((8, 3))
    unit[2, 1] = 1e-9
    column = force(k, unit) / 1e-9
    expected = stiffness[0].reshape(8, 3, 8, 3)
    corner = int(np.flatnonzero(k.cells[0] == 2)[0])
    assert np.allclose(column[k.cells[0]], expected[:, :, corner, 1], atol=1e-6 * values[-1])
    assert mass.sum() == pytest.approx(DENSITY * k.cell_volume.sum())


def test_agrees_with_the_eight_point_element_where_both_are_exact() -> None:
    points, cells = grid(3, 3, 3)
    full = hex8(points, cells, *material(len(cells)))
    one = body((3, 3, 3))
    u = points @ np.array([[1e-3, 2e-3, 0], [0, -1e-3, 1e-3], [1e-3, 0, 2e-3]])
    assert np.allclose(force(one, u), force(full, u), atol=1e-12 * YOUNG * SIZE**2)
    assert one.lumped_mass == pytest.approx(full.lumped_mass)


def test_a_run_chooses_it_and_audits_its_hourglass_energy() -> None:
    """A hinged brick falls on its end: energies close, and the hourglass share is reported."""
    mesh = boxes((0.02,), (0.005, 0.005), (6, 2, 2))
    soft = rf.Material(youngs_modulus=1e7, poisson_ratio=0.3, density=1000.0)
    one, full = (
        rf.simulate(
            mesh, (soft,), rf.Surface(height=0.01, friction=0.2), rf.Drive(gravity=9.8),
            rf.Settings(element=name),
        )
        for name in ("hex8-one-point", "hex8-sri")
    )  # fmt: skip
    assert one.status is rf.Status.COMPLETED
    # measured: 1.0e-3 with either element, a quarter of it at half the step
    assert one.summary.energy_residual < 3e-3
    assert (full.history.hourglass_energy_J == 0).all()
    share = one.history.hourglass_energy_J / one.history.strain_energy_J.max()
    assert 0 < share.max() < 1
    assert one.summary.peak_normal_force_N == pytest.approx(
        full.summary.peak_normal_force_N, rel=0.2
    )
