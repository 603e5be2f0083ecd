"""Rows of numbers and the frames of compiled kernels begin cache lines.

A frame is where a kernel keeps the numbers that its registers don't hold. Numba's functions may
find their stack at any multiple of 16 bytes. Vectors of 64 bytes that a kernel sets aside there lie
across two cache lines with three starts out of four, and it depends on the callers, the thread and
the run which it is (measured: 1-point arithmetic 17.2 or 20.4 ns an element).
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
        # no instruction, but LLVM must believe that it uses the place, which else would go
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
