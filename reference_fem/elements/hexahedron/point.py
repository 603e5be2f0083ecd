"""One Gauss point of an 8-node hexahedron, in a frame of its own.

With J = dX/dxi = Q R (Q a rotation, R upper triangular), F Q = [g_1 g_2 g_3] R^-1. An isotropic law
does not see Q: F S J^-T = (F Q)(Q^T S Q) R^-T. So a point stores the 6 numbers of R^-1 and w
instead of J^-1 and w, and two products become triangular.

`r[o + row*LANES]`, row 0..6: R^-1 (11, 12, 13, 22, 23, 33; 1/m) and w (m^3).
"""

from reference_fem.arrays import Array
from reference_fem.compiled import inlined
from reference_fem.elements.blocks import LANES
from reference_fem.elements.hexahedron.edges import Rows, Three

POINT_ROWS = 7


@inlined
def gradient_row(g1: float, g2: float, g3: float, r: Array, o: int) -> Three:
    """One row of F Q = [g_1 g_2 g_3] R^-1, R^-1 at r[o], r[o + LANES] .. r[o + 5 LANES]."""
    return (
        g1 * r[o],
        g1 * r[o + LANES] + g2 * r[o + 3 * LANES],
        g1 * r[o + 2 * LANES] + g2 * r[o + 4 * LANES] + g3 * r[o + 5 * LANES],
    )


@inlined
def gradient_rows(g: Rows, r: Array, o: int) -> Rows:
    """Rows x, y, z of F Q, or of its rate, from those of [g_1 g_2 g_3]."""
    return (
        gradient_row(g[0][0], g[0][1], g[0][2], r, o),
        gradient_row(g[1][0], g[1][1], g[1][2], r, o),
        gradient_row(g[2][0], g[2][1], g[2][2], r, o),
    )


@inlined
def force_row(fx: Three, s1: Three, s2: Three, s3: Three, r: Array, o: int) -> Three:
    """One row of w (F Q)(Q^T S Q) R^-T: the forces conjugate to that row of g_1, g_2, g_3."""
    p1 = fx[0] * s1[0] + fx[1] * s1[1] + fx[2] * s1[2]
    p2 = fx[0] * s2[0] + fx[1] * s2[1] + fx[2] * s2[2]
    p3 = fx[0] * s3[0] + fx[1] * s3[1] + fx[2] * s3[2]
    return (
        p1 * r[o] + p2 * r[o + LANES] + p3 * r[o + 2 * LANES],
        p2 * r[o + 3 * LANES] + p3 * r[o + 4 * LANES],
        p3 * r[o + 5 * LANES],
    )


@inlined
def dilatation(f: Rows, r: Array, o: int) -> float:
    """Return w tr E at one point, m^3, from the rows of F Q."""
    fx, fy, fz = f
    xx = fx[0] * fx[0] + fx[1] * fx[1] + fx[2] * fx[2]
    yy = fy[0] * fy[0] + fy[1] * fy[1] + fy[2] * fy[2]
    zz = fz[0] * fz[0] + fz[1] * fz[1] + fz[2] * fz[2]
    return r[o + 6 * LANES] * (0.5 * (xx + yy + zz) - 1.5)


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
def strain_rate(f: Rows, v: Rows, lag: float) -> tuple[Three, Three]:
    """2 dE/dt = F^T F' + F'^T F, F' = dF/dt, in the order of `green_strain`, from rows of F and F'.

    F' is that of `lag` ago, and is combined with the F of that time, F - lag F': over a step of
    twice the lag the rate is the difference of the strains, which is zero where the body turns.
    """
    (fx, fy, fz), (vx, vy, vz) = f, v
    gx = (fx[0] - lag * vx[0], fx[1] - lag * vx[1], fx[2] - lag * vx[2])
    gy = (fy[0] - lag * vy[0], fy[1] - lag * vy[1], fy[2] - lag * vy[2])
    gz = (fz[0] - lag * vz[0], fz[1] - lag * vz[1], fz[2] - lag * vz[2])
    return (
        (
            2.0 * (gx[0] * vx[0] + gy[0] * vy[0] + gz[0] * vz[0]),
            2.0 * (gx[1] * vx[1] + gy[1] * vy[1] + gz[1] * vz[1]),
            2.0 * (gx[2] * vx[2] + gy[2] * vy[2] + gz[2] * vz[2]),
        ),
        (
            gx[0] * vx[1] + gx[1] * vx[0] + gy[0] * vy[1] + gy[1] * vy[0] + gz[0] * vz[1]
            + gz[1] * vz[0],
            gx[1] * vx[2] + gx[2] * vx[1] + gy[1] * vy[2] + gy[2] * vy[1] + gz[1] * vz[2]
            + gz[2] * vz[1],
            gx[0] * vx[2] + gx[2] * vx[0] + gy[0] * vy[2] + gy[2] * vy[0] + gz[0] * vz[2]
            + gz[2] * vz[0],
        ),
    )  # fmt: skip


