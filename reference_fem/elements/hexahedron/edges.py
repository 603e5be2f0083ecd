"""Edges of an 8-node hexahedron: its covariant base vectors at the 2 x 2 x 2 Gauss points.

The base vectors g_k = dx/dxi_k of a trilinear element need only the 12 edge vectors: along xi_k
each is bilinear in the other two coordinates, so 4 values per k serve 8 points.
"""

from reference_fem.arrays import Array
from reference_fem.compiled import inlined
from reference_fem.elements.blocks import LANES

LOW = 0.21132486540518713  # 1/2 - 1/sqrt(12): the first Gauss point on [0, 1]

Three = tuple[float, float, float]
Four = tuple[float, float, float, float]
Bases = tuple[Four, Four, Four]
Rows = tuple[Three, Three, Three]


@inlined
def dot(a: Three, b: Three) -> float:
    """Return a . b."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@inlined
def cross(a: Three, b: Three) -> Three:
    """Return a x b."""
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


@inlined
def at_gauss(e00: float, e10: float, e01: float, e11: float) -> Four:
    """Bilinear interpolation of 4 corner values to the 2 x 2 Gauss points (its own transpose)."""
    d, h = e10 - e00, e11 - e01
    p0, p1 = e00 + LOW * d, e10 - LOW * d
    q0, q1 = e01 + LOW * h, e11 - LOW * h
    d, h = q0 - p0, q1 - p1
    return p0 + LOW * d, p1 + LOW * h, q0 - LOW * d, q1 - LOW * h


@inlined
def base_vectors(s: Array, row: int, lane: int) -> Bases:
    """One Cartesian component of g_1, g_2, g_3 (4 values each) from 8 nodal rows of scratch s."""
    o = row * LANES + lane
    x0, x1, x2, x3 = s[o], s[o + LANES], s[o + 2 * LANES], s[o + 3 * LANES]
    x4, x5, x6, x7 = s[o + 4 * LANES], s[o + 5 * LANES], s[o + 6 * LANES], s[o + 7 * LANES]
    return (
        at_gauss(x1 - x0, x2 - x3, x5 - x4, x6 - x7),
        at_gauss(x3 - x0, x2 - x1, x7 - x4, x6 - x5),
        at_gauss(x4 - x0, x5 - x1, x7 - x3, x6 - x2),
    )


@inlined
def base_forces(s: Array, row: int, lane: int, c: Bases) -> None:
    """Transpose of `base_vectors`: 8 nodal rows of s from the forces conjugate to g_1, g_2, g_3."""
    o, (c1, c2, c3) = row * LANES + lane, c
    a01, a32, a45, a76 = at_gauss(c1[0], c1[1], c1[2], c1[3])
    b03, b12, b47, b56 = at_gauss(c2[0], c2[1], c2[2], c2[3])
    d04, d15, d37, d26 = at_gauss(c3[0], c3[1], c3[2], c3[3])
    s[o] = -a01 - b03 - d04
    s[o + LANES] = a01 - b12 - d15
    s[o + 2 * LANES] = a32 + b12 - d26
    s[o + 3 * LANES] = b03 - a32 - d37
    s[o + 4 * LANES] = d04 - a45 - b47
    s[o + 5 * LANES] = a45 + d15 - b56
    s[o + 6 * LANES] = a76 + b56 + d26
    s[o + 7 * LANES] = b47 + d37 - a76


@inlined
def collect(
    f0: Three, f1: Three, f2: Three, f3: Three, f4: Three, f5: Three, f6: Three, f7: Three
) -> Bases:
    """Sums over the two points that share a value of g_1, of g_2 and of g_3."""
    return (
        (f0[0] + f1[0], f2[0] + f3[0], f4[0] + f5[0], f6[0] + f7[0]),
        (f0[1] + f3[1], f1[1] + f2[1], f4[1] + f7[1], f5[1] + f6[1]),
        (f0[2] + f4[2], f1[2] + f5[2], f3[2] + f7[2], f2[2] + f6[2]),
    )


@inlined
def nodal_forces(
    s: Array, lane: int, f0: Rows, f1: Rows, f2: Rows, f3: Rows, f4: Rows, f5: Rows, f6: Rows,
    f7: Rows,
) -> None:  # fmt: skip
    """24 nodal rows of s from rows x, y, z of the forces conjugate to g_1, g_2, g_3 at 8 points."""
    base_forces(s, 0, lane, collect(f0[0], f1[0], f2[0], f3[0], f4[0], f5[0], f6[0], f7[0]))
    base_forces(s, 8, lane, collect(f0[1], f1[1], f2[1], f3[1], f4[1], f5[1], f6[1], f7[1]))
    base_forces(s, 16, lane, collect(f0[2], f1[2], f2[2], f3[2], f4[2], f5[2], f6[2], f7[2]))


@inlined
def store_bases(s: Array, row: int, lane: int, g: Bases) -> None:
    """Twelve rows of s: one Cartesian component of g_1, g_2, g_3."""
    o = row * LANES + lane
    for k in range(3):
        s[o], s[o + LANES], s[o + 2 * LANES], s[o + 3 * LANES] = g[k]
        o += 4 * LANES
