"""Loops over the blocks of a mesh, on several threads: one source for every element.

Numba compiles each loop once for each class of `Blocks`. What is done with one block of that class
is found by its type when the loop is compiled (`implement`).
"""

from collections.abc import Callable

import numpy as np
from numba import prange

from reference_fem.arrays import Array, Index
from reference_fem.compiled import SAFE_MATH, inner, njit, use_for
from reference_fem.elements.blocks import Blocks, Moving, Stored
from reference_fem.elements.stress import lower
from reference_fem.elements.threads import (
    START,
    STOP,
    add_buffers,
    thread_range,
    thread_shares,
    zero_forces,
)


def add_force(
    blocks: Blocks, u: Array, block: int, share: Index, t: int, out: Array, stored: Stored,
    moving: Moving,
) -> None:  # fmt: skip
    """Add the forces of one block, N.

    Where `stored` is given, energies of strains and of hourglass modes, J, are added to its row t.
    With `moving` the forces include damping, whose power is added there, to thread t's.

    u (n_nodes, dim) displacements, m; `share` of thread t as in `threads`.
    """
    raise NotImplementedError(f"{type(blocks).__name__} has no overload of add_force")


def least_det(blocks: Blocks, u: Array, block: int, s: Array) -> float:
    """Smallest det F over the points of one block; NaN if any of them is NaN."""
    raise NotImplementedError(f"{type(blocks).__name__} has no overload of least_det")


def implement(
    kind: type[Blocks],
    force: Callable[[Blocks, Array, int, Index, int, Array, Stored, Moving], None],
    det: Callable[[Blocks, Array, int, Array], float],
) -> None:
    """Register compiled versions of `add_force` and `least_det` for blocks of `kind`."""
    use_for(add_force, kind, lambda *args: force(*args))
    use_for(least_det, kind, lambda *args: det(*args))


@inner(_nrt=False)
def share_force(
    blocks: Blocks, u: Array, shares: Index, t: int, out: Array, stored: Stored, moving: Moving
) -> None:
    """Forces of thread t's blocks and, if asked for, their energies in row t of `stored`.

    Compiled without reference counts, which take 3 % of the time of a hexahedron.
    """
    zero_forces(blocks, shares, t, out)
    if stored is not None:
        stored[t, 0], stored[t, 1] = 0.0, 0.0
    if moving is not None:
        moving[2][t] = 0.0
    for block in range(shares[t, START], shares[t, STOP]):
        add_force(blocks, u, block, shares[t], t, out, stored, moving)


@njit(cache=True, parallel=True, fastmath=SAFE_MATH)
def internal_force(
    blocks: Blocks, displacement: Array, n_threads: int, out: Array, stored: Stored,
    moving: Moving,
) -> None:  # fmt: skip
    """Internal force of the mesh, (n_nodes, dim), N; the same bits for one number of threads.

    stored : (n_threads, 2), filled as by `add_force`, like the power of `moving`.
    """
    shares = thread_shares(blocks.node_range, n_threads)
    for t in prange(n_threads):
        share_force(blocks, displacement, shares, t, out, stored, moving)
    add_buffers(blocks, shares, out)


@njit(cache=True, parallel=True, fastmath=SAFE_MATH)
def min_dets(blocks: Blocks, displacement: Array, out: Array) -> None:
    """Smallest det F of each thread's blocks, (threads,); NaN if any of them is NaN."""
    for t in prange(len(out)):
        start, stop = thread_range(len(blocks.nodes), t, len(out))
        smallest = np.inf
        for block in range(start, stop):
            smallest = lower(smallest, least_det(blocks, displacement, block, blocks.scratch[t]))
        out[t] = smallest
