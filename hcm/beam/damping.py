"""Kelvin-Voigt damping of the beam element: N = E A (e + tau de/dt), M = E I (k + tau dk/dt).

e is the element's axial strain. k are the components of r'' along and across its chord c, so that
|k| = |r''| and E I |k|^2/2 is the bending energy: a rigid motion turns r'' but changes neither e
nor k. With alpha_i = r'_i - c, J a quarter turn and theta the chord's angle, dk/dt is to

    beta_i = alpha._i - theta. J alpha_i,      theta. = c x c./|c|^2,

what r'' is to alpha_i (`element.internal_force`). The power that is dissipated,

    tau int E A (de/dt)^2 + E I |dk/dt|^2 dx,

is a quadratic form in the velocities: half its gradient by them is the force, half its Hessian the
damping matrix. The rate of r'' itself would resist the rotation of a bent element.

The arguments w, h1, h2 are the rates of c, r'_1 and r'_2; `axial`, `near` and `far` are those of
`internal_force` times tau.
"""

from __future__ import annotations

import numpy as np

from hcm.arrays import Floats
from hcm.beam.banded_ldl import HALF_BANDWIDTH
from hcm.beam.element import Four, Six, axial_force, moments, polynomial
from hcm.compiled import kernel

Five = tuple[float, float, float, float, float]

# Five points integrate (grad e)(grad e)^T, of degree eight in x, exactly; weights of a mean.
POINTS, WEIGHTS = np.polynomial.legendre.leggauss(5)


@kernel
def strain_rate(
    cx: float, cy: float, g1x: float, g1y: float, g2x: float, g2y: float,
    wx: float, wy: float, h1x: float, h1y: float, h2x: float, h2y: float,
) -> Five:  # fmt: skip
    """Coefficients of the quartic de/dt = r'.v' in t = 2 x/l - 1, 1/s."""
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
def bending_rate(
    cx: float, cy: float, g1x: float, g1y: float, g2x: float, g2y: float,
    wx: float, wy: float, h1x: float, h1y: float, h2x: float, h2y: float,
) -> Four:  # fmt: skip
    """(beta_1, beta_2), X before Y, 1/s."""
    turn = (cx * wy - cy * wx) / (cx * cx + cy * cy)
    return (
        h1x - wx + turn * (g1y - cy),
        h1y - wy - turn * (g1x - cx),
        h2x - wx + turn * (g2y - cy),
        h2y - wy - turn * (g2x - cx),
    )


@kernel
def damping_force(
    cx: float, cy: float, g1x: float, g1y: float, g2x: float, g2y: float,
    wx: float, wy: float, h1x: float, h1y: float, h2x: float, h2y: float,
    axial: float, near: float, far: float,
) -> Six:  # fmt: skip
    """Force conjugate to (c, r'_1, r'_2), X before Y, N m; beta_i is relative to the chord."""
    e0, e1, e2, e3, e4 = strain_rate(cx, cy, g1x, g1y, g2x, g2y, wx, wy, h1x, h1y, h2x, h2y)
    fcx, fcy, f1x, f1y, f2x, f2y = axial_force(
        cx, cy, g1x, g1y, g2x, g2y, moments(e0, e1, e2, e3, e4), axial
    )
    b1x, b1y, b2x, b2y = bending_rate(cx, cy, g1x, g1y, g2x, g2y, wx, wy, h1x, h1y, h2x, h2y)
    p1x, p1y = near * b1x + far * b2x, near * b1y + far * b2y
    p2x, p2y = far * b1x + near * b2x, far * b1y + near * b2y
    back = (g1x - cx) * p1y - (g1y - cy) * p1x + (g2x - cx) * p2y - (g2y - cy) * p2x
    back /= cx * cx + cy * cy
    return (
        fcx - p1x - p2x + back * cy,
        fcy - p1y - p2y - back * cx,
        f1x + p1x,
        f1y + p1y,
        f2x + p2x,
        f2y + p2y,
    )


@kernel
def damping_power(
    cx: float, cy: float, g1x: float, g1y: float, g2x: float, g2y: float,
    wx: float, wy: float, h1x: float, h1y: float, h2x: float, h2y: float,
    axial: float, near: float, far: float,
) -> float:  # fmt: skip
    """Power that the element dissipates, W."""
    e0, e1, e2, e3, e4 = strain_rate(cx, cy, g1x, g1y, g2x, g2y, wx, wy, h1x, h1y, h2x, h2y)
    m0, m1, m2, m3, m4 = moments(e0, e1, e2, e3, e4)
    b1x, b1y, b2x, b2y = bending_rate(cx, cy, g1x, g1y, g2x, g2y, wx, wy, h1x, h1y, h2x, h2y)
    bending = near * (b1x * b1x + b1y * b1y + b2x * b2x + b2y * b2y)
    bending += 2.0 * far * (b1x * b2x + b1y * b2y)
    return axial * (e0 * m0 + e1 * m1 + e2 * m2 + e3 * m3 + e4 * m4) + bending


@kernel
def add_square(
    weight: float, cx: float, cy: float, f1x: float, f1y: float, f2x: float, f2y: float,
    rows: Floats,
) -> None:  # fmt: skip
    """Add weight L L^T, L = (-c, f_1, c, f_2) of an element's coordinates, to its `rows`."""
    form = (-cx, -cy, f1x, f1y, cx, cy, f2x, f2y)
    for i in range(8):
        for j in range(i + 1):
            rows[i, HALF_BANDWIDTH - i + j] += weight * form[i] * form[j]


@kernel
def add_damping_matrix(
    cx: float, cy: float, g1x: float, g1y: float, g2x: float, g2y: float,
    axial: float, near: float, far: float, length: float, s1: float, s2: float, rows: Floats,
) -> None:  # fmt: skip
    """Add the force's derivative by the velocities to the element's `rows` (8, w + 1).

    s1 and s2 are the slopes' units. The form is a sum of squares: of de/dt at the Gauss points, and
    of beta_1 +- beta_2.
    """
    ax, bx, dx = polynomial(cx, g1x, g2x)
    ay, by, dy = polynomial(cy, g1y, g2y)
    for k in range(5):
        t = POINTS[k]
        rx, ry = ax + t * (bx + t * dx), ay + t * (by + t * dy)
        chord = 1.5 * (1.0 - t * t) / length
        first = s1 * (-0.25 - 0.5 * t + 0.75 * t * t)
        second = s2 * (-0.25 + 0.5 * t + 0.75 * t * t)
        add_square(
            0.5 * WEIGHTS[k] * axial, rx * chord, ry * chord, rx * first, ry * first,
            rx * second, ry * second, rows,
        )  # fmt: skip
    square = (cx * cx + cy * cy) * length
    turn_x, turn_y = -cy / square, cx / square
    for sign in (1.0, -1.0):
        weight, chord = 0.5 * (near + sign * far), -(1.0 + sign) / length
        jx = (g1y - cy) + sign * (g2y - cy)
        jy = -(g1x - cx) - sign * (g2x - cx)
        add_square(weight, chord + jx * turn_x, jx * turn_y, s1, 0.0, sign * s2, 0.0, rows)
        add_square(weight, jy * turn_x, chord + jy * turn_y, 0.0, s1, 0.0, sign * s2, rows)
