"""Compiled kernels of the 8-node hexahedron with 2 x 2 x 2 Gauss points q, for any `Law`.

Total Lagrangian, with the points' volumes w_q:

    v = sum_q w_q v_q,  p = p(v)          (v_q: tr E or det F; the same pressure at all points)
    f_a = sum_q w_q P_q grad N_a,  P_q the law's stress of F_q and p, the gradient of its energy

Only the volumetric term is reduced (selective reduced integration), so the element does not lock as
nu -> 1/2 and has no hourglass modes, and the force is the exact gradient of an energy.

The covariant base vectors come from the edges (`edges`), each point has a frame of its own
(`point`).

Layout: blocks of LANES elements in structure-of-arrays form, so the compiler vectorises over lanes.
`reference[block, row*LANES + lane]`: rows 7q..7q+6 hold R^-1 (11, 12, 13, 22, 23, 33; 1/m) and w
(m^3) of the point nearest to corner q, row MU mu (Pa), the next ones the law's other constants.
Where there is damping, its last row tau (s); a block without any takes the forces without damping.
Lanes past the last element have zero rows and repeat its nodes.
"""

import numpy as np

from reference_fem.arrays import Array, Index
from reference_fem.compiled import entry, inlined, kernel
from reference_fem.elements.alignment import aligned_frame
from reference_fem.elements.blocks import LANES, Blocks, Moving, Stored, lane_sum
from reference_fem.elements.hexahedron.edges import Rows, base_vectors, nodal_forces, store_bases
from reference_fem.elements.hexahedron.law import (
    Law,
    damped_point,
    damping,
    energy,
    law_of,
    point,
    pressure,
    volume,
)
from reference_fem.elements.hexahedron.nodes import gather, scatter
from reference_fem.elements.hexahedron.point import (
    POINT_ROWS,
    gradient_rows,
    point_det,
    strain_rate,
)
from reference_fem.elements.stress import lower

MU = 8 * POINT_ROWS  # row of `reference`
# Rows of the scratch array: 24 nodal positions, later forces; 36 values of g_k; v; energies or
# dets. With damping: 24 nodal velocities; 36 values of their g_k; sum of w tr dE/dt; dissipation.
BASES = 24
VOLUME = BASES + 36
RESULT = VOLUME + 1
VELOCITIES = RESULT + 1
RATES = VELOCITIES + 24
DILATATION_RATE = RATES + 36
POWER = DILATATION_RATE + 1
SCRATCH_ROWS = POWER + 1
Values = tuple[int, int, int]
# Which of the 4 values of g_1, g_2, g_3 the 8 points take.
VALUES = (
    (0, 0, 0), (0, 1, 1), (1, 1, 3), (1, 0, 2), (2, 2, 0), (2, 3, 1), (3, 3, 3), (3, 2, 2),
)  # fmt: skip


@inlined
def point_bases(s: Array, row: int, lane: int, values: Values) -> Rows:
    """Rows of [g_1 g_2 g_3] at one point, from the 36 rows of s that `store_bases` filled."""
    a, b, c = values
    o = row * LANES + lane
    return (
        (s[o + a * LANES], s[o + (4 + b) * LANES], s[o + (8 + c) * LANES]),
        (s[o + (12 + a) * LANES], s[o + (16 + b) * LANES], s[o + (20 + c) * LANES]),
        (s[o + (24 + a) * LANES], s[o + (28 + b) * LANES], s[o + (32 + c) * LANES]),
    )


@inlined
def all_bases(
    s: Array, row: int, lane: int
) -> tuple[Rows, Rows, Rows, Rows, Rows, Rows, Rows, Rows]:
    """`point_bases` of the 8 points."""
    return (
        point_bases(s, row, lane, VALUES[0]),
        point_bases(s, row, lane, VALUES[1]),
        point_bases(s, row, lane, VALUES[2]),
        point_bases(s, row, lane, VALUES[3]),
        point_bases(s, row, lane, VALUES[4]),
        point_bases(s, row, lane, VALUES[5]),
        point_bases(s, row, lane, VALUES[6]),
        point_bases(s, row, lane, VALUES[7]),
    )


