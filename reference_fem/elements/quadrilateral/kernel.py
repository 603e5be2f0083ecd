"""Compiled kernels of the 4-node quadrilateral in plane stress: force, energy, det F.

Total Lagrangian, St. Venant-Kirchhoff, 2 x 2 Gauss points q with volumes w_q = thickness x area:

    C = F^T F,  E = (C - I)/2,  lambda* = 2 lambda mu/(lambda + 2 mu)            (S_zz = 0)
    W = sum_q w_q (mu E_q:E_q + lambda* (tr E_q)^2 / 2)                          (element energy)
    S = lambda* tr E I + 2 mu E,  f_a = dW/dx_a = sum_q w_q F_q S_q grad N_a

With damping, tau dE/dt is added to E in S.

Edges and frames as in `edges` and `point`: [g_1 g_2] from the 4 edge vectors,
F Q = [g_1 g_2] R^-1.
`reference[block, row*LANES + lane]`: rows 4q..4q+3 hold R^-1 (11, 12, 22; 1/m) and w (m^3) of the
point nearest to corner q, row 16 mu (Pa), row 17 lambda* (Pa), row 18, with damping, tau (s).
Scratch rows 0..3 hold x, 4..7 y of the nodes, row 8 energies, 9..16 velocities, 17 dissipation.
"""

import numpy as np

from reference_fem.arrays import Array, Index
from reference_fem.compiled import inlined, kernel
from reference_fem.elements.blocks import LANES, Blocks, Moving, Nodes, Stored, lane_sum
from reference_fem.elements.hexahedron.edges import LOW, Three
from reference_fem.elements.loops import implement
from reference_fem.elements.stress import lower
from reference_fem.elements.threads import OWN_HIGH, OWN_LOW, holds_own_nodes_only

POINT_ROWS = 4
RESULT = 8
VELOCITIES = RESULT + 1
POWER = VELOCITIES + 8
SCRATCH_ROWS = POWER + 1
RELAXATION = 4 * POINT_ROWS + 2  # row of `reference`: tau (s), where there is damping


class Quad4Blocks(Blocks):
    """Blocks of plane-stress quadrilaterals."""


Two = tuple[float, float]
Points = tuple[Two, Two, Two, Two]


@inlined
def base_vectors(s: Array, row: int, lane: int) -> Points:
    """One Cartesian component of (g_1, g_2) at the 4 points, from 4 nodal rows of scratch s."""
    o = row * LANES + lane
    x0, x1, x2, x3 = s[o], s[o + LANES], s[o + 2 * LANES], s[o + 3 * LANES]
    a, b = x1 - x0, x2 - x3
    c, d = x3 - x0, x2 - x1
    t, h = b - a, d - c
    a, b = a + LOW * t, b - LOW * t
    c, d = c + LOW * h, d - LOW * h
    return (a, c), (a, d), (b, d), (b, c)


@inlined
def base_forces(s: Array, row: int, lane: int, f0: Two, f1: Two, f2: Two, f3: Two) -> None:
    """Transpose of `base_vectors`: 4 nodal rows of s from the points' forces on (g_1, g_2)."""
    o = row * LANES + lane
    a, b = f0[0] + f1[0], f2[0] + f3[0]
    c, d = f0[1] + f3[1], f1[1] + f2[1]
    t, h = b - a, d - c
    a, b = a + LOW * t, b - LOW * t
    c, d = c + LOW * h, d - LOW * h
    s[o] = -a - c
    s[o + LANES] = a - d
    s[o + 2 * LANES] = b + d
    s[o + 3 * LANES] = c - b


@inlined
def gradient_row(g: Two, r: Array, o: int) -> Two:
    """One row of F Q = [g_1 g_2] R^-1."""
    return g[0] * r[o], g[0] * r[o + LANES] + g[1] * r[o + 2 * LANES]


@inlined
def green_strain(fx: Two, fy: Two) -> Three:
    """2E = C - I in the point's frame: 11, 22, 12."""
    return (
        fx[0] * fx[0] + fy[0] * fy[0] - 1.0,
        fx[1] * fx[1] + fy[1] * fy[1] - 1.0,
        fx[0] * fx[1] + fy[0] * fy[1],
    )


