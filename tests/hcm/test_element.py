"""The beam element against closed forms, independent quadrature and differences."""

import numpy as np
import pytest
from numpy.polynomial import Polynomial
from scipy.interpolate import CubicSpline
from scipy.optimize import fsolve

import hcm
from hcm.beam.chain import build_chain
from hcm.beam.element import (
    fill_matrices,
    inertia,
    internal_force,
    kinetic_energy,
    over,
    shape_of,
    strain_energy,
    tangent_stiffness,
)
from hcm.beam.energy import stress_at_probe
from hcm.beam.probe import build_probe, smooth_probe
from tests.hcm.cases import order_of

LENGTH, EA, EI, RHO_A = 0.008, 1.8e5, 2.5, 0.25
MASS, BENDING = np.empty((4, 4)), np.empty((4, 4))
fill_matrices(RHO_A, EI, LENGTH, MASS, BENDING)
STRAIGHT = np.array([0.0, 0, 1, 0, LENGTH, 0, 1, 0])

x = Polynomial([0, 1])
HERMITE = [
    1 - 3 * (x / LENGTH) ** 2 + 2 * (x / LENGTH) ** 3,
    x * (1 - x / LENGTH) ** 2,
    3 * (x / LENGTH) ** 2 - 2 * (x / LENGTH) ** 3,
    x * (x / LENGTH) * (x / LENGTH - 1),
]


def integral(p: Polynomial) -> float:
    return float(p.integ()(LENGTH) - p.integ()(0.0))


def deformed(seed: int) -> np.ndarray:
    """Strains and rotations of order 0.1, about some direction."""
    rng = np.random.default_rng(seed)
    q = rotated(STRAIGHT, rng.uniform(0, 2 * np.pi))
    return q + 0.1 * rng.standard_normal(8) * np.tile([LENGTH, LENGTH, 1, 1], 2)


def rotated(q: np.ndarray, angle: float) -> np.ndarray:
    c, s = np.cos(angle), np.sin(angle)
    return (q.reshape(4, 2) @ np.array([[c, s], [-s, c]])).ravel()


def arguments(q: np.ndarray) -> tuple[tuple[float, ...], ...]:
    """Chord and slopes, and stiffnesses, as the kernels take them."""
    return shape_of(q, LENGTH), (EA * LENGTH, BENDING[1, 1], BENDING[1, 3])


# (chord, r'_1, r'_2) of one component from (r_1, r'_1, r_2, r'_2)
REDUCE = np.array([[-1 / LENGTH, 0, 1 / LENGTH, 0], [0, 1, 0, 0], [0, 0, 0, 1]])


def force(q: np.ndarray) -> np.ndarray:
    conjugate = np.array(internal_force(*arguments(q))).reshape(3, 2)
    return (REDUCE.T @ conjugate).ravel()


def energy(q: np.ndarray) -> float:
    return strain_energy(*arguments(q))


def tangent(q: np.ndarray) -> np.ndarray:
    out = np.zeros((8, 8))
    xx, xy, yy = (
        REDUCE.T @ np.array(block)[[[0, 1, 2], [1, 3, 4], [2, 4, 5]]] @ REDUCE
        for block in tangent_stiffness(*arguments(q))
    )
    out[::2, ::2], out[::2, 1::2], out[1::2, ::2], out[1::2, 1::2] = xx, xy, xy, yy
    return out


def test_mass_is_the_integral_of_hermite_products() -> None:
    expected = [[RHO_A * integral(a * b) for b in HERMITE] for a in HERMITE]
    np.testing.assert_allclose(MASS, expected, rtol=1e-13)


def test_bending_is_the_integral_of_hermite_curvatures() -> None:
    expected = [[EI * integral(a.deriv(2) * b.deriv(2)) for b in HERMITE] for a in HERMITE]
    np.testing.assert_allclose(BENDING, expected, rtol=1e-12)


def test_inertia_and_kinetic_energy_use_the_mass_matrix() -> None:
    v = np.random.default_rng(0).standard_normal(8)
    mass = np.kron(MASS, np.eye(2))
    found = np.transpose([inertia(MASS, *v[c::2]) for c in range(2)]).ravel()
    np.testing.assert_allclose(found, mass @ v, rtol=1e-13)
    expected = 0.5 * v @ mass @ v
    assert kinetic_energy(MASS, v) == pytest.approx(expected, rel=1e-13)


def test_strain_energy_is_the_integral_of_the_strains() -> None:
    """Polynomial algebra instead of Gauss points, S'' instead of slopes' deviations."""
    q = deformed(1)
    r = [sum(HERMITE[i] * q[2 * i + c] for i in range(4)) for c in range(2)]
    strain = 0.5 * (r[0].deriv() ** 2 + r[1].deriv() ** 2 - 1)
    curvature_squared = r[0].deriv(2) ** 2 + r[1].deriv(2) ** 2
    expected = 0.5 * integral(EA * strain**2 + EI * curvature_squared)
    # powers of x/l up to 8 lose about three digits
    assert energy(q) == pytest.approx(expected, rel=1e-11)


