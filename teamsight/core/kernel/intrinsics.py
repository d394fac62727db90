"""Intrinsics that numba lacks, such as arrays at an address and calls of other entries."""

from __future__ import annotations

from typing import Any

import numba
from llvmlite import ir
from numba.core import cgutils
from numba.extending import intrinsic
from numba.np.arrayobj import make_array, populate_array

_CACHE_LINE = 64
WORD = ir.IntType(64)


def array_value(context: Any, builder: Any, array: Any, data: Any, lengths: list[Any]) -> Any:
    """Write code that makes an array of numba's type `array`, in C order, at an address or a pointer."""
    element = context.get_data_type(array.dtype)
    itemsize = cgutils.intp_t(context.get_abi_sizeof(element))
    if not isinstance(data.type, ir.PointerType):
        data = builder.inttoptr(data, element.as_pointer())
    strides, step = [], itemsize
    for length in reversed(lengths):
        strides.append(step)
        step = builder.mul(step, length)
    result = make_array(array)(context, builder)
    populate_array(result, data=data, shape=lengths, strides=strides[::-1], itemsize=itemsize, meminfo=None)
    return result._getvalue()


@intrinsic  # type: ignore[untyped-decorator]
def array_at(typing_context: Any, address: Any, shape: Any, dtype: Any) -> Any:
    """Return the array of this shape and dtype, in C order, at an address.

    `shape` is an int or a tuple of int, `dtype` a constant: a type such as ``np.float64``, or a structured dtype.
    """
    element = dtype.dtype
    dimensions = len(shape) if isinstance(shape, numba.types.BaseTuple) else 1
    array = numba.types.Array(element, dimensions, "C")

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        lengths = cgutils.unpack_tuple(builder, arguments[1]) if dimensions > 1 else [arguments[1]]
        kinds = list(shape) if dimensions > 1 else [shape]
        lengths = [context.cast(builder, n, kind, numba.types.intp) for n, kind in zip(lengths, kinds, strict=True)]
        return array_value(context, builder, array, arguments[0], lengths)

    return array(address, shape, dtype), generate


@intrinsic(prefer_literal=True)  # type: ignore[untyped-decorator]
def scratch(typing_context: Any, count: Any, dtype: Any) -> Any:
    """Return an uninitialised array of `count` numbers on the stack, valid until the present entry returns.

    `count` and `dtype` are constants. Each execution of the line in a call returns the same array: clear it before use.
    """
    if not isinstance(count, numba.types.IntegerLiteral):
        return None
    array = numba.types.Array(dtype.dtype, 1, "C")

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        length = cgutils.intp_t(count.literal_value)
        with builder.goto_entry_block():
            room = builder.alloca(context.get_data_type(array.dtype), length)
            room.align = _CACHE_LINE
        return array_value(context, builder, array, room, [length])

    return array(count, dtype), generate


def _in_all(builder: Any, lanes: Any, value: Any) -> Any:
    """Write code that makes a vector of this type whose lanes all have one value."""
    undefined, first = ir.Constant(lanes, ir.Undefined), ir.Constant(ir.IntType(32), 0)
    one = builder.insert_element(undefined, value, first)
    zeros = ir.Constant(ir.VectorType(ir.IntType(32), lanes.count), [0] * lanes.count)
    return builder.shuffle_vector(one, undefined, zeros)


def _lanes_at(context: Any, builder: Any, kind: Any, value: Any, first: Any, element: Any, count: int = 8) -> Any:
    """Write code that returns a pointer to the elements of an array that begin at the index `first`, as a vector."""
    place = builder.gep(make_array(kind)(context, builder, value).data, [first])
    return builder.bitcast(place, ir.VectorType(element, count).as_pointer())


