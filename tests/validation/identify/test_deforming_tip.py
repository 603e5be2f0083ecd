"""What a tip that deforms adds to its compliance (`hcm.contact.build`), computed again.

E = rho = R = 1. In three dimensions a free phalanx takes half a sine of force on a patch at its
lowest point; from its displacement there those of the reduced model's beam and of the half-space
are taken away. Axisymmetric: a half-ball on a rod (`half_ball`) is pressed on a plane, and Hertz's
indentation and the rod's shortening are taken away.
"""

from typing import Any

import numpy as np
import pytest
import scipy.optimize as so
import scipy.sparse as sp
from numpy.typing import NDArray

import meshes
from hcm.beam.refinement import shapes
from hcm.contact.build import FINITE_STRAIN, GROWN, RADIATED, RADIATION
from hcm.parameters import NEO_HOOKE, SAINT_VENANT, MaterialLaw
from reference_fem.elements.geometry import geometries
from reference_fem.settings import Material
from reference_fem.statics.tip import _stiffness, last_phalanx, touch_frame
from reference_fem.statics.yielding import facet_quadrature, half_space
from tests.validation.identify.half_ball import NU, ROD, HalfBall, factorized

Numbers = NDArray[np.float64]
LENGTH, PATCH, STEPS = 8.0, 0.25, 30


def solid(degrees: float, length: float) -> tuple[Any, Numbers, Numbers, Numbers]:
    """K, M (diagonal), the loads into the body and along it, and these directions; half a body."""
    angle = np.radians(90.0 - degrees)
    sizes = meshes.Sizing(
        section_size=1 / 5, axial_size=1 / 3.5, tip_size=0.1, contact_angle=angle, growth=1.2
    )
    mesh = meshes.finger_hexahedra(meshes.FingerGeometry((length,), (2.0,)), sizes)
    _, body = last_phalanx(mesh)
    points, facets = body.points, body.facet_sets["surface"]
    _, _, place, frame = touch_frame(body, angle)
    quadrature = facet_quadrature(points, facets)
    at = np.einsum("qk,fkd->fqd", quadrature.shape, points[facets])
    pressure = np.sqrt(np.maximum(1 - ((at - place) ** 2).sum(axis=2) / PATCH**2, 0.0))
    mean = np.zeros(len(points))
    np.add.at(mean, facets, (quadrature.weight * pressure) @ quadrature.shape)
    mean /= mean.sum()
    volume = np.concatenate(
        [
            np.asarray(g.weights).reshape(len(g.weights), -1).sum(axis=1)
            for g in geometries(points, body.cells)
        ]
    )
    mass = np.zeros(len(points))
    np.add.at(mass, body.cells, np.repeat(volume[:, None] / 8, 8, axis=1))
    mass *= (np.pi * (length - 1) + 2 * np.pi / 3) / 2 / mass.sum()
    free = np.setdiff1d(np.arange(3 * len(points)), 3 * body.node_sets["symmetry"] + 2)
    loads = np.stack([np.outer(mean, d).ravel()[free] / 2 for d in frame[:2]], axis=1)
    stiffness = _stiffness(points, body.cells, Material(1.0, NU, 1.0))
    return stiffness[free][:, free].tocsc(), np.repeat(mass, 3)[free], loads, frame[:2, :2]


def beam(directions: Numbers, length: float, elements: int = 8) -> tuple[Numbers, Numbers, Numbers]:
    """K, M and the loads of the reduced model's straight beam with its rigid half-ball."""
    el, area, inertia = (length - 1) / elements, np.pi, np.pi / 4
    phi = 24 * (1 + NU) * inertia / (6 * (1 + NU) ** 2 / (7 + 12 * NU + 4 * NU**2) * area * el**2)
    points, weights = np.polynomial.legendre.leggauss(6)
    x, ds = 0.5 * (1 + points), 0.5 * weights * el
    axis, turn = np.array(shapes.py_func(x, el, phi))
    lines = np.array([1 - x, x])
    near, far = (4 + phi) * el**2, (2 - phi) * el**2
    bending = np.array(
        [[12, 6 * el, -12, 6 * el], [6 * el, near, -6 * el, far],
         [-12, -6 * el, 12, -6 * el], [6 * el, far, -6 * el, near]]
    ) * inertia / (el**3 * (1 + phi))  # fmt: skip
    pair = np.array([[1, -1], [-1, 1]]) / el
    n = 3 * (elements + 1)
    stiffness, mass = np.zeros((n, n)), np.zeros((n, n))
    for e in range(elements):
        across, along = np.array([1, 2, 4, 5]) + 3 * e, np.array([0, 3]) + 3 * e
        stiffness[np.ix_(across, across)] += bending
        stiffness[np.ix_(along, along)] += area * pair
        mass[np.ix_(across, across)] += area * (axis * ds) @ axis.T + inertia * (turn * ds) @ turn.T
        mass[np.ix_(along, along)] += area * (lines * ds) @ lines.T + inertia * pair
    ball = 2 * np.pi / 3
    mass[-3, -3] += ball
    mass[-2:, -2:] += ball * np.array([[1, 3 / 8], [3 / 8, 9 / 64 + 83 / 320]])
    # the mesh's x points from the tip, the beam's to it: both turned by pi
    outward, loads = directions[0], np.zeros((n, 2))
    for j, d in enumerate(-directions):
        loads[-3:, j] = *d, outward[0] * d[1] - outward[1] * d[0]
    return stiffness, mass, loads


