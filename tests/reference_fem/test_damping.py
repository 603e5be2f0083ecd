"""Kelvin-Voigt damping of the solids: elements, stable step, free vibration, damped drops."""

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.linalg import eigh, expm
from scipy.optimize import brentq, curve_fit

import reference_fem as rf
from reference_fem.dynamics.step import advance, start_state
from reference_fem.elements.base import ElementKernel
from reference_fem.elements.kinds import hex8, hex8_one_point, quad4_plane_stress
from reference_fem.stable_step import lanczos_frequency, stable_step
from tests.reference_fem.boxes import boxes
from tests.reference_fem.elements.bodies import (
    SIZE,
    THICKNESS,
    force,
    grid,
    material,
    rotation,
    tangent,
)
from tests.reference_fem.elements.test_every_kind import COMPONENTS, LAME, MU, moved
from tests.reference_fem.taps import body

TAU, LAG = 1e-5, 2e-7
NONE, ZERO = np.empty(0, dtype=np.int64), np.zeros(1)


def damped(dim: int, counts: tuple[int, ...] = (5, 4, 3), tau: float = TAU) -> ElementKernel:
    """A distorted box; in 2D a sheet."""
    points, cells = grid(*counts[:dim], distortion=0.15, seed=1)
    given, taus = material(len(cells)), np.full(len(cells), tau)
    if dim == 3:
        return hex8(points, cells, *given, taus)
    return quad4_plane_stress(points, cells, *given, np.full(cells.shape, THICKNESS), taus)


def with_rates(
    k: ElementKernel, u: np.ndarray, v: np.ndarray, lag: float
) -> tuple[np.ndarray, tuple[float, float, float]]:
    """What damping adds to the force, N, and the energies and the power; the force and the power
    are the same to round-off where the energies are not asked for.
    """
    out, same = np.full((2, *u.shape), np.nan)
    found = k.force(u, out, (v, lag), audited=True)
    assert k.force(u, same, (v, lag)).power == pytest.approx(found[2], rel=1e-14)
    np.testing.assert_allclose(same, out, rtol=0, atol=1e-13 * np.abs(out).max())
    return out - force(k, u), found


both = pytest.mark.parametrize("dim", [2, 3])


@both
def test_uniform_strain_rate(dim: int) -> None:
    """S = C : (E + tau dE/dt): virtual power, dissipation and stress where F and F. are uniform."""
    k, unit = damped(dim), np.eye(dim)
    slope = np.array([[0.1, 0.2, 0.0], [-0.05, -0.1, 0.3], [0.1, 0.0, 0.05]])[:dim, :dim]
    rate = np.array([[300.0, 20, 70], [-40, 110, 10], [60, -20, -90]])[:dim, :dim]
    u, v, f = k.points @ slope.T, k.points @ rate.T, unit + slope
    before = f - 2 * LAG * rate
    strain_rate = 0.5 * (f.T @ f - before.T @ before) / (2 * LAG)
    piola = TAU * (LAME[dim] * np.trace(strain_rate) * unit + 2 * MU * strain_rate)
    added, (stored, _, power) = with_rates(k, u, v, LAG)
    volume = k.cell_volume.sum()
    for virtual in np.eye(dim * dim).reshape(-1, dim, dim):
        expected = volume * np.sum(f @ piola * virtual)
        # 0.5 E of strains of 0.003 beside 0.1, summed over the elements
        assert np.sum(added * (k.points @ virtual.T)) == pytest.approx(
            expected, abs=1e-11 * volume * np.abs(piola).max()
        )
    assert power == pytest.approx(volume * np.sum(piola * strain_rate), rel=1e-11)
    assert stored == pytest.approx(k.energies(u)[0], rel=1e-13)
    now = 0.5 * (f.T @ rate + rate.T @ f)
    viscous = TAU * f @ (LAME[dim] * np.trace(now) * unit + 2 * MU * now) @ f.T / np.linalg.det(f)
    found = k.cell_stress(u, velocity=v) - k.cell_stress(u)
    np.testing.assert_allclose(found, np.tile(viscous[COMPONENTS[dim]], (k.n_cells, 1)), rtol=1e-8)
    assert np.array_equal(k.cell_stress(u, np.array([7]), v), k.cell_stress(u, velocity=v)[[7]])
    assert np.array_equal(k.cell_stress(u, velocity=0 * v), k.cell_stress(u))