@inlined
def store_all_bases(s: Array, row: int, nodal: int) -> None:
    """36 rows of s: g_k of the vectors in 24 nodal rows; zeros in the next row, for a sum."""
    for lane in range(LANES):
        for k in range(3):
            store_bases(s, row + 12 * k, lane, base_vectors(s, nodal + 8 * k, lane))
        s[(row + 36) * LANES + lane] = 0.0


@inlined
def add_volume(law: Law, s: Array, r: Array, q: int, values: Values, lag: float | None) -> None:
    """Add the part of point q, where g_1, g_2, g_3 take these values, to row VOLUME.

    With a lag add also w tr dE/dt, m^3/s, to row DILATATION_RATE.
    """
    for lane in range(LANES):
        o = lane + q * POINT_ROWS * LANES
        f = gradient_rows(point_bases(s, BASES, lane, values), r, o)
        s[VOLUME * LANES + lane] += volume(law, f, r, o)
        if lag is not None:
            v = gradient_rows(point_bases(s, RATES, lane, values), r, o)
            d, _ = strain_rate(f, v, lag)
            s[DILATATION_RATE * LANES + lane] += 0.5 * r[o + 6 * LANES] * (d[0] + d[1] + d[2])


@kernel
def block_volume(law: Law, s: Array, r: Array, lag: float | None) -> None:
    """Rows BASES.. of s and, in row VOLUME, v, from the nodal positions.

    With a lag (see `strain_rate`) also rows RATES.., from the nodal velocities. One loop over lanes
    for each point: 7 streams of r at a time, in the order of memory.
    """
    store_all_bases(s, BASES, 0)
    if lag is not None:
        store_all_bases(s, RATES, VELOCITIES)
    add_volume(law, s, r, 0, VALUES[0], lag)
    add_volume(law, s, r, 1, VALUES[1], lag)
    add_volume(law, s, r, 2, VALUES[2], lag)
    add_volume(law, s, r, 3, VALUES[3], lag)
    add_volume(law, s, r, 4, VALUES[4], lag)
    add_volume(law, s, r, 5, VALUES[5], lag)
    add_volume(law, s, r, 6, VALUES[6], lag)
    add_volume(law, s, r, 7, VALUES[7], lag)


@inlined
def lane_force(law: Law, s: Array, r: Array, lane: int) -> float:
    """One element's forces, from what `block_volume` left in s; its energy, J."""
    x = all_bases(s, BASES, lane)
    step = POINT_ROWS * LANES
    mu, v = r[MU * LANES + lane], s[VOLUME * LANES + lane]
    p = pressure(law, r, lane, v)
    f0, e0 = point(law, x[0], r, lane, mu, p)
    f1, e1 = point(law, x[1], r, lane + step, mu, p)
    f2, e2 = point(law, x[2], r, lane + 2 * step, mu, p)
    f3, e3 = point(law, x[3], r, lane + 3 * step, mu, p)
    f4, e4 = point(law, x[4], r, lane + 4 * step, mu, p)
    f5, e5 = point(law, x[5], r, lane + 5 * step, mu, p)
    f6, e6 = point(law, x[6], r, lane + 6 * step, mu, p)
    f7, e7 = point(law, x[7], r, lane + 7 * step, mu, p)
    nodal_forces(s, lane, f0, f1, f2, f3, f4, f5, f6, f7)
    return ((e0 + e1) + (e2 + e3)) + ((e4 + e5) + (e6 + e7)) + energy(law, r, lane, v)