@pytest.mark.parametrize("angle", np.radians(np.arange(0, 361, 24)))
def test_rigid_motion_gives_no_force(angle: float) -> None:
    """Round-off of a unit slope strains the bar by 1e-16, and EA times that is all that is left."""
    q = rotated(STRAIGHT, angle) + np.tile([0.31, -0.17, 0, 0], 2)
    unit = np.tile([1 / LENGTH, 1 / LENGTH, 1, 1], 2)
    # translation by 0.3 m: positions rounded to 5e-17 m, over a length of 8 mm
    assert np.abs(force(q) / unit).max() < 50 * np.finfo(float).eps * 0.3 / LENGTH * EA * LENGTH
    assert energy(q) < 1e-20


@pytest.mark.parametrize("seed", range(5))
def test_force_is_the_gradient_of_the_energy(seed: int) -> None:
    q, f = deformed(seed), force(deformed(seed))
    step = 1e-5 * np.tile([LENGTH, LENGTH, 1, 1], 2)
    differences = np.array([(energy(q + d) - energy(q - d)) / d.sum() / 2 for d in np.diag(step)])
    # central differences: step^2 = 1e-10 of the third derivative, round-off 1e-16/1e-5
    np.testing.assert_allclose(differences * step, f * step, atol=1e-8 * np.abs(f * step).max())


@pytest.mark.parametrize("seed", range(5))
def test_tangent_is_the_gradient_of_the_force(seed: int) -> None:
    q, k = deformed(seed), tangent(deformed(seed))
    step = 1e-5 * np.tile([LENGTH, LENGTH, 1, 1], 2)
    differences = np.array([(force(q + d) - force(q - d)) / d.sum() / 2 for d in np.diag(step)]).T
    scaled = step[:, None] * step
    error = np.abs(scaled * (differences - k)).max() / np.abs(scaled * k).max()
    assert error < 1e-7


def test_forces_turn_with_the_frame() -> None:
    q = deformed(3)
    for angle in (0.3, 2.0, -1.1):
        moved = rotated(q, angle) + np.tile([0.1, -0.2, 0, 0], 2)
        assert energy(moved) == pytest.approx(energy(q), rel=1e-12)
        f = force(q)
        unit = np.tile([LENGTH, LENGTH, 1, 1], 2)
        error = np.abs((force(moved) - rotated(f, angle)) * unit).max()
        assert error < 1e-11 * np.abs(f * unit).max()


@pytest.mark.parametrize("elements", [4, 5])
@pytest.mark.parametrize("direction", [0.0, np.pi, -0.7])
def test_stress_at_r_of_a_bent_and_stretched_bar(elements: int, direction: float) -> None:
    """Field r(s) with stretch f and curvature c at mid-length: sigma = E (e - k d/2) exactly."""
    phalanx = hcm.Phalanx(0.04, 0.015, 1e9, 1400.0, elements)
    body = hcm.Finger((phalanx,))
    chain, q = build_chain(body, hcm.Drive())
    stretch, bend, middle = 1.002, 3.0, phalanx.length / 2
    along = np.array([np.cos(direction), np.sin(direction)])
    across = np.array([-along[1], along[0]])
    for i in range(elements + 1):
        s, place = phalanx.length * i / elements - middle, 2 + 4 * i
        q[place : place + 2] = stretch * s * along + 0.5 * bend * s**2 * across
        q[place + 2 : place + 4] = stretch * along + bend * s * across
    # r'' = bend across, r' = stretch along at s = 0; quadratics are in the element's space
    expected = 1e9 * ((stretch**2 - 1) / 2 - bend * 0.0075)
    probe = build_probe(body)
    if elements % 2 == 0:  # both sides of a node agree here, the bar being smooth
        assert probe.elements[0] != probe.elements[1]
    assert stress_at_probe(q, np.zeros(q.size), chain, probe) == pytest.approx(expected, rel=1e-10)


