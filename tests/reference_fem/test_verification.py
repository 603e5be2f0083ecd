"""The explicit solver against exact solutions: manufactured, bending, hitting, sliding, rolling."""

import itertools
import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from scipy.linalg import expm
from scipy.optimize import brentq

from meshes.ball import half_ball
from reference_fem import Material, Settings, Status, Surface
from reference_fem import model as modelling
from reference_fem.dynamics.central_difference import leapfrog
from reference_fem.dynamics.step import advance, start_state
from reference_fem.elements.kinds import hex8, quad4_plane_stress
from reference_fem.stable_step import stable_step
from tests.reference_fem.boxes import boxes
from tests.reference_fem.taps import body, throw

LAWS = ("penalty", "surface", "impulse")


# --- manufactured solution ---------------------------------------------------------------------

YOUNG, POISSON, DENSITY = 1.0, 0.3, 1.0
AMPLITUDE = 0.05  # strains of 0.05 pi: far beyond linear


def manufactured(x: np.ndarray, t: float) -> np.ndarray:
    """u_i = a cos(t + i) sin(pi (x_1 + i/3)) prod cos(...): no symmetry to hide behind."""
    dim = x.shape[1]
    phase = np.arange(dim)
    waves = np.sin(math.pi * (x[:, :1] + phase / 3.0))
    for axis in range(1, dim):
        waves = waves * np.cos(0.5 * math.pi * (x[:, axis : axis + 1] - phase / 5.0))
    return np.asarray(AMPLITUDE * np.cos(t + phase) * waves)


def first_piola(gradient: np.ndarray, lame: float, mu: float) -> np.ndarray:
    """P = F (lambda tr E I + 2 mu E), E = (F^T F - I)/2."""
    eye = np.eye(gradient.shape[-1])
    f = eye + gradient
    strain = 0.5 * (np.swapaxes(f, -1, -2) @ f - eye)
    trace = np.trace(strain, axis1=-2, axis2=-1)[..., None, None]
    return np.asarray(f @ (lame * trace * eye + 2.0 * mu * strain))


def derivative(function: Callable[[np.ndarray], np.ndarray], x: np.ndarray) -> np.ndarray:
    """d/dX_j of a function (n, dim) -> (n, ...), last axis j; central, fourth order."""
    h, parts = 2e-3, []
    for axis in range(x.shape[1]):
        step = np.zeros(x.shape[1])
        step[axis] = h
        near = function(x + step) - function(x - step)
        far = function(x + 2 * step) - function(x - 2 * step)
        parts.append((8.0 * near - far) / (12.0 * h))
    return np.stack(parts, axis=-1)


def manufactured_error(dim: int, n: int) -> float:
    """RMS error after t = 0.5 on the unit square or cube of n cells a side, distorted."""
    mesh = boxes((1.0,), (1.0,) * (dim - 1), (n,) * dim, hinged=False)
    x = mesh.points.copy()
    inside = np.all([np.abs(x[:, a] - x[:, a].mean()) < 0.5 - 1e-9 for a in range(dim)], axis=0)
    # A smooth distortion: the cells become general, and similar from mesh to mesh.
    x += 0.04 * np.prod(np.sin(2 * math.pi * x), axis=1, keepdims=True)
    columns = [np.full(len(mesh.cells), value) for value in (YOUNG, POISSON, DENSITY)]
    mu = YOUNG / (2 * (1 + POISSON))
    lame = YOUNG * POISSON / ((1 + POISSON) * (1 - 2 * POISSON))
    if dim == 3:
        kernel = hex8(x, mesh.cells, *columns)
    else:
        kernel = quad4_plane_stress(x, mesh.cells, *columns, np.ones((len(mesh.cells), 4)))
        lame = 2 * lame * mu / (lame + 2 * mu)
    none = np.empty(0, dtype=np.int64)
    steps = math.ceil(0.5 / (0.8 * stable_step(kernel, none, np.empty(0), none)))
    dt = 0.5 / steps

    def body_force(t: float) -> np.ndarray:
        def stress(at: np.ndarray) -> np.ndarray:
            return first_piola(derivative(lambda y: manufactured(y, t), at), lame, mu)

        divergence = np.trace(derivative(stress, x), axis1=-2, axis2=-1)
        return np.asarray(-DENSITY * manufactured(x, t) - divergence)

    u = manufactured(x, dt)
    v = (u - manufactured(x, 0.0)) / dt
    residual, held = np.empty_like(u), ~inside
    for step in range(1, steps):
        kernel.internal_force(u, residual)
        residual -= kernel.lumped_mass[:, None] / DENSITY * body_force(step * dt)
        leapfrog(u, v, residual, 1.0 / kernel.lumped_mass, (0.0, 0.0), dt)
        u[held] = manufactured(x[held], (step + 1) * dt)
        v[held] = 0.0
    error = u - manufactured(x, steps * dt)
    return float(np.sqrt(np.mean(error**2)))


