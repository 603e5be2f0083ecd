"""Kelvin-Voigt damping of the beams: its forces, the decay of vibrations, and damped taps."""

import math
from dataclasses import replace

import numpy as np
import pytest

import hcm
from hcm.assembly.equations import residual
from hcm.beam.banded_ldl import HALF_BANDWIDTH
from hcm.beam.chain import Chain, build_chain
from hcm.beam.damping import add_damping_matrix, damping_force, damping_power
from hcm.beam.element import shape_of
from hcm.beam.energy import energies, stress_at_probe
from hcm.beam.probe import build_probe
from hcm.contact.law import IN_FLIGHT
from hcm.reference_solution import ChainStart, solve_chain
from tests.hcm.cases import (
    NOWHERE,
    SOFT,
    SOFT_LAW,
    SOFT_TIP,
    SURFACE,
    finger,
    integrate,
    mode_near,
    straight_links,
)
from tests.hcm.test_element import EA, EI, HERMITE, LENGTH, deformed, integral, rotated

TAU = 1e-5
STIFFNESS = EA * LENGTH, 4 * EI / LENGTH, 2 * EI / LENGTH
STILL = hcm.Drive(gravity=0.0)


def reduced(q: np.ndarray) -> tuple[float, ...]:
    """Chord and slopes, or their rates."""
    return shape_of(q, LENGTH)


def force(q: np.ndarray, v: np.ndarray) -> np.ndarray:
    c, f1, f2 = np.reshape(damping_force(reduced(q), reduced(v), STIFFNESS), (3, 2))
    return np.concatenate([-c / LENGTH, f1, c / LENGTH, f2])


def power(q: np.ndarray, v: np.ndarray) -> float:
    return damping_power(reduced(q), reduced(v), STIFFNESS)


def velocities(seed: int) -> np.ndarray:
    return np.random.default_rng(seed).standard_normal(8) * np.tile([LENGTH, LENGTH, 1, 1], 2)


def spun(q: np.ndarray) -> np.ndarray:
    """Velocities of a rigid motion: one radian a second about the origin, and a translation."""
    return rotated(q, math.pi / 2) + np.tile([0.3, -0.2, 0.0, 0.0], 2)


@pytest.mark.parametrize("seed", range(3))
def test_power_is_that_of_strains_in_the_elements_frame(seed: int) -> None:
    """Differences in time of e and of r'' along and across the chord, on Hermite polynomials."""
    q, v, step = deformed(seed), velocities(seed + 10), 1e-6

    def strains(state: np.ndarray) -> list:
        r = [sum(HERMITE[i] * state[2 * i + c] for i in range(4)) for c in range(2)]
        cx, cy = (state[4:6] - state[:2]) / np.linalg.norm(state[4:6] - state[:2])
        kx, ky = r[0].deriv(2), r[1].deriv(2)
        return [0.5 * (r[0].deriv() ** 2 + r[1].deriv() ** 2), cx * kx + cy * ky, cx * ky - cy * kx]

    ends = [strains(q + sign * step * v) for sign in (1, -1)]
    e, along, across = ((a - b) / (2 * step) for a, b in zip(*ends, strict=True))
    expected = integral(EA * e**2 + EI * (along**2 + across**2))
    # differences: step^2 of the third derivative, and 1e-16/1e-6 of strains of order 0.1
    assert power(q, v) == pytest.approx(expected, rel=1e-8)


@pytest.mark.parametrize("seed", range(3))
def test_force_is_half_the_gradient_of_the_power(seed: int) -> None:
    """A quadratic form: its differences are exact, and force times velocity is the power."""
    q, v = deformed(seed), velocities(seed + 10)
    gradient = [(power(q, v + d) - power(q, v - d)) / 2 for d in np.eye(8)]
    np.testing.assert_allclose(2 * force(q, v), gradient, atol=1e-10 * np.abs(gradient).max())
    assert v @ force(q, v) == pytest.approx(power(q, v), rel=1e-12)
    assert power(q, v) > 0