@both
def test_blocks_without_a_relaxation_time_take_elastic_forces(dim: int) -> None:
    """A material of two parts: each has its own forces and dissipation, to the last bits."""
    whole = damped(dim, (9, 4, 3))
    points, cells = whole.points, whole.cells
    taus = np.where(np.arange(len(cells)) < 20, TAU, 0.0)  # a block and a quarter
    given = material(len(cells))
    if dim == 3:
        part = hex8(points, cells, *given, taus)
    else:
        part = quad4_plane_stress(points, cells, *given, np.full(cells.shape, THICKNESS), taus)
    u, v = moved(points, 3), 1e3 * moved(points, 4)
    added, (stored, _, power) = with_rates(part, u, v, 0.0)
    everywhere, (_, _, most) = with_rates(whole, u, v, 0.0)
    apart = np.setdiff1d(np.arange(len(points)), cells[:20])
    inside = np.setdiff1d(np.arange(len(points)), cells[20:])
    scale = np.abs(everywhere).max()
    np.testing.assert_allclose(added[inside], everywhere[inside], atol=1e-12 * scale)
    np.testing.assert_allclose(added[apart], 0.0, atol=1e-12 * np.abs(force(part, u)).max())
    assert stored == pytest.approx(whole.energies(u)[0], rel=1e-13)
    assert 0.0 < power < most
    assert np.sum(added * v) == pytest.approx(power, rel=1e-10)
    still = part.cell_stress(u, velocity=v) - part.cell_stress(u)
    assert not still[20:].any()
    assert still[:20].any(axis=1).all()


@both
def test_damping_is_symmetric_and_takes_what_its_forces_do(dim: int) -> None:
    """v . D(u) w = w . D(u) v, and the power is v . D v >= 0."""
    k = damped(dim)
    u, v, w = moved(k.points, 3), 1e3 * moved(k.points, 4), 1e3 * moved(k.points, 5)
    of_v, (_, _, power) = with_rates(k, u, v, 0.0)
    of_w, _ = with_rates(k, u, w, 0.0)
    assert np.sum(of_v * w) == pytest.approx(np.sum(of_w * v), rel=1e-10)
    assert np.sum(of_v * v) == pytest.approx(power, rel=1e-10)
    assert power > 0.0


@both
def test_small_strains_are_damped_in_proportion_to_their_stiffness(dim: int) -> None:
    """At the reference configuration D = tau K, mean dilatation included."""
    k, step = damped(dim), 1e-6
    v = moved(k.points, 6)
    stiff = (force(k, step * v) - force(k, -step * v)) / (2 * step)
    found, _ = with_rates(k, np.zeros(v.shape), v, 0.0)
    np.testing.assert_allclose(found, TAU * stiff, atol=1e-8 * TAU * np.abs(stiff).max())


@both
@pytest.mark.parametrize("angle", [1e-4, 0.3])
def test_rotation_is_not_damped(dim: int, angle: float) -> None:
    """From one state to its turned one in a step of twice the lag, strained by 0.1 or not."""
    k = damped(dim)
    for u in (np.zeros(k.points.shape), moved(k.points, 7)):
        turned = (k.points + u) @ rotation(angle, dim).T - k.points
        v = (turned - u) / (2 * LAG)
        still = np.abs(with_rates(k, u, 1e-3 * np.abs(v).max() * moved(k.points, 8) / SIZE, 0.0)[0])
        added, (_, _, power) = with_rates(k, turned, v, LAG)
        # positions of 5 mm round to 1e-18 m, over an edge of 1 mm and a step of 4e-7 s
        noise = 1e-15 / (2 * LAG) * TAU * 1e9 * SIZE * max(SIZE, THICKNESS)
        assert np.abs(added).max() < 50 * noise
        assert np.abs(added).max() < 1e-3 * still.max()
        assert 0.0 <= power < 50 * noise * np.abs(v).max() * len(v)


def growth(k: ElementKernel, mode: np.ndarray, dt: float, springs: np.ndarray = ZERO) -> float:
    """How much the velocities of a mode grow in 1,000 steps of the leapfrog, up to a million.

    springs : (n_nodes,) or a zero, N/m, to the ground.
    """
    v = 1e-9 / dt * mode.reshape(k.points.shape) / np.abs(mode).max()
    u, out, start = np.zeros(v.shape), np.empty(v.shape), np.abs(v).max()
    for _ in range(1000):
        k.force(u, out, (v, 0.5 * dt))
        v = v - dt * (out + springs[:, None] * u) / k.lumped_mass[:, None]
        u = u + dt * v
        if np.abs(v).max() > 1e6 * start:
            break
    return float(np.abs(v).max() / start)


