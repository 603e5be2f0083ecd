"""What a tip that deforms adds to its compliance (`hcm.contact.build`), computed again.

E = rho = R = 1. In three dimensions a free phalanx takes half a sine of force on a patch at its
lowest point; from its displacement there those of the reduced model's beam and of the half-space
are taken away. Axisymmetric: a half-ball on a rod is pressed on a plane, with small strains and by
St. Venant-Kirchhoff's law, and Hertz's indentation and the rod's shortening are taken away.
"""

from typing import Any

import numpy as np
import pytest
import scipy.sparse as sp
import scipy.sparse.linalg as sl
from numpy.typing import NDArray

import meshes
from hcm.beam.refinement import shapes
from hcm.contact.build import GROWN, GROWTH, RADIATED, RADIATION
from reference_fem.elements.geometry import geometries
from reference_fem.settings import Material
from reference_fem.statics.tip import _stiffness, last_phalanx, touch_frame
from reference_fem.statics.yielding import facet_quadrature, half_space

Numbers = NDArray[np.float64]
NU, LENGTH, PATCH, STEPS = 0.4, 8.0, 0.25, 30
ROD = 3.0  # of the axisymmetric body, between the ball's centre and its clamped end


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
    options = {"SymmetricMode": True}
    factors = sl.splu(
        (sp.diags(mass) + 0.25 * dt**2 * stiffness).tocsc(),
        permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options=options,
    )  # fmt: skip
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
    statics; c_nt's closed form, which knows no angle, is 0.07 too high at 60 degrees.
    """
    force = np.sin(0.5 * np.pi * np.arange(STEPS + 1) / STEPS)
    rest = left_over(degrees, 0.5 * np.pi / 0.2 / STEPS, force)
    found = 2 * np.trapezoid(force[:, None, None], rest, axis=0)
    assert found[0, 1] == pytest.approx(found[1, 0], abs=1e-9)  # reciprocity
    steep = np.sin(np.radians(degrees))
    assert found[0, 0] == pytest.approx(-0.365 + 0.22 * steep**2, abs=0.06)
    assert -found[0, 1] == pytest.approx(0.34 - 0.16 * steep, abs=0.09)


def hertzian(
    degrees: float, rise: float, steps: int, length: float = LENGTH
) -> tuple[Numbers, Numbers, Numbers]:
    """Of a pulse like Hertz's: F and -F. (N, 2), what is left over (N,), and the c and D that fit
    it best; ends left out.
    """
    time = np.linspace(0.0, 2 * rise, steps + 1)
    force = np.sin(0.5 * np.pi * time / rise) ** 1.5
    inner = slice(3, -3)
    rest = left_over(degrees, time[1], force, length)[inner, 0, 0]
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


@pytest.mark.parametrize(("length", "growth"), [(5.0, 1.0), (8.0, 3.4)])
def test_the_rates_share_grows_with_the_rise_by_the_phalanxs_length(
    length: float, growth: float
) -> None:
    """D of a rise of 11 over D of one of 5: no memory of the tip's own has both."""
    early, late = (hertzian(30.0, rise, 4 * STEPS, length)[2][1] for rise in (5.0, 11.0))
    assert late / early == pytest.approx(growth, abs=0.5)


