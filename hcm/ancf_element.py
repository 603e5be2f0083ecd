"""Gradient-deficient ANCF beam element (paper, section 2.1.1, eqs. 1-7).

Two nodes, coordinates (r, r') at each; position field r = S q with the cubic Hermite functions
S_1..S_4 of x/l, the same for X and Y. Strain energy

    U = 1/2 int_0^l E A e^2 + E I k^2 dx,   e = (r'.r' - 1)/2,   k = |r''|.

U's bending part is quadratic in q (constant matrix), its axial part quartic: the force is cubic,
the tangent quadratic. e^2 has degree 8 in x, so five Gauss points integrate it exactly.
"""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

Floats = NDArray[np.float64]

GAUSS_POINTS, GAUSS_WEIGHTS = (
    0.5 * (np.polynomial.legendre.leggauss(5)[0] + 1.0),
    0.5 * np.polynomial.legendre.leggauss(5)[1],
)


def mass_matrix(mass_per_length: float, length: float) -> Floats:
    """Consistent mass of one component, rho A int S^T S dx (eq. 4).

    Parameters
    ----------
    mass_per_length : rho A, kg/m.
    length : l, m.

    Returns
    -------
    (4, 4), for (r_1, r'_1, r_2, r'_2): kg, kg m, kg m^2.
    """
    el = length
    return (mass_per_length * el / 420) * np.array(
        [
            [156, 22 * el, 54, -13 * el],
            [22 * el, 4 * el**2, 13 * el, -3 * el**2],
            [54, 13 * el, 156, -22 * el],
            [-13 * el, -3 * el**2, -22 * el, 4 * el**2],
        ]
    )


def bending_matrix(bending_stiffness: float, length: float) -> Floats:
    """Constant bending stiffness of one component, E I int S''^T S'' dx (eq. 6).

    Parameters
    ----------
    bending_stiffness : E I, N m^2.
    length : l, m.

    Returns
    -------
    (4, 4), for (r_1, r'_1, r_2, r'_2): N/m, N, N m.
    """
    el = length
    return (bending_stiffness / el**3) * np.array(
        [
            [12, 6 * el, -12, 6 * el],
            [6 * el, 4 * el**2, -6 * el, 2 * el**2],
            [-12, -6 * el, 12, -6 * el],
            [6 * el, 2 * el**2, -6 * el, 4 * el**2],
        ]
    )


@njit(cache=True)
def chord(q: Floats, a: int, b: int, length: float) -> tuple[float, float]:
    """(r_2 - r_1)/l: all that strains need of the positions, without the cancellation of S q."""
    return (q[b] - q[a]) / length, (q[b + 1] - q[a + 1]) / length


@njit(cache=True)
def slope_functions(xi: float) -> tuple[float, float, float]:
    """Weights of (chord, r'_1, r'_2) in r' at xi = x/l (eq. 3 differentiated)."""
    return 6.0 * xi * (1.0 - xi), 1.0 + xi * (3.0 * xi - 4.0), xi * (3.0 * xi - 2.0)


@njit(cache=True)
def curvature_functions(xi: float) -> tuple[float, float, float]:
    """Weights of (chord, r'_1, r'_2) in l r'' at xi = x/l."""
    return 6.0 - 12.0 * xi, 6.0 * xi - 4.0, 6.0 * xi - 2.0


@njit(cache=True)
def combine(
    q: Floats, a: int, b: int, c: tuple[float, float], s: tuple[float, float, float]
) -> tuple[float, float]:
    """s_1 chord + s_2 r'_1 + s_3 r'_2, both components."""
    return (
        s[0] * c[0] + s[1] * q[a + 2] + s[2] * q[b + 2],
        s[0] * c[1] + s[1] * q[a + 3] + s[2] * q[b + 3],
    )


