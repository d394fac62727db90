"""The machine code of intrinsics and of what reads records; imported when the first kernel is compiled."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.core.typing.templates import make_intrinsic_template
from numba.np.arrayobj import make_array, populate_array
from numba.np.numpy_support import from_dtype

if TYPE_CHECKING:
    from teamsight.core.kernel.parts import Intrinsic
    from teamsight.core.kernel.record import Length, Node

_CACHE_LINE = 64
WORD = ir.IntType(64)


def type_of(intrinsic: Intrinsic) -> Any:
    """Return numba's type of an intrinsic; the function here of the same name types it and writes its code."""
    node = intrinsic.identity
    typed = globals()[intrinsic.__name__] if node is None else _unpacking(node)
    prefers_literal = intrinsic.__name__ == "scratch"
    return types.Function(make_intrinsic_template(intrinsic, typed, intrinsic.__name__, prefer_literal=prefers_literal))


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


def array_at(typing_context: Any, address: Any, shape: Any, dtype: Any) -> Any:
    element = dtype.dtype
    dimensions = len(shape) if isinstance(shape, types.BaseTuple) else 1
    array = types.Array(element, dimensions, "C")

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        lengths = cgutils.unpack_tuple(builder, arguments[1]) if dimensions > 1 else [arguments[1]]
        kinds = list(shape) if dimensions > 1 else [shape]
        lengths = [context.cast(builder, n, kind, types.intp) for n, kind in zip(lengths, kinds, strict=True)]
        return array_value(context, builder, array, arguments[0], lengths)

    return array(address, shape, dtype), generate


def scratch(typing_context: Any, count: Any, dtype: Any) -> Any:
    if not isinstance(count, types.IntegerLiteral):
        return None
    array = types.Array(dtype.dtype, 1, "C")

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

    return types.uint64(values, types.int64, types.float32), generate


def below_8(typing_context: Any, values: Any, first: Any, limit: Any) -> Any:
    return _below(8, values)


def below_64(typing_context: Any, values: Any, first: Any, limit: Any) -> Any:
    return _below(64, values)


def ones(typing_context: Any, word: Any) -> Any:
    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        return builder.ctpop(arguments[0])

    return types.int64(types.uint64), generate


def trailing_zeros(typing_context: Any, word: Any) -> Any:
    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        return builder.cttz(arguments[0], ir.Constant(ir.IntType(1), 0))

    return word(word), generate


def _same_bits(result: Any, given: Any) -> tuple[Any, Any]:
    """Return the signature and the generator of an intrinsic that takes the bits of a number for another type."""

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        return builder.bitcast(arguments[0], context.get_data_type(result))

    return result(given), generate


def bits_of(typing_context: Any, number: Any) -> Any:
    return _same_bits(types.uint64, types.float64)


def float_of(typing_context: Any, word: Any) -> Any:
    return _same_bits(types.float64, types.uint64)


def near_eight(typing_context: Any, xs: Any, ys: Any, first: Any, x: Any, y: Any, limit: Any) -> Any:
    def is_near(builder: Any, way_x: Any, way_y: Any, limit: Any) -> Any:
        square = builder.fadd(builder.fmul(way_x, way_x), builder.fmul(way_y, way_y))
        return builder.fcmp_ordered("<=", square, limit)

    return _compare_eight(xs, ys, is_near)


def near_eight_in_square(typing_context: Any, xs: Any, ys: Any, first: Any, x: Any, y: Any, limit: Any) -> Any:
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

    f8 = types.float64
    return types.uint64(xs, ys, types.int64, f8, f8, f8), generate


def put_eight_parts(typing_context: Any, values: Any, first: Any, low: Any, factor: Any, out: Any, at: Any) -> Any:
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

    i8, two = types.int64, types.UniTuple(types.float64, 2)
    return types.void(values, i8, two, two, out, i8), generate


def put_eight_bytes(typing_context: Any, values: Any, first: Any, out: Any, at: Any) -> Any:
    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        place = _lanes_at(context, builder, signature.args[0], arguments[0], arguments[1], WORD)
        low = builder.trunc(builder.load(place, align=8), ir.VectorType(ir.IntType(8), 8))
        place = _lanes_at(context, builder, signature.args[2], arguments[2], arguments[3], ir.IntType(8))
        builder.store(low, place, align=1)
        return context.get_dummy_value()

    return types.void(values, types.int64, out, types.int64), generate


def equal_eight(typing_context: Any, values: Any, first: Any, one: Any, other: Any) -> Any:
    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        lanes = ir.VectorType(WORD, 8)
        place = _lanes_at(context, builder, signature.args[0], arguments[0], arguments[1], WORD)
        eight = builder.load(place, align=8)
        found = [builder.icmp_signed("==", eight, _in_all(builder, lanes, wanted)) for wanted in arguments[2:]]
        return builder.zext(builder.bitcast(builder.or_(*found), ir.IntType(8)), WORD)

    i8 = types.int64
    return types.uint64(values, i8, i8, i8), generate


def call(typing_context: Any, entry: Any, record: Any) -> Any:
    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        function = builder.inttoptr(arguments[0], ir.FunctionType(WORD, [WORD]).as_pointer())
        return builder.call(function, [arguments[1]])

    return types.int64(types.int64, types.int64), generate


def _unpacking(node: Node) -> Any:
    """Return the function that types and writes what reads a record."""

    def unpack(typing_context: Any, address: Any) -> Any:
        if not isinstance(address, types.Integer):
            return None
        kind = _type(node)

        def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
            words = builder.inttoptr(arguments[0], WORD.as_pointer())
            return _value(context, builder, words, node, kind)

        return kind(types.int64), generate

    return unpack


def _type(part: Any) -> Any:
    """Return numba's type of a part of a record, a `Node` or a `Leaf`."""
    if hasattr(part, "parts"):
        return types.BaseTuple.from_types([_type(inner) for inner in part.parts], part.kind)
    if part.dtype is None:
        return types.int64
    element = from_dtype(part.dtype)
    if part.lengths is None:
        return element
    return types.Array(element, len(part.lengths), "C", readonly=part.is_read_only)


def _value(context: Any, builder: Any, words: Any, part: Any, kind: Any) -> Any:
    """Write code that reads a part of a record."""
    if hasattr(part, "parts"):
        values = [
            _value(context, builder, words, inner, inner_kind)
            for inner, inner_kind in zip(part.parts, kind.types, strict=True)
        ]
        return context.make_tuple(builder, kind, values)
    word = _load_word(builder, words, part.slot)
    if part.lengths is None:
        return builder.bitcast(word, ir.DoubleType()) if kind == types.float64 else word
    lengths = [_length_value(builder, words, length) for length in part.lengths]
    return array_value(context, builder, kind, word, lengths)


def _load_word(builder: Any, words: Any, slot: int) -> Any:
    """Write code that reads a word of a record."""
    return builder.load(builder.gep(words, [WORD(slot)]))


def _length_value(builder: Any, words: Any, length: Length) -> Any:
    if length.slot < 0:
        return cgutils.intp_t(length.plus)
    if length.last:
        address, slot, plus = length.last
        array = builder.inttoptr(_load_word(builder, words, address), WORD.as_pointer())
        at = builder.add(_load_word(builder, words, slot), WORD(plus - 1))
        return builder.load(builder.gep(array, [at]))
    size = _load_word(builder, words, length.slot)
    return builder.add(size, WORD(length.plus)) if length.plus else size
