"""Gradient-deficient ANCF beam element (paper, section 2.1.1, eqs. 1-7).

Two nodes, coordinates (r, r') at each; position field r = S q with the cubic Hermite functions
S_1..S_4 of x/l, the same for X and Y. Strain energy

    U = 1/2 int_0^l E A e^2 + E I k^2 dx,   e = (r'.r' - 1)/2,   k = |r''|.

U's bending part is quadratic in q (constant matrix), its axial part quartic: the force is cubic,
the tangent quadratic. r' is quadratic in x and e quartic, so both are integrated as polynomials:
exactly, as five Gauss points would, in a third of the operations. Element coordinates are
q_e = (r_1, r'_1, r_2, r'_2), X before Y.
"""

from __future__ import annotations

import numpy as np

from hcm.arrays import Floats
from hcm.compiled import kernel, kernel_with

Three = tuple[float, float, float]
Four = tuple[float, float, float, float]
Five = tuple[float, float, float, float, float]
Six = tuple[float, float, float, float, float, float]


# Mass and bending matrices for l = 1, in units of rho A l/420 and E I/l^3. Slopes count l times.
UNIT_MASS = np.array(
    [[156.0, 22.0, 54.0, -13.0], [22.0, 4.0, 13.0, -3.0],
     [54.0, 13.0, 156.0, -22.0], [-13.0, -3.0, -22.0, 4.0]]
)  # fmt: skip
UNIT_BENDING = np.array(
    [[12.0, 6.0, -12.0, 6.0], [6.0, 4.0, -6.0, 2.0],
     [-12.0, -6.0, 12.0, -6.0], [6.0, 2.0, -6.0, 4.0]]
)  # fmt: skip


@kernel
def fill_matrices(
    mass_per_length: float, bending_stiffness: float, length: float, mass: Floats, bending: Floats
) -> None:
    """Write one component's mass, rho A int S^T S dx (eq. 4), and E I int S''^T S'' dx (eq. 6).

    mass_per_length : rho A, kg/m. bending_stiffness : E I, N m^2. length : l, m.
    mass, bending : (4, 4), for (r_1, r'_1, r_2, r'_2): kg, kg m, kg m^2, and N/m, N, N m.
    """
    inertia_unit, stiffness_unit = mass_per_length * length / 420.0, bending_stiffness / length**3
    for i in range(4):
        for j in range(4):
            size = (length if i % 2 else 1.0) * (length if j % 2 else 1.0)
            mass[i, j] = inertia_unit * (UNIT_MASS[i, j] * size)
            bending[i, j] = stiffness_unit * (UNIT_BENDING[i, j] * size)


@kernel
def shape_of(qe: Floats, length: float) -> Six:
    """Chord c = (r_2 - r_1)/l and slopes r'_1, r'_2 of an element, X before Y, of which its strains
    are functions; with velocities for its coordinates qe (8,), their rates.
    """
    return (qe[4] - qe[0]) / length, (qe[5] - qe[1]) / length, qe[2], qe[3], qe[6], qe[7]


@kernel
def polynomial(c: float, g1: float, g2: float) -> Three:
    """Coefficients of one component of r' = A + B t + C t^2, t = 2 x/l - 1 in [-1, 1].

    c is the chord (r_2 - r_1)/l, all that strains need of the positions; it avoids the cancellation
    in S q. g1, g2 are the slopes r'_1, r'_2.
    """
    return 1.5 * c - 0.25 * (g1 + g2), 0.5 * (g2 - g1), 0.75 * (g1 + g2) - 1.5 * c


@kernel
def polynomials(shape: Six) -> Six:
    """`polynomial` of both components, X before Y, of a shape or of its rates."""
    cx, cy, g1x, g1y, g2x, g2y = shape
    return polynomial(cx, g1x, g2x) + polynomial(cy, g1y, g2y)


@kernel
def deviations(shape: Six) -> Four:
    """alpha_i = r'_i - c, the slopes' deviation from the chord."""
    cx, cy, g1x, g1y, g2x, g2y = shape
    return g1x - cx, g1y - cy, g2x - cx, g2y - cy


@kernel_with("contract", forceinline=True)
def over(x: float, by: float, inverse: float) -> float:
    """x/by to the last bit, from 1/by correctly rounded and what x (1/by) leaves (Markstein 1990),
    in a third of a division's time.
    """
    quotient = x * inverse
    return quotient + (x - quotient * by) * inverse


