"""Compiled kernels of the 8-node hexahedron: force, energy, det F, mean dilatation.

Total Lagrangian, St. Venant-Kirchhoff, 2 x 2 x 2 Gauss points q with volumes w_q, V = sum w_q:

    C = F^T F,  E = (C - I)/2,  e = sum_q w_q tr E_q / V                         (mean dilatation)
    W = sum_q w_q mu E_q:E_q + V lambda e^2 / 2                                  (element energy)
    S_q = lambda e I + 2 mu E_q,  f_a = dW/dx_a = sum_q w_q F_q S_q grad N_a

Only the volumetric term is reduced (selective reduced integration), so the element does not lock as
nu -> 1/2 and has no hourglass modes, and the force is the exact gradient of an energy.

Two things make it fast.
*Edges.* The covariant base vectors g_k = dx/dxi_k of a trilinear element need only the 12 edge
vectors: along xi_k each is bilinear in the other two coordinates, so 4 values per k serve 8 points.
*A frame of its own at each point.* With J = dX/dxi = Q R (Q a rotation, R upper triangular),
F Q = [g_1 g_2 g_3] R^-1. An isotropic law does not see Q: F S J^-T = (F Q)(Q^T S Q) R^-T. So a
point stores the 6 numbers of R^-1 and w instead of J^-1 and w, and two products become triangular.

Layout: blocks of LANES elements in structure-of-arrays form, so the compiler vectorises over lanes.
`reference[block, row*LANES + lane]`: rows 7q..7q+6 hold R^-1 (11, 12, 13, 22, 23, 33; 1/m) and w
(m^3) of the point nearest to corner q, row 56 mu (Pa), row 57 lambda/V (Pa/m^3).
Lanes past the last element have zero rows and repeat its nodes.
"""

from numba import njit, prange

from reference_fem.elements.blocks import LANES, add_buffers, first_touch, touched
from reference_fem.elements.protocol import Floats, Integers, Nodes

POINT_ROWS = 7
ROWS = 8 * POINT_ROWS + 2
# Rows of the scratch array: 24 nodal positions, later forces; 36 values of g_k; sum of w tr E; and
# one for what `first_touch` returns.
BASES = 24
DILATATION = BASES + 36
TOUCH = DILATATION + 1
SCRATCH_ROWS = TOUCH + 1
LOW = 0.21132486540518713  # 1/2 - 1/sqrt(12): the first Gauss point on [0, 1]

# No nnan or ninf: a NaN in the displacement must reach the audit, not be optimised away.
SAFE_MATH = {"contract", "nsz"}

Three = tuple[float, float, float]
Four = tuple[float, float, float, float]
Bases = tuple[Four, Four, Four]
Rows = tuple[Three, Three, Three]


@njit(cache=True, fastmath=SAFE_MATH, error_model="numpy", forceinline=True)
def at_gauss(e00: float, e10: float, e01: float, e11: float) -> Four:
    """Bilinear interpolation of 4 corner values to the 2 x 2 Gauss points (its own transpose)."""
    d, h = e10 - e00, e11 - e01
    p0, p1 = e00 + LOW * d, e10 - LOW * d
    q0, q1 = e01 + LOW * h, e11 - LOW * h
    d, h = q0 - p0, q1 - p1
    return p0 + LOW * d, p1 + LOW * h, q0 - LOW * d, q1 - LOW * h


@njit(cache=True, fastmath=SAFE_MATH, error_model="numpy", forceinline=True)
def base_vectors(s: Floats, row: int, lane: int) -> Bases:
    """One Cartesian component of g_1, g_2, g_3 (4 values each) from 8 nodal rows of scratch s."""
    o = row * LANES + lane
    x0, x1, x2, x3 = s[o], s[o + LANES], s[o + 2 * LANES], s[o + 3 * LANES]
    x4, x5, x6, x7 = s[o + 4 * LANES], s[o + 5 * LANES], s[o + 6 * LANES], s[o + 7 * LANES]
    return (
        at_gauss(x1 - x0, x2 - x3, x5 - x4, x6 - x7),
        at_gauss(x3 - x0, x2 - x1, x7 - x4, x6 - x5),
        at_gauss(x4 - x0, x5 - x1, x7 - x3, x6 - x2),
    )


@njit(cache=True, fastmath=SAFE_MATH, error_model="numpy", forceinline=True)
def base_forces(s: Floats, row: int, lane: int, c1: Four, c2: Four, c3: Four) -> None:
    """Transpose of `base_vectors`: 8 nodal rows of s from the forces conjugate to g_1, g_2, g_3."""
    o = row * LANES + lane
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


