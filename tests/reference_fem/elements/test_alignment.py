"""Rows of 8 numbers and the frames of compiled kernels begin cache lines."""

import platform

import numpy as np
import pytest
from numba import njit

from reference_fem.elements.alignment import LINE, aligned, aligned_frame


@pytest.mark.parametrize("shape", [(1,), (3, 16), (2, 5, 7)])
def test_aligned_copies_hold_the_same_and_begin_a_cache_line(shape: tuple[int, ...]) -> None:
    values = np.random.default_rng(1).standard_normal(shape)
    for _ in range(20):  # malloc's places differ
        copy = aligned(values)
        assert copy.ctypes.data % LINE == 0
        assert copy.flags.c_contiguous
        assert np.array_equal(copy, values)


@pytest.mark.skipif(platform.machine() != "x86_64", reason="reads the machine code of x86_64")
def test_a_frame_begins_a_cache_line() -> None:
    @njit
    def plain(x):
        return 2.0 * x

    @njit
    def framed(x):
        aligned_frame()
        return 2.0 * x

    assert plain(3.0) == framed(3.0) == 6.0
    (without,), (with_frame,) = plain.inspect_asm().values(), framed.inspect_asm().values()
    assert f"$-{LINE}, %rsp" in with_frame
    assert f"$-{LINE}, %rsp" not in without