@inlined
def strain_rate(fx: Two, fy: Two, vx: Two, vy: Two, lag: float) -> Three:
    """2 dE/dt as `green_strain` gives 2E; see `hexahedron.point.strain_rate`."""
    gx = fx[0] - lag * vx[0], fx[1] - lag * vx[1]
    gy = fy[0] - lag * vy[0], fy[1] - lag * vy[1]
    return (
        2.0 * (gx[0] * vx[0] + gy[0] * vy[0]),
        2.0 * (gx[1] * vx[1] + gy[1] * vy[1]),
        gx[0] * vx[1] + gx[1] * vx[0] + gy[0] * vy[1] + gy[1] * vy[0],
    )


@inlined
def force_row(f: Two, s11: float, s22: float, s12: float, r: Array, o: int) -> Two:
    """One row of w (F Q)(Q^T S Q) R^-T."""
    p1, p2 = f[0] * s11 + f[1] * s12, f[0] * s12 + f[1] * s22
    return p1 * r[o] + p2 * r[o + LANES], p2 * r[o + 2 * LANES]


@inlined
def strain_energy(c: Three, w: float, mu: float, lame: float) -> float:
    """Energy w (mu E:E + lambda* (tr E)^2 / 2), J, from 2E."""
    trace = c[0] + c[1]
    shear = c[0] * c[0] + c[1] * c[1] + 2.0 * c[2] * c[2]
    return 0.25 * w * (mu * shear + 0.5 * lame * trace * trace)


@inlined
def stress_force(
    fx: Two, fy: Two, c: Three, r: Array, o: int, mu: float, lame: float
) -> tuple[Two, Two]:
    """Rows x, y of w F S J^-T, S of 2E = c: the forces conjugate to g_1, g_2 at one point."""
    w = r[o + 3 * LANES]
    pressure = 0.5 * w * lame * (c[0] + c[1])
    wmu = w * mu
    s11, s22, s12 = wmu * c[0] + pressure, wmu * c[1] + pressure, wmu * c[2]
    return force_row(fx, s11, s22, s12, r, o), force_row(fy, s11, s22, s12, r, o)


@inlined
def point_force(
    gx: Two, gy: Two, hx: Two, hy: Two, r: Array, o: int, mu: float, lame: float, tau: float,
    lag: float | None,
) -> tuple[Two, Two, float, float]:  # fmt: skip
    """`stress_force` of the point's own strains; its energy, J, and what damping dissipates, W.

    h : rates of g, of which there is damping with a lag alone (see `strain_rate`). Where the caller
        that inlines this does not use energy or dissipation, they are not computed.
    """
    fx, fy = gradient_row(gx, r, o), gradient_row(gy, r, o)
    c, w = green_strain(fx, fy), r[o + 3 * LANES]
    both, power = c, 0.0
    if lag is not None:
        d = strain_rate(fx, fy, gradient_row(hx, r, o), gradient_row(hy, r, o), lag)
        both = (c[0] + tau * d[0], c[1] + tau * d[1], c[2] + tau * d[2])
        power = 2.0 * tau * strain_energy(d, w, mu, lame)
    x, y = stress_force(fx, fy, both, r, o, mu, lame)
    return x, y, strain_energy(c, w, mu, lame), power


@inlined
def lane_force(s: Array, r: Array, lane: int, lag: float | None) -> tuple[float, float]:
    """One element's forces in place of its positions; its energy, J, and dissipation, W."""
    step = POINT_ROWS * LANES
    x, y = base_vectors(s, 0, lane), base_vectors(s, 4, lane)
    mu, lame, tau = r[16 * LANES + lane], r[17 * LANES + lane], 0.0
    v, w = x, y  # without a lag not used
    if lag is not None:
        v, w = base_vectors(s, VELOCITIES, lane), base_vectors(s, VELOCITIES + 4, lane)
        tau = r[RELAXATION * LANES + lane]
    f0 = point_force(x[0], y[0], v[0], w[0], r, lane, mu, lame, tau, lag)
    f1 = point_force(x[1], y[1], v[1], w[1], r, lane + step, mu, lame, tau, lag)
    f2 = point_force(x[2], y[2], v[2], w[2], r, lane + 2 * step, mu, lame, tau, lag)
    f3 = point_force(x[3], y[3], v[3], w[3], r, lane + 3 * step, mu, lame, tau, lag)
    base_forces(s, 0, lane, f0[0], f1[0], f2[0], f3[0])
    base_forces(s, 4, lane, f0[1], f1[1], f2[1], f3[1])
    return (f0[2] + f1[2]) + (f2[2] + f3[2]), (f0[3] + f1[3]) + (f2[3] + f3[3])