class HalfBall:
    """Quadratic axisymmetric elements of a half-ball on a rod, finer towards the pole."""

    def __init__(self, across: int = 8, edge: float = 0.025) -> None:
        chords = [*np.arange(0.0, 0.4 + 1e-9, edge)]
        while chords[-1] < 1.3:
            chords.append(chords[-1] + 1.25 * (chords[-1] - chords[-2]))
        chords[-1] = np.sqrt(2.0)
        rings = len(chords) - 1
        half = np.interp(np.arange(2 * rings + 1) / 2, np.arange(rings + 1), chords)
        t = np.linspace(0.0, 1.0, 2 * across + 1)
        turn = np.outer(np.arccos(half / 2), t)  # arcs about the pole, up to the ball
        arcs = half[:, None, None] * np.stack([np.sin(turn), np.cos(turn)], axis=-1)
        top = np.stack([t, np.full_like(t, 1.0 + ROD)], axis=-1)
        shaft = [arcs[-1] * (1 - s) + top * s for s in np.linspace(0.0, 1.0, 17)[1:]]
        self.points = points = np.concatenate([*arcs, *shaft])
        row, n = len(t), len(points)
        corner = [
            2 * i * row + 2 * j + a * row + b
            for i in range(rings + 8) for j in range(across) for a in range(3) for b in range(3)
        ]  # fmt: skip
        names = np.arange(n)
        names[:row] = 0  # the pole is one node
        self.cells = names[np.array(corner).reshape(-1, 9)]
        count = round(0.4 / edge)
        self.outside = names[
            [[(2 * i + a) * row + row - 1 for a in range(3)] for i in range(count)]
        ]
        held = np.zeros((n, 2), dtype=bool)
        held[n - row :, 1], held[points[:, 0] < 1e-12, 0], held[1:row] = True, True, True
        self.free = np.flatnonzero(~held.ravel())
        at, weight = np.polynomial.legendre.leggauss(3)
        shape, slope = quadratic(at)
        values = np.einsum("pa,qb->pqab", shape, shape).reshape(9, 9)
        local = np.stack(
            [np.einsum("pa,qb->pqab", slope, shape), np.einsum("pa,qb->pqab", shape, slope)], -1
        ).reshape(9, 9, 2)
        jacobian = np.einsum("eai,qak->eqik", points[self.cells], local)
        slopes = np.einsum("qak,eqkj->eqaj", local, np.linalg.inv(jacobian))
        radius = np.einsum("qa,ea->eq", values, points[self.cells][..., 0])
        area = np.abs(np.linalg.det(jacobian)) * np.outer(weight, weight).ravel()
        self.weight = 2 * np.pi * radius * area
        gradient = np.zeros((*radius.shape, 9, 2, 3, 3))
        gradient[..., 0, 0, :2], gradient[..., 1, 1, :2] = slopes, slopes
        gradient[..., 0, 2, 2] = values / radius[..., None]
        self.gradient = gradient.reshape(*radius.shape, 18, 3, 3)
        self.places = (2 * self.cells[:, :, None] + np.arange(2)).reshape(-1, 18)
        at, weight = np.polynomial.legendre.leggauss(5)
        self.on_edge, slope = quadratic(at)
        rim = points[self.outside]
        stretch = np.linalg.norm(np.einsum("qa,eai->eqi", slope, rim), axis=-1)
        self.rim = 2 * np.pi * weight * stretch * np.einsum("qa,ea->eq", self.on_edge, rim[..., 0])

    def forces(self, u: Numbers, finite: bool) -> tuple[Numbers, Any]:
        """Internal forces and their tangent, with S = lam tr(E) + 2 mu E."""
        lam, mu, one = NU / ((1 + NU) * (1 - 2 * NU)), 0.5 / (1 + NU), np.eye(3)

        def stress(strain: Numbers) -> Numbers:
            trace = np.trace(strain, axis1=-2, axis2=-1)[..., None, None]
            return np.asarray(lam * trace * one + 2 * mu * strain)

        turned = np.einsum("eqdij,ed->eqij", self.gradient, u[self.places])
        full = one + turned if finite else np.broadcast_to(one, turned.shape)
        strain = 0.5 * (turned + turned.swapaxes(-1, -2))
        if finite:
            strain = strain + 0.5 * turned.swapaxes(-1, -2) @ turned
        rate = np.einsum("eqki,eqdkj->eqdij", full, self.gradient)
        rate = 0.5 * (rate + rate.swapaxes(-1, -2))
        pressed = stress(strain)
        out = np.zeros(u.size)
        np.add.at(out, self.places, np.einsum("eq,eqij,eqdij->ed", self.weight, pressed, rate))
        tangent = self.product(stress(rate), rate)
        if finite:
            tangent += self.product(self.gradient @ pressed[:, :, None], self.gradient)
        return out, assembled(tangent, self.places, u.size)

    def product(self, left: Numbers, right: Numbers) -> Numbers:
        """(elements, 18, 18) integrals of the double contraction of two fields of gradients."""
        weighed = (self.weight[:, :, None, None, None] * left).swapaxes(1, 2)
        count = len(left)
        other = right.swapaxes(1, 2).reshape(count, 18, -1)
        return np.asarray(weighed.reshape(count, 18, -1) @ other.swapaxes(1, 2))

    def press(self, depths: Numbers, finite: bool, stiffness: float = 1000.0) -> Numbers:
        """(force, approach less the springs' own) of each depth of a plane with stiff springs."""
        u, found, heights = np.zeros(self.points.size), [], 2 * self.outside + 1
        for depth in depths:
            for step in range(40):
                residual, tangent = self.forces(u, finite)
                z = self.points[self.outside, 1] + u[heights]
                gap = depth - z @ self.on_edge.T
                push = self.rim * stiffness * np.maximum(gap, 0.0)
                np.add.at(residual, heights, -push @ self.on_edge)
                springs = np.einsum(
                    "eq,qa,qb->eab", self.rim * stiffness * (gap > 0), self.on_edge, self.on_edge
                )
                tangent = tangent + assembled(springs, heights, u.size)
                own = residual[self.free]
                if step and np.abs(own).max() < 1e-9 * push.sum():
                    break
                u[self.free] -= sl.spsolve(tangent[self.free][:, self.free].tocsc(), own)
            assert step < 39
            found.append((push.sum(), depth - (push * gap).sum() / push.sum()))
        return np.array(found)


