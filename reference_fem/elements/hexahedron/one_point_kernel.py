"""Compiled kernels of the 1-point hexahedron: force, energies, det F.

Flanagan and Belytschko (1981) in total Lagrangian form. With the mean gradients
b_a = 1/V int grad N_a dV, reference corners X_a and the four hourglass vectors h^n of +-1,

    F = I + H,  H = sum_a u_a b_a^T,  E = (F^T F - I)/2,  S = lambda tr E I + 2 mu E,
    g^n_a = h^n_a - G^n . b_a,  G^n = sum_a h^n_a X_a,     q^n = sum_a g^n_a x_a = sum_a g^n_a u_a
    W = V (mu E:E + lambda (tr E)^2 / 2) + k/2 sum_n |q^n|^2
    f_a = V F S b_a + k sum_n g^n_a q^n

g^n is orthogonal to every linear motion, so a patch has no hourglass energy, and |q^n|^2 does not
see rotations: the force is the exact gradient of W however large the rotation.
k = c E V B/72 with B = sum_a b_a . b_a; c = 1 gives a cube its exact stiffness in pure bending.

Sums over corners are taken over the modes of `modes`, where b has six vectors instead of
eight and h^n is a unit vector. b and G are not stored but recomputed in each call from the corners:
150 operations cost less than reading 288 bytes.

Layout: `reference[block, row*LANES + lane]` holds V mu, V lambda (J) and k (N/m).
Scratch rows: 24 of displacements (later forces), 24 of reference corners, two of energies or dets.
"""

import numpy as np

from reference_fem.arrays import Array, Index
from reference_fem.compiled import inlined, kernel
from reference_fem.elements.alignment import aligned_frame
from reference_fem.elements.blocks import LANES, Blocks, Moving, Stored, lane_sum
from reference_fem.elements.hexahedron.edges import Four, Rows, Three, dot
from reference_fem.elements.hexahedron.modes import Modes, Six, mean_gradients, modes, spread
from reference_fem.elements.hexahedron.nodes import gather, scatter
from reference_fem.elements.loops import implement
from reference_fem.elements.stress import lower

CORNERS = 24
RESULT = CORNERS + 24
SCRATCH_ROWS = RESULT + 2


class OnePointBlocks(Blocks):
    """Blocks of 1-point hexahedra."""


FourThrees = tuple[Three, Three, Three, Three]


@inlined
def hourglass_shapes(x: Modes, y: Modes, z: Modes) -> FourThrees:
    """G^n from the modes of the reference corners, m."""
    return (x[3], y[3], z[3]), (x[4], y[4], z[4]), (x[5], y[5], z[5]), (x[6], y[6], z[6])


@inlined
def gradient_row(u: Modes, b: Six) -> Three:
    """One row of H."""
    b1, b2, b3, b4, b5, b6 = b
    return (
        u[0] * b1[0] + u[1] * b2[0] + u[2] * b3[0] + u[3] * b4[0] + u[4] * b5[0] + u[5] * b6[0],
        u[0] * b1[1] + u[1] * b2[1] + u[2] * b3[1] + u[3] * b4[1] + u[4] * b5[1] + u[5] * b6[1],
        u[0] * b1[2] + u[1] * b2[2] + u[2] * b3[2] + u[3] * b4[2] + u[4] * b5[2] + u[5] * b6[2],
    )


@inlined
def hourglass_row(u: Modes, h: Three, g: FourThrees) -> Four:
    """One component of q^1..q^4, h the same row of H."""
    return u[3] - dot(h, g[0]), u[4] - dot(h, g[1]), u[5] - dot(h, g[2]), u[6] - dot(h, g[3])


@inlined
def twice_strain(hx: Three, hy: Three, hz: Three) -> tuple[Three, Three]:
    """2E = H + H^T + H^T H as (11, 22, 33), (12, 23, 13)."""
    return (
        (
            2.0 * hx[0] + (hx[0] * hx[0] + hy[0] * hy[0] + hz[0] * hz[0]),
            2.0 * hy[1] + (hx[1] * hx[1] + hy[1] * hy[1] + hz[1] * hz[1]),
            2.0 * hz[2] + (hx[2] * hx[2] + hy[2] * hy[2] + hz[2] * hz[2]),
        ),
        (
            hx[1] + hy[0] + (hx[0] * hx[1] + hy[0] * hy[1] + hz[0] * hz[1]),
            hy[2] + hz[1] + (hx[1] * hx[2] + hy[1] * hy[2] + hz[1] * hz[2]),
            hx[2] + hz[0] + (hx[0] * hx[2] + hy[0] * hy[2] + hz[0] * hz[2]),
        ),
    )


@inlined
def strain_energy(d: Three, c: Three, v_mu: float, v_lame: float) -> float:
    """V (mu E:E + lambda (tr E)^2 / 2), J, from 2E as `twice_strain` gives it."""
    trace = d[0] + d[1] + d[2]
    return 0.25 * (v_mu * (dot(d, d) + 2.0 * dot(c, c)) + 0.5 * v_lame * trace * trace)


@inlined
def square(q: Four) -> float:
    """One component's part of sum_n |q^n|^2."""
    return q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]