@njit(cache=True, fastmath=SAFE_MATH, error_model="numpy", forceinline=True)
def gradient_row(g1: float, g2: float, g3: float, r: Floats, o: int) -> Three:
    """One row of F Q = [g_1 g_2 g_3] R^-1, R^-1 at r[o], r[o + LANES] .. r[o + 5 LANES]."""
    return (
        g1 * r[o],
        g1 * r[o + LANES] + g2 * r[o + 3 * LANES],
        g1 * r[o + 2 * LANES] + g2 * r[o + 4 * LANES] + g3 * r[o + 5 * LANES],
    )


@njit(cache=True, fastmath=SAFE_MATH, error_model="numpy", forceinline=True)
def force_row(fx: Three, s1: Three, s2: Three, s3: Three, r: Floats, o: int) -> Three:
    """One row of w (F Q)(Q^T S Q) R^-T: the forces conjugate to that row of g_1, g_2, g_3."""
    p1 = fx[0] * s1[0] + fx[1] * s1[1] + fx[2] * s1[2]
    p2 = fx[0] * s2[0] + fx[1] * s2[1] + fx[2] * s2[2]
    p3 = fx[0] * s3[0] + fx[1] * s3[1] + fx[2] * s3[2]
    return (
        p1 * r[o] + p2 * r[o + LANES] + p3 * r[o + 2 * LANES],
        p2 * r[o + 3 * LANES] + p3 * r[o + 4 * LANES],
        p3 * r[o + 5 * LANES],
    )


@njit(cache=True, fastmath=SAFE_MATH, error_model="numpy", forceinline=True)
def dilatation(gx: Three, gy: Three, gz: Three, r: Floats, o: int) -> float:
    """Return w tr E at one point, m^3, from the rows of [g_1 g_2 g_3]."""
    fx = gradient_row(gx[0], gx[1], gx[2], r, o)
    fy = gradient_row(gy[0], gy[1], gy[2], r, o)
    fz = gradient_row(gz[0], gz[1], gz[2], r, o)
    xx = fx[0] * fx[0] + fx[1] * fx[1] + fx[2] * fx[2]
    yy = fy[0] * fy[0] + fy[1] * fy[1] + fy[2] * fy[2]
    zz = fz[0] * fz[0] + fz[1] * fz[1] + fz[2] * fz[2]
    return r[o + 6 * LANES] * (0.5 * (xx + yy + zz) - 1.5)


@njit(cache=True, fastmath=SAFE_MATH, error_model="numpy", forceinline=True)
def green_strain(fx: Three, fy: Three, fz: Three) -> tuple[Three, Three]:
    """2E = C - I in the point's frame, as (11, 22, 33), (12, 23, 13)."""
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


@njit(cache=True, fastmath=SAFE_MATH, error_model="numpy", forceinline=True)
def point_force(
    gx: Three, gy: Three, gz: Three, r: Floats, o: int, mu: float, pressure: float
) -> Rows:
    """Rows x, y, z of w F S J^-T: the forces conjugate to g_1, g_2, g_3 at one point."""
    fx = gradient_row(gx[0], gx[1], gx[2], r, o)
    fy = gradient_row(gy[0], gy[1], gy[2], r, o)
    fz = gradient_row(gz[0], gz[1], gz[2], r, o)
    (c11, c22, c33), (c12, c23, c13) = green_strain(fx, fy, fz)
    wmu, wp = r[o + 6 * LANES] * mu, r[o + 6 * LANES] * pressure
    s12, s23, s13 = wmu * c12, wmu * c23, wmu * c13
    s1 = (wmu * c11 + wp, s12, s13)
    s2 = (s12, wmu * c22 + wp, s23)
    s3 = (s13, s23, wmu * c33 + wp)
    return (
        force_row(fx, s1, s2, s3, r, o),
        force_row(fy, s1, s2, s3, r, o),
        force_row(fz, s1, s2, s3, r, o),
    )


@njit(cache=True, fastmath=SAFE_MATH, error_model="numpy", forceinline=True)
def collect(
    f0: Three, f1: Three, f2: Three, f3: Three, f4: Three, f5: Three, f6: Three, f7: Three
) -> Bases:
    """Sums over the two points that share a value of g_1, of g_2 and of g_3."""
    return (
        (f0[0] + f1[0], f2[0] + f3[0], f4[0] + f5[0], f6[0] + f7[0]),
        (f0[1] + f3[1], f1[1] + f2[1], f4[1] + f7[1], f5[1] + f6[1]),
        (f0[2] + f4[2], f1[2] + f5[2], f3[2] + f7[2], f2[2] + f6[2]),
    )