@pytest.mark.parametrize(("dim", "sizes"), [(2, (8, 16, 32)), (3, (4, 8, 16))])
def test_manufactured_solution_converges_with_order_two(dim: int, sizes: tuple[int, ...]) -> None:
    errors = [manufactured_error(dim, n) for n in sizes]
    orders = [math.log2(a / b) for a, b in itertools.pairwise(errors)]
    # Linear elements, lumped mass, leapfrog: order 2 in h with the step proportional to h.
    assert orders[-1] == pytest.approx(2.0, abs=0.25)
    assert errors[-1] < 0.01 * AMPLITUDE


# --- free vibration ------------------------------------------------------------------------------


def timoshenko(length: float, area: float, inertia: float, material: Material, k: float) -> float:
    """First bending frequency of a free-free Timoshenko beam, rad/s.

    w' = phi + V/kGA, phi' = M/EI, M' = -V - rho I w² phi, V' = -rho A w² w; the transfer matrix
    over the length must take M = V = 0 to M = V = 0.
    """
    e, rho = material.youngs_modulus, material.density
    g = e / (2 * (1 + material.poisson_ratio))

    def closing(omega: float) -> float:
        s = omega * omega * rho
        a = np.zeros((4, 4))
        a[0, 1], a[0, 3], a[1, 2] = 1, 1 / (k * g * area), 1 / (e * inertia)
        a[2, 1], a[2, 3], a[3, 0] = -s * inertia, -1, -s * area
        return float(np.linalg.det(expm(a * length)[2:, :2]))

    slender = 22.3733 / length**2 * math.sqrt(e * inertia / (rho * area))
    return float(brentq(closing, 0.6 * slender, 1.01 * slender))


@pytest.mark.parametrize("dim", [2, 3])
def test_free_bending_frequency_is_timoshenkos(dim: int) -> None:
    material, length, height = Material(1e9, 0.3, 1400.0), 0.08, 0.008
    if dim == 3:
        mesh = boxes((length,), (height, height), (80, 8, 4), hinged=False, half=True)
        area, inertia = height**2, height**4 / 12
        k = 10 * 1.3 / (12 + 11 * 0.3)  # Cowper 1966, square
    else:  # the thickness is the chord of a round section
        mesh = boxes((length,), (height,), (80, 8), hinged=False)
        area, inertia = math.pi * height**2 / 4, math.pi * height**4 / 64
        k = 6 * 1.3 / (7 + 6 * 0.3)  # Cowper 1966, round
    model = body(mesh, material)
    along = model.points[:, 0] + 0.5 * length
    b = 4.73004 / length
    ratio = (math.cosh(4.73004) - math.cos(4.73004)) / (math.sinh(4.73004) - math.sin(4.73004))
    z = b * (along + 0.5 * length)
    shape = np.cosh(z) + np.cos(z) - ratio * (np.sinh(z) + np.sin(z))
    shape -= np.average(shape, weights=model.mass)
    velocity = np.zeros_like(model.points)
    velocity[:, 1] = 1e-3 * shape
    state = start_state(model, np.zeros_like(velocity), velocity, 0.0)
    expected = timoshenko(length, area, inertia, material, k)
    times, deflections = [], []
    while state.time_s < 2.2 * 2 * math.pi / expected:
        state, _ = advance(model, state, 10, False)
        times.append(state.time_s)
        deflections.append(float(np.sum(model.mass * shape * state.displacement[:, 1])))
    y, t = np.array(deflections), np.array(times)
    turns = np.flatnonzero(y[:-1] * y[1:] < 0)
    zeros = t[turns] - y[turns] * (t[turns + 1] - t[turns]) / (y[turns + 1] - y[turns])
    omega = math.pi * (len(zeros) - 1) / (zeros[-1] - zeros[0])
    # Linear elements lock in shear by (l/h)² G/E /2 = 0.3 % of the bending stiffness at eight
    # through the height; 0.5 % is left for the beam theory itself and the other modes.
    assert omega == pytest.approx(expected, rel=0.008)