@njit(cache=True)
def add_internal_force(
    q: Floats,
    c: tuple[float, float],
    a: int,
    b: int,
    length: float,
    axial_stiffness: float,
    bending: Floats,
    out: Floats,
) -> None:
    """Add dU/dq = int E A e S'^T r' + E I S''^T r'' dx to `out` (n,), N and N m.

    `c` is the element's chord: the caller may know it more precisely than from q's positions.
    The bending part uses alpha_i = r'_i - chord, the slopes' deviation from the chord: the moments
    conjugate to them are E I/l (4 alpha_1 + 2 alpha_2) and E I/l (2 alpha_1 + 4 alpha_2), whose
    factors are `bending`'s entries (1, 1) and (1, 3).
    """
    near, far = bending[1, 1], bending[1, 3]
    alpha_1x, alpha_1y = q[a + 2] - c[0], q[a + 3] - c[1]
    alpha_2x, alpha_2y = q[b + 2] - c[0], q[b + 3] - c[1]
    f1x, f1y = near * alpha_1x + far * alpha_2x, near * alpha_1y + far * alpha_2y
    f2x, f2y = far * alpha_1x + near * alpha_2x, far * alpha_1y + near * alpha_2y
    fcx, fcy = -f1x - f2x, -f1y - f2y
    for g in range(5):
        s = slope_functions(GAUSS_POINTS[g])
        rx, ry = combine(q, a, b, c, s)
        n = GAUSS_WEIGHTS[g] * length * axial_stiffness * 0.5 * (rx * rx + ry * ry - 1.0)
        fcx += n * s[0] * rx
        fcy += n * s[0] * ry
        f1x += n * s[1] * rx
        f1y += n * s[1] * ry
        f2x += n * s[2] * rx
        f2y += n * s[2] * ry
    out[a] -= fcx / length
    out[a + 1] -= fcy / length
    out[a + 2] += f1x
    out[a + 3] += f1y
    out[b] += fcx / length
    out[b + 1] += fcy / length
    out[b + 2] += f2x
    out[b + 3] += f2y


@njit(cache=True)
def axial_tangent(
    q: Floats, a: int, b: int, length: float, axial_stiffness: float, out: Floats
) -> None:
    """Write d^2U_a/dq^2 = int E A (S'^T r')(S'^T r')^T + E A e S'^T S' dx.

    `out` is (8, 8), rows and columns in the order of q_e = (r_1, r'_1, r_2, r'_2), X before Y.
    """
    out[:] = 0.0
    c = chord(q, a, b, length)
    p = np.empty(8)
    for g in range(5):
        weights = slope_functions(GAUSS_POINTS[g])
        rx, ry = combine(q, a, b, c, weights)
        s = (-weights[0] / length, weights[1], weights[0] / length, weights[2])
        w = GAUSS_WEIGHTS[g] * length * axial_stiffness
        n = w * 0.5 * (rx * rx + ry * ry - 1.0)
        for i in range(4):
            p[2 * i] = s[i] * rx
            p[2 * i + 1] = s[i] * ry
        for i in range(8):
            for j in range(8):
                out[i, j] += w * p[i] * p[j]
        for i in range(4):
            for j in range(4):
                out[2 * i, 2 * j] += n * s[i] * s[j]
                out[2 * i + 1, 2 * j + 1] += n * s[i] * s[j]


@njit(cache=True)
def strain_energy(
    q: Floats, a: int, b: int, length: float, axial_stiffness: float, bending: Floats
) -> float:
    """U = 1/2 int E A e^2 + E I k^2 dx, J (eq. 5)."""
    c = chord(q, a, b, length)
    energy = 0.0
    for d in range(2):
        alpha_1, alpha_2 = q[a + 2 + d] - c[d], q[b + 2 + d] - c[d]
        energy += 0.5 * bending[1, 1] * (alpha_1 * alpha_1 + alpha_1 * alpha_2 + alpha_2 * alpha_2)
    for g in range(5):
        rx, ry = combine(q, a, b, c, slope_functions(GAUSS_POINTS[g]))
        e = 0.5 * (rx * rx + ry * ry - 1.0)
        energy += 0.5 * GAUSS_WEIGHTS[g] * length * axial_stiffness * e * e
    return energy


@njit(cache=True)
def add_inertia(mass: Floats, acceleration: Floats, a: int, b: int, out: Floats) -> None:
    """Add M q.. of one element to `out` (n,); `mass` (4, 4) is one component's."""
    for c in range(2):
        x0, x1 = acceleration[a + c], acceleration[a + 2 + c]
        x2, x3 = acceleration[b + c], acceleration[b + 2 + c]
        out[a + c] += mass[0, 0] * x0 + mass[0, 1] * x1 + mass[0, 2] * x2 + mass[0, 3] * x3
        out[a + 2 + c] += mass[1, 0] * x0 + mass[1, 1] * x1 + mass[1, 2] * x2 + mass[1, 3] * x3
        out[b + c] += mass[2, 0] * x0 + mass[2, 1] * x1 + mass[2, 2] * x2 + mass[2, 3] * x3
        out[b + 2 + c] += mass[3, 0] * x0 + mass[3, 1] * x1 + mass[3, 2] * x2 + mass[3, 3] * x3


@njit(cache=True)
def kinetic_energy(mass: Floats, v: Floats, a: int, b: int) -> float:
    """T = 1/2 q.^T M q. of one element, J."""
    place = (a, a + 2, b, b + 2)
    energy = 0.0
    for c in range(2):
        for i in range(4):
            for j in range(4):
                energy += 0.5 * mass[i, j] * v[place[i] + c] * v[place[j] + c]
    return energy
