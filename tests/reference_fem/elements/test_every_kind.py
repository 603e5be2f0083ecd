"""Elements of every kind against mathematics: patches, rigid motions, gradients, tension."""

import numpy as np
import pytest
from scipy.linalg import eigh

from reference_fem.elements.base import ElementKernel
from reference_fem.elements.kinds import NEO_HOOKE
from reference_fem.stable_step import lanczos_frequency
from tests.reference_fem.elements.bodies import (
    KINDS,
    POISSON,
    SIZE,
    THICKNESS,
    YOUNG,
    body,
    each_kind,
    force,
    grid,
    rotation,
    sheet,
    tangent,
)

MU = YOUNG / (2 * (1 + POISSON))
LAME = {3: 2 * MU * POISSON / (1 - 2 * POISSON), 2: YOUNG * POISSON / (1 - POISSON**2)}
COMPONENTS = {3: ([0, 1, 2, 0, 1, 0], [0, 1, 2, 1, 2, 2]), 2: ([0, 1, 0], [0, 1, 1])}
Body = tuple[np.ndarray, ElementKernel]


@pytest.fixture(scope="module", params=KINDS)
def distorted(request: pytest.FixtureRequest) -> Body:
    """60 distorted hexahedra or 20 quadrilaterals of uneven thickness."""
    points, cells, k = body(request.param, (5, 4, 3), 0.15)
    if k.dim == 2:
        thickness = np.random.default_rng(1).uniform(0.8, 1.2, cells.shape) * THICKNESS
        k = sheet(points, cells, thickness=thickness)
    return points, k


def law(kind: str, f: np.ndarray) -> tuple[np.ndarray, float]:
    """Second Piola-Kirchhoff stress, Pa, and energy per volume, Pa, of F."""
    unit, lame, right = np.eye(len(f)), LAME[len(f)], f.T @ f
    if kind == "hex8-neo-hooke":
        inverse, volume = np.linalg.inv(right), np.linalg.det(f)
        piola = MU * (unit - inverse) + 0.5 * lame * (volume**2 - 1) * inverse
        shape = 0.5 * MU * (np.trace(right) - 3) - MU * np.log(volume)
        return piola, shape + 0.25 * lame * (volume**2 - 1) - 0.5 * lame * np.log(volume)
    strain = 0.5 * (right - unit)
    piola = lame * np.trace(strain) * unit + 2 * MU * strain
    return piola, 0.5 * np.sum(piola * strain)


def moved(points: np.ndarray, seed: int) -> np.ndarray:
    return 0.1 * SIZE * np.random.default_rng(seed).standard_normal(points.shape)


@each_kind
def test_patch_linear_displacement(kind: str) -> None:
    """Any F: one stress everywhere, no net force inside, and the energy W(F) V."""
    points, _, k = body(kind, (5, 4, 3), 0.15)
    dim = k.dim
    assert (k.n_nodes, k.n_cells) == ((120, 60) if dim == 3 else (30, 20))
    assert (k.lumped_mass.shape, k.cell_volume.shape) == ((k.n_nodes,), (k.n_cells,))
    slope = np.array([[0.1, 0.2, 0.0], [-0.05, -0.1, 0.3], [0.1, 0.0, 0.05]])[:dim, :dim]
    f = np.eye(dim) + slope
    u = points @ slope.T
    piola, density = law(kind, f)
    trace = 0.5 * (np.sum(f * f) - dim)
    # a sheet thins
    through = 1.0 if dim == 3 else np.sqrt(1 - 2 * POISSON / (1 - POISSON) * trace)
    cauchy = f @ piola @ f.T / (np.linalg.det(f) * through)
    assert np.allclose(k.cell_stress(u), cauchy[COMPONENTS[dim]], rtol=1e-11, atol=0)
    energy = density * k.cell_volume.sum()
    assert k.energies(u)[0] == pytest.approx(energy, rel=1e-12)
    assert k.energies(u)[1] < 1e-20 * energy
    assert k.min_det_F(u) == pytest.approx(np.linalg.det(f), rel=1e-12)
    nodal = force(k, u).reshape(*(n + 1 for n in (5, 4, 3)[:dim]), dim)
    inside = nodal[(slice(1, -1),) * dim]
    assert np.abs(inside).max() < 1e-12 * np.abs(nodal).max()
    full = np.zeros((3, 3))
    full[:dim, :dim] = cauchy
    deviator = full - np.trace(full) / 3 * np.eye(3)
    assert k.von_mises(u)[7] == pytest.approx(np.sqrt(1.5 * np.sum(deviator**2)))


