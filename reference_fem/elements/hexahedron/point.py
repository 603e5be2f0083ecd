"""One Gauss point of an 8-node hexahedron, in a frame of its own.

With J = dX/dxi = Q R (Q a rotation, R upper triangular), F Q = [g_1 g_2 g_3] R^-1. An isotropic law
does not see Q: F S J^-T = (F Q)(Q^T S Q) R^-T. So a point stores the 6 numbers of R^-1 and w
instead of J^-1 and w, and two products become triangular.

`r[o + row*LANES]`, row 0..6: R^-1 (11, 12, 13, 22, 23, 33; 1/m) and w (m^3).
"""

from reference_fem.arrays import Array
from reference_fem.compiled import inlined
from reference_fem.elements.blocks import LANES
from reference_fem.elements.hexahedron.edges import Rows, Three, cross, dot

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
def conjugate_row(p: Three, r: Array, o: int) -> Three:
    """One row of `conjugate`."""
    return (
        p[0] * r[o] + p[1] * r[o + LANES] + p[2] * r[o + 2 * LANES],
        p[1] * r[o + 3 * LANES] + p[2] * r[o + 4 * LANES],
        p[2] * r[o + 5 * LANES],
    )


@inlined
def conjugate(p: Rows, r: Array, o: int) -> Rows:
    """Rows x, y, z of w P J^-T, the forces conjugate to g_1, g_2, g_3, from those of w P Q."""
    return conjugate_row(p[0], r, o), conjugate_row(p[1], r, o), conjugate_row(p[2], r, o)


@inlined
def strain_rate(f: Rows, v: Rows, lag: float) -> tuple[Three, Three]:
    """2 dE/dt = F^T F' + F'^T F, F' = dF/dt, as (11, 22, 33), (12, 23, 13), from rows of F and F'.

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
    """E:E from 2E in the order of `strain_rate`."""
    squares = d[0] * d[0] + d[1] * d[1] + d[2] * d[2]
    return 0.25 * (squares + 2.0 * (h[0] * h[0] + h[1] * h[1] + h[2] * h[2]))


@inlined
def stress_rows(f: Rows, d: Three, h: Three, wmu: float, wp: float) -> Rows:
    """Rows x, y, z of w F S Q, S = p I + 2 mu E, from those of F Q.

    d, h : 2E in the order of `strain_rate`. wmu, wp : w mu and w p, J.
    """
    s12, s23, s13 = wmu * h[0], wmu * h[1], wmu * h[2]
    s1 = (wmu * d[0] + wp, s12, s13)
    s2 = (s12, wmu * d[1] + wp, s23)
    s3 = (s13, s23, wmu * d[2] + wp)
    fx, fy, fz = f
    return (
        (dot(fx, s1), dot(fx, s2), dot(fx, s3)),
        (dot(fy, s1), dot(fy, s2), dot(fy, s3)),
        (dot(fz, s1), dot(fz, s2), dot(fz, s3)),
    )


@inlined
def point_det(g: Rows, r: Array, o: int) -> float:
    """Return det F at one point."""
    fx, fy, fz = gradient_rows(g, r, o)
    return dot(fx, cross(fy, fz))
