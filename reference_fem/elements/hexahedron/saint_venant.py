"""St. Venant-Kirchhoff's law in the 8-point hexahedron, with a mean dilatation e.

    C = F^T F,  E = (C - I)/2,  e = sum_q w_q tr E_q / V,  V = sum_q w_q
    W = sum_q w_q mu E_q:E_q + V lambda e^2 / 2,  S_q = lambda e I + 2 mu E_q,  P_q = F_q S_q

With damping, tau dE/dt and tau de/dt are added to E and e in S.

Rows of `reference` beyond those of `eight_point_kernel`: 57 lambda/V (Pa/m^3), 58 tau (s).
"""

from reference_fem.arrays import Array
from reference_fem.compiled import inlined
from reference_fem.elements.blocks import LANES, Blocks
from reference_fem.elements.hexahedron.edges import Rows, Three, dot
from reference_fem.elements.hexahedron.eight_point_kernel import MU, add_force, least_det
from reference_fem.elements.hexahedron.law import Five, Law, implement_law
from reference_fem.elements.hexahedron.point import (
    conjugate,
    gradient_rows,
    product,
    strain_rate,
    stress_rows,
)
from reference_fem.elements.loops import implement

LAME_PER_VOLUME = MU + 1
RELAXATION = LAME_PER_VOLUME + 1


class SaintVenant(Law):
    """St. Venant-Kirchhoff's law."""


class Hex8Blocks(Blocks):
    """Blocks of St. Venant-Kirchhoff's 8-point hexahedra."""


def constants(lame: Array, volume: Array) -> tuple[Array, ...]:
    """Rows of `reference` beside mu and tau: lambda/V, Pa/m^3."""
    return (lame / volume,)


@inlined
def volume(f: Rows, r: Array, o: int) -> float:
    """Part of one point in v: w tr E, m^3."""
    squares = dot(f[0], f[0]) + dot(f[1], f[1]) + dot(f[2], f[2])
    return r[o + 6 * LANES] * (0.5 * squares - 1.5)


@inlined
def pressure(r: Array, lane: int, v: float) -> float:
    """Pressure lambda e, Pa, of V e."""
    return r[LAME_PER_VOLUME * LANES + lane] * v


@inlined
def energy(r: Array, lane: int, v: float) -> float:
    """V lambda e^2 / 2, J."""
    return 0.5 * pressure(r, lane, v) * v


@inlined
def green_strain(f: Rows) -> tuple[Three, Three]:
    """2E = C - I in the point's frame, as (11, 22, 33), (12, 23, 13)."""
    fx, fy, fz = f
    return (
        (
            fx[0] * fx[0] + fy[0] * fy[0] + fz[0] * fz[0] - 1.0,
            fx[1] * fx[1] + fy[1] * fy[1] + fz[1] * fz[1] - 1.0,
            fx[2] * fx[2] + fy[2] * fy[2] + fz[2] * fz[2] - 1.0,
        ),
        (
            fx[0] * fx[1] + fy[0] * fy[1] + fz[0] * fz[1],
            fx[1] * fx[2] + fy[1] * fy[2] + fz[1] * fz[2],
            fx[0] * fx[2] + fy[0] * fy[2] + fz[0] * fz[2],
        ),
    )


@inlined
def point(g: Rows, r: Array, o: int, mu: float, p: float) -> tuple[Rows, float]:
    """Rows of w F S J^-T; w mu E:E, J."""
    f = gradient_rows(g, r, o)
    d, h = green_strain(f)
    wmu, wp = r[o + 6 * LANES] * mu, r[o + 6 * LANES] * p
    return conjugate(stress_rows(f, d, h, wmu, wp), r, o), wmu * product(d, h)


@inlined
def damping(r: Array, lane: int, v: float, rate: float) -> Five:
    """Pressure lambda (e + tau de/dt), which has its viscous part in it, and the others."""
    k, tau = r[LAME_PER_VOLUME * LANES + lane], r[RELAXATION * LANES + lane]
    return k * (v + tau * rate), 0.0, tau, energy(r, lane, v), tau * k * rate * rate


@inlined
def damped_point(
    bases: Rows, rates: Rows, r: Array, o: int, given: Five, stored: float, power: float
) -> tuple[Rows, float, float]:
    """`point` with damping."""
    mu, tau, p, _, lag = given
    f, v = gradient_rows(bases, r, o), gradient_rows(rates, r, o)
    d, h = green_strain(f)
    e, g = strain_rate(f, v, lag)
    wmu, wp = r[o + 6 * LANES] * mu, r[o + 6 * LANES] * p
    stored += wmu * product(d, h)
    power += 2.0 * tau * wmu * product(e, g)
    d = (d[0] + tau * e[0], d[1] + tau * e[1], d[2] + tau * e[2])
    h = (h[0] + tau * g[0], h[1] + tau * g[1], h[2] + tau * g[2])
    return conjugate(stress_rows(f, d, h, wmu, wp), r, o), stored, power


implement_law(
    Hex8Blocks, SaintVenant(RELAXATION),
    volume, pressure, energy, point, damping, damped_point,
)  # fmt: skip
implement(Hex8Blocks, add_force, least_det)
