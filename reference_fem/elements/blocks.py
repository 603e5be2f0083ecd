"""Elements in blocks of LANES: the form in which the compiled kernels of all elements get them."""

from typing import NamedTuple, TypeVar

import numba
import numpy as np
from numpy.typing import NDArray

from reference_fem.arrays import Array, Index
from reference_fem.compiled import inlined
from reference_fem.elements.alignment import aligned

Nodes = NDArray[np.uint32]  # unsigned: numba then emits no test for negative indices
# Energies of strains and of hourglass modes by thread, (threads, 2), J. Where it is None, numba
# leaves their code out.
Stored = Array | None
# Velocity (n_nodes, dim), m/s, how long before the displacement it was, s, and the power that
# damping takes by thread, (threads,), W; None: no damping.
Moving = tuple[Array, float, Array] | None

# Below 16 lanes the compiler does not vectorise; with more, a block no longer stays in 32 kB of
# first-level cache between the two passes over it (measured: 32 lanes are 10 to 15 % slower).
LANES = 16


class Blocks(NamedTuple):
    """A mesh in blocks, and the threads' workspaces, in a form that numba takes directly.

    Each element derives a class of its own, by which `loops` selects the code for a block.

    points : (n_nodes, dim) reference positions, m
    nodes : (n_blocks, LANES, corners); lanes past the last element repeat its nodes
    node_range : (n_blocks, 2) first node and one past the last of each block
    n_cells : number of elements
    reference : (n_blocks, rows*LANES) what the kernel stores of each element; zero past the last
    scratch : (threads, rows*LANES) workspace
    buffers : (threads, n_nodes, dim) workspace, forces on nodes that threads share, N. Sized for
        as many threads as numba may ever use; pages that are not needed are never touched.
    """

    points: Array
    nodes: Nodes
    node_range: Index
    n_cells: int
    reference: Array
    scratch: Array
    buffers: Array


AnyBlocks = TypeVar("AnyBlocks", bound=Blocks)


def make_blocks(
    kind: type[AnyBlocks], points: Array, cells: Index, rows: Array, scratch_rows: int
) -> AnyBlocks:
    """Blocks of `cells` (n_cells, corners) in their order; `rows` (n_cells, rows) to be stored."""
    padded = np.vstack((cells, np.repeat(cells[-1:], -len(cells) % LANES, axis=0)))
    nodes = padded.reshape(-1, LANES, cells.shape[1])
    threads = numba.config.NUMBA_NUM_THREADS
    return kind(
        points=points,
        nodes=nodes.astype(np.uint32),
        node_range=np.stack((nodes.min(axis=(1, 2)), nodes.max(axis=(1, 2)) + 1), axis=1),
        n_cells=len(cells),
        reference=_lanes(rows),
        scratch=aligned(np.zeros((threads, scratch_rows * LANES))),
        buffers=np.empty((threads, *points.shape)),
    )


@inlined
def lane_sum(total: float, s: Array, row: int) -> float:
    """`total` plus the LANES numbers in a row of scratch s, added one after another."""
    for lane in range(LANES):
        total += s[row * LANES + lane]
    return total


def _lanes(values: Array) -> Array:
    """Values by element and row (n_cells, rows) as (n_blocks, rows*LANES), zero past the last."""
    padded = np.vstack((values, np.zeros((-len(values) % LANES, values.shape[1]))))
    by_block = padded.reshape(-1, LANES, values.shape[1]).transpose(0, 2, 1)
    return aligned(by_block.reshape(len(by_block), -1))
