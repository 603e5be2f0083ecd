"""Which blocks each thread takes, and how forces are summed: one number of threads, the same bits.

Each thread takes a contiguous run of blocks. It adds forces on nodes that no other thread touches
straight to the result, those of the seam to its own buffer; the buffers are summed in the order of
the threads. With nodes numbered locally the seam is one section of the mesh, so that almost nothing
is summed twice; a mesh numbered at random costs time, not correctness.
"""

import numpy as np

from reference_fem.arrays import Array, Index
from reference_fem.compiled import inner
from reference_fem.elements.blocks import Blocks

# Columns of a share: blocks START..STOP-1 touch nodes LOW..HIGH-1, of which no other
# thread's blocks touch OWN_LOW..OWN_HIGH-1.
START, STOP, LOW, OWN_LOW, OWN_HIGH, HIGH = range(6)


@inner()
def thread_range(count: int, t: int, n_threads: int) -> tuple[int, int]:
    """First and one past the last of the `count` items that thread t takes."""
    return t * count // n_threads, (t + 1) * count // n_threads


@inner()
def thread_shares(node_range: Index, n_threads: int) -> Index:
    """Shares (n_threads, 6) of all threads."""
    shares = np.zeros((n_threads, 6), dtype=np.int64)
    for t in range(n_threads):
        start, stop = thread_range(len(node_range), t, n_threads)
        low, high = (node_range[start, 0], node_range[start, 1]) if start < stop else (0, 0)
        for block in range(start + 1, stop):
            low, high = min(low, node_range[block, 0]), max(high, node_range[block, 1])
        shares[t, START], shares[t, STOP] = start, stop
        shares[t, LOW], shares[t, HIGH] = low, high
    for t in range(n_threads):
        first, last = shares[t, LOW], shares[t, HIGH]
        for other in range(n_threads):
            if shares[other, START] < shares[other, STOP]:
                if other < t:
                    first = max(first, shares[other, HIGH])
                elif other > t:
                    last = min(last, shares[other, LOW])
        if first >= last:
            first = last = shares[t, HIGH]
        shares[t, OWN_LOW], shares[t, OWN_HIGH] = first, last
    return shares


@inner()
def zero_forces(blocks: Blocks, shares: Index, t: int, out: Array) -> None:
    """Zero the forces that thread t is going to add to."""
    low, first, last, high = (
        shares[t, LOW],
        shares[t, OWN_LOW],
        shares[t, OWN_HIGH],
        shares[t, HIGH],
    )
    out[first:last] = 0.0
    blocks.buffers[t, low:first] = 0.0
    blocks.buffers[t, last:high] = 0.0


@inner()
def holds_own_nodes_only(blocks: Blocks, block: int, share: Index) -> bool:
    """Whether all of a block's nodes are its thread's own."""
    return bool(
        blocks.node_range[block, 0] >= share[OWN_LOW]
        and blocks.node_range[block, 1] <= share[OWN_HIGH]
    )


@inner()
def add_buffers(blocks: Blocks, shares: Index, out: Array) -> None:
    """Sum the buffers into the nodes that belong to no single thread.

    One thread does it all: waking the others takes longer than a section of the mesh.
    """
    position = 0
    for t in range(len(shares)):
        if shares[t, OWN_LOW] < shares[t, OWN_HIGH]:
            out[position : shares[t, OWN_LOW]] = 0.0
            position = shares[t, OWN_HIGH]
    out[position:] = 0.0
    for t in range(len(shares)):
        share = shares[t]
        for low, high in ((share[LOW], share[OWN_LOW]), (share[OWN_HIGH], share[HIGH])):
            total, more = out[low:high].reshape(-1), blocks.buffers[t, low:high].reshape(-1)
            for i in range(len(total)):  # a flat loop vectorises, one over nodes does not
                total[i] += more[i]
