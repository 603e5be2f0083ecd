"""Compiled kernels of the 8-node hexahedron for outputs: det F, stress at the centre.

Same equations, layout and scratch rows as `eight_point_kernel`; row RESULT holds dets.
"""

import numpy as np

from reference_fem.arrays import Array, Index
from reference_fem.compiled import compiled
from reference_fem.elements.blocks import LANES, Blocks
from reference_fem.elements.hexahedron.eight_point_kernel import (
    BASES,
    DILATATION,
    RESULT,
    add_force,
    block_dilatation,
    point_bases,
)
from reference_fem.elements.hexahedron.nodes import gather_positions
from reference_fem.elements.hexahedron.point import POINT_ROWS, point_det
from reference_fem.elements.loops import implement
from reference_fem.elements.stress import cauchy_stress, deformation, lower

# Which of the 4 values of g_1, g_2, g_3 the 8 points take.
VALUES = (
    (0, 0, 0), (0, 1, 1), (1, 1, 3), (1, 0, 2), (2, 2, 0), (2, 3, 1), (3, 3, 3), (3, 2, 2),
)  # fmt: skip


class Hex8Blocks(Blocks):
    """Blocks of 8-point hexahedra."""


@compiled
def least_det(blocks: Blocks, displacement: Array, block: int, s: Array) -> float:
    """See `loops`."""
    smallest = np.inf
    r = blocks.reference[block]
    gather_positions(blocks.points, displacement, blocks.nodes[block], s)
    block_dilatation(s, r)
    for q in range(8):
        values = VALUES[q]
        for lane in range(LANES):
            bases, o = point_bases(s, BASES, lane, values), lane + q * POINT_ROWS * LANES
            s[RESULT * LANES + lane] = point_det(bases, r, o)
        for lane in range(min(LANES, blocks.n_cells - block * LANES)):
            smallest = lower(smallest, s[RESULT * LANES + lane])
    return float(smallest)


@compiled
def stresses(
    blocks: Blocks,
    displacement: Array,
    gradients: Array,
    mu: Array,
    _lame: Array,
    cells: Index,
    stress: Array,
) -> None:
    """Cauchy stress F S F^T / det F at the centres of `cells` into stress (n, 6), Pa.

    S = lambda e I + 2 mu E with the element's mean e and E at the centre. Each block is gathered
    once for a run of cells that lie in it; gradients (n_cells, 8, 3) are those at the centre, 1/m.
    """
    gathered = -1
    f = np.empty((3, 3))
    s = blocks.scratch[0]
    for row in range(len(cells)):
        cell = cells[row]
        block, lane = cell // LANES, cell % LANES
        r = blocks.reference[block]
        if block != gathered:
            gather_positions(blocks.points, displacement, blocks.nodes[block], s)
            block_dilatation(s, r)
            gathered = block
        deformation(blocks, displacement, cell, gradients[cell], f)
        pressure = r[57 * LANES + lane] * s[DILATATION * LANES + lane]
        cauchy_stress(f, mu[cell], pressure, stress[row])


implement(Hex8Blocks, add_force, least_det)