@pytest.mark.parametrize("seed", range(3))
def test_matrix_is_the_gradient_of_the_force(seed: int) -> None:
    q, scale, w = deformed(seed), np.array([1, 1, 2, 2, 1, 1, 3, 3]), HALF_BANDWIDTH
    rows = np.zeros((8, w + 1))
    add_damping_matrix(reduced(q), STIFFNESS, LENGTH, 2.0, 3.0, rows)
    expected = np.array([force(q, d) for d in np.eye(8)]).T * np.outer(scale, scale)
    found = [[rows[max(i, j), w - abs(i - j)] for j in range(8)] for i in range(8)]
    np.testing.assert_allclose(found, expected, atol=1e-12 * np.abs(expected).max())


@pytest.mark.parametrize("seed", range(3))
def test_frames_do_not_matter(seed: int) -> None:
    """A rigid motion of a strained element is not resisted; forces turn with the element."""
    q, v = deformed(seed), velocities(seed + 10)
    f = force(q, v)
    assert np.abs(force(q, spun(q))).max() < 1e-12 * np.abs(f).max()
    assert power(q, spun(q)) < 1e-24 * power(q, v)
    moved, carried = rotated(q, 2.0), rotated(v, 2.0)
    assert power(moved, carried + 7.0 * spun(moved)) == pytest.approx(power(q, v), rel=1e-10)
    expected = rotated(f, 2.0)
    np.testing.assert_allclose(force(moved, carried), expected, atol=1e-10 * np.abs(f).max())


def test_stress_at_r_follows_the_strain_rate() -> None:
    body = finger(SOFT, 1, elements=4, relaxation_time=TAU)
    chain, rest = build_chain(body, STILL)
    rng, probe, step = np.random.default_rng(2), build_probe(body), 1e-5
    q = rest + 0.01 * chain.scale * rng.standard_normal(rest.size)
    v = chain.scale * rng.standard_normal(rest.size)
    before, now, later = (
        stress_at_probe(q + s * step * v, np.zeros(q.size), chain, probe) for s in (-1, 0, 1)
    )
    expected = now + TAU * (later - before) / (2 * step)
    assert stress_at_probe(q, v, chain, probe) == pytest.approx(expected, rel=1e-9)


def test_phalanges_have_relaxation_times_of_their_own() -> None:
    """Only the damped one adds to the forces."""
    body = hcm.Finger((SOFT, replace(SOFT, relaxation_time=TAU)))
    chain, rest = build_chain(body, STILL)
    v, (with_it, without) = np.random.default_rng(3).standard_normal(rest.size), np.empty((2, 60))
    residual(rest, v, np.zeros(rest.size), chain, IN_FLIGHT, NOWHERE, with_it[: rest.size])
    residual(rest, 0 * v, np.zeros(rest.size), chain, IN_FLIGHT, NOWHERE, without[: rest.size])
    added = (with_it - without)[: rest.size]
    second = int(chain.hinge[1])
    assert not added[:second].any()
    assert np.abs(added[second:]).max() > 0


def hinged(diameter: float, tau: float) -> tuple[Chain, np.ndarray]:
    bar = replace(SOFT, diameter=diameter, elements=10, relaxation_time=tau)
    return build_chain(hcm.Finger((bar,)), STILL)


SOUND = math.sqrt(SOFT.youngs_modulus / SOFT.density)
# rad/s; the second moment of the axial bar's section would disperse its waves.
BENDING = (0.015, 3.92660231**2 * SOUND * 0.015 / 4 / SOFT.length**2)
AXIAL = (1.5e-4, math.pi / 2 * SOUND / SOFT.length)


