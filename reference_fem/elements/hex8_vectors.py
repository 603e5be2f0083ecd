"""Nodal vectors of 8 lanes to three rows of 8 numbers and back, transposed in registers.

    x0 y0 z0   x1 y1 z1 ... x7 y7 z7     <->     x0 .. x7,  y0 .. y7,  z0 .. z7

In numba's Python each number is one load and one store, together longer than the arithmetic of a
1-point hexahedron. Here, in LLVM's own vectors for which Python has no words, x and y of a node
move as a pair and a row is stored at once (measured on one thread: 8 to 16 % less time). Any
processor will do: where registers hold fewer than 8 numbers LLVM takes several.

Arrays are contiguous and indices in bounds; neither is checked. Node numbers (LANES, 8) are taken
at flat places `first`, `first + 8`, ... for lanes 0, 1, ...: one corner of 8 elements.
"""

from typing import Any

from llvmlite import ir
from numba import types
from numba.extending import intrinsic

WIDTH = 8  # lanes moved at once
CORNERS = 8
DIM = 3
BYTES = 8

DOUBLE = ir.DoubleType()
PAIR = ir.VectorType(DOUBLE, 2)
ROW = ir.VectorType(DOUBLE, WIDTH)
INDEX = ir.IntType(32)


def _data(context: Any, builder: Any, kind: Any, array: Any) -> Any:
    return context.make_array(kind)(context, builder, array).data


def _constants(numbers: list[int]) -> ir.Constant:
    return ir.Constant(ir.VectorType(INDEX, len(numbers)), numbers)


def _number(i: int) -> ir.Constant:
    return ir.Constant(INDEX, i)


def _node(builder: Any, array: Any, nodes: Any, first: Any, lane: int) -> Any:
    """Address of the vector at one lane's node."""
    place = builder.add(first, ir.Constant(first.type, lane * CORNERS))
    node = builder.zext(builder.load(builder.gep(nodes, [place])), ir.IntType(64))
    return builder.gep(array, [builder.mul(node, ir.Constant(node.type, DIM))])


def _as(builder: Any, pointer: Any, offset: int, kind: Any) -> Any:
    """Address `offset` numbers further on, of something of another type."""
    there = builder.gep(pointer, [ir.Constant(ir.IntType(64), offset)])
    return builder.bitcast(there, kind.as_pointer())


def _row(builder: Any, s: Any, place: Any) -> Any:
    """Address of a row of 8 numbers."""
    return builder.bitcast(builder.gep(s, [place]), ROW.as_pointer())


def _concatenate(builder: Any, parts: list[Any]) -> Any:
    """One vector of all numbers of several."""
    while len(parts) > 1:
        size = 2 * parts[0].type.count
        together = _constants(list(range(size)))
        parts = [
            builder.shuffle_vector(a, b, together)
            for a, b in zip(parts[::2], parts[1::2], strict=True)
        ]
    return parts[0]


@intrinsic
def take_rows(_: Any, values: Any, nodes: Any, first: Any, s: Any, o: Any, stride: Any) -> Any:
    """Set s[o + i stride + lane] = values[nodes.flat[first + 8 lane], i], values (n_nodes, 3)."""

    def code(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        kinds = signature.args
        array = _data(context, builder, kinds[0], args[0])
        numbers = _data(context, builder, kinds[1], args[1])
        out = _data(context, builder, kinds[3], args[3])
        at = [_node(builder, array, numbers, args[2], lane) for lane in range(WIDTH)]
        pairs = [builder.load(_as(builder, p, 0, PAIR), align=BYTES) for p in at]
        low = _concatenate(builder, pairs[: WIDTH // 2])
        high = _concatenate(builder, pairs[WIDTH // 2 :])
        even = _constants(list(range(0, 2 * WIDTH, 2)))
        odd = _constants(list(range(1, 2 * WIDTH, 2)))
        third = ir.Constant(ROW, ir.Undefined)
        for lane, p in enumerate(at):
            z = builder.load(_as(builder, p, 2, DOUBLE), align=BYTES)
            third = builder.insert_element(third, z, _number(lane))
        rows = (
            builder.shuffle_vector(low, high, even),
            builder.shuffle_vector(low, high, odd),
            third,
        )
        place = args[4]
        for row in rows:
            builder.store(row, _row(builder, out, place), align=BYTES)
            place = builder.add(place, args[5])
        return context.get_dummy_value()

    return types.none(values, nodes, types.int64, s, types.int64, types.int64), code


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