@inlined
def force_row(
    s: Array, o: int, u: Modes, h: Three, f: Three, k: float, stress: Rows, b: Six, g: FourThrees
) -> float:
    """Overwrite one component of 8 displacements with that of the forces; return sum_n (q^n)^2."""
    q = hourglass_row(u, h, g)
    q1, q2, q3, q4 = k * q[0], k * q[1], k * q[2], k * q[3]
    g1, g2, g3, g4 = g
    t = (
        dot(f, stress[0]) - (q1 * g1[0] + q2 * g2[0] + q3 * g3[0] + q4 * g4[0]),
        dot(f, stress[1]) - (q1 * g1[1] + q2 * g2[1] + q3 * g3[1] + q4 * g4[1]),
        dot(f, stress[2]) - (q1 * g1[2] + q2 * g2[2] + q3 * g3[2] + q4 * g4[2]),
    )
    straight = (dot(t, b[0]), dot(t, b[1]), dot(t, b[2]))
    spread(s, o, (*straight, dot(t, b[3]) + q1, dot(t, b[4]) + q2, dot(t, b[5]) + q3, q4))
    return square(q)


@inlined
def lane_force(s: Array, r: Array, lane: int) -> tuple[float, float]:
    """One element's forces in place of its displacements; energies of strains and hourglass, J.

    Where the caller that inlines this does not use the energies, they are not computed.
    """
    o = lane + CORNERS * LANES
    x, y, z = modes(s, o), modes(s, o + 8 * LANES), modes(s, o + 16 * LANES)
    b, g = mean_gradients(x, y, z), hourglass_shapes(x, y, z)
    u, v, w = modes(s, lane), modes(s, lane + 8 * LANES), modes(s, lane + 16 * LANES)
    hx, hy, hz = gradient_row(u, b), gradient_row(v, b), gradient_row(w, b)
    mu, lame, k = r[lane], r[lane + LANES], r[lane + 2 * LANES]
    d, c = twice_strain(hx, hy, hz)
    p = 0.5 * lame * (d[0] + d[1] + d[2])
    s12, s23, s13 = mu * c[0], mu * c[1], mu * c[2]
    stress = ((mu * d[0] + p, s12, s13), (s12, mu * d[1] + p, s23), (s13, s23, mu * d[2] + p))
    fx, fy, fz = (1.0 + hx[0], hx[1], hx[2]), (hy[0], 1.0 + hy[1], hy[2]), (
        hz[0], hz[1], 1.0 + hz[2],
    )  # fmt: skip
    squares = force_row(s, lane, u, hx, fx, k, stress, b, g)
    squares += force_row(s, lane + 8 * LANES, v, hy, fy, k, stress, b, g)
    squares += force_row(s, lane + 16 * LANES, w, hz, fz, k, stress, b, g)
    return strain_energy(d, c, mu, lame), 0.5 * k * squares


@kernel
def block_force(s: Array, r: Array, stored: Stored) -> None:
    """Rows 0..23 of s: the nodal forces in place of the nodal displacements.

    Where energies are `stored`, rows RESULT and RESULT + 1: of strains and of hourglass modes, J.
    """
    aligned_frame()
    for lane in range(LANES):
        strain, hourglass = lane_force(s, r, lane)
        if stored is not None:
            s[RESULT * LANES + lane], s[(RESULT + 1) * LANES + lane] = strain, hourglass


@kernel
def block_det(s: Array) -> None:
    """Row RESULT of s: det F."""
    for lane in range(LANES):
        o = lane + CORNERS * LANES
        b = mean_gradients(modes(s, o), modes(s, o + 8 * LANES), modes(s, o + 16 * LANES))
        hx = gradient_row(modes(s, lane), b)
        hy = gradient_row(modes(s, lane + 8 * LANES), b)
        hz = gradient_row(modes(s, lane + 16 * LANES), b)
        s[RESULT * LANES + lane] = (
            (1.0 + hx[0]) * ((1.0 + hy[1]) * (1.0 + hz[2]) - hy[2] * hz[1])
            + hx[1] * (hy[2] * hz[0] - hy[0] * (1.0 + hz[2]))
            + hx[2] * (hy[0] * hz[1] - (1.0 + hy[1]) * hz[0])
        )


@inlined
def gather_both(blocks: Blocks, displacement: Array, block: int, s: Array) -> None:
    """Displacements and reference corners of a block into rows 0..47 of s."""
    gather(displacement, None, blocks.nodes[block], s, 0)
    gather(blocks.points, None, blocks.nodes[block], s, CORNERS)


@kernel
def add_force(
    blocks: Blocks, u: Array, block: int, share: Index, t: int, out: Array, stored: Stored,
    _moving: Moving,
) -> None:  # fmt: skip
    """See `loops`; there is no damping."""
    s = blocks.scratch[t]
    gather_both(blocks, u, block, s)
    block_force(s, blocks.reference[block], stored)
    scatter(s, blocks, block, share, t, out)
    if stored is not None:
        stored[t, 0] += lane_sum(0.0, s, RESULT)
        stored[t, 1] += lane_sum(0.0, s, RESULT + 1)


@kernel
def least_det(blocks: Blocks, displacement: Array, block: int, s: Array) -> float:
    """See `loops`."""
    smallest = np.inf
    gather_both(blocks, displacement, block, s)
    block_det(s)
    for lane in range(LANES):
        smallest = lower(smallest, s[RESULT * LANES + lane])
    return float(smallest)


implement(OnePointBlocks, add_force, least_det)
