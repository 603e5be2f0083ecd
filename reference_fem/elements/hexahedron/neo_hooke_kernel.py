"""Compiled kernels of the 8-node hexahedron of a compressible neo-Hookean material.

Total Lagrangian, 2 x 2 x 2 Gauss points q with volumes w_q, V = sum w_q, J = det F:

    J' = sum_q w_q J_q / V                                                           (mean volume)
    W = sum_q w_q mu ((tr C_q - 3)/2 - ln J_q) + V lambda ((J'^2 - 1)/2 - ln J')/2   (its energy)
    p = lambda (J' - 1/J')/2,  P_q = mu F_q + (p - mu/J_q) cof F_q,  f_a = sum_q w_q P_q grad N_a

(W(C) and its U(J): Simo, Pister 1984, CMAME 46; Bonet, Wood, Nonlinear Continuum Mechanics for FEA,
2008, section 6.4.3; J' in place of J: Nagtegaal, Parks, Rice 1974, CMAME 4.) Small strains follow
Hooke's law. Crushed, it stiffens without bound, where St. Venant-Kirchhoff's law softens.

Damping (`damped_force`) adds F S of S = tau (lambda de/dt I + 2 mu dE/dt), e as in
`eight_point_kernel`, whose layout holds here too; `reference` rows 57, 58 and, where there is
damping, 59 are lambda/2 (Pa), 1/V (1/m^3) and tau (s).
"""

import numpy as np

from reference_fem.arrays import Array, Index
from reference_fem.compiled import entry, inlined, kernel
from reference_fem.elements.alignment import aligned_frame
from reference_fem.elements.blocks import LANES, Blocks, Moving, Stored, lane_sum
from reference_fem.elements.hexahedron.edges import (
    at_points,
    load_bases,
    nodal_forces,
)
from reference_fem.elements.hexahedron.eight_point_kernel import (
    BASES,
    DILATATION,
    DILATATION_RATE,
    POWER,
    RATES,
    RESULT,
    VELOCITIES,
    least_det,
    point_bases,
    store_all_bases,
)
from reference_fem.elements.hexahedron.neo_hooke_point import (
    cross,
    damped_point,
    dot,
    elastic_point,
)
from reference_fem.elements.hexahedron.nodes import gather, gather_positions, scatter
from reference_fem.elements.hexahedron.point import POINT_ROWS, gradient_rows, strain_rate
from reference_fem.elements.loops import implement

HALF_LAME = 8 * POINT_ROWS + 1  # rows of `reference`
PER_VOLUME = HALF_LAME + 1
RELAXATION = PER_VOLUME + 1


class NeoHookeBlocks(Blocks):
    """Blocks of neo-Hookean 8-point hexahedra."""


@inlined
def add_volume(s: Array, r: Array, q: int, a: int, b: int, c: int) -> None:
    """Add w J of point q, where g_1, g_2, g_3 take their values a, b, c, to row DILATATION."""
    for lane in range(LANES):
        o = lane + q * POINT_ROWS * LANES
        f = gradient_rows(point_bases(s, BASES, lane, (a, b, c)), r, o)
        s[DILATATION * LANES + lane] += r[o + 6 * LANES] * dot(f[0], cross(f[1], f[2]))


@kernel
def block_volume(s: Array, r: Array) -> None:
    """Rows BASES.. of s and, in row DILATATION, sum_q w J = V J', from the nodal positions."""
    store_all_bases(s, BASES, 0)
    add_volume(s, r, 0, 0, 0, 0)
    add_volume(s, r, 1, 0, 1, 1)
    add_volume(s, r, 2, 1, 1, 3)
    add_volume(s, r, 3, 1, 0, 2)
    add_volume(s, r, 4, 2, 2, 0)
    add_volume(s, r, 5, 2, 3, 1)
    add_volume(s, r, 6, 3, 3, 3)
    add_volume(s, r, 7, 3, 2, 2)


@inlined
def mean_volume(s: Array, r: Array, lane: int) -> float:
    """J' of an element, 1 in lanes past the last."""
    share = r[PER_VOLUME * LANES + lane]
    return s[DILATATION * LANES + lane] * share if share > 0.0 else 1.0