@kernel
def block_force(s: Array, r: Array, stored: Stored, lag: float | None) -> None:
    """Rows 0..7 of s: positions in, forces out; with a lag damped ones, from rows VELOCITIES.. too.

    Where energies are `stored`, row RESULT of s: those of the elements, J. With a lag row POWER:
    what they dissipate, W.
    """
    for lane in range(LANES):
        energy, power = lane_force(s, r, lane, lag)
        if stored is not None:
            s[RESULT * LANES + lane] = energy
        if lag is not None:
            s[POWER * LANES + lane] = power


@inlined
def gather(values: Array, more: Array | None, nodes: Nodes, s: Array, row: int) -> None:
    """Nodal vectors (n_nodes, 2) of a block, (LANES, 4) node numbers, into 8 rows of s.

    Those of `values`, with those of `more`, if it is not None, added.
    """
    for lane in range(LANES):
        for a in range(4):
            n = nodes[lane, a]
            x, y = values[n, 0], values[n, 1]
            if more is not None:
                x, y = x + more[n, 0], y + more[n, 1]
            s[(row + a) * LANES + lane] = x
            s[(row + 4 + a) * LANES + lane] = y


@inlined
def scatter(s: Array, blocks: Blocks, block: int, share: Index, t: int, out: Array) -> None:
    """Add rows 0..7 of s to the nodal forces, those of the seam to thread t's buffer."""
    nodes, seam = blocks.nodes[block], blocks.buffers[t]
    inside = holds_own_nodes_only(blocks, block, share)
    for lane in range(LANES):
        for a in range(4):
            n = nodes[lane, a]
            f = out if inside or share[OWN_LOW] <= n < share[OWN_HIGH] else seam
            f[n, 0] += s[a * LANES + lane]
            f[n, 1] += s[(4 + a) * LANES + lane]


@kernel
def add_force(
    blocks: Blocks, u: Array, block: int, share: Index, t: int, out: Array, stored: Stored,
    moving: Moving,
) -> None:  # fmt: skip
    """See `loops`."""
    s = blocks.scratch[t]
    r = blocks.reference[block]
    gather(blocks.points, u, blocks.nodes[block], s, 0)
    if moving is not None and lane_sum(0.0, r, RELAXATION) > 0.0:
        velocity, lag, power = moving
        gather(velocity, None, blocks.nodes[block], s, VELOCITIES)
        block_force(s, r, stored, lag)
        power[t] = lane_sum(power[t], s, POWER)
    else:
        block_force(s, r, stored, None)
    scatter(s, blocks, block, share, t, out)
    if stored is not None:
        stored[t, 0] += lane_sum(0.0, s, RESULT)


@kernel
def least_det(blocks: Blocks, displacement: Array, block: int, s: Array) -> float:
    """See `loops`."""
    smallest = np.inf
    r = blocks.reference[block]
    gather(blocks.points, displacement, blocks.nodes[block], s, 0)
    for lane in range(min(LANES, blocks.n_cells - block * LANES)):
        x, y = base_vectors(s, 0, lane), base_vectors(s, 4, lane)
        for q in range(4):
            o = lane + q * POINT_ROWS * LANES
            fx, fy = gradient_row(x[q], r, o), gradient_row(y[q], r, o)
            smallest = lower(smallest, fx[0] * fy[1] - fx[1] * fy[0])
    return float(smallest)


implement(Quad4Blocks, add_force, least_det)