# --- contact -------------------------------------------------------------------------------------


@pytest.mark.parametrize("contact", LAWS)
@pytest.mark.parametrize("dim", [2, 3])
def test_bar_impact_on_a_wall(dim: int, contact: str, monkeypatch: pytest.MonkeyPatch) -> None:
    # Saint-Venant: F = A sqrt(E rho) v for 2 L/c, with nu = 0. The plane bar stands upright, so an
    # even thickness takes the place of the round section's chord.
    monkeypatch.setattr(
        modelling, "chord_thickness", lambda points, cells, radius: np.full(cells.shape, 0.001)
    )
    length, v, young, density = 0.04, 0.5, 1e9, 1400.0
    mesh = boxes((0.001,), (length, 0.001)[: dim - 1], (1, 80, 1)[:dim], hinged=False)
    settings = Settings(
        contact=contact, penalty_factor=1.0, surface_factor=100.0, output_interval=5
    )
    surface = Surface(length / 2 + 1e-7, 0.0)
    model = body(mesh, Material(young, 0.0, density), surface, settings)
    result = throw(model, settings, (0.0, -v))
    plateau = 1e-6 * math.sqrt(young * density) * v
    transit = 2 * length / math.sqrt(young / density)
    time = result.forces.time_s - (result.summary.contact_time_s or 0.0)
    force = result.forces.normal_force_N
    middle = (time > 0.1 * transit) & (time < 0.9 * transit)
    # The plateau's mean is off by the dispersion of 80 elements; measured 0.3 %, and the front
    # rings by Gibbs' 9 to 18 % about it, under stiff springs in pressure by 43 %.
    assert force[middle].mean() == pytest.approx(plateau, rel=0.01)
    assert force.max() < (1.5 if contact == "surface" else 1.25) * plateau
    # The front smears over (h² L)^(1/3), here 4 % of L at either end.
    assert result.summary.contact_duration_s == pytest.approx(transit, rel=0.05)
    impulse = 2 * density * 1e-6 * length * v
    assert result.summary.normal_impulse_N_s == pytest.approx(impulse, rel=0.02)
    assert (result.summary.energy_residual or 1.0) < (0.01 if contact == "impulse" else 1e-3)