@inlined
def elastic_pressure(r: Array, lane: int, mean: float) -> float:
    """Pressure p = lambda (J' - 1/J')/2, Pa."""
    return r[HALF_LAME * LANES + lane] * (mean - 1.0 / mean)


@inlined
def volumetric_energy(r: Array, lane: int, mean: float) -> float:
    """V lambda ((J'^2 - 1)/2 - ln J')/2, J; zero in lanes past the last."""
    share = r[PER_VOLUME * LANES + lane]
    energy = r[HALF_LAME * LANES + lane] * (0.5 * (mean * mean - 1.0) - np.log(mean))
    return energy / share if share > 0.0 else 0.0


@inlined
def lane_force(s: Array, r: Array, lane: int) -> float:
    """One element's forces, from what `block_volume` left in s; its energy, J."""
    x = at_points(load_bases(s, BASES, lane))
    y = at_points(load_bases(s, BASES + 12, lane))
    z = at_points(load_bases(s, BASES + 24, lane))
    step = POINT_ROWS * LANES
    mu, mean = r[56 * LANES + lane], mean_volume(s, r, lane)
    p = elastic_pressure(r, lane, mean)
    f0, e0 = elastic_point((x[0], y[0], z[0]), r, lane, mu, p)
    f1, e1 = elastic_point((x[1], y[1], z[1]), r, lane + step, mu, p)
    f2, e2 = elastic_point((x[2], y[2], z[2]), r, lane + 2 * step, mu, p)
    f3, e3 = elastic_point((x[3], y[3], z[3]), r, lane + 3 * step, mu, p)
    f4, e4 = elastic_point((x[4], y[4], z[4]), r, lane + 4 * step, mu, p)
    f5, e5 = elastic_point((x[5], y[5], z[5]), r, lane + 5 * step, mu, p)
    f6, e6 = elastic_point((x[6], y[6], z[6]), r, lane + 6 * step, mu, p)
    f7, e7 = elastic_point((x[7], y[7], z[7]), r, lane + 7 * step, mu, p)
    nodal_forces(s, lane, f0, f1, f2, f3, f4, f5, f6, f7)
    return ((e0 + e1) + (e2 + e3)) + ((e4 + e5) + (e6 + e7)) + volumetric_energy(r, lane, mean)


@kernel
def block_force(s: Array, r: Array, stored: Stored) -> None:
    """Rows 0..23 of s: the nodal forces, from what `block_volume` left in s.

    Where energies are `stored`, row RESULT of s: those of the elements, J.
    """
    aligned_frame()
    for lane in range(LANES):
        energy = lane_force(s, r, lane)
        if stored is not None:
            s[RESULT * LANES + lane] = energy


@inlined
def add_volumes(s: Array, r: Array, q: int, a: int, b: int, c: int, lag: float) -> None:
    """`add_volume`, and w tr dE/dt, m^3/s, to row DILATATION_RATE."""
    for lane in range(LANES):
        o = lane + q * POINT_ROWS * LANES
        f = gradient_rows(point_bases(s, BASES, lane, (a, b, c)), r, o)
        v = gradient_rows(point_bases(s, RATES, lane, (a, b, c)), r, o)
        d, _ = strain_rate(f, v, lag)
        s[DILATATION * LANES + lane] += r[o + 6 * LANES] * dot(f[0], cross(f[1], f[2]))
        s[DILATATION_RATE * LANES + lane] += 0.5 * r[o + 6 * LANES] * (d[0] + d[1] + d[2])