def quadratic(x: Numbers) -> tuple[Numbers, Numbers]:
    """The shapes (points, 3) of an edge, and their slopes."""
    return (
        np.stack([x * (x - 1) / 2, 1 - x * x, x * (x + 1) / 2], axis=-1),
        np.stack([x - 0.5, -2 * x, x + 0.5], axis=-1),
    )


def assembled(blocks: Numbers, places: Any, n: int) -> Any:
    """The sparse sum of elements' matrices."""
    width = places.shape[1]
    rows, columns = np.repeat(places, width, axis=1), np.tile(places, (1, width))
    return sp.coo_matrix((blocks.ravel(), (rows.ravel(), columns.ravel())), shape=(n, n)).tocsr()


def test_the_law_softens_under_pressure() -> None:
    """c = (approach - Hertz's - the rod's)/F at a/R 0.13 to 0.35, linear and at finite strain:
    there it grows with the patch.
    """
    ball, depths = HalfBall(), np.array([0.02, 0.06, 0.1, 0.16])
    found = []
    for finite in (False, True):
        force, approach = ball.press(depths, finite).T
        hertz = (0.75 * (1 - NU**2) * force) ** (2 / 3)
        stretch = 1 - force / np.pi
        for _ in range(20 if finite else 0):  # F = -pi (l^3 - l)/2 of the rod's law
            stretch -= (0.5 * (stretch**3 - stretch) + force / np.pi) / (1.5 * stretch**2 - 0.5)
        found.append((approach - hertz - ROD * (1 - stretch)) / force)
    assert found[0] == pytest.approx(np.full(4, -0.20), abs=0.03)
    # the sum of all three at alpha = 0, but for the lag there, 0.04
    assert found[1] - found[0] == pytest.approx(np.full(4, 0.23), abs=0.035)
    patch = np.sqrt(hertz)
    assert found[1] == pytest.approx(0.045 + GROWTH * (patch - GROWN), abs=0.005)
