"""Compiled kernels of the 1-point hexahedron: force, energies, det F, stress.

Flanagan and Belytschko (1981) in total Lagrangian form. With the mean gradients
b_a = 1/V int grad N_a dV, reference corners X_a and the four hourglass vectors h^n of +-1,

    F = sum_a x_a b_a^T,  E = (F^T F - I)/2,  S = lambda tr E I + 2 mu E,
    g^n_a = h^n_a - G^n . b_a,  G^n = sum_a h^n_a X_a,     q^n = sum_a g^n_a x_a
    W = V (mu E:E + lambda (tr E)^2 / 2) + k/2 sum_n |q^n|^2
    f_a = V F S b_a + k sum_n g^n_a q^n

g^n is orthogonal to every linear motion, so a patch has no hourglass energy, and |q^n|^2 does not
see rotations: the force is the exact gradient of W however large the rotation.
k = c E V B/72 with B = sum_a b_a . b_a; c = 1 gives a cube its exact stiffness in pure bending.

Layout as in `hex8_kernel`: rows 8 j + a hold b_aj (1/m), then 3 n + j G^n_j (m), V mu, V lambda, k.
"""

import numpy as np
from numba import njit, prange

from reference_fem.elements.blocks import LANES, add_buffers, first_touch, touched
from reference_fem.elements.hex8_kernel import SAFE_MATH, Four, Three, gather, scatter
from reference_fem.elements.protocol import Floats, Integers, Nodes
from reference_fem.elements.stress import cauchy_stress

SHAPES = 24  # first of the 12 rows of G
MU, LAME, STIFFNESS = SHAPES + 12, SHAPES + 13, SHAPES + 14
ROWS = STIFFNESS + 1
TOUCH = 24
SCRATCH_ROWS = TOUCH + 1

Eight = tuple[float, float, float, float, float, float, float, float]


@njit(cache=True, fastmath=SAFE_MATH, error_model="numpy", forceinline=True)
def weighted(x: Eight, r: Floats, o: int) -> float:
    """Sum of x_a b_a over the corners; written out, or the compiler does not vectorise lanes."""
    low = x[0] * r[o] + x[1] * r[o + LANES] + x[2] * r[o + 2 * LANES] + x[3] * r[o + 3 * LANES]
    o += 4 * LANES
    high = x[4] * r[o] + x[5] * r[o + LANES] + x[6] * r[o + 2 * LANES] + x[7] * r[o + 3 * LANES]
    return low + high


@njit(cache=True, fastmath=SAFE_MATH, error_model="numpy", forceinline=True)
def gradient_row(s: Floats, row: int, lane: int, r: Floats) -> Three:
    """One row of F."""
    o = row * LANES + lane
    x = (
        s[o], s[o + LANES], s[o + 2 * LANES], s[o + 3 * LANES],
        s[o + 4 * LANES], s[o + 5 * LANES], s[o + 6 * LANES], s[o + 7 * LANES],
    )  # fmt: skip
    return (
        weighted(x, r, lane),
        weighted(x, r, lane + 8 * LANES),
        weighted(x, r, lane + 16 * LANES),
    )


@njit(cache=True, fastmath=SAFE_MATH, error_model="numpy", forceinline=True)
def hourglass_row(s: Floats, row: int, lane: int, f: Three, r: Floats) -> Four:
    """One component of q^1..q^4: sums with the signs xi eta, eta zeta, xi zeta, xi eta zeta."""
    o = row * LANES + lane
    x0, x1, x2, x3 = s[o], s[o + LANES], s[o + 2 * LANES], s[o + 3 * LANES]
    x4, x5, x6, x7 = s[o + 4 * LANES], s[o + 5 * LANES], s[o + 6 * LANES], s[o + 7 * LANES]
    low, high = (x0 - x1) + (x2 - x3), (x4 - x5) + (x6 - x7)
    even, odd = (x0 - x2) - (x4 - x6), (x1 - x3) - (x5 - x7)
    g = lane + SHAPES * LANES
    n = 3 * LANES
    return (
        low + high - linear_part(f, r, g),
        even + odd - linear_part(f, r, g + n),
        even - odd - linear_part(f, r, g + 2 * n),
        high - low - linear_part(f, r, g + 3 * n),
    )