@pytest.mark.parametrize("degrees", range(30, 361, 30))
def test_rigid_motion_costs_nothing(distorted: Body, degrees: int) -> None:
    points, k = distorted
    now = points @ rotation(np.radians(degrees), k.dim).T + [0.003, -0.002, 0.001][: k.dim]
    # the noise of a strain from positions
    noise = 50 * np.finfo(float).eps * np.abs(now).max() / SIZE
    area = SIZE**2 if k.dim == 3 else SIZE * 1.2 * THICKNESS
    assert np.abs(force(k, now - points)).max() < noise * YOUNG * area
    assert np.abs(k.cell_stress(now - points)).max() < noise * YOUNG
    # that of neo-Hookean bodies is a difference of numbers of order one
    least = np.finfo(float).eps if k.kind is NEO_HOOKE else noise**2
    assert abs(k.energies(now - points)[0]) < least * YOUNG * k.cell_volume.sum()


def test_force_is_the_gradient_of_the_energy(distorted: Body) -> None:
    """Central differences of the energy: truncation O(step^2), round-off eps W/step."""
    points, k = distorted
    u, step = moved(points, 3), 1e-8
    f = force(k, u)
    for direction in np.random.default_rng(7).standard_normal((5, *points.shape)):
        up, down = (k.energies(u + s * step * direction)[0] for s in (1, -1))
        assert np.sum(f * direction) == pytest.approx((up - down) / (2 * step), rel=1e-7)
    for node, axis in ((0, 0), (k.n_nodes // 2, 1), (-1, k.dim - 1)):
        direction = np.zeros(points.shape)
        direction[node, axis] = step
        up, down = (k.energies(u + s * direction)[0] for s in (1, -1))
        assert f[node, axis] == pytest.approx((up - down) / (2 * step), rel=1e-5)


@pytest.mark.parametrize("angle", np.radians([30.0, 90.0, 115.0, 200.0]))
def test_frame_invariance(distorted: Body, angle: float) -> None:
    points, k = distorted
    u, turn = moved(points, 4), rotation(angle, k.dim)
    turned = (points + u) @ turn.T - points
    f = force(k, u)
    assert np.allclose(force(k, turned), f @ turn.T, rtol=0, atol=1e-11 * np.abs(f).max())
    assert k.energies(turned)[0] == pytest.approx(k.energies(u)[0], rel=1e-11)
    assert np.allclose(k.von_mises(turned), k.von_mises(u), rtol=1e-10)


def test_stress_of_chosen_cells(distorted: Body) -> None:
    points, k = distorted
    u, chosen = 1e-2 * moved(points, 11), np.array([k.n_cells - 1, 3, 3, 17])
    assert np.array_equal(k.cell_stress(u, chosen), k.cell_stress(u)[chosen])


@pytest.mark.parametrize("kind", [kind for kind in KINDS if kind != "hex8-neo-hooke"])
def test_uniaxial_tension_of_st_venant_kirchhoff(kind: str) -> None:
    """Lateral stretch from S_yy = 0: E_yy = -nu E_xx; then S_xx = E E_xx, N = stretch S_xx A."""
    points, _, k = body(kind, (4, 2, 2))
    stretch = 1.2
    axial = 0.5 * (stretch**2 - 1)
    lateral = np.sqrt(1 - 2 * POISSON * axial)
    u = points * ([stretch - 1, lateral - 1, lateral - 1][: k.dim])
    f = force(k, u)
    face = points[:, 0] > points[:, 0].max() - 1e-9
    area = 2 * SIZE * (2 * SIZE if k.dim == 3 else THICKNESS)
    assert f[face, 0].sum() == pytest.approx(stretch * YOUNG * axial * area, rel=1e-12)
    assert np.abs(f[:, 1:]).max() < 1e-11 * f[face, 0].sum()
    # a sheet thins as much as it narrows: the true stress of the 3D bar
    expected = np.zeros(k.cell_stress(u).shape[1])
    expected[0] = stretch * stretch * YOUNG * axial / (stretch * lateral**2)
    assert k.cell_stress(u)[0] == pytest.approx(expected, abs=1e-11 * expected[0])
    assert k.cell_stress(u)[0, 0] == pytest.approx(expected[0], rel=1e-12)
    assert k.von_mises(u)[0] == pytest.approx(expected[0], rel=1e-12)


@pytest.mark.parametrize(
    ("kind", "poisson", "distortion"),
    [("hex8-sri", 0.0, 0.0), ("hex8-sri", 0.4, 0.0), ("hex8-sri", 0.4, 0.2),
     ("quad4", 0.4, 0.0), ("quad4", 0.4, 0.2)],
)  # fmt: skip
def test_lanczos_bounds_the_spectrum_and_is_near(
    kind: str, poisson: float, distortion: float
) -> None:
    build, dim = KINDS[kind]
    points, cells = grid(*(4, 3, 3)[:dim], distortion=distortion)
    k = build(points, cells, poisson)
    mass = np.diag(np.repeat(k.lumped_mass, dim))
    true = np.sqrt(eigh(tangent(k, points), mass, eigvals_only=True)[-1])
    found = lanczos_frequency(k, np.zeros(k.n_nodes), np.empty(0, dtype=np.int64))
    assert true * (1 - 1e-6) < found < 1.02 * true