def _below(count: int, values: Any) -> tuple[Any, Any]:
    """Return the signature and the generator of an intrinsic that compares `count` float32 with a limit."""

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        place = _lanes_at(context, builder, values, arguments[0], arguments[1], ir.FloatType(), count)
        limits = _in_all(builder, place.type.pointee, arguments[2])
        bits = builder.fcmp_ordered("<", builder.load(place, align=4), limits)
        word = builder.bitcast(bits, ir.IntType(count))
        return builder.zext(word, WORD) if count < 64 else word

    return numba.types.uint64(values, numba.types.int64, numba.types.float32), generate


@intrinsic  # type: ignore[untyped-decorator]
def below_8(typing_context: Any, values: Any, first: Any, limit: Any) -> Any:
    """Return a word in which bit i is set if ``values[first + i] < limit``, for 8 float32 that lie side by side."""
    return _below(8, values)


@intrinsic  # type: ignore[untyped-decorator]
def below_64(typing_context: Any, values: Any, first: Any, limit: Any) -> Any:
    """Return a word in which bit i is set if ``values[first + i] < limit``, for 64 float32 that lie side by side."""
    return _below(64, values)


@intrinsic  # type: ignore[untyped-decorator]
def ones(typing_context: Any, word: Any) -> Any:
    """Return the number of bits of a word that are set."""

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        return builder.ctpop(arguments[0])

    return numba.types.int64(numba.types.uint64), generate


def _same_bits(result: Any, given: Any) -> tuple[Any, Any]:
    """Return the signature and the generator of an intrinsic that takes the bits of a number for another type."""

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        return builder.bitcast(arguments[0], context.get_data_type(result))

    return result(given), generate


@intrinsic  # type: ignore[untyped-decorator]
def bits_of(typing_context: Any, number: Any) -> Any:
    """Return the bits of a float64 as a word."""
    return _same_bits(numba.types.uint64, numba.types.float64)


@intrinsic  # type: ignore[untyped-decorator]
def float_of(typing_context: Any, word: Any) -> Any:
    """Return the float64 with these bits."""
    return _same_bits(numba.types.float64, numba.types.uint64)


@intrinsic  # type: ignore[untyped-decorator]
def near_eight(typing_context: Any, xs: Any, ys: Any, first: Any, x: Any, y: Any, limit: Any) -> Any:
    """Return a word in which bit i is set if point ``first + i`` is within the squared distance, for 8 points."""

    def is_near(builder: Any, way_x: Any, way_y: Any, limit: Any) -> Any:
        square = builder.fadd(builder.fmul(way_x, way_x), builder.fmul(way_y, way_y))
        return builder.fcmp_ordered("<=", square, limit)

    return _compare_eight(xs, ys, is_near)


@intrinsic  # type: ignore[untyped-decorator]
def near_eight_in_square(typing_context: Any, xs: Any, ys: Any, first: Any, x: Any, y: Any, limit: Any) -> Any:
    """Return a word in which bit i is set if point ``first + i`` is within `limit` along both axes, for 8 points."""

    def is_near(builder: Any, way_x: Any, way_y: Any, limit: Any) -> Any:
        # All comparisons are false for NaN.
        sides = [
            builder.and_(builder.fcmp_ordered("<=", way, limit), builder.fcmp_ordered(">=", way, builder.fneg(limit)))
            for way in (way_x, way_y)
        ]
        return builder.and_(*sides)

    return _compare_eight(xs, ys, is_near)


def _compare_eight(xs: Any, ys: Any, is_near: Any) -> tuple[Any, Any]:
    """Return the signature and the generator of an intrinsic that compares 8 points with one place."""

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        *axes, first, x, y, limit = arguments
        ways = []
        for kind, values, middle in zip((xs, ys), axes, (x, y), strict=True):
            place = _lanes_at(context, builder, kind, values, first, ir.DoubleType())
            ways.append(builder.fsub(builder.load(place, align=8), _in_all(builder, place.type.pointee, middle)))
        bits = is_near(builder, *ways, _in_all(builder, place.type.pointee, limit))
        return builder.zext(builder.bitcast(bits, ir.IntType(8)), WORD)

    f8 = numba.types.float64
    return numba.types.uint64(xs, ys, numba.types.int64, f8, f8, f8), generate


