"""The 1-point hexahedron against mathematics: hourglass modes, bending, a run."""

from itertools import product

import numpy as np
import pytest

import reference_fem as rf
from reference_fem.elements.base import ElementKernel
from reference_fem.elements.geometry import CORNERS
from reference_fem.elements.kinds import (
    hex8,
    hex8_one_point,
)
from tests.reference_fem.boxes import boxes
from tests.reference_fem.elements.bodies import (
    SIZE,
    YOUNG,
    force,
    grid,
    material,
    tangent,
)


def hourglass_signs() -> np.ndarray:
    """Hourglass vectors h^n, (4, 8): xi eta, eta zeta, xi zeta, xi eta zeta at the corners."""
    x, y, z = (2.0 * CORNERS[3] - 1.0).T
    return np.stack([x * y, y * z, x * z, x * y * z])


def body(counts: tuple[int, int, int], distortion: float = 0.0) -> ElementKernel:
    points, cells = grid(*counts, distortion=distortion, seed=1)
    return hex8_one_point(points, cells, *material(len(cells)))


@pytest.mark.parametrize(("mode", "axis"), list(product(range(4), range(3))))
def test_every_hourglass_mode_is_held(mode: int, axis: int) -> None:
    """One cube: u_i = a h^n strains nothing at the centre; its energy is k/2 (8 a)^2."""
    k = body((1, 1, 1))
    signs = np.zeros((8, 3))
    signs[k.cells[0], axis] = hourglass_signs()[mode]
    a = 1e-4 * SIZE
    control = YOUNG * SIZE**3 * (24 / (4 * SIZE) ** 2) / 72
    assert np.abs(k.cell_stress(a * signs)).max() < 1e-6 * YOUNG * 1e-4
    assert k.energies(a * signs)[1] == pytest.approx(0.5 * control * 64 * a**2, rel=1e-6)
    assert np.allclose(force(k, a * signs), 8 * a * control * signs, atol=1e-9 * control * a)


def test_pure_bending_of_a_cube_has_the_beams_energy() -> None:
    """u_x = a xi eta: curvature 4 a/h^2, energy E V (curvature)^2 h^2/24, exactly (c = 1)."""
    k = body((1, 1, 1))
    u = np.zeros((8, 3))
    a = 1e-5 * SIZE
    u[k.cells[0], 0] = a * hourglass_signs()[0]
    curvature = 4 * a / SIZE**2
    exact = 0.5 * YOUNG * SIZE**3 * curvature**2 * SIZE**2 / 12
    assert k.energies(u)[0] == pytest.approx(exact, rel=1e-8)


def test_stiffness_has_no_mode_without_energy_but_the_rigid_ones() -> None:
    k = body((1, 1, 1), 0.2)
    values = np.linalg.eigvalsh(tangent(k, k.points))
    assert np.abs(values[:6]).max() < 1e-9 * values[-1]
    assert values[6] > 1e-3 * values[-1]


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