@njit(cache=True, fastmath=SAFE_MATH, error_model="numpy", forceinline=True)
def linear_part(f: Three, r: Floats, o: int) -> float:
    """One component of F G^n."""
    return f[0] * r[o] + f[1] * r[o + LANES] + f[2] * r[o + 2 * LANES]


@njit(cache=True, fastmath=SAFE_MATH, error_model="numpy", forceinline=True)
def force_rows(
    s: Floats, row: int, lane: int, f: Three, s1: Three, s2: Three, s3: Three, r: Floats
) -> None:
    """Overwrite one component of the 8 positions by that of the 8 forces."""
    k = r[lane + STIFFNESS * LANES]
    q = hourglass_row(s, row, lane, f, r)
    q1, q2, q3, q4 = k * q[0], k * q[1], k * q[2], k * q[3]
    t1 = f[0] * s1[0] + f[1] * s1[1] + f[2] * s1[2]
    t2 = f[0] * s2[0] + f[1] * s2[1] + f[2] * s2[2]
    t3 = f[0] * s3[0] + f[1] * s3[1] + f[2] * s3[2]
    g, n = lane + SHAPES * LANES, 3 * LANES
    t1 -= q1 * r[g] + q2 * r[g + n] + q3 * r[g + 2 * n] + q4 * r[g + 3 * n]
    g += LANES
    t2 -= q1 * r[g] + q2 * r[g + n] + q3 * r[g + 2 * n] + q4 * r[g + 3 * n]
    g += LANES
    t3 -= q1 * r[g] + q2 * r[g + n] + q3 * r[g + 2 * n] + q4 * r[g + 3 * n]
    o, b = row * LANES + lane, lane
    low, high = q1 - q4, q1 + q4
    even, odd = q2 + q3, q2 - q3
    s[o] = corner_force(t1, t2, t3, r, b) + low + even
    s[o + LANES] = corner_force(t1, t2, t3, r, b + LANES) + odd - low
    s[o + 2 * LANES] = corner_force(t1, t2, t3, r, b + 2 * LANES) + low - even
    s[o + 3 * LANES] = corner_force(t1, t2, t3, r, b + 3 * LANES) - odd - low
    s[o + 4 * LANES] = corner_force(t1, t2, t3, r, b + 4 * LANES) + high - even
    s[o + 5 * LANES] = corner_force(t1, t2, t3, r, b + 5 * LANES) - odd - high
    s[o + 6 * LANES] = corner_force(t1, t2, t3, r, b + 6 * LANES) + high + even
    s[o + 7 * LANES] = corner_force(t1, t2, t3, r, b + 7 * LANES) + odd - high


@njit(cache=True, fastmath=SAFE_MATH, error_model="numpy", forceinline=True)
def corner_force(t1: float, t2: float, t3: float, r: Floats, o: int) -> float:
    """Product of a row of stress with b_a."""
    return t1 * r[o] + t2 * r[o + 8 * LANES] + t3 * r[o + 16 * LANES]


@njit(cache=True, fastmath=SAFE_MATH, error_model="numpy")
def block_force(s: Floats, r: Floats) -> None:
    """Rows 0..23 of s: the nodal forces in place of the nodal positions."""
    for lane in range(LANES):
        fx = gradient_row(s, 0, lane, r)
        fy = gradient_row(s, 8, lane, r)
        fz = gradient_row(s, 16, lane, r)
        mu, lame = r[lane + MU * LANES], r[lane + LAME * LANES]
        c11 = fx[0] * fx[0] + fy[0] * fy[0] + fz[0] * fz[0] - 1.0
        c22 = fx[1] * fx[1] + fy[1] * fy[1] + fz[1] * fz[1] - 1.0
        c33 = fx[2] * fx[2] + fy[2] * fy[2] + fz[2] * fz[2] - 1.0
        s12 = mu * (fx[0] * fx[1] + fy[0] * fy[1] + fz[0] * fz[1])
        s23 = mu * (fx[1] * fx[2] + fy[1] * fy[2] + fz[1] * fz[2])
        s13 = mu * (fx[0] * fx[2] + fy[0] * fy[2] + fz[0] * fz[2])
        p = 0.5 * lame * (c11 + c22 + c33)
        s1, s2, s3 = (mu * c11 + p, s12, s13), (s12, mu * c22 + p, s23), (s13, s23, mu * c33 + p)
        force_rows(s, 0, lane, fx, s1, s2, s3, r)
        force_rows(s, 8, lane, fy, s1, s2, s3, r)
        force_rows(s, 16, lane, fz, s1, s2, s3, r)


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
    """Internal force of the mesh, (n_nodes, 3), N; threads as in `hex8_kernel.internal_force`."""
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


