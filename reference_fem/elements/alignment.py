"""Rows of numbers and the frames of compiled kernels begin cache lines.

A frame is where a kernel keeps the numbers that its registers don't hold. The stack of numba's
functions may start at any multiple of 16 bytes. With three starts out of four the 64-byte vectors
that a kernel keeps there lie across two cache lines, and the start depends on the callers, the
thread and the run (measured: 1-point arithmetic 17.2 or 20.4 ns an element).
"""

from typing import Any

import numpy as np
from llvmlite import ir
from numba import types
from numba.extending import intrinsic

from reference_fem.arrays import Array

LINE = 64  # bytes of a cache line; a vector of 8 numbers that lies across two of them costs twice


@intrinsic
def aligned_frame(_: Any) -> Any:
    """Have the calling function's frame begin a cache line."""

    def code(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        with builder.goto_entry_block():
            place = builder.alloca(ir.IntType(8))
        place.align = LINE
        # no instruction, but LLVM believes that it uses the place and does not remove it
        nothing = ir.FunctionType(ir.VoidType(), [place.type])
        builder.asm(nothing, "", "r", [place], side_effect=True)
        return context.get_dummy_value()

    return types.none(), code


def aligned(values: Array) -> Array:
    """A copy whose first number begins a cache line, as then every row of 8 lanes does."""
    room = np.empty(values.size + LINE // values.itemsize)
    first = -room.ctypes.data % LINE // values.itemsize
    copy = room[first : first + values.size].reshape(values.shape)
    copy[...] = values
    return copy