@both
@pytest.mark.parametrize("damping", [0.1, 3.0])
def test_stable_step_of_lagging_damping(dim: int, damping: float) -> None:
    """2/w (sqrt(1 + xi^2) - xi), xi = tau w/2, and the leapfrog stays bounded below it alone."""
    elastic = damped(dim, (3, 2, 2), 0.0)
    mass = np.repeat(elastic.lumped_mass, dim)
    squares, modes = eigh(tangent(elastic, elastic.points), np.diag(mass))
    highest = math.sqrt(squares[-1])
    k = damped(dim, (3, 2, 2), 2 * damping / highest)
    exact = 2 / highest * (math.sqrt(1 + damping**2) - damping)
    step = stable_step(k, NONE, np.empty(0), NONE)
    assert 0.97 * exact < step <= exact * (1 + 1e-9)  # as near as Lanczos comes to w
    assert growth(k, modes[:, -1], 0.99 * exact) < 2.0
    assert growth(k, modes[:, -1], 1.02 * exact) > 1e3


@both
def test_springs_between_nodes_shorten_the_step_without_a_part_of_the_damping(dim: int) -> None:
    """Of the mesh's own spectrum: as if K were (1 + 3) K, of which tau K is a quarter."""
    for tau in (0.0, 1e-6):
        k = damped(dim, (3, 2, 2), tau)
        highest = lanczos_frequency(k, np.zeros(k.n_nodes), NONE)
        step = stable_step(k, NONE, np.empty(0), NONE, coupled_eigenvalue=3.0 * highest**2)
        limit, lag = 1.0 / highest, tau / 4.0
        assert step == pytest.approx(limit**2 / (lag + math.hypot(lag, limit)), rel=1e-12)


@both
@pytest.mark.parametrize("damping", [0.1, 3.0])
def test_stable_step_of_stiff_contact_on_a_material_that_relaxes(dim: int, damping: float) -> None:
    """4/dt^2 is the largest eigenvalue of (1 + 2 tau/dt) K + K_c: contact's springs, 30 times as
    stiff as the elements, do not relax. They took part in tau, in up to a hundred times the steps.
    """
    elastic = damped(dim, (3, 2, 2), 0.0)
    mass = np.repeat(elastic.lumped_mass, dim)
    stiffness = tangent(elastic, elastic.points)
    highest = math.sqrt(eigh(stiffness, np.diag(mass), eigvals_only=True)[-1])
    tau, touching = 2 * damping / highest, np.arange(4)
    springs = np.zeros(elastic.n_nodes)
    springs[touching] = 30.0 * highest**2 * elastic.lumped_mass[touching]
    contact = np.diag(np.repeat(springs, dim))

    def largest(dt: float) -> tuple[float, np.ndarray]:
        found = eigh((1 + 2 * tau / dt) * stiffness + contact, np.diag(mass))
        return found[0][-1], found[1][:, -1]

    exact = brentq(lambda dt: 4 / dt**2 - largest(dt)[0], 1e-4 / highest, 2 / highest)
    k = damped(dim, (3, 2, 2), tau)
    step = stable_step(k, touching, springs[touching], NONE)
    assert 0.8 * exact < step <= exact * (1 + 1e-9)
    mode = largest(exact)[1]
    assert growth(k, mode, 0.99 * step, springs) < 2.0
    assert growth(k, mode, 1.02 * exact, springs) > 1e3


LENGTH, SIDE = 0.04, 0.008
MATERIAL = rf.Material(1e9, 0.3, 1400.0)


def hinged_timoshenko(dim: int) -> float:
    """First frequency above rotation of a beam hinged at one end, rad/s: square, in 2D round.

    w' = phi + V/kGA, phi' = M/EI, M' = -V - rho I s phi, V' = -rho A s w with s = omega^2: from
    w = M = 0 to M = V = 0; Cowper's k.
    """
    e, rho, nu = MATERIAL.youngs_modulus, MATERIAL.density, MATERIAL.poisson_ratio
    if dim == 3:
        area, inertia, k = SIDE**2, SIDE**4 / 12, 10 * (1 + nu) / (12 + 11 * nu)
    else:
        area, inertia = math.pi * SIDE**2 / 4, math.pi * SIDE**4 / 64
        k = 6 * (1 + nu) / (7 + 6 * nu)
    shear = k * e / (2 * (1 + nu)) * area

    def closing(omega: float) -> float:
        a = np.zeros((4, 4))
        a[0, 1], a[0, 3], a[1, 2] = 1, 1 / shear, 1 / (e * inertia)
        a[2, 1], a[2, 3], a[3, 0] = -rho * omega**2 * inertia, -1, -rho * omega**2 * area
        return float(np.linalg.det(expm(a * LENGTH)[np.ix_([2, 3], [1, 3])]))

    slender = 3.92660231**2 / LENGTH**2 * math.sqrt(e * inertia / (rho * area))
    return float(brentq(closing, 0.5 * slender, 1.01 * slender))