@kernel
def moments(quartic: Five) -> Five:
    """Means over the element of t^k p(t), k = 0..4, for p = c0 + c1 t + .. + c4 t^4."""
    c0, c1, c2, c3, c4 = quartic
    return (
        c0 + over(c2, 3.0, 1.0 / 3.0) + over(c4, 5.0, 0.2),
        over(c1, 3.0, 1.0 / 3.0) + over(c3, 5.0, 0.2),
        over(c0, 3.0, 1.0 / 3.0) + over(c2, 5.0, 0.2) + over(c4, 7.0, 1.0 / 7.0),
        over(c1, 5.0, 0.2) + over(c3, 7.0, 1.0 / 7.0),
        over(c0, 5.0, 0.2) + over(c2, 7.0, 1.0 / 7.0) + over(c4, 9.0, 1.0 / 9.0),
    )


@kernel
def axial_strain(shape: Six) -> Five:
    """Coefficients of the quartic e(t) = (r'.r' - 1)/2."""
    ax, bx, dx, ay, by, dy = polynomials(shape)
    return (
        0.5 * (ax * ax + ay * ay - 1.0),
        ax * bx + ay * by,
        ax * dx + ay * dy + 0.5 * (bx * bx + by * by),
        bx * dx + by * dy,
        0.5 * (dx * dx + dy * dy),
    )


@kernel
def axial_force(shape: Six, mean: Five, axial: float) -> Six:
    """E A int n grad e dx in (c, r'_1, r'_2), X before Y, N m.

    mean : `moments` of n(t), a quartic, against which r'(t) is taken. axial : E A l, N m.
    """
    ax, bx, dx, ay, by, dy = polynomials(shape)
    m0, m1, m2, m3, m4 = mean
    # dU/dA, dU/dB, dU/dC, then the chain rule of `polynomial`
    uax, uay = m0 * ax + m1 * bx + m2 * dx, m0 * ay + m1 * by + m2 * dy
    ubx, uby = m1 * ax + m2 * bx + m3 * dx, m1 * ay + m2 * by + m3 * dy
    udx, udy = m2 * ax + m3 * bx + m4 * dx, m2 * ay + m3 * by + m4 * dy
    sumx, sumy = 0.75 * udx - 0.25 * uax, 0.75 * udy - 0.25 * uay
    return (
        1.5 * axial * (uax - udx),
        1.5 * axial * (uay - udy),
        axial * (sumx - 0.5 * ubx),
        axial * (sumy - 0.5 * uby),
        axial * (sumx + 0.5 * ubx),
        axial * (sumy + 0.5 * uby),
    )


@kernel
def end_moments(bent: Four, near: float, far: float) -> Four:
    """E I/l (4 alpha_1 + 2 alpha_2) and E I/l (2 alpha_1 + 4 alpha_2), conjugate to the alpha."""
    a1x, a1y, a2x, a2y = bent
    return (
        near * a1x + far * a2x,
        near * a1y + far * a2y,
        far * a1x + near * a2x,
        far * a1y + near * a2y,
    )


@kernel_with("contract", forceinline=True)  # passing the arguments would cost as much as the rest
def internal_force(shape: Six, stiffness: Three) -> Six:
    """(dU/dc, dU/dr'_1, dU/dr'_2), X before Y: int E A e grad e + grad(E I k^2/2) dx, N m.

    stiffness : E A l, 4 E I/l and 2 E I/l, N m.
    """
    axial, near, far = stiffness
    fcx, fcy, u1x, u1y, u2x, u2y = axial_force(shape, moments(axial_strain(shape)), axial)
    f1x, f1y, f2x, f2y = end_moments(deviations(shape), near, far)
    return fcx - f1x - f2x, fcy - f1y - f2y, u1x + f1x, u1y + f1y, u2x + f2x, u2y + f2y


@kernel
def hessian(quartic: Five, axial: float) -> Six:
    """(cc, c1, c2, 11, 12, 22) of axial * the matrix s_(i+j) on (A, B, C), by the chain rule."""
    s0, s1, s2, s3, s4 = quartic
    cross, mixed = 0.75 * (s1 - s3), 0.125 * (3.0 * s3 - s1)
    c_sum = 1.5 * s2 - 0.375 * s0 - 1.125 * s4
    both, half = 0.0625 * s0 - 0.375 * s2 + 0.5625 * s4, 0.25 * s2
    return (
        axial * 2.25 * (s0 - 2.0 * s2 + s4),
        axial * (c_sum - cross),
        axial * (c_sum + cross),
        axial * (both + half - 2.0 * mixed),
        axial * (both - half),
        axial * (both + half + 2.0 * mixed),
    )