@inlined
def damped_lane(s: Array, r: Array, lane: int, lag: float) -> tuple[float, float]:
    """`lane_force` with damping, and its dissipation, W; row DILATATION_RATE must be complete."""
    x = at_points(load_bases(s, BASES, lane))
    y = at_points(load_bases(s, BASES + 12, lane))
    z = at_points(load_bases(s, BASES + 24, lane))
    u = at_points(load_bases(s, RATES, lane))
    v = at_points(load_bases(s, RATES + 12, lane))
    w = at_points(load_bases(s, RATES + 24, lane))
    step, t = POINT_ROWS * LANES, lane
    mu, tau, mean = r[56 * LANES + lane], r[RELAXATION * LANES + lane], mean_volume(s, r, lane)
    p, e = elastic_pressure(r, lane, mean), volumetric_energy(r, lane, mean)
    rate = s[DILATATION_RATE * LANES + lane]
    k = 2.0 * r[HALF_LAME * LANES + lane] * r[PER_VOLUME * LANES + lane] * tau * rate
    d = k * rate
    f0, e, d = damped_point((x[0], y[0], z[0]), (u[0], v[0], w[0]), r, t, mu, tau, p, k, lag, e, d)
    t += step
    f1, e, d = damped_point((x[1], y[1], z[1]), (u[1], v[1], w[1]), r, t, mu, tau, p, k, lag, e, d)
    t += step
    f2, e, d = damped_point((x[2], y[2], z[2]), (u[2], v[2], w[2]), r, t, mu, tau, p, k, lag, e, d)
    t += step
    f3, e, d = damped_point((x[3], y[3], z[3]), (u[3], v[3], w[3]), r, t, mu, tau, p, k, lag, e, d)
    t += step
    f4, e, d = damped_point((x[4], y[4], z[4]), (u[4], v[4], w[4]), r, t, mu, tau, p, k, lag, e, d)
    t += step
    f5, e, d = damped_point((x[5], y[5], z[5]), (u[5], v[5], w[5]), r, t, mu, tau, p, k, lag, e, d)
    t += step
    f6, e, d = damped_point((x[6], y[6], z[6]), (u[6], v[6], w[6]), r, t, mu, tau, p, k, lag, e, d)
    t += step
    f7, e, d = damped_point((x[7], y[7], z[7]), (u[7], v[7], w[7]), r, t, mu, tau, p, k, lag, e, d)
    nodal_forces(s, lane, f0, f1, f2, f3, f4, f5, f6, f7)
    return e, d


@kernel
def damped_force(s: Array, r: Array, lag: float) -> None:
    """Rows 0..23 of s: damped forces replace positions; rows VELOCITIES.. hold velocities.

    Rows RESULT and POWER of s: the elements' energies, J, and what they dissipate, W.
    """
    aligned_frame()
    store_all_bases(s, BASES, 0)
    store_all_bases(s, RATES, VELOCITIES)
    add_volumes(s, r, 0, 0, 0, 0, lag)
    add_volumes(s, r, 1, 0, 1, 1, lag)
    add_volumes(s, r, 2, 1, 1, 3, lag)
    add_volumes(s, r, 3, 1, 0, 2, lag)
    add_volumes(s, r, 4, 2, 2, 0, lag)
    add_volumes(s, r, 5, 2, 3, 1, lag)
    add_volumes(s, r, 6, 3, 3, 3, lag)
    add_volumes(s, r, 7, 3, 2, 2, lag)
    for lane in range(LANES):
        energy, power = damped_lane(s, r, lane, lag)
        s[RESULT * LANES + lane], s[POWER * LANES + lane] = energy, power


@kernel
def add_force(
    blocks: Blocks, u: Array, block: int, share: Index, t: int, out: Array, stored: Stored,
    moving: Moving,
) -> None:  # fmt: skip
    """See `loops`."""
    s = blocks.scratch[t]
    r = blocks.reference[block]
    gather_positions(blocks.points, u, blocks.nodes[block], s)
    if moving is not None and lane_sum(0.0, r, RELAXATION) > 0.0:
        velocity, lag, power = moving
        gather(velocity, blocks.nodes[block], s, VELOCITIES)
        damped_force(s, r, lag)
        power[t] = lane_sum(power[t], s, POWER)
    else:
        block_volume(s, r)
        block_force(s, r, stored)
    scatter(s, blocks, block, share, t, out)
    if stored is not None:
        stored[t, 0] += lane_sum(0.0, s, RESULT)


@entry
def pressures(blocks: Blocks, displacement: Array, cells: Index, out: Array) -> None:
    """The p of `cells` into out (n,), Pa. Each block is gathered once for a run of cells in it."""
    gathered = -1
    s = blocks.scratch[0]
    for row in range(len(cells)):
        block, lane = cells[row] // LANES, cells[row] % LANES
        r = blocks.reference[block]
        if block != gathered:
            gather_positions(blocks.points, displacement, blocks.nodes[block], s)
            block_volume(s, r)
            gathered = block
        out[row] = elastic_pressure(r, lane, mean_volume(s, r, lane))


implement(NeoHookeBlocks, add_force, least_det)