@njit(cache=True, fastmath=SAFE_MATH, error_model="numpy", forceinline=True)
def at_points(
    g: Bases,
) -> tuple[Three, Three, Three, Three, Three, Three, Three, Three]:
    """One Cartesian component of (g_1, g_2, g_3) at the 8 points."""
    g1, g2, g3 = g
    return (
        (g1[0], g2[0], g3[0]),
        (g1[0], g2[1], g3[1]),
        (g1[1], g2[1], g3[3]),
        (g1[1], g2[0], g3[2]),
        (g1[2], g2[2], g3[0]),
        (g1[2], g2[3], g3[1]),
        (g1[3], g2[3], g3[3]),
        (g1[3], g2[2], g3[2]),
    )


@njit(cache=True, fastmath=SAFE_MATH, error_model="numpy", forceinline=True)
def store_bases(s: Floats, row: int, lane: int, g: Bases) -> None:
    """Twelve rows of s: one Cartesian component of g_1, g_2, g_3."""
    o = row * LANES + lane
    for k in range(3):
        s[o], s[o + LANES], s[o + 2 * LANES], s[o + 3 * LANES] = g[k]
        o += 4 * LANES


@njit(cache=True, fastmath=SAFE_MATH, error_model="numpy", forceinline=True)
def load_bases(s: Floats, row: int, lane: int) -> Bases:
    """What `store_bases` stored."""
    o = row * LANES + lane
    h, t = o + 4 * LANES, o + 8 * LANES
    return (
        (s[o], s[o + LANES], s[o + 2 * LANES], s[o + 3 * LANES]),
        (s[h], s[h + LANES], s[h + 2 * LANES], s[h + 3 * LANES]),
        (s[t], s[t + LANES], s[t + 2 * LANES], s[t + 3 * LANES]),
    )


@njit(cache=True, fastmath=SAFE_MATH, error_model="numpy", forceinline=True)
def add_dilatation(s: Floats, r: Floats, q: int, a: int, b: int, c: int) -> None:
    """Add w tr E of point q, where g_1, g_2, g_3 take their values a, b, c, to row DILATATION."""
    for lane in range(LANES):
        o = BASES * LANES + lane
        gx = (s[o + a * LANES], s[o + (4 + b) * LANES], s[o + (8 + c) * LANES])
        gy = (s[o + (12 + a) * LANES], s[o + (16 + b) * LANES], s[o + (20 + c) * LANES])
        gz = (s[o + (24 + a) * LANES], s[o + (28 + b) * LANES], s[o + (32 + c) * LANES])
        p = lane + q * POINT_ROWS * LANES
        s[DILATATION * LANES + lane] += dilatation(gx, gy, gz, r, p)


@njit(cache=True, fastmath=SAFE_MATH, error_model="numpy")
def block_dilatation(s: Floats, r: Floats) -> None:
    """Rows BASES.. of s and, in row DILATATION, sum_q w tr E = V e, from the nodal positions.

    One loop over lanes for each point: 7 streams of r at a time, in the order of memory.
    """
    for lane in range(LANES):
        store_bases(s, BASES, lane, base_vectors(s, 0, lane))
        store_bases(s, BASES + 12, lane, base_vectors(s, 8, lane))
        store_bases(s, BASES + 24, lane, base_vectors(s, 16, lane))
        s[DILATATION * LANES + lane] = 0.0
    add_dilatation(s, r, 0, 0, 0, 0)
    add_dilatation(s, r, 1, 0, 1, 1)
    add_dilatation(s, r, 2, 1, 1, 3)
    add_dilatation(s, r, 3, 1, 0, 2)
    add_dilatation(s, r, 4, 2, 2, 0)
    add_dilatation(s, r, 5, 2, 3, 1)
    add_dilatation(s, r, 6, 3, 3, 3)
    add_dilatation(s, r, 7, 3, 2, 2)


