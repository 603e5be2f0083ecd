"""Rows of nodal vectors, taken and added by vector instructions, against numpy."""

import ctypes
import mmap

import numpy as np
from numba import njit

from reference_fem.elements.hexahedron.vectors import CORNERS, WIDTH, add_rows, take_rows

NO_ACCESS = 0  # of mprotect
STRIDE, PLACE = 3 * WIDTH, 5  # rows further apart than they are long, at no multiple of 8


@njit
def take(values, more, nodes, first, s):
    take_rows(values, more, nodes, first, s, PLACE, STRIDE)


@njit
def add(s, values, nodes, first):
    add_rows(s, PLACE, STRIDE, values, nodes, first)


def rows_of(s: np.ndarray) -> np.ndarray:
    return np.array([s[PLACE + i * STRIDE :][:WIDTH] for i in range(3)])


def nodes_of(n_nodes: int) -> np.ndarray:
    """Two groups of lanes, with nodes that come back and the last one, whose end is memory's."""
    nodes = np.random.default_rng(3).integers(0, n_nodes, (2 * WIDTH, CORNERS)).astype(np.uint32)
    nodes[3] = nodes[4]
    nodes[-1] = n_nodes - 1
    return nodes


def test_rows_hold_what_the_nodes_of_one_corner_hold_and_nothing_else_is_touched() -> None:
    values, others = np.random.default_rng(4).standard_normal((2, 20, 3))
    nodes = nodes_of(20)
    for corner in range(CORNERS):
        for lane in (0, WIDTH):
            s = np.full(PLACE + 3 * STRIDE, np.nan)
            take(values, None, nodes, lane * CORNERS + corner, s)
            assert np.array_equal(rows_of(s), values[nodes[lane : lane + WIDTH, corner]].T)
            assert np.isfinite(s).sum() == 3 * WIDTH
            s[:] = np.nan
            take(values, others, nodes, lane * CORNERS + corner, s)
            sums = (values + others)[nodes[lane : lane + WIDTH, corner]].T
            assert np.array_equal(rows_of(s), sums)
            assert np.isfinite(s).sum() == 3 * WIDTH


def test_nothing_behind_the_last_node_is_read() -> None:
    """The last node's numbers end where a page does that must not be read."""
    page = mmap.PAGESIZE
    room = mmap.mmap(-1, 2 * page)
    values = np.frombuffer(room, dtype=np.float64)[: page // 8][-20 * 3 :].reshape(20, 3)
    values[:] = np.random.default_rng(4).standard_normal((20, 3))
    start = values.ctypes.data + values.nbytes
    libc = ctypes.CDLL(None, use_errno=True)
    assert libc.mprotect(ctypes.c_void_p(start), page, NO_ACCESS) == 0
    s = np.full(PLACE + 3 * STRIDE, np.nan)
    take(values, None, np.full((WIDTH, CORNERS), 19, dtype=np.uint32), 0, s)
    assert np.array_equal(rows_of(s), np.repeat(values[19][:, None], WIDTH, axis=1))


def test_rows_add_up_where_lanes_share_a_node() -> None:
    """The order of lanes is the order of the sum, so the bits are those of a loop."""
    rng = np.random.default_rng(5)
    nodes = nodes_of(20)
    for corner in range(CORNERS):
        for lane in (0, WIDTH):
            s, found = rng.standard_normal(PLACE + 3 * STRIDE), rng.standard_normal((20, 3))
            expected = found.copy()
            for node, vector in zip(nodes[lane : lane + WIDTH, corner], rows_of(s).T, strict=True):
                expected[node] += vector
            add(s, found, nodes, lane * CORNERS + corner)
            assert np.array_equal(found, expected)