@inlined
def damped_lane(law: Law, s: Array, r: Array, lane: int, lag: float) -> tuple[float, float]:
    """`lane_force` with damping, and its dissipation, W."""
    x, u = all_bases(s, BASES, lane), all_bases(s, RATES, lane)
    step, mu = POINT_ROWS * LANES, r[MU * LANES + lane]
    summed, rate = s[VOLUME * LANES + lane], s[DILATATION_RATE * LANES + lane]
    p, viscous, tau, e, d = damping(law, r, lane, summed, rate)
    c = mu, tau, p, viscous, lag
    f0, e, d = damped_point(law, x[0], u[0], r, lane, c, e, d)
    f1, e, d = damped_point(law, x[1], u[1], r, lane + step, c, e, d)
    f2, e, d = damped_point(law, x[2], u[2], r, lane + 2 * step, c, e, d)
    f3, e, d = damped_point(law, x[3], u[3], r, lane + 3 * step, c, e, d)
    f4, e, d = damped_point(law, x[4], u[4], r, lane + 4 * step, c, e, d)
    f5, e, d = damped_point(law, x[5], u[5], r, lane + 5 * step, c, e, d)
    f6, e, d = damped_point(law, x[6], u[6], r, lane + 6 * step, c, e, d)
    f7, e, d = damped_point(law, x[7], u[7], r, lane + 7 * step, c, e, d)
    nodal_forces(s, lane, f0, f1, f2, f3, f4, f5, f6, f7)
    return e, d


@kernel
def block_force(law: Law, s: Array, r: Array, stored: Stored, lag: float | None) -> None:
    """Rows 0..23 of s: the nodal forces, from what `block_volume` left in s with the same lag.

    Where energies are `stored`, row RESULT of s: those of the elements, J. With a lag row POWER:
    what they dissipate, W.
    """
    aligned_frame()
    for lane in range(LANES):
        if lag is None:
            stores = lane_force(law, s, r, lane)
        else:
            stores, s[POWER * LANES + lane] = damped_lane(law, s, r, lane, lag)
        if stored is not None:
            s[RESULT * LANES + lane] = stores


@kernel
def add_force(
    blocks: Blocks, u: Array, block: int, share: Index, t: int, out: Array, stored: Stored,
    moving: Moving,
) -> None:  # fmt: skip
    """See `loops`."""
    law = law_of(blocks)
    s = blocks.scratch[t]
    r = blocks.reference[block]
    gather(blocks.points, u, blocks.nodes[block], s, 0)
    if moving is not None and lane_sum(0.0, r, law.relaxation) > 0.0:
        velocity, lag, power = moving
        gather(velocity, None, blocks.nodes[block], s, VELOCITIES)
        block_volume(law, s, r, lag)
        block_force(law, s, r, stored, lag)
        power[t] = lane_sum(power[t], s, POWER)
    else:
        block_volume(law, s, r, None)
        block_force(law, s, r, stored, None)
    scatter(s, blocks, block, share, t, out)
    if stored is not None:
        stored[t, 0] += lane_sum(0.0, s, RESULT)


@kernel
def least_det(blocks: Blocks, displacement: Array, block: int, s: Array) -> float:
    """See `loops`."""
    smallest = np.inf
    r = blocks.reference[block]
    gather(blocks.points, displacement, blocks.nodes[block], s, 0)
    store_all_bases(s, BASES, 0)
    for q in range(8):
        values = VALUES[q]
        for lane in range(LANES):
            bases, o = point_bases(s, BASES, lane, values), lane + q * POINT_ROWS * LANES
            s[RESULT * LANES + lane] = point_det(bases, r, o)
        for lane in range(min(LANES, blocks.n_cells - block * LANES)):
            smallest = lower(smallest, s[RESULT * LANES + lane])
    return float(smallest)


@entry
def pressures(blocks: Blocks, displacement: Array, cells: Index, out: Array) -> None:
    """The p of `cells` into out (n,), Pa. Each block is gathered once for a run of cells in it."""
    law, gathered = law_of(blocks), -1
    s = blocks.scratch[0]
    for row in range(len(cells)):
        block, lane = cells[row] // LANES, cells[row] % LANES
        r = blocks.reference[block]
        if block != gathered:
            gather(blocks.points, displacement, blocks.nodes[block], s, 0)
            block_volume(law, s, r, None)
            gathered = block
        out[row] = pressure(law, r, lane, s[VOLUME * LANES + lane])
