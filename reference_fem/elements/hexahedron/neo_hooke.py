"""A compressible neo-Hookean law in the 8-point hexahedron, with a mean volume J'.

    J = det F,  J' = sum_q w_q J_q / V,  V = sum_q w_q
    W = sum_q w_q mu ((tr C_q - 3)/2 - ln J_q) + V lambda ((J'^2 - 1)/2 - ln J')/2
    p = lambda (J' - 1/J')/2,  P_q = mu F_q + (p - mu/J_q) cof F_q,  cof(F Q) = cof(F) Q

(W(C) and its U(J): Simo, Pister 1984, CMAME 46; Bonet, Wood, Nonlinear Continuum Mechanics for FEA,
2008, section 6.4.3; J' in place of J: Nagtegaal, Parks, Rice 1974, CMAME 4.) Small strains follow
Hooke's law. Crushed, it stiffens without bound, where St. Venant-Kirchhoff's law softens.

Damping adds F S of S = tau (lambda de/dt I + 2 mu dE/dt), e as in `saint_venant`.

Rows of `reference` beyond those of `eight_point_kernel`: 57 lambda/2 (Pa), 58 1/V (1/m^3), 59
tau (s).
"""

import numpy as np

from reference_fem.arrays import Array
from reference_fem.compiled import inlined
from reference_fem.elements.blocks import LANES, Blocks
from reference_fem.elements.hexahedron.edges import Rows, Three, cross, dot
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

HALF_LAME = MU + 1
PER_VOLUME = HALF_LAME + 1
RELAXATION = PER_VOLUME + 1


class NeoHooke(Law):
    """The neo-Hookean law."""


class NeoHookeBlocks(Blocks):
    """Blocks of neo-Hookean 8-point hexahedra."""


def constants(lame: Array, volume: Array) -> tuple[Array, ...]:
    """Rows of `reference` beside mu and tau: lambda/2, Pa, and 1/V, 1/m^3."""
    return 0.5 * lame, 1.0 / volume


@inlined
def volume(f: Rows, r: Array, o: int) -> float:
    """Part of one point in v: w J, m^3."""
    return r[o + 6 * LANES] * dot(f[0], cross(f[1], f[2]))


@inlined
def mean_volume(r: Array, lane: int, v: float) -> float:
    """J' of V J', 1 in lanes past the last."""
    share = r[PER_VOLUME * LANES + lane]
    return v * share if share > 0.0 else 1.0


@inlined
def pressure(r: Array, lane: int, v: float) -> float:
    """Pressure lambda (J' - 1/J')/2, Pa, of V J'."""
    mean = mean_volume(r, lane, v)
    return r[HALF_LAME * LANES + lane] * (mean - 1.0 / mean)


@inlined
def energy(r: Array, lane: int, v: float) -> float:
    """V lambda ((J'^2 - 1)/2 - ln J')/2, J; zero in lanes past the last."""
    share, mean = r[PER_VOLUME * LANES + lane], mean_volume(r, lane, v)
    found = r[HALF_LAME * LANES + lane] * (0.5 * (mean * mean - 1.0) - np.log(mean))
    return found / share if share > 0.0 else 0.0


@inlined
def total(a: float, f: Three, b: float, c: Three) -> Three:
    """Return a f + b c."""
    return a * f[0] + b * c[0], a * f[1] + b * c[1], a * f[2] + b * c[2]


@inlined
def elastic_rows(f: Rows, r: Array, o: int, mu: float, p: float) -> tuple[Rows, float]:
    """Rows of w P Q; w mu ((tr C - 3)/2 - ln J), J."""
    x, y, z = cross(f[1], f[2]), cross(f[2], f[0]), cross(f[0], f[1])
    weight = r[o + 6 * LANES]
    det = dot(f[0], x) if weight > 0.0 else 1.0
    a, b = weight * mu, weight * (p - mu / det)
    squares = dot(f[0], f[0]) + dot(f[1], f[1]) + dot(f[2], f[2])
    rows = total(a, f[0], b, x), total(a, f[1], b, y), total(a, f[2], b, z)
    return rows, a * (0.5 * (squares - 3.0) - np.log(det))


@inlined
def point(g: Rows, r: Array, o: int, mu: float, p: float) -> tuple[Rows, float]:
    """Rows of w P J^-T, and the energy."""
    rows, stored = elastic_rows(gradient_rows(g, r, o), r, o, mu, p)
    return conjugate(rows, r, o), stored


@inlined
def damping(r: Array, lane: int, v: float, rate: float) -> Five:
    """Pressure, its viscous part lambda tau de/dt, and the others; `rate` is V de/dt."""
    tau = r[RELAXATION * LANES + lane]
    viscous = 2.0 * r[HALF_LAME * LANES + lane] * r[PER_VOLUME * LANES + lane] * tau * rate
    return pressure(r, lane, v), viscous, tau, energy(r, lane, v), viscous * rate


@inlined
def damped_point(
    bases: Rows, rates: Rows, r: Array, o: int, given: Five, stored: float, power: float
) -> tuple[Rows, float, float]:
    """`point` with damping."""
    mu, tau, p, viscous, lag = given
    f, v = gradient_rows(bases, r, o), gradient_rows(rates, r, o)
    d, h = strain_rate(f, v, lag)
    weight = r[o + 6 * LANES]
    power += 2.0 * tau * weight * mu * product(d, h)
    d = (tau * d[0], tau * d[1], tau * d[2])
    h = (tau * h[0], tau * h[1], tau * h[2])
    (x, y, z), own = elastic_rows(f, r, o, mu, p)
    a, b, c = stress_rows(f, d, h, weight * mu, weight * viscous)
    rows = total(1.0, x, 1.0, a), total(1.0, y, 1.0, b), total(1.0, z, 1.0, c)
    return conjugate(rows, r, o), stored + own, power


implement_law(
    NeoHookeBlocks, NeoHooke(RELAXATION),
    volume, pressure, energy, point, damping, damped_point,
)  # fmt: skip
implement(NeoHookeBlocks, add_force, least_det)