@inlined
def product(d: Three, h: Three) -> float:
    """E:E from 2E as `green_strain` gives it."""
    squares = d[0] * d[0] + d[1] * d[1] + d[2] * d[2]
    return 0.25 * (squares + 2.0 * (h[0] * h[0] + h[1] * h[1] + h[2] * h[2]))


@inlined
def stress_force(f: Rows, d: Three, h: Three, r: Array, o: int, wmu: float, wp: float) -> Rows:
    """Rows x, y, z of w F S J^-T, S = p I + 2 mu E: the forces conjugate to g_1, g_2, g_3.

    d, h : 2E as `green_strain` gives it. wmu, wp : w mu and w p, J.
    """
    s12, s23, s13 = wmu * h[0], wmu * h[1], wmu * h[2]
    s1 = (wmu * d[0] + wp, s12, s13)
    s2 = (s12, wmu * d[1] + wp, s23)
    s3 = (s13, s23, wmu * d[2] + wp)
    return (
        force_row(f[0], s1, s2, s3, r, o),
        force_row(f[1], s1, s2, s3, r, o),
        force_row(f[2], s1, s2, s3, r, o),
    )


@inlined
def point_force(g: Rows, r: Array, o: int, mu: float, pressure: float) -> tuple[Rows, float]:
    """Rows x, y, z of w F S J^-T: the forces conjugate to g_1, g_2, g_3 at one point; w mu E:E, J.

    Where the caller that inlines this does not use the energy, it is not computed.
    """
    f = gradient_rows(g, r, o)
    d, h = green_strain(f)
    wmu, wp = r[o + 6 * LANES] * mu, r[o + 6 * LANES] * pressure
    return stress_force(f, d, h, r, o, wmu, wp), wmu * product(d, h)


@inlined
def damped_point(
    bases: Rows, rates: Rows, r: Array, o: int, mu: float, tau: float, pressure: float, lag: float,
    energy: float, power: float,
) -> tuple[Rows, float, float]:  # fmt: skip
    """`point_force` with damping, `rates` those of g; returns energy and power plus its own."""
    f, v = gradient_rows(bases, r, o), gradient_rows(rates, r, o)
    d, h = green_strain(f)
    e, g = strain_rate(f, v, lag)
    wmu, wp = r[o + 6 * LANES] * mu, r[o + 6 * LANES] * pressure
    energy += wmu * product(d, h)
    power += 2.0 * tau * wmu * product(e, g)
    d = (d[0] + tau * e[0], d[1] + tau * e[1], d[2] + tau * e[2])
    h = (h[0] + tau * g[0], h[1] + tau * g[1], h[2] + tau * g[2])
    return stress_force(f, d, h, r, o, wmu, wp), energy, power


@inlined
def point_det(g: Rows, r: Array, o: int) -> float:
    """Return det F at one point."""
    fx, fy, fz = gradient_rows(g, r, o)
    return (
        fx[0] * (fy[1] * fz[2] - fy[2] * fz[1])
        + fx[1] * (fy[2] * fz[0] - fy[0] * fz[2])
        + fx[2] * (fy[0] * fz[1] - fy[1] * fz[0])
    )