@pytest.mark.parametrize("parity", [0, 1])
@pytest.mark.parametrize(("smooth", "order"), [(False, 2.0), (True, 4.0)])
def test_order_of_the_stress_at_r_in_a_bar_of_varying_curvature(
    parity: int, smooth: bool, order: float
) -> None:
    """A bar of small deflection a sin w s, w = 2/L, has k = -a w^2 sin 1 at its middle.

    Cubics through its nodes, whatever their number's parity: of order 2 at R, 4 by Gauss points.
    """
    counts, errors = np.array([6, 12, 24, 48]) + parity, []
    length, a, wave = 0.04, 1e-6, 2 / 0.04
    exact = 1e9 * (0.5 * (a * wave * np.cos(1.0)) ** 2 + a * wave**2 * np.sin(1.0) * 0.0075)
    for n in counts:
        finger = hcm.Finger((hcm.Phalanx(length, 0.015, 1e9, 1400.0, int(n)),))
        chain, q = build_chain(finger, hcm.Drive())
        s = length * np.arange(n + 1) / n
        nodes = s, a * np.sin(wave * s), np.ones(n + 1), a * wave * np.cos(wave * s)
        q[2:] = np.stack(nodes, axis=1).ravel()
        probe = smooth_probe(finger, length, 1.0) if smooth else build_probe(finger)
        stress = stress_at_probe(q, np.zeros(q.size), chain, probe)
        errors.append(abs(stress / exact - 1.0))
    assert order_of(1.0 / counts, errors) == pytest.approx(order, abs=0.3)


@pytest.mark.parametrize(("elements", "length"), [(1, 0.04), (2, 0.04), (5, 0.05), (7, 0.09)])
def test_places_of_a_smooth_stress_give_a_cubic_exactly(elements: int, length: float) -> None:
    """A line on one element. R is at half of `length`, or at the end of a shorter beam."""
    finger = hcm.Finger((hcm.Phalanx(0.04, 0.015, 1e9, 1400.0, elements),) * 2)
    probe = smooth_probe(finger, length, 1.0)
    el, at = 0.04 / elements, min(0.5 * length, 0.04)
    places = el * (probe.elements - elements + probe.abscissa)
    assert ((probe.abscissa > 0.2) & (probe.abscissa < 0.8)).all()
    for power in range(min(2 * elements, 4)):
        assert probe.weights @ places**power == pytest.approx(at**power)


def fitted_stress(e: float, b: float, nu: float) -> float:
    """Cauchy's stress over E at the surface of a St. Venant-Kirchhoff rod of radius 1.

    Its force is E A e |r'|, its moment about the centroid E I |r'| k with k = -b, as the model's.
    Fibres stretch by stretch - turn eta and contract by (1 - 2 nu e_11)^(1/2); the fit is linear in
    y.
    """
    y, weights = np.polynomial.legendre.leggauss(120)
    weights = weights * np.sqrt(1.0 - y**2) / np.sum(weights * np.sqrt(1.0 - y**2))
    length = np.sqrt(1.0 + 2.0 * e)

    def fields(stretch: float, turn: float) -> tuple[np.ndarray, ...]:
        eta = y
        for _ in range(30):  # contraction and strain depend on each other
            strain = 0.5 * ((stretch - turn * eta) ** 2 - 1.0)
            across = CubicSpline(y, np.sqrt(1.0 - 2.0 * nu * strain)).antiderivative()
            eta = across(y) - across(0.0)
        return strain, stretch - turn * eta, eta

    def missing(unknown: np.ndarray) -> list[float]:
        strain, fibre, eta = fields(*unknown)
        force, arm = weights @ (fibre * strain), eta - weights @ eta
        moment = -weights @ (fibre * strain * arm)
        return [force - e * length, 4.0 * moment + b * length]

    strain, fibre, _ = fields(*fsolve(missing, [length, -b], xtol=1e-13))
    stress = fibre * strain / (1.0 - 2.0 * nu * strain)
    return float(weights @ stress + 4.0 * (weights @ (stress * y)))


@pytest.mark.parametrize("nu", [0.0, 0.3, 0.48])
@pytest.mark.parametrize(("e", "b"), [(1.0, 0.0), (0.0, 1.0), (0.3, -1.0), (-0.4, 0.8)])
def test_cauchy_stress_is_right_to_second_order(e: float, b: float, nu: float) -> None:
    finger = hcm.Finger((hcm.Phalanx(0.04, 0.015, 1e9, 1400.0, 4, poisson_ratio=nu),))
    probe = smooth_probe(finger, 0.04, 1.0, cauchy=True)
    ee, ek, kk = probe.second_order
    for size in (1e-2, 1e-3):
        axial, bent = size * e, size * b
        stretch, k = 2.0 * axial, -bent / probe.radius
        told = axial + bent + ee * stretch**2 + ek * stretch * k + kk * k**2
        assert abs(told - fitted_stress(axial, bent, nu)) < 2.0 * size**3


@pytest.mark.parametrize("by", [3.0, 5.0, 7.0, 9.0, 1.7e-3])
def test_over_divides_to_the_last_bit(by: float) -> None:
    """The product with 1/by alone is off by one bit in a sixth to a third of the cases."""
    rng = np.random.default_rng(1)
    values = rng.standard_normal(2000) * 10.0 ** rng.uniform(-30, 30, 2000)
    found = np.array([over(x, by, 1.0 / by) for x in values])
    np.testing.assert_array_equal(found, values / by)
    assert (values * (1.0 / by) != values / by).sum() > 100