@kernel
def added(a: Six, b: Six) -> Six:
    """Sum of two symmetric blocks."""
    return a[0] + b[0], a[1] + b[1], a[2] + b[2], a[3] + b[3], a[4] + b[4], a[5] + b[5]


@kernel
def tangent_stiffness(shape: Six, stiffness: Three) -> tuple[Six, Six, Six]:
    """Second derivatives of U in (c, r'_1, r'_2): blocks XX, XY (= YX) and YY, N m.

    Each block is symmetric, (cc, c1, c2, 11, 12, 22). Arguments as for `internal_force`:
    E A int (grad e)(grad e)^T + e Hess e dx, the moments of the quartics r'_i r'_j and e.
    """
    axial, near, far = stiffness
    ax, bx, dx, ay, by, dy = polynomials(shape)
    x0, x1, x2, x3, x4 = moments(
        (ax * ax, 2.0 * ax * bx, 2.0 * ax * dx + bx * bx, 2.0 * bx * dx, dx * dx)
    )
    y0, y1, y2, y3, y4 = moments(
        (ay * ay, 2.0 * ay * by, 2.0 * ay * dy + by * by, 2.0 * by * dy, dy * dy)
    )
    mixed = moments(
        (ax * ay, ax * by + bx * ay, ax * dy + dx * ay + bx * by, bx * dy + dx * by, dx * dy)
    )
    # moments of e = (r'.r' - 1)/2
    e0, e1, e2 = 0.5 * (x0 + y0 - 1.0), 0.5 * (x1 + y1), 0.5 * (x2 + y2 - 1.0 / 3.0)
    e3, e4 = 0.5 * (x3 + y3), 0.5 * (x4 + y4 - 1.0 / 5.0)
    bend = (2.0 * (near + far), -near - far, -near - far, near, far, near)
    xx = hessian((x0 + e0, x1 + e1, x2 + e2, x3 + e3, x4 + e4), axial)
    yy = hessian((y0 + e0, y1 + e1, y2 + e2, y3 + e3, y4 + e4), axial)
    return added(xx, bend), hessian(mixed, axial), added(yy, bend)


@kernel
def strain_energy(shape: Six, stiffness: Three) -> float:
    """U = 1/2 int E A e^2 + E I k^2 dx, J (eq. 5); arguments as for `internal_force`."""
    axial, near, far = stiffness
    e0, e1, e2, e3, e4 = axial_strain(shape)
    m0, m1, m2, m3, m4 = moments((e0, e1, e2, e3, e4))
    a1x, a1y, a2x, a2y = deviations(shape)
    bending = near * (a1x * a1x + a1y * a1y + a2x * a2x + a2y * a2y)
    bending += 2.0 * far * (a1x * a2x + a1y * a2y)
    return 0.5 * (axial * (e0 * m0 + e1 * m1 + e2 * m2 + e3 * m3 + e4 * m4) + bending)


@kernel
def inertia(m: Floats, x0: float, x1: float, x2: float, x3: float) -> Four:
    """M q.. of one component (r_1, r'_1, r_2, r'_2); `m` (4, 4) is one component's mass."""
    return (
        m[0, 0] * x0 + m[0, 1] * x1 + m[0, 2] * x2 + m[0, 3] * x3,
        m[1, 0] * x0 + m[1, 1] * x1 + m[1, 2] * x2 + m[1, 3] * x3,
        m[2, 0] * x0 + m[2, 1] * x1 + m[2, 2] * x2 + m[2, 3] * x3,
        m[3, 0] * x0 + m[3, 1] * x1 + m[3, 2] * x2 + m[3, 3] * x3,
    )


@kernel
def kinetic_energy(mass: Floats, v: Floats) -> float:
    """T = 1/2 q.^T M q. of one element, J; v (8,) in the order of q_e."""
    px, py = inertia(mass, v[0], v[2], v[4], v[6]), inertia(mass, v[1], v[3], v[5], v[7])
    energy = v[0] * px[0] + v[1] * py[0] + v[2] * px[1] + v[3] * py[1]
    return 0.5 * (energy + v[4] * px[2] + v[5] * py[2] + v[6] * px[3] + v[7] * py[3])