@njit(cache=True, error_model="numpy")
def deformation(x: Floats, gradients: Floats, f: Floats) -> None:
    """F (3, 3) of one element, x and gradients (8, 3)."""
    for i in range(3):
        for j in range(3):
            f[i, j] = 0.0
            for a in range(8):
                f[i, j] += x[a, i] * gradients[a, j]


@njit(cache=True, error_model="numpy")
def energies(
    points: Floats,
    displacement: Floats,
    cells: Integers,
    gradients: Floats,
    signs: Floats,
    shapes: Floats,
    moduli: Floats,
) -> tuple[float, float]:
    """Energy of the strains and of the hourglass modes, J, from the definitions above.

    gradients (n, 8, 3), signs (4, 8) h^n, shapes (n, 4, 3) G^n, moduli (n, 3) V mu, V lambda, k.
    """
    strain, hourglass = 0.0, 0.0
    f, x = np.empty((3, 3)), np.empty((8, 3))
    for e in range(len(cells)):
        for a in range(8):
            for i in range(3):
                x[a, i] = points[cells[e, a], i] + displacement[cells[e, a], i]
        deformation(x, gradients[e], f)
        trace, squares = 0.0, 0.0
        for i in range(3):
            for j in range(3):
                c = f[0, i] * f[0, j] + f[1, i] * f[1, j] + f[2, i] * f[2, j]
                if i == j:
                    c -= 1.0
                    trace += 0.5 * c
                squares += 0.25 * c * c
        strain += moduli[e, 0] * squares + 0.5 * moduli[e, 1] * trace * trace
        for n in range(4):
            for i in range(3):
                q = 0.0
                for a in range(8):
                    q += signs[n, a] * x[a, i]
                for j in range(3):
                    q -= f[i, j] * shapes[e, n, j]
                hourglass += 0.5 * moduli[e, 2] * q * q
    return strain, hourglass


@njit(cache=True, error_model="numpy")
def min_det(points: Floats, displacement: Floats, cells: Integers, gradients: Floats) -> float:
    """Smallest det F over the elements; NaN if any of them is NaN."""
    smallest = np.inf
    f, x = np.empty((3, 3)), np.empty((8, 3))
    for e in range(len(cells)):
        for a in range(8):
            for i in range(3):
                x[a, i] = points[cells[e, a], i] + displacement[cells[e, a], i]
        deformation(x, gradients[e], f)
        det = (
            f[0, 0] * (f[1, 1] * f[2, 2] - f[1, 2] * f[2, 1])
            + f[0, 1] * (f[1, 2] * f[2, 0] - f[1, 0] * f[2, 2])
            + f[0, 2] * (f[1, 0] * f[2, 1] - f[1, 1] * f[2, 0])
        )
        if np.isnan(det):
            return float(det)
        smallest = min(smallest, det)
    return float(smallest)


@njit(cache=True, error_model="numpy")
def stresses(
    points: Floats,
    displacement: Floats,
    cells: Integers,
    gradients: Floats,
    mu: Floats,
    lame: Floats,
    chosen: Integers,
    stress: Floats,
) -> None:
    """Cauchy stress of the chosen elements into stress (n, 6), Pa."""
    f, x = np.empty((3, 3)), np.empty((8, 3))
    for row in range(len(chosen)):
        e = chosen[row]
        for a in range(8):
            for i in range(3):
                x[a, i] = points[cells[e, a], i] + displacement[cells[e, a], i]
        deformation(x, gradients[e], f)
        trace = -1.5
        for i in range(3):
            for j in range(3):
                trace += 0.5 * f[i, j] * f[i, j]
        cauchy_stress(f, mu[e], lame[e] * trace, stress[row])