@intrinsic  # type: ignore[untyped-decorator]
def put_eight_parts(typing_context: Any, values: Any, first: Any, low: Any, factor: Any, out: Any, at: Any) -> Any:
    """Write the nearest whole numbers to ``(values - low) * factor``, minus 32,768, for 8 elements from `first` on.

    `values` is an array of float64, `out` one of int16; what is written must be in its range. `low` and `factor` are
    tuples of two float64: for every other element, from the first on, and for those after them.
    """

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        lanes, words = ir.VectorType(ir.DoubleType(), 8), ir.VectorType(ir.IntType(32), 8)

        def by_turns(pair: Any) -> Any:
            one, other = (_in_all(builder, lanes, number) for number in cgutils.unpack_tuple(builder, pair))
            order = ir.Constant(ir.VectorType(ir.IntType(32), 8), [lane + 8 * (lane % 2) for lane in range(8)])
            return builder.shuffle_vector(one, other, order)

        place = _lanes_at(context, builder, signature.args[0], arguments[0], arguments[1], ir.DoubleType())
        part = builder.fmul(builder.fsub(builder.load(place, align=8), by_turns(arguments[2])), by_turns(arguments[3]))
        whole = builder.fptosi(builder.fadd(part, ir.Constant(lanes, [0.5] * 8)), words)
        shorts = builder.trunc(builder.sub(whole, ir.Constant(words, [32_768] * 8)), ir.VectorType(ir.IntType(16), 8))
        place = _lanes_at(context, builder, signature.args[4], arguments[4], arguments[5], ir.IntType(16))
        builder.store(shorts, place, align=2)
        return context.get_dummy_value()

    i8, two = numba.types.int64, numba.types.UniTuple(numba.types.float64, 2)
    return numba.types.void(values, i8, two, two, out, i8), generate


@intrinsic  # type: ignore[untyped-decorator]
def put_eight_bytes(typing_context: Any, values: Any, first: Any, out: Any, at: Any) -> Any:
    """Write the lowest bytes of 8 int64, from `first` on, into an array of uint8."""

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        place = _lanes_at(context, builder, signature.args[0], arguments[0], arguments[1], WORD)
        low = builder.trunc(builder.load(place, align=8), ir.VectorType(ir.IntType(8), 8))
        place = _lanes_at(context, builder, signature.args[2], arguments[2], arguments[3], ir.IntType(8))
        builder.store(low, place, align=1)
        return context.get_dummy_value()

    return numba.types.void(values, numba.types.int64, out, numba.types.int64), generate


@intrinsic  # type: ignore[untyped-decorator]
def equal_eight(typing_context: Any, values: Any, first: Any, one: Any, other: Any) -> Any:
    """Return a word in which bit i is set if ``values[first + i]`` is one of two numbers, for 8 int64."""

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        lanes = ir.VectorType(WORD, 8)
        place = _lanes_at(context, builder, signature.args[0], arguments[0], arguments[1], WORD)
        eight = builder.load(place, align=8)
        found = [builder.icmp_signed("==", eight, _in_all(builder, lanes, wanted)) for wanted in arguments[2:]]
        return builder.zext(builder.bitcast(builder.or_(*found), ir.IntType(8)), WORD)

    i8 = numba.types.int64
    return numba.types.uint64(values, i8, i8, i8), generate


@intrinsic  # type: ignore[untyped-decorator]
def call(typing_context: Any, entry: Any, record: Any) -> Any:
    """Call the entry at address `entry` on the record at address `record`; return its status."""

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        function = builder.inttoptr(arguments[0], ir.FunctionType(WORD, [WORD]).as_pointer())
        return builder.call(function, [arguments[1]])

    return numba.types.int64(numba.types.int64, numba.types.int64), generate