@both
@pytest.mark.parametrize("damping", [0.02, 0.1])
def test_free_vibration_of_a_hinged_beam_decays(dim: int, damping: float) -> None:
    """At xi = tau omega/2 of the closed form's frequency; what is dissipated is missing after."""
    omega = hinged_timoshenko(dim)
    mesh = boxes((LENGTH,), (SIDE, SIDE)[: dim - 1], (16, 4, 4)[:dim])
    made = replace(MATERIAL, relaxation_time=2 * damping / omega)
    model = body(mesh, made, settings=rf.Settings(step_factor=0.5))
    x, y = -model.points[:, 0], model.points[:, 1]
    beta = 3.92660231 / LENGTH
    share = math.sin(beta * LENGTH) / math.sinh(beta * LENGTH)
    shape = np.zeros_like(model.points)
    shape[:, 1] = np.sin(beta * x) + share * np.sinh(beta * x)
    shape[:, 0] = y * beta * (np.cos(beta * x) + share * np.cosh(beta * x))
    turn = np.zeros_like(shape)
    turn[:, 0], turn[:, 1] = y, x
    weighted = model.mass[:, None] * shape
    shape -= turn * np.sum(weighted * turn) / np.sum(model.mass[:, None] * turn * turn)
    weighted = model.mass[:, None] * shape / np.sum(model.mass[:, None] * shape * shape)
    state = start_state(model, 1e-6 * shape, np.zeros_like(shape), 0.0)
    every = max(1, round(2 * math.pi / omega / model.step_s / 40))
    times, places, losses, energies = [], [], [], []
    while state.time_s < 4 * 2 * math.pi / omega:
        state, block = advance(model, state, every, search=False)
        kinetic = 0.5 * np.sum(model.mass[:, None] * block.velocity**2)
        energies.append(kinetic + block.stored_J)
        losses.append(block.material_J)
        times.append(state.time_s)
        places.append(1e6 * np.sum(weighted * state.displacement))

    def vibration(t: np.ndarray, a: float, b: float, decay: float, w: float) -> np.ndarray:
        return np.asarray(np.exp(-decay * t) * (a * np.cos(w * t) + b * np.sin(w * t)))

    time, place = np.array(times), np.array(places)
    settled = time > 2 * math.pi / omega  # higher modes decay faster
    guess = 1.0, 0.0, damping * omega, omega
    (_, _, decay, turning), _ = curve_fit(vibration, time[settled], place[settled], guess)
    natural = math.hypot(decay, turning)
    # four linear elements across the depth bend 3 % too stiffly
    assert natural == pytest.approx(omega, rel=0.03)
    assert decay / natural == pytest.approx(damping * natural / omega, rel=0.01)
    assert np.all(np.diff(losses) >= 0.0)
    held = np.array(energies) + losses
    # of the stiffest modes in the first posture the leapfrog's energy is (omega h)^2/4 off
    assert np.ptp(held[1:]) < 1e-3 * held[0]
    assert losses[-1] > 0.3 * held[0]


@both
def test_damped_drop_balances_its_energy(dim: int, one_thread: None) -> None:
    """mu = 0, to 1e-3, and the peaks of a stiffer contact: what is lost grows all the time."""
    mesh = boxes((0.04, 0.04), (0.015, 0.015)[: dim - 1], (8, 3, 2)[:dim])
    soft = (rf.Material(1e9, 0.4, 1400.0, 2e-6),) * 2
    settings = rf.Settings(estimate=False)
    result = rf.simulate(mesh, soft, rf.Surface(0.05, 0.0), rf.Drive(), settings)
    assert result.status is rf.Status.COMPLETED
    h = result.history
    assert result.summary.energy_residual < 1e-3
    assert np.all(np.diff(h.material_dissipation_J) >= 0.0)
    assert h.material_dissipation_J[-1] > 5e-3 * h.kinetic_energy_J.max()
    assert h.friction_dissipation_J.max() == 0.0


def test_one_point_is_refused_with_the_remedy() -> None:
    points, cells = grid(1, 1, 1)
    with pytest.raises(ValueError, match=r"relaxation_time = 1e-05.*hex8-sri.*leave") as refused:
        hex8_one_point(points, cells, *material(1), np.full(1, TAU))
    assert "\n" not in str(refused.value)


@pytest.mark.parametrize("tau", [-1e-9, math.nan, math.inf])
def test_bad_relaxation_times_are_refused(tau: float) -> None:
    with pytest.raises(ValueError, match="relaxation_time"):
        rf.Material(1e9, 0.4, 1400.0, tau)
