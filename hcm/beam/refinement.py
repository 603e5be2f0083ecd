"""The beams under the refined assumptions: masses, shear, and the tip's rigid end.

Sections of radius r(s) (of a half-ball over the last R: r^2 = R^2 - (s - L + R)^2) have the mass
rho pi r^2 and, with rotary inertia, rho pi r^4/4 per length. Where the tip touches with its lowest
point the last beam ends at the sphere's centre, and what lies beyond turns with its slope r'.

Shear: r' at the nodes is the direction that sections are normal to, and bends away from the axis by
the angle Q/(kappa G A). With Phi = 12 E I/(kappa G A l^2) an element's static shapes are
(Przemieniecki 1968, section 5.6; x = s/l)

    (1 + Phi) N_1 = 1 + Phi (1 - x) - 3 x^2 + 2 x^3,        N_3 = 1 - N_1,
    (1 + Phi) N_2 = l [x - 2 x^2 + x^3 + Phi (x - x^2)/2],  N_4 likewise,

for the axis, and T for the sections; 4 and 2 E I/l, the bending stiffness of slopes, become 4 + Phi
and 2 - Phi over 1 + Phi; kappa = 6 (1 + nu)^2/(7 + 12 nu + 4 nu^2) (Hutchinson 2001). Mass is
int rho A N^T N + rho I T^T T ds, the same for X and Y and constant: T is the turn of a slope of
length 1, and a stretch adds rho I e.^2/2 to the energy, two to five times the Poisson effect in a
bar (Love); its waves, of wave number k, are slower by (k R)^2/8. The angle of shear is constant in
an element, so that frequencies converge with order two instead of four.
"""

from dataclasses import replace

import numpy as np

from hcm.arrays import Floats
from hcm.assumptions import Assumptions
from hcm.beam.chain import Chain
from hcm.beam.element import Four
from hcm.bounds import ParameterError
from hcm.compiled import kernel_with
from hcm.parameters import Drive, Finger, Phalanx, Surface

# Gauss points on [0, 1]: exact for the mass of a half-ball's elements, of degree 10.
_GAUSS = np.polynomial.legendre.leggauss(6)
POINTS, WEIGHTS = 0.5 * (1.0 + _GAUSS[0]), 0.5 * _GAUSS[1]
# Share of an element that is a rounding: there is no part of it to integrate over.
SLIVER = 1e-9


def beams_of(finger: Finger, assumptions: Assumptions) -> Finger:
    """The finger's beams: the last one ends at the centre of a tip whose lowest point touches.

    Raises ParameterError: the last phalanx is not longer than its round end, or a Poisson's ratio
        is missing.
    """
    if not assumptions.any:
        return finger
    *inner, last = finger.phalanges
    if (assumptions.has("lowest_point") or assumptions.has("half_ball")) and (
        last.length <= last.diameter / 2
    ):
        raise ParameterError(
            f"length = {last.length!r} of the last phalanx: must be longer than its round end, "
            f"{last.diameter / 2:g} m; lengthen it, or switch half_ball and lowest_point off"
        )
    for needs in ("shear", "hertz", "tip_compliance", "cauchy_stress"):
        if assumptions.has(needs) and any(p.poisson_ratio is None for p in finger.phalanges):
            raise ParameterError(f"poisson_ratio = None: {needs} needs a number in [0, 0.5)")
    if not assumptions.has("lowest_point"):
        return finger
    return Finger((*inner, replace(last, length=last.length - last.diameter / 2)))


def touching_height(finger: Finger, surface: Surface, assumptions: Assumptions) -> float:
    """How far below the hinge the beam's end is when the tip touches, m."""
    radius = finger.phalanges[-1].diameter / 2 if assumptions.has("lowest_point") else 0.0
    return float(surface.height) - radius


def shear_number(phalanx: Phalanx, assumptions: Assumptions) -> float:
    """Phi of a phalanx's elements; zero without shear."""
    nu = phalanx.poisson_ratio
    if not assumptions.has("shear") or nu is None:
        return 0.0
    kappa = 6 * (1 + nu) ** 2 / (7 + 12 * nu + 4 * nu**2)
    el = phalanx.length / phalanx.elements
    return 24 * (1 + nu) * phalanx.second_moment / (kappa * phalanx.area * el**2)


def inertia(phalanx: Phalanx, s: Floats, round_from: float, rotary: bool) -> tuple[Floats, Floats]:
    """(rho A, rho I) per length at the arc lengths s, kg/m and kg m; I zero without rotary inertia.

    round_from : where the half-ball begins, m.
    """
    r2 = (phalanx.diameter / 2) ** 2 - np.maximum(s - round_from, 0.0) ** 2
    line = phalanx.density * np.pi * r2
    return line, line * r2 / 4 if rotary else np.zeros_like(s)


