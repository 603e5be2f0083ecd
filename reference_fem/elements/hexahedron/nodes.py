"""Copying between the mesh and a block of 8-node hexahedra: 24 rows of scratch, x then y, z."""

from reference_fem.arrays import Array, Index
from reference_fem.compiled import inlined
from reference_fem.elements.blocks import LANES, Blocks, Nodes
from reference_fem.elements.hexahedron.vectors import WIDTH, add_rows, take_rows
from reference_fem.elements.threads import OWN_HIGH, OWN_LOW, holds_own_nodes_only


@inlined
def gather(values: Array, more: Array | None, nodes: Nodes, s: Array, row: int) -> None:
    """Nodal vectors (n_nodes, 3) of a block, (LANES, 8) node numbers, into 24 rows of s.

    Those of `values`, with those of `more`, if it is not None, added.
    """
    for lane in range(0, LANES, WIDTH):
        for a in range(8):
            take_rows(values, more, nodes, lane * 8 + a, s, (row + a) * LANES + lane, 8 * LANES)


@inlined
def scatter(s: Array, blocks: Blocks, block: int, share: Index, t: int, out: Array) -> None:
    """Add rows 0..23 of s to the nodal forces, those of the seam to thread t's buffer."""
    nodes, seam = blocks.nodes[block], blocks.buffers[t]
    if holds_own_nodes_only(blocks, block, share):
        for lane in range(0, LANES, WIDTH):
            for a in range(8):
                add_rows(s, a * LANES + lane, 8 * LANES, out, nodes, lane * 8 + a)
        return
    for lane in range(LANES):
        for a in range(8):
            n = nodes[lane, a]
            f = out if share[OWN_LOW] <= n < share[OWN_HIGH] else seam
            for k in range(3):
                f[n, k] += s[(8 * k + a) * LANES + lane]