def moved(
    solve: Any, stiffness: Any, load: Numbers, probes: Numbers, dt: float, pulse: Numbers
) -> Numbers:
    """(N, 2) displacements under the load times `pulse` (N,) (Newmark, mean acceleration)."""
    u, v, a = (np.zeros(len(load)) for _ in range(3))
    found = [np.zeros(2)]
    for force in pulse[1:]:
        guess = u + dt * v + 0.25 * dt**2 * a
        new = solve(force * load - stiffness @ guess)
        u, v, a = guess + 0.25 * dt**2 * new, v + 0.5 * dt * (a + new), new
        found.append(probes.T @ u)
    return np.array(found)


def left_over(degrees: float, dt: float, pulse: Numbers, length: float = LENGTH) -> Numbers:
    """(N, probe, load) displacements of the solid less those of the beam and the half-space."""
    stiffness, mass, loads, directions = solid(degrees, length)
    own, inertia, pushes = beam(directions, length)
    factors = factorized(sp.diags(mass) + 0.25 * dt**2 * stiffness)
    inverse = np.linalg.inv(inertia + 0.25 * dt**2 * own)
    flat = half_space(Material(1.0, NU, 1.0), PATCH)
    found = np.empty((len(pulse), 2, 2))
    for j in range(2):
        body = 2 * moved(factors.solve, stiffness, loads[:, j], loads, dt, pulse)
        rod = moved(lambda r: inverse @ r, own, pushes[:, j], pushes, dt, pulse)
        found[:, :, j] = body - rod - np.outer(pulse, flat[:, j])
    return found


@pytest.mark.parametrize("degrees", [30.0, 60.0])
def test_the_parts_between_contact_and_centre_lag(degrees: float) -> None:
    """c of int F d(c F) = c F^2/2. The mesh (b = 2.5 edges) has c_nn 0.01 to 0.04 too low by
    statics. c_nt is higher here than below, where its rate is fitted too.
    """
    force = np.sin(0.5 * np.pi * np.arange(STEPS + 1) / STEPS)
    rest = left_over(degrees, 0.5 * np.pi / 0.2 / STEPS, force)
    found = 2 * np.trapezoid(force[:, None, None], rest, axis=0)
    assert found[0, 1] == pytest.approx(found[1, 0], abs=1e-9)  # reciprocity
    steep = np.sin(np.radians(degrees))
    assert found[0, 0] == pytest.approx(-0.365 + 0.22 * steep**2, abs=0.06)
    assert -found[0, 1] == pytest.approx(0.34 - 0.16 * steep, abs=0.09)


def hertzian(
    degrees: float, rise: float, steps: int, length: float = LENGTH, load: int = 0
) -> tuple[Numbers, Numbers, Numbers]:
    """Of a pulse like Hertz's: F and -F. (N, 2), what is left over along the normal (N,), and the c
    and D that fit it best; ends left out. load : of which direction.
    """
    time = np.linspace(0.0, 2 * rise, steps + 1)
    force = np.sin(0.5 * np.pi * time / rise) ** 1.5
    inner = slice(3, -3)
    rest = left_over(degrees, time[1], force, length)[inner, 0, load]
    terms = np.stack([force, -np.gradient(force, time)], axis=1)[inner]
    return terms, rest, np.linalg.lstsq(terms, rest)[0]