@pytest.mark.parametrize("collocation", [False, True])
@pytest.mark.parametrize("damping", [0.02, 0.3])
@pytest.mark.parametrize("mode", [BENDING, AXIAL], ids=["bending", "axial"])
def test_free_vibration_of_a_hinged_beam_decays(
    mode: tuple[float, float], damping: float, collocation: bool
) -> None:
    """q + tau omega^2 q. + omega^2 q.. of each mode: tau omega/2 of the critical damping."""
    diameter, omega = mode
    chain, rest = hinged(diameter, 2 * damping / omega)
    found, shape = mode_near(omega, chain, rest)
    assert found == pytest.approx(omega, rel=2e-3)  # axial: (pi/20)^2/24 of linear elements
    amplitude, periods = 1e-8, 3
    end, steps = periods * 2 * math.pi / found, 90 if collocation else 1200
    start = ChainStart(rest + amplitude * shape, np.zeros(rest.size))
    run = integrate(
        chain, NOWHERE, start, end / steps, xi=1.0, end_time=end, collocation=collocation
    )
    away = (run.motion.q - rest)[chain.hinge_outer[0] :]
    left = away @ shape[chain.hinge_outer[0] :] / (shape @ shape) / amplitude
    slower = math.sqrt(1 - damping**2)
    turned = slower * found * end
    decay = math.exp(-damping * found * end)
    expected = decay * (math.cos(turned) + damping / slower * math.sin(turned))
    # (omega h)^2/12 of the turned angle for the trapezoidal rule; positions keep five digits
    assert left == pytest.approx(expected, abs=1e-5 if collocation else 6e-4)
    held = sum(energies(start.coordinates, start.velocities, chain)[:2])
    lost = run["material_loss"]
    assert np.all(np.diff(lost) >= 0)
    now = sum(energies(run.motion.q, run.motion.v, chain)[:2])
    assert lost[-1] == pytest.approx(held - now, rel=1e-3)


def test_loop_agrees_with_the_truth() -> None:
    """A tap with friction of one damped link's elements, against DOP853 in minimal coordinates."""
    body = finger(SOFT, elements=1, relaxation_time=TAU)
    chain, start = straight_links(body)
    exact = solve_chain(chain, SOFT_LAW, start, 1e-10, 1e-14)
    run = integrate(chain, SOFT_LAW, start, 1e-7, xi=1.0)
    assert run.kinds() == [e.kind for e in exact.events]
    assert run["normal_force"].max() == pytest.approx(exact.peak_normal_force_N, rel=1e-5)
    for event, found in zip(exact.events, run.events, strict=True):
        assert found.time_s == pytest.approx(event.time_s, abs=1e-9)
    assert run["friction_loss"][-1] == pytest.approx(exact.friction_dissipation_J, rel=1e-5)
    total = run["kinetic"] + run["strain"] + run["gravity"] + run["friction_loss"]
    total += run["contact_energy"] + run["material_loss"]
    assert np.ptp(total) < 1e-6 * run["kinetic"][0]
    assert run["material_loss"][-1] > 0.02 * run["kinetic"][0]


@pytest.mark.parametrize("tau", [1e-6, 1e-4])
def test_damped_drops_balance_their_energy(tau: float) -> None:
    """mu = 0, in each kind of flight, through a second tap; rods neither bend nor lose energy."""
    surface, peaks = hcm.Surface(0.1, 0.0), []
    for how in ({"flight_integrator": "gauss"}, {"flight": "rigid"}, {"taps": 2}):
        settings = hcm.Settings(estimate=False, **how)
        body = finger(SOFT, relaxation_time=tau)
        result = hcm.simulate(body, surface, SOFT_TIP, settings=settings)
        assert result.status is hcm.Status.COMPLETED
        assert result.summary.energy_residual < 1e-4
        lost = result.history.material_dissipation_J
        assert np.all(np.diff(lost) >= 0)
        assert lost[-1] > 5e-3 * result.history.kinetic_energy_J.max()
        if how == {"flight": "rigid"}:
            flown = result.history.time_s < result.summary.contact_time_s
            assert not lost[flown].any()
        peaks.append(result.summary.peak_normal_force_N)
    # the release's vibration moves the peak by 1e-4
    assert peaks == pytest.approx([peaks[0]] * 3, rel=2e-4)


def test_estimate_covers_a_damped_tap() -> None:
    settings = hcm.Settings(flight_tolerance=1e-5, contact_tolerance=1e-10)
    finer = hcm.Settings(flight_tolerance=1e-8, contact_tolerance=1e-13, estimate=False)
    coarse, fine = (
        hcm.simulate(finger(SOFT, elements=n, relaxation_time=TAU), SURFACE, SOFT_TIP, settings=s)
        for n, s in ((5, settings), (20, finer))
    )
    for name in ("peak_normal_force_N", "normal_impulse_N_s", "contact_duration_s"):
        error = abs(getattr(coarse.summary, name) - getattr(fine.summary, name))
        assert error < coarse.errors[name] < 0.02 * getattr(fine.summary, name)