def pieces(finger: Finger, assumptions: Assumptions) -> list[tuple[Phalanx, float, float]]:
    """Each phalanx, whole; the length of its beam, m; where its half-ball begins, m (inf: none)."""
    beams = beams_of(finger, assumptions)
    found = [(p, b.length, np.inf) for p, b in zip(finger.phalanges, beams.phalanges, strict=True)]
    if assumptions.has("half_ball"):
        last, length, _ = found[-1]
        found[-1] = (last, length, last.length - last.diameter / 2)
    return found


def quadrature(begin: float, length: float, round_from: float) -> tuple[Floats, Floats]:
    """Points on [0, 1] and weights for integrals over `length` from `begin` on, m; those of two
    parts if the half-ball begins in between.
    """
    share = (round_from - begin) / length
    if not SLIVER < share < 1.0 - SLIVER:
        return POINTS, WEIGHTS
    rest = 1.0 - share
    points = np.concatenate([share * POINTS, share + rest * POINTS])
    return points, np.concatenate([share * WEIGHTS, rest * WEIGHTS])


def moments(finger: Finger, assumptions: Assumptions) -> Floats:
    """(3, P): mass of each phalanx, kg, and its moments about its hinge over m L and m L^2, L the
    length of its beam.
    """
    if not assumptions.any:
        whole = [p.density * p.area * p.length for p in finger.phalanges]
        return np.array([whole, [0.5] * len(whole), [1 / 3] * len(whole)])
    out = np.empty((3, len(finger.phalanges)))
    for w, (p, length, round_from) in enumerate(pieces(finger, assumptions)):
        points, weights = quadrature(0.0, p.length, round_from)
        s, ds = points * p.length, weights * p.length
        line, turning = inertia(p, s, round_from, assumptions.has("rotary_inertia"))
        mass = float(line @ ds)
        out[:, w] = mass, line * s @ ds / (mass * length), 0.0
        out[2, w] = (line * s**2 + turning) @ ds / (mass * length**2)
    return out


@kernel_with()
def shapes(x: float, el: float, phi: float) -> tuple[Four, Four]:
    """N and T at x in [0, 1] of elements of length el."""
    bow = 0.5 * phi * (x - x**2)
    n1 = 1 + phi * (1 - x) - 3 * x**2 + 2 * x**3
    n2, n4 = el * (x - 2 * x**2 + x**3 + bow), el * (x**3 - x**2 - bow)
    t1 = 6 * (x**2 - x) / el
    t2, t4 = 1 + phi - (4 + phi) * x + 3 * x**2, 3 * x**2 + (phi - 2) * x
    n3, whole = 1 + phi - n1, 1 + phi
    axis = (n1 / whole, n2 / whole, n3 / whole, n4 / whole)
    return axis, (t1 / whole, t2 / whole, -t1 / whole, t4 / whole)


def refine_chain(chain: Chain, finger: Finger, drive: Drive, assumptions: Assumptions) -> Chain:
    """The chain of `beams_of(finger)` with the masses and stiffnesses of the assumptions."""
    mass, bending = chain.mass.copy(), chain.bending.copy()
    weight, f = np.zeros_like(chain.weight), np.array(drive.gravity_vector)
    rotary, e = assumptions.has("rotary_inertia"), 0
    for p, length, round_from in pieces(finger, assumptions):
        el, phi = length / p.elements, shear_number(replace(p, length=length), assumptions)
        near, far = 4 + phi, 2 - phi
        unit = np.array([1.0, el, 1.0, el])
        matrix = np.array(
            [[12, 6, -12, 6], [6, near, -6, far], [-12, -6, 12, -6], [6, far, -6, near]]
        )  # fmt: skip
        stiffness = p.youngs_modulus * p.second_moment / (el**3 * (1 + phi)) * matrix
        for i in range(p.elements):
            points, weights = quadrature(el * i, el, round_from)
            axis, turn = np.array(shapes.py_func(points, el, phi))
            line, turning = inertia(p, el * (i + points), round_from, rotary)
            bending[e] = unit[:, None] * stiffness * unit
            mass[e] = (axis * (line * weights * el)) @ axis.T
            mass[e] += (turn * (turning * weights * el)) @ turn.T
            own = slice(chain.first[e], chain.first[e] + 8)
            weight[own] += np.outer(axis @ (line * weights) * el, f).ravel()
            e += 1
        if length < p.length:
            s, ds = (p.length - length) * POINTS, (p.length - length) * WEIGHTS
            line, turning = inertia(p, length + s, round_from, rotary)
            arms = np.array([np.ones_like(s), s])
            mass[e - 1, 2:, 2:] += (arms * (line * ds)) @ arms.T
            mass[e - 1, 3, 3] += turning @ ds
            weight[chain.tip :] += np.outer(arms @ (line * ds), f).ravel()
    return chain._replace(mass=mass, bending=bending, weight=weight)