@pytest.mark.parametrize("rise", [6.0, 10.0])
@pytest.mark.parametrize("degrees", [30.0, 60.0])
def test_a_pulse_takes_energy_with_it(degrees: float, rise: float) -> None:
    """c and D of c F - D F. that fit a pulse like Hertz's best, both to what `hcm.contact.build`
    says of them; without D more is left.
    """
    terms, rest, (c, lag) = hertzian(degrees, rise, 2 * STEPS)
    assert lag == pytest.approx(RADIATION, abs=0.09)
    closed = -0.365 + 0.22 * np.sin(np.radians(degrees)) ** 2 - RADIATED
    assert c == pytest.approx(closed, abs=0.06)
    assert np.std(terms @ (c, lag) - rest) < 0.6 * np.std(terms @ (c, 0.0) - rest)


@pytest.mark.parametrize("rise", [6.0, 10.0])
@pytest.mark.parametrize("degrees", [30.0, 45.0, 60.0])
def test_they_lag_along_the_surface_too(degrees: float, rise: float) -> None:
    """c_nt of the same fit; statics on this patch have 0.03 to 0.05 less than for b -> 0."""
    _, _, (c, _) = hertzian(degrees, rise, 2 * STEPS, load=1)
    closed = 0.34 - 0.28 * np.sin(np.radians(degrees))
    assert 0.04 - c == pytest.approx(closed, abs=0.04)


@pytest.mark.parametrize(("length", "growth"), [(5.0, 1.0), (8.0, 3.4)])
def test_the_rates_share_grows_with_the_rise_by_the_phalanxs_length(
    length: float, growth: float
) -> None:
    """D of a rise of 11 over D of one of 5: no memory of the tip's own has both."""
    early, late = (hertzian(30.0, rise, 4 * STEPS, length)[2][1] for rise in (5.0, 11.0))
    assert late / early == pytest.approx(growth, abs=0.5)


@pytest.fixture(scope="module")
def ball() -> HalfBall:
    return HalfBall()


def rod_stretch(load: float, law: MaterialLaw | None) -> float:
    """Of a rod with E = 1 and no load across, -load its nominal stress."""
    lam, mu = NU / ((1 + NU) * (1 - 2 * NU)), 0.5 / (1 + NU)

    def left(stretches: Numbers) -> list[float]:
        along, across = stretches
        det = along * across**2
        share = 0.5 * lam * (det - 1 / det) - mu / det
        return [mu * along + share * across**2 + load, mu * across + share * along * across]

    if law is None:
        return 1 - load
    if law == SAINT_VENANT:
        return float(so.brentq(lambda at: 0.5 * (at**3 - at) + load, 0.6, 1.0))
    return float(so.fsolve(left, [1 - load, 1 + NU * load])[0])


def left_of_the_approach(
    ball: HalfBall, depths: Numbers, law: MaterialLaw | None
) -> tuple[Numbers, Numbers]:
    """a/R, and c = (approach - Hertz's - the rod's)/F, at each depth of the plane."""
    force, approach = ball.press(depths, law).T
    hertz = (0.75 * (1 - NU**2) * force) ** (2 / 3)
    stretch = np.array([rod_stretch(load, law) for load in force / np.pi])
    return np.sqrt(hertz), (approach - hertz - ROD * (1 - stretch)) / force


def test_the_law_softens_under_pressure(ball: HalfBall) -> None:
    """At a/R 0.13 to 0.35, linear and at finite strain: there c grows with the patch."""
    depths = np.array([0.02, 0.06, 0.1, 0.16])
    _, linear = left_of_the_approach(ball, depths, None)
    patch, finite = left_of_the_approach(ball, depths, SAINT_VENANT)
    assert linear == pytest.approx(np.full(4, -0.20), abs=0.03)
    # the sum of all three at alpha = 0, but for the lag there, 0.04
    assert finite - linear == pytest.approx(np.full(4, 0.23), abs=0.035)
    growth = FINITE_STRAIN[SAINT_VENANT].growth
    assert finite == pytest.approx(0.045 + growth * (patch - GROWN), abs=0.005)


def test_a_neo_hookean_tip_does_not_soften(ball: HalfBall) -> None:
    """At a/R 0.09 to 0.41 its c is what the other law's is at `GROWN`, and their difference there:
    a constant.
    """
    depths = np.array([0.01, 0.04, 0.1, 0.16, 0.25])
    patch, found = left_of_the_approach(ball, depths, NEO_HOOKE)
    laws = FINITE_STRAIN[NEO_HOOKE], FINITE_STRAIN[SAINT_VENANT]
    assert (patch.min() < 0.1, patch.max() > 0.4, laws[0].growth) == (True, True, 0.0)
    assert found == pytest.approx(0.045 + laws[0].compliance - laws[1].compliance, abs=0.008)