@pytest.mark.parametrize("contact", LAWS)
@pytest.mark.parametrize(("dim", "incline"), [(2, 0.0), (3, 0.0), (2, 0.2)])
def test_block_slides_to_coulombs_rest(dim: int, incline: float, contact: str) -> None:
    # v²/(2 a) and v/a, a = g (mu cos + sin)(incline), and what the rise doesn't take of the kinetic
    # energy goes into friction; tan(incline) < mu, so that it stays there. Put on the surface at
    # once, the block swings about its weight by 100 %, at w = sqrt(k/m): the impulse
    # is off by mu g/w, at the penalty's stiffness 2.45 % of v.
    share, v, mu, gravity = 0.0245, 0.2, 0.4, 100.0
    section = (0.005, 0.01)[: dim - 1]
    mesh = boxes((0.04,), section, (4, 1, 1)[:dim], hinged=False)
    rise = gravity * math.sin(incline)
    slowing = mu * gravity * math.cos(incline) + rise
    stop, distance = v / slowing, v * v / (2 * slowing)
    settings = Settings(
        contact=contact,
        penalty_factor=0.05,
        surface_factor=0.2,
        end_time_s=1.4 * stop,
        max_samples=4000,
        output_interval=1,
    )
    material, surface = Material(1e8, 0.0, 1000.0), Surface(0.0025, mu)
    model = body(mesh, material, surface, settings, gravity=gravity, incline=incline)
    result = throw(model, settings, (v, 0.0))
    assert result.status in (Status.COMPLETED, Status.STILL_IN_CONTACT)
    history = result.history
    travel = history.tip_position_m[:, 0] - history.tip_position_m[0, 0]
    assert travel.max() == pytest.approx(distance, rel=2 * share)
    assert history.time_s[np.argmax(travel)] == pytest.approx(stop, rel=2 * share + 0.02)
    assert travel[-1] == pytest.approx(travel.max(), rel=2 * share)
    # Friction takes it all but for the vibration that is left.
    spent = model.mass.sum() * (0.5 * v * v - rise * distance)
    assert history.friction_dissipation_J[-1] == pytest.approx(spent, rel=2 * share)
    assert np.all(np.diff(history.friction_dissipation_J) > -1e-12 * spent)
    assert history.coulomb_excess_N.max() < 1e-12 * history.normal_force_N.max()
    assert (result.summary.energy_residual or 1.0) < 0.01


def test_ball_slides_then_rolls() -> None:
    # Coulomb: rolling begins at 2 v/(7 mu g), with 5/7 of the speed, 12 v²/(49 mu g) farther;
    # friction has taken m v²/7.
    radius, v, mu, gravity = 0.01, 3.0, 0.3, 100.0
    mesh = half_ball(radius, 2e-3, 1.001)
    mesh = replace(mesh, facet_sets={"surface": mesh.facet_sets["tip"]})
    start = 2 * v / (7 * mu * gravity)
    lasts = {"end_time_s": 2.0 * start, "max_contact_time_s": 2.0 * start}
    settings = Settings(contact="surface", surface_factor=30.0, **lasts)
    surface = Surface(radius * (1 + 1e-6), mu)
    model = body(mesh, Material(3e6, 0.3, 1000.0), surface, settings, gravity=gravity)
    result = throw(model, settings, (v, 0.0))
    history = result.history
    mass = 2 * model.mass.sum()
    # The mesh's own moment of inertia, about Z: J = share * m R².
    share = 2 * np.sum(model.mass[:, None] * model.points[:, :2] ** 2) / (mass * radius**2)
    assert share == pytest.approx(0.4, rel=0.03)
    lost = mass * v * v / 2 * share / (1 + share)
    # Facets make the ball a polygon, and the normal force swings by all of the weight.
    assert history.friction_dissipation_J[-1] == pytest.approx(lost, rel=0.05)
    rolled = history.friction_dissipation_J > 0.97 * history.friction_dissipation_J[-1]
    # The rate falls linearly with the slip speed: 97 % are lost at 1 - sqrt(0.03) of the time.
    assert history.time_s[rolled][0] == pytest.approx((1 - math.sqrt(0.03)) * start, rel=0.1)
    assert (result.summary.energy_residual or 1.0) < 0.01


@pytest.mark.parametrize("contact", LAWS)
def test_half_model_touches_as_the_full_one(contact: str) -> None:
    found, step = [], None
    for half, width in ((False, 4), (True, 2)):
        mesh = boxes((0.01,), (0.01, 0.02), (3, 3, width), hinged=False, half=half)
        settings = Settings(contact=contact, surface_factor=10.0, step_factor=0.8)
        model = body(mesh, Material(1e8, 0.3, 1000.0), Surface(0.0050001, 0.3), settings)
        step = step or model.step_s
        result = throw(replace(model, step_s=step), settings, (0.3, -0.2))
        names = ("peak_normal_force_N", "normal_impulse_N_s", "contact_duration_s",
                 "peak_tangential_force_N")  # fmt: skip
        scalars = [getattr(result.summary, name) for name in names]
        found.append([*scalars, result.history.friction_dissipation_J[-1]])
    # The same equations in another order: round-off, which contact's switches may enlarge.
    assert found[0] == pytest.approx(found[1], rel=1e-6)