@njit(cache=True, fastmath=SAFE_MATH, error_model="numpy")
def block_force(s: Floats, r: Floats) -> None:
    """Rows 0..23 of s: the nodal forces, from what `block_dilatation` left in s."""
    for lane in range(LANES):
        x = at_points(load_bases(s, BASES, lane))
        y = at_points(load_bases(s, BASES + 12, lane))
        z = at_points(load_bases(s, BASES + 24, lane))
        step = POINT_ROWS * LANES
        mu, p = r[56 * LANES + lane], r[57 * LANES + lane] * s[DILATATION * LANES + lane]
        f0 = point_force(x[0], y[0], z[0], r, lane, mu, p)
        f1 = point_force(x[1], y[1], z[1], r, lane + step, mu, p)
        f2 = point_force(x[2], y[2], z[2], r, lane + 2 * step, mu, p)
        f3 = point_force(x[3], y[3], z[3], r, lane + 3 * step, mu, p)
        f4 = point_force(x[4], y[4], z[4], r, lane + 4 * step, mu, p)
        f5 = point_force(x[5], y[5], z[5], r, lane + 5 * step, mu, p)
        f6 = point_force(x[6], y[6], z[6], r, lane + 6 * step, mu, p)
        f7 = point_force(x[7], y[7], z[7], r, lane + 7 * step, mu, p)
        cx = collect(f0[0], f1[0], f2[0], f3[0], f4[0], f5[0], f6[0], f7[0])
        cy = collect(f0[1], f1[1], f2[1], f3[1], f4[1], f5[1], f6[1], f7[1])
        cz = collect(f0[2], f1[2], f2[2], f3[2], f4[2], f5[2], f6[2], f7[2])
        base_forces(s, 0, lane, cx[0], cx[1], cx[2])
        base_forces(s, 8, lane, cy[0], cy[1], cy[2])
        base_forces(s, 16, lane, cz[0], cz[1], cz[2])


@njit(cache=True, fastmath=SAFE_MATH, error_model="numpy", forceinline=True)
def gather(points: Floats, displacement: Floats, nodes: Nodes, s: Floats) -> None:
    """Current nodal positions of a block, (LANES, 8) node numbers, into rows 0..23 of s."""
    for lane in range(LANES):
        for a in range(8):
            n = nodes[lane, a]
            s[a * LANES + lane] = points[n, 0] + displacement[n, 0]
            s[(8 + a) * LANES + lane] = points[n, 1] + displacement[n, 1]
            s[(16 + a) * LANES + lane] = points[n, 2] + displacement[n, 2]


@njit(cache=True, fastmath=SAFE_MATH, error_model="numpy", forceinline=True)
def scatter(s: Floats, nodes: Nodes, f: Floats) -> None:
    """Add rows 0..23 of s to the nodal forces."""
    for lane in range(LANES):
        for a in range(8):
            n = nodes[lane, a]
            f[n, 0] += s[a * LANES + lane]
            f[n, 1] += s[(8 + a) * LANES + lane]
            f[n, 2] += s[(16 + a) * LANES + lane]


@njit(cache=True, fastmath=SAFE_MATH, error_model="numpy")
def chunk_force(
    points: Floats,
    displacement: Floats,
    nodes: Nodes,
    reference: Floats,
    start: int,
    stop: int,
    s: Floats,
    f: Floats,
) -> None:
    """Add the forces of blocks start..stop-1 to f."""
    for block in range(start, stop):
        r = reference[block]
        s[TOUCH * LANES] = first_touch(r)
        gather(points, displacement, nodes[block], s)
        block_dilatation(s, r)
        block_force(s, r)
        scatter(s, nodes[block], f)


@njit(cache=True, parallel=True, fastmath=SAFE_MATH, error_model="numpy")
def internal_force(
    points: Floats,
    displacement: Floats,
    nodes: Nodes,
    reference: Floats,
    node_range: Integers,
    n_threads: int,
    scratch: Floats,
    buffers: Floats,
    out: Floats,
) -> None:
    """Internal force of the mesh, (n_nodes, 3), N.

    Blocks are dealt to threads in contiguous runs, each thread adds into a buffer of its own over
    the range of nodes that it touches, and the buffers are summed in the order of the threads: the
    same bits every time for one number of threads. Arrays as in `blocks.Blocks`.
    """
    n_nodes, n_blocks = len(points), len(nodes)
    for t in prange(n_threads):
        start, stop = t * n_blocks // n_threads, (t + 1) * n_blocks // n_threads
        low, high = touched(node_range, start, stop)
        s, f = scratch[t], buffers[t]
        f[low:high] = 0.0
        chunk_force(points, displacement, nodes, reference, start, stop, s, f)
    for t in prange(n_threads):
        first, last = t * n_nodes // n_threads, (t + 1) * n_nodes // n_threads
        add_buffers(buffers, node_range, n_threads, first, last, out)
