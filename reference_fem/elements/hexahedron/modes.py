"""The 8 corner values of a hexahedron as sums over its modes, and the mean gradients in them.

With s_m the signs at the corners of xi, eta, zeta (linear) and of xi eta, eta zeta, xi zeta,
xi eta zeta (hourglass), x_m = sum_a s_ma x_a. A constant drops out of everything that follows.
Flanagan and Belytschko's (1981) mean gradients b_a = 1/V int grad N_a dV = 1/V dV/dX_a become

    b_a = sum_m s_ma b_m,   b_m = (1/v) dv/dX_m,   v = 64 V

where integrating det(dX/dxi) over the cube, with L_1..3 the linear and G_1..4 the hourglass modes
of X, gives v = L_1.(L_2 x L_3) + (L_1.(G_1 x G_3) + L_2.(G_2 x G_1) + L_3.(G_3 x G_2))/3:
the last mode leaves no trace in the volume, and its b is zero.
"""

from reference_fem.arrays import Array
from reference_fem.compiled import inlined
from reference_fem.elements.blocks import LANES
from reference_fem.elements.hexahedron.edges import Three, dot

Six = tuple[Three, Three, Three, Three, Three, Three]
Modes = tuple[float, float, float, float, float, float, float]


@inlined
def modes(s: Array, o: int) -> Modes:
    """x_m of one component, m as above, from 8 rows of s, the first one's lane at o."""
    x0, x1, x2, x3 = s[o], s[o + LANES], s[o + 2 * LANES], s[o + 3 * LANES]
    x4, x5, x6, x7 = s[o + 4 * LANES], s[o + 5 * LANES], s[o + 6 * LANES], s[o + 7 * LANES]
    a, b, c, d = x1 + x0, x1 - x0, x2 + x3, x2 - x3
    e, f, g, h = x5 + x4, x5 - x4, x6 + x7, x6 - x7
    sum_low, sum_high, slope_low, slope_high = a + c, e + g, b + d, f + h
    eta_low, eta_high, twist_low, twist_high = c - a, g - e, d - b, h - f
    return (
        slope_high + slope_low,
        eta_high + eta_low,
        sum_high - sum_low,
        twist_high + twist_low,
        eta_high - eta_low,
        slope_high - slope_low,
        twist_high - twist_low,
    )


@inlined
def spread(s: Array, o: int, m: Modes) -> None:
    """Transpose of `modes`: f_a = sum_m s_ma f_m into 8 rows of s, the first one's lane at o."""
    slope_low, slope_high = m[0] - m[5], m[0] + m[5]
    eta_low, eta_high = m[1] - m[4], m[1] + m[4]
    twist_low, twist_high = m[3] - m[6], m[3] + m[6]
    even, odd = -m[2] - eta_low, eta_low - m[2]
    near, far = slope_low - twist_low, slope_low + twist_low
    s[o], s[o + LANES] = even - near, even + near
    s[o + 2 * LANES], s[o + 3 * LANES] = odd + far, odd - far
    even, odd = m[2] - eta_high, m[2] + eta_high
    near, far = slope_high - twist_high, slope_high + twist_high
    s[o + 4 * LANES], s[o + 5 * LANES] = even - near, even + near
    s[o + 6 * LANES], s[o + 7 * LANES] = odd + far, odd - far


@inlined
def scaled(c: float, a: Three) -> Three:
    """Return c a."""
    return c * a[0], c * a[1], c * a[2]


@inlined
def crosses(a: Three, b: Three, c: Three, d: Three) -> Three:
    """Return a x b + c x d."""
    return (
        a[1] * b[2] - a[2] * b[1] + c[1] * d[2] - c[2] * d[1],
        a[2] * b[0] - a[0] * b[2] + c[2] * d[0] - c[0] * d[2],
        a[0] * b[1] - a[1] * b[0] + c[0] * d[1] - c[1] * d[0],
    )


@inlined
def mean_gradients(x: Modes, y: Modes, z: Modes) -> Six:
    """b_m of the first six modes, 1/m, from the modes of the reference corners."""
    l1, l2, l3 = (x[0], y[0], z[0]), (x[1], y[1], z[1]), (x[2], y[2], z[2])
    g1, g2, g3 = (x[3], y[3], z[3]), (x[4], y[4], z[4]), (x[5], y[5], z[5])
    t1, t2, t3 = scaled(1.0 / 3.0, g1), scaled(1.0 / 3.0, g2), scaled(1.0 / 3.0, g3)
    b1, b2, b3 = crosses(l2, l3, t1, g3), crosses(l3, l1, t2, g1), crosses(l1, l2, t3, g2)
    c1, c2, c3 = crosses(t3, l1, l2, t2), crosses(t1, l2, l3, t3), crosses(l1, t1, t2, l3)
    w = 1.0 / (dot(l1, b1) + dot(g2, c2))
    return scaled(w, b1), scaled(w, b2), scaled(w, b3), scaled(w, c1), scaled(w, c2), scaled(w, c3)
