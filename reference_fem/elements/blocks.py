"""Elements in blocks of LANES, dealt to threads in contiguous runs."""

from dataclasses import dataclass

import numba
import numpy as np
from numba import njit

from reference_fem.elements.protocol import Floats, Integers, Nodes

# Below 16 lanes the compiler does not vectorise; with more, a block no longer stays in 32 kB of
# first-level cache between the two passes over it (measured: 32 lanes are 15 % slower).
LANES = 16


@dataclass(frozen=True, eq=False)
class Blocks:
    """Node numbers by block, and the workspaces of the threads.

    nodes : (n_blocks, LANES, corners); lanes past the last element repeat its nodes
    node_range : (n_blocks, 2) first node and one past the last of each block
    scratch : (threads, rows*LANES) workspace
    buffers : (threads, n_nodes, dim) workspace, forces added by each thread, N. Sized for as many
        threads as numba may ever use; the pages of idle ones are never touched.
    """

    nodes: Nodes
    node_range: Integers
    scratch: Floats
    buffers: Floats


def make_blocks(points: Floats, cells: Integers, scratch_rows: int) -> Blocks:
    """Blocks of `cells` (n_cells, corners) in their order, with workspaces."""
    padded = np.vstack((cells, np.repeat(cells[-1:], -len(cells) % LANES, axis=0)))
    nodes = padded.reshape(-1, LANES, cells.shape[1])
    threads = numba.config.NUMBA_NUM_THREADS
    return Blocks(
        nodes=nodes.astype(np.uint32),
        node_range=np.stack((nodes.min(axis=(1, 2)), nodes.max(axis=(1, 2)) + 1), axis=1),
        scratch=np.zeros((threads, scratch_rows * LANES)),
        buffers=np.empty((threads, *points.shape)),
    )


def lanes(values: Floats) -> Floats:
    """Values by element and row (n_cells, rows) as (n_blocks, rows*LANES), zero past the last."""
    padded = np.vstack((values, np.zeros((-len(values) % LANES, values.shape[1]))))
    by_block = padded.reshape(-1, LANES, values.shape[1]).transpose(0, 2, 1)
    return np.ascontiguousarray(by_block).reshape(len(by_block), -1)


@njit(cache=True, error_model="numpy")
def first_touch(r: Floats) -> float:
    """Read one number of each cache line of r; the sum only keeps the reads from being dropped.

    The kernels read a block as dozens of short streams, which the processor does not foresee. One
    reading in the order of memory brings it into the cache at full bandwidth
    (measured: 2 to 10 % faster).
    """
    total = 0.0
    for i in range(0, r.size, 8):
        total += r[i]
    return total


@njit(cache=True, error_model="numpy")
def touched(node_range: Integers, start: int, stop: int) -> tuple[int, int]:
    """First node and one past the last that blocks start..stop-1 touch."""
    if start == stop:
        return 0, 0
    low, high = node_range[start, 0], node_range[start, 1]
    for block in range(start + 1, stop):
        low, high = min(low, node_range[block, 0]), max(high, node_range[block, 1])
    return low, high


@njit(cache=True, error_model="numpy")
def add_buffers(
    buffers: Floats, node_range: Integers, n_threads: int, first: int, last: int, out: Floats
) -> None:
    """Nodes first..last-1 of out: the sum of the threads' buffers, in the order of the threads."""
    n_blocks = len(node_range)
    out[first:last] = 0.0
    for t in range(n_threads):
        start, stop = t * n_blocks // n_threads, (t + 1) * n_blocks // n_threads
        low, high = touched(node_range, start, stop)
        for n in range(max(low, first), min(high, last)):
            for i in range(out.shape[1]):
                out[n, i] += buffers[t, n, i]
