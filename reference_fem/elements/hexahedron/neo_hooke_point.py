"""One Gauss point of a neo-Hookean hexahedron, in the frame of `point`: cof(F Q) = cof(F) Q."""

import numpy as np

from reference_fem.arrays import Array
from reference_fem.compiled import inlined
from reference_fem.elements.blocks import LANES
from reference_fem.elements.hexahedron.edges import Rows, Three
from reference_fem.elements.hexahedron.point import (
    gradient_rows,
    product,
    strain_rate,
    stress_force,
)


@inlined
def cross(a: Three, b: Three) -> Three:
    """The vector product a x b."""
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


@inlined
def dot(a: Three, b: Three) -> float:
    """The scalar product a.b."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@inlined
def row_force(f: Three, c: Three, a: float, b: float, r: Array, o: int) -> Three:
    """A row of (a F Q + b cof F Q) R^-T: the forces conjugate to that row of g_1, g_2, g_3."""
    p1, p2, p3 = a * f[0] + b * c[0], a * f[1] + b * c[1], a * f[2] + b * c[2]
    return (
        p1 * r[o] + p2 * r[o + LANES] + p3 * r[o + 2 * LANES],
        p2 * r[o + 3 * LANES] + p3 * r[o + 4 * LANES],
        p3 * r[o + 5 * LANES],
    )


@inlined
def elastic_point(g: Rows, r: Array, o: int, mu: float, pressure: float) -> tuple[Rows, float]:
    """Rows x, y, z of w P J^-T: the forces conjugate to g_1, g_2, g_3 at one point;
    w mu ((tr C - 3)/2 - ln J), J, which is not computed where its caller does not use it.
    """
    f = gradient_rows(g, r, o)
    x, y, z = cross(f[1], f[2]), cross(f[2], f[0]), cross(f[0], f[1])
    weight = r[o + 6 * LANES]
    volume = dot(f[0], x) if weight > 0.0 else 1.0
    a, b = weight * mu, weight * (pressure - mu / volume)
    force = (
        row_force(f[0], x, a, b, r, o),
        row_force(f[1], y, a, b, r, o),
        row_force(f[2], z, a, b, r, o),
    )
    squares = dot(f[0], f[0]) + dot(f[1], f[1]) + dot(f[2], f[2])
    return force, a * (0.5 * (squares - 3.0) - np.log(volume))


@inlined
def damped_point(
    bases: Rows, rates: Rows, r: Array, o: int, mu: float, tau: float, pressure: float,
    viscous: float, lag: float, energy: float, power: float,
) -> tuple[Rows, float, float]:  # fmt: skip
    """`elastic_point` with damping, `viscous` its pressure, Pa, `rates` those of the bases.

    Returns energy and power plus its own.
    """
    f, v = gradient_rows(bases, r, o), gradient_rows(rates, r, o)
    d, h = strain_rate(f, v, lag)
    weight = r[o + 6 * LANES]
    power += 2.0 * tau * weight * mu * product(d, h)
    d = (tau * d[0], tau * d[1], tau * d[2])
    h = (tau * h[0], tau * h[1], tau * h[2])
    (x, y, z), stored = elastic_point(bases, r, o, mu, pressure)
    a, b, c = stress_force(f, d, h, r, o, weight * mu, weight * viscous)
    force = (
        (x[0] + a[0], x[1] + a[1], x[2] + a[2]),
        (y[0] + b[0], y[1] + b[1], y[2] + b[2]),
        (z[0] + c[0], z[1] + c[1], z[2] + c[2]),
    )
    return force, energy + stored, power
