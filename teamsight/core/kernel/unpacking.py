"""Machine code that reads a record: from its address to a NamedTuple of arrays and numbers."""

from __future__ import annotations

from typing import Any

import numba
from llvmlite import ir
from numba.core import cgutils
from numba.extending import intrinsic

from teamsight.core.kernel.intrinsics import array_value
from teamsight.core.kernel.layout import Leaf, Length, Node

_WORD = ir.IntType(64)


def unpacking(node: Node, guards: Any = None) -> Any:
    """Return the kernel that reads a record.

    Parameters
    ----------
    node : Node
        The layout.
    guards : guarded_record.Guards, optional
        Makes its arrays guarded; in worlds they are plain.
    """

    def unpack(typing_context: Any, address: Any) -> Any:
        if not isinstance(address, numba.types.Integer):
            return None
        kind = _type(node, guards)

        def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
            words = builder.inttoptr(arguments[0], _WORD.as_pointer())
            return _value(context, builder, words, node, kind, guards)

        return kind(numba.types.int64), generate

    made = intrinsic(unpack)
    # Guarded copies of kernels replace it by `guarded_at(node)`.
    made.node = node
    return made


def _type(part: Node | Leaf, guards: Any) -> Any:
    """Return numba's type of a part of a record."""
    if isinstance(part, Node):
        types = [_type(inner, guards) for inner in part.parts]
        return numba.types.BaseTuple.from_types(types, part.kind)
    if part.dtype is None:
        return numba.types.int64
    element = numba.from_dtype(part.dtype)
    if part.lengths is None:
        return element
    array = numba.types.Array(element, len(part.lengths), "C")
    return guards.kind(array) if guards else array


def _value(context: Any, builder: Any, words: Any, part: Node | Leaf, kind: Any, guards: Any) -> Any:
    """Write code that reads a part of a record."""
    if isinstance(part, Node):
        values = [
            _value(context, builder, words, inner, inner_kind, guards)
            for inner, inner_kind in zip(part.parts, kind.types, strict=True)
        ]
        return context.make_tuple(builder, kind, values)
    word = load_word(builder, words, part.slot)
    if part.lengths is None:
        return builder.bitcast(word, ir.DoubleType()) if kind == numba.types.float64 else word
    lengths = [_length_value(builder, words, length) for length in part.lengths]
    array = array_value(context, builder, kind, word, lengths)
    return guards.value(context, builder, part, kind, array, words) if guards else array


def load_word(builder: Any, words: Any, slot: int) -> Any:
    """Write code that reads a word of a record."""
    return builder.load(builder.gep(words, [_WORD(slot)]))


def _length_value(builder: Any, words: Any, length: Length) -> Any:
    if length.slot < 0:
        return cgutils.intp_t(length.plus)
    if length.last:
        address, slot, plus = length.last
        array = builder.inttoptr(load_word(builder, words, address), _WORD.as_pointer())
        at = builder.add(load_word(builder, words, slot), _WORD(plus - 1))
        return builder.load(builder.gep(array, [at]))
    size = load_word(builder, words, length.slot)
    return builder.add(size, _WORD(length.plus)) if length.plus else size
