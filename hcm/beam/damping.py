"""Kelvin-Voigt damping of the beam element: N = E A (e + tau de/dt), M = E I (k + tau dk/dt).

e is the element's axial strain. k are the components of r'' along and across its chord c, so that
|k| = |r''| and E I |k|^2/2 is the bending energy: a rigid motion turns r'' but changes neither e
nor k. With alpha_i = r'_i - c, J a quarter turn and theta the chord's angle, dk/dt is to

    beta_i = alpha._i - theta. J alpha_i,      theta. = c x c./|c|^2,

what r'' is to alpha_i (`element.internal_force`). The power that is dissipated,

    tau int E A (de/dt)^2 + E I |dk/dt|^2 dx,

is a quadratic form in the velocities: half its gradient by them is the force, half its Hessian the
damping matrix. The rate of r'' itself would resist the rotation of a bent element.

The arguments `shape`, `rates` and `stiffness` are the element's (c, r'_1, r'_2), their rates, and
tau times what `internal_force` takes.
"""

from __future__ import annotations

import numpy as np

from hcm.arrays import Floats
from hcm.beam.banded_ldl import HALF_BANDWIDTH
from hcm.beam.element import (
    Five,
    Four,
    Six,
    Three,
    axial_force,
    deviations,
    end_moments,
    moments,
    polynomial,
    polynomials,
)
from hcm.compiled import kernel

# Five points integrate (grad e)(grad e)^T, of degree eight in x, exactly; weights of a mean.
POINTS, WEIGHTS = np.polynomial.legendre.leggauss(5)


@kernel
def strain_rate(shape: Six, rates: Six) -> Five:
    """Coefficients of the quartic de/dt = r'.v' in t = 2 x/l - 1, 1/s."""
    cx, cy, g1x, g1y, g2x, g2y = shape
    wx, wy, h1x, h1y, h2x, h2y = rates
    ax, bx, dx = polynomial(cx, g1x, g2x)
    ay, by, dy = polynomial(cy, g1y, g2y)
    px, qx, sx = polynomial(wx, h1x, h2x)
    py, qy, sy = polynomial(wy, h1y, h2y)
    return (
        ax * px + ay * py,
        ax * qx + bx * px + ay * qy + by * py,
        ax * sx + dx * px + bx * qx + ay * sy + dy * py + by * qy,
        bx * sx + dx * qx + by * sy + dy * qy,
        dx * sx + dy * sy,
    )


@kernel
def bending_rate(shape: Six, rates: Six) -> Four:
    """(beta_1, beta_2), X before Y, 1/s."""
    cx, cy, wx, wy = shape[0], shape[1], rates[0], rates[1]
    turn = (cx * wy - cy * wx) / (cx * cx + cy * cy)
    a1x, a1y, a2x, a2y = deviations(shape)
    b1x, b1y, b2x, b2y = deviations(rates)
    return b1x + turn * a1y, b1y - turn * a1x, b2x + turn * a2y, b2y - turn * a2x


@kernel
def damping_force(shape: Six, rates: Six, stiffness: Three) -> Six:
    """Force conjugate to (c, r'_1, r'_2), X before Y, N m; beta_i is relative to the chord."""
    cx, cy, (axial, near, far) = shape[0], shape[1], stiffness
    fcx, fcy, f1x, f1y, f2x, f2y = axial_force(shape, moments(strain_rate(shape, rates)), axial)
    p1x, p1y, p2x, p2y = end_moments(bending_rate(shape, rates), near, far)
    a1x, a1y, a2x, a2y = deviations(shape)
    back = (a1x * p1y - a1y * p1x + a2x * p2y - a2y * p2x) / (cx * cx + cy * cy)
    fcx, fcy = fcx - p1x - p2x + back * cy, fcy - p1y - p2y - back * cx
    return fcx, fcy, f1x + p1x, f1y + p1y, f2x + p2x, f2y + p2y


@kernel
def damping_power(shape: Six, rates: Six, stiffness: Three) -> float:
    """Power that the element dissipates, W."""
    axial, near, far = stiffness
    e0, e1, e2, e3, e4 = strain_rate(shape, rates)
    m0, m1, m2, m3, m4 = moments((e0, e1, e2, e3, e4))
    b1x, b1y, b2x, b2y = bending_rate(shape, rates)
    bending = near * (b1x * b1x + b1y * b1y + b2x * b2x + b2y * b2y)
    bending += 2.0 * far * (b1x * b2x + b1y * b2y)
    return axial * (e0 * m0 + e1 * m1 + e2 * m2 + e3 * m3 + e4 * m4) + bending


@kernel
def add_square(weight: float, gradient: Six, rows: Floats) -> None:
    """Add weight L L^T, L = (-c, f_1, c, f_2) of an element's coordinates, to its `rows`.

    gradient : (c, f_1, f_2), X before Y.
    """
    cx, cy, f1x, f1y, f2x, f2y = gradient
    form = (-cx, -cy, f1x, f1y, cx, cy, f2x, f2y)
    for i in range(8):
        for j in range(i + 1):
            rows[i, HALF_BANDWIDTH - i + j] += weight * form[i] * form[j]


@kernel
def add_damping_matrix(
    shape: Six, stiffness: Three, length: float, s1: float, s2: float, rows: Floats
) -> None:
    """Add the force's derivative by the velocities to the element's `rows` (8, w + 1).

    s1 and s2 are the slopes' units. The form is a sum of squares: of de/dt at the Gauss points, and
    of beta_1 +- beta_2.
    """
    cx, cy, (axial, near, far) = shape[0], shape[1], stiffness
    ax, bx, dx, ay, by, dy = polynomials(shape)
    for k in range(5):
        t = POINTS[k]
        rx, ry = ax + t * (bx + t * dx), ay + t * (by + t * dy)
        chord = 1.5 * (1.0 - t * t) / length
        first = s1 * (-0.25 - 0.5 * t + 0.75 * t * t)
        second = s2 * (-0.25 + 0.5 * t + 0.75 * t * t)
        gradient = (rx * chord, ry * chord, rx * first, ry * first, rx * second, ry * second)
        add_square(0.5 * WEIGHTS[k] * axial, gradient, rows)
    size = (cx * cx + cy * cy) * length
    turn_x, turn_y = -cy / size, cx / size
    a1x, a1y, a2x, a2y = deviations(shape)
    for sign in (1.0, -1.0):
        weight, chord = 0.5 * (near + sign * far), -(1.0 + sign) / length
        jx, jy = a1y + sign * a2y, -a1x - sign * a2x
        add_square(weight, (chord + jx * turn_x, jx * turn_y, s1, 0.0, sign * s2, 0.0), rows)
        add_square(weight, (jy * turn_x, chord + jy * turn_y, 0.0, s1, 0.0, sign * s2), rows)
