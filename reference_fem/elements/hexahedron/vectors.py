"""Nodal vectors of 8 lanes to three rows of 8 numbers and back, transposed in registers.

    x0 y0 z0   x1 y1 z1 ... x7 y7 z7     <->     x0 .. x7,  y0 .. y7,  z0 .. z7

Written in Python, each number takes one load and one store, together slower than the arithmetic of
a 1-point hexahedron. Here LLVM's vectors, which Python cannot express, load a node's numbers at
once, add x and y as a pair, and store a row at once (measured on one thread: 8 to 16 % less time).
Any processor will do: where registers hold fewer than 8 numbers LLVM uses several.

Arrays must be contiguous and indices in bounds; neither is checked. Node numbers (LANES, 8) are
taken at flat places `first`, `first + 8`, ... for lanes 0, 1, ...: one corner of 8 elements.
"""

from functools import reduce
from typing import Any

from llvmlite import ir
from numba import types
from numba.core.cgutils import get_or_insert_function
from numba.extending import intrinsic

WIDTH = 8  # lanes moved at once
CORNERS = 8
DIM = 3
BYTES = 8

DOUBLE = ir.DoubleType()
PAIR = ir.VectorType(DOUBLE, 2)
FOUR = ir.VectorType(DOUBLE, 4)
ROW = ir.VectorType(DOUBLE, WIDTH)
INDEX = ir.IntType(32)
MASK = ir.Constant(ir.VectorType(ir.IntType(1), 4), [1, 1, 1, 0])


def _data(context: Any, builder: Any, kind: Any, array: Any) -> Any:
    return context.make_array(kind)(context, builder, array).data


def _constants(numbers: list[int]) -> ir.Constant:
    return ir.Constant(ir.VectorType(INDEX, len(numbers)), numbers)


# Shuffles of `_store_rows`: ALL joins nodes i and i + 4; of two such, in each half, EVEN takes
# x x z z and ODD y y; of two of these, in each half, FIRST or SECOND takes such pairs.
ALL = _constants([0, 1, 2, 3, 4, 5, 6, 7])
EVEN = _constants([0, 8, 2, 10, 4, 12, 6, 14])
ODD = _constants([1, 9, 3, 11, 5, 13, 7, 15])
FIRST = _constants([0, 1, 8, 9, 4, 5, 12, 13])
SECOND = _constants([2, 3, 10, 11, 6, 7, 14, 15])


def _number(i: int) -> ir.Constant:
    return ir.Constant(INDEX, i)


def _node(builder: Any, array: Any, nodes: Any, first: Any, lane: int) -> Any:
    """Address of the vector at one lane's node."""
    place = builder.add(first, ir.Constant(first.type, lane * CORNERS))
    node = builder.zext(builder.load(builder.gep(nodes, [place])), ir.IntType(64))
    return builder.gep(array, [builder.mul(node, ir.Constant(node.type, DIM))])


def _as(builder: Any, pointer: Any, offset: int, kind: Any) -> Any:
    """Address `offset` numbers further on, as a pointer to another type."""
    there = builder.gep(pointer, [ir.Constant(ir.IntType(64), offset)])
    return builder.bitcast(there, kind.as_pointer())


def _row(builder: Any, s: Any, place: Any) -> Any:
    """Address of a row of 8 numbers."""
    return builder.bitcast(builder.gep(s, [place]), ROW.as_pointer())


def _three(builder: Any, p: Any) -> Any:
    """Load the vector at p without its fourth number (the last node has none after it)."""
    kind = ir.FunctionType(FOUR, [FOUR.as_pointer(), INDEX, MASK.type, FOUR])
    load = get_or_insert_function(builder.module, kind, "llvm.masked.load.v4f64.p0")
    args = [_as(builder, p, 0, FOUR), _number(BYTES), MASK, ir.Constant(FOUR, ir.Undefined)]
    return builder.call(load, args)


def _store_rows(builder: Any, threes: list[Any], out: Any, place: Any, stride: Any) -> None:
    """Store the first, second and third numbers of 8 vectors as rows."""
    shuffle = builder.shuffle_vector
    both = [shuffle(a, b, ALL) for a, b in zip(threes[:4], threes[4:], strict=True)]
    xz = [shuffle(a, b, EVEN) for a, b in (both[:2], both[2:])]
    y = [shuffle(a, b, ODD) for a, b in (both[:2], both[2:])]
    for row in (shuffle(*xz, FIRST), shuffle(*y, FIRST), shuffle(*xz, SECOND)):
        builder.store(row, _row(builder, out, place), align=BYTES)
        place = builder.add(place, stride)


@intrinsic
def take_rows(
    _: Any, values: Any, more: Any, nodes: Any, first: Any, s: Any, o: Any, stride: Any
) -> Any:
    """Set s[o + i stride + lane] = values[nodes.flat[first + 8 lane], i], values (n_nodes, 3).

    Unless `more` is None, its vectors are added to those of `values`.
    """

    def code(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        kinds, threes = signature.args, []
        fields = [n for n in (0, 1) if kinds[n] != types.none]
        arrays = [_data(context, builder, kinds[n], args[n]) for n in fields]
        numbers, out = (_data(context, builder, kinds[n], args[n]) for n in (2, 4))
        for lane in range(WIDTH):
            at = (_node(builder, array, numbers, args[3], lane) for array in arrays)
            threes.append(reduce(builder.fadd, [_three(builder, p) for p in at]))
        _store_rows(builder, threes, out, args[5], args[6])
        return context.get_dummy_value()

    return types.none(values, more, nodes, types.int64, s, types.int64, types.int64), code


@intrinsic
def add_rows(_: Any, s: Any, o: Any, stride: Any, values: Any, nodes: Any, first: Any) -> Any:
    """Add s[o + i stride + lane] to values[nodes.flat[first + 8 lane], i], lane after lane."""

    def code(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        kinds = signature.args
        rows, place = [], args[1]
        source = _data(context, builder, kinds[0], args[0])
        array = _data(context, builder, kinds[3], args[3])
        numbers = _data(context, builder, kinds[4], args[4])
        for _i in range(DIM):
            rows.append(builder.load(_row(builder, source, place), align=BYTES))
            place = builder.add(place, args[2])
        for lane in range(WIDTH):
            p = _node(builder, array, numbers, args[5], lane)
            pair = builder.shuffle_vector(rows[0], rows[1], _constants([lane, WIDTH + lane]))
            z = builder.extract_element(rows[2], _number(lane))
            for value, kind, offset in ((pair, PAIR, 0), (z, DOUBLE, 2)):
                there = _as(builder, p, offset, kind)
                total = builder.fadd(builder.load(there, align=BYTES), value)
                builder.store(total, there, align=BYTES)
        return context.get_dummy_value()

    return types.none(s, types.int64, types.int64, values, nodes, types.int64), code
