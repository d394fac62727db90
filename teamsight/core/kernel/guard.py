"""Guarded arrays: an access outside of one stops the kernel and is reported.

The checks of policies, degrees of awareness and arenas run kernels on such arrays. Code for worlds has no bounds
checks, and both NumPy and numba let negative indices count from the end; here every index must be at least 0 and below
the length of its axis, and read-only arrays cannot be written.

`Guarded` is numba's array type with other code for reading and writing elements; all else is inherited. A number that
identifies the array is passed on to all its views, in the field `parent` of numba's array structure, which is unused in
code without reference counting.
"""

from __future__ import annotations

import ctypes
import operator
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, NamedTuple

import llvmlite.binding
import numba
from llvmlite import ir
from numba.core import cgutils
from numba.core.datamodel import models, register_default
from numba.core.lowering import BaseLower
from numba.extending import intrinsic, lower_builtin
from numba.np import arrayobj

from teamsight.core.kernel import array_at, below_8, below_64, scratch
from teamsight.core.kernel.digest import digest
from teamsight.core.kernel.errors import shown

#: Added to the number of an array that a kernel may only read.
READ_ONLY = 1 << 8
#: The number of an array, plus this times n, leaves the elements from n on of its last axis out of bounds.
LIMIT = 1 << 16

_NUMBA = str(Path(numba.__file__).parent)
_WORD = ir.IntType(64)


class Access(NamedTuple):
    """A forbidden access."""

    array: int  # its number, as given to `numbered`; 0 for one that the kernel made itself
    dimensions: int  # the number of axes of the array or view
    axis: int  # that of the wrong index; −1 for a write to a read-only array
    at: int  # the index
    size: int  # the number of elements along the axis
    place: str  # the file and the line


class Guarded(numba.types.Array):  # type: ignore[misc]
    """The type of guarded arrays and of their views."""

    def __init__(self, dtype: Any, ndim: int, layout: str, readonly: bool = False, aligned: bool = True) -> None:
        name = f"guarded({dtype}, {ndim}d, {layout}, {readonly}, {aligned})"
        super().__init__(dtype, ndim, layout, readonly=readonly, name=name, aligned=aligned)

    def copy(self, dtype: Any = None, ndim: Any = None, layout: Any = None, readonly: Any = None) -> Guarded:
        """Return the type of a view."""
        return guarded_type(super().copy(dtype, ndim, layout, readonly))

    def unify(self, typing_context: Any, other: Any) -> Any:
        """Return the common type of two arrays."""
        common = super().unify(typing_context, other)
        return None if common is None else guarded_type(common)


register_default(Guarded)(models.ArrayModel)


def guarded_type(array: Any) -> Guarded:
    """Return the guarded type that corresponds to one of numba's array types."""
    return Guarded(array.dtype, array.ndim, array.layout, not array.mutable, array.aligned)


class Watch(NamedTuple):
    """The forbidden accesses of guarded kernels, and the exceptions that they raised."""

    accesses: list[Access]
    raised: list[BaseException]


_accesses: list[Access] = []


def _note(array: int, dimensions: int, axis: int, at: int, size: int, line: int, file: bytes) -> None:
    _accesses.append(Access(array, dimensions, axis, at, size, shown(file.decode(), line)))


# Machine code, also from the cache, calls the function by this name, so the reference to it is kept.
_SYMBOL = "teamsight_note_access"
_NOTE = ctypes.CFUNCTYPE(None, *[ctypes.c_int64] * 6, ctypes.c_char_p)(_note)
llvmlite.binding.add_symbol(_SYMBOL, ctypes.cast(_NOTE, ctypes.c_void_p).value)


@contextmanager
def watched() -> Iterator[Watch]:
    """Collect forbidden accesses and exceptions in kernels; numba would only print that an exception was ignored."""
    _accesses.clear()
    watch, hook = Watch(_accesses, []), sys.unraisablehook

    def keep(report: Any) -> None:
        if isinstance(report.object, str) and "numba" in report.object:
            watch.raised.append(report.exc_value)
        else:
            hook(report)

    sys.unraisablehook = keep
    try:
        yield watch
    finally:
        sys.unraisablehook = hook


def _place() -> tuple[str, int] | None:
    """Return the file and the line that numba is compiling; None in numba's own functions."""
    frame: Any = sys._getframe(1)
    while frame is not None:
        lower = frame.f_locals.get("self")
        if isinstance(lower, BaseLower):
            file = str(lower.loc.filename)
            return None if file.startswith(_NUMBA) else (file, int(lower.loc.line))
        frame = frame.f_back
    return None


def _stop(context: Any, builder: Any, numbers: list[Any], place: tuple[str, int]) -> None:
    """Write code that notes an access and leaves the kernel."""
    kind = ir.FunctionType(ir.VoidType(), [_WORD] * 6 + [ir.IntType(8).as_pointer()])
    note = cgutils.get_or_insert_function(builder.module, kind, _SYMBOL)
    builder.call(note, [*numbers, _WORD(place[1]), context.insert_const_string(builder.module, place[0])])
    context.call_conv.return_user_exc(builder, IndexError, ("an access outside of an array",))


def _check(context: Any, builder: Any, kind: Any, array: Any, index_type: Any, index: Any, *, writes: bool) -> Any:
    """Write code that checks an access; return the number that a view inherits."""
    number, place = builder.ptrtoint(array.parent, _WORD), _place()
    if place is None:
        return number
    name = builder.and_(number, _WORD(READ_ONLY - 1))
    if writes:
        is_wrong = builder.icmp_unsigned("!=", builder.and_(number, _WORD(READ_ONLY)), _WORD(0))
        with cgutils.if_unlikely(builder, is_wrong):
            _stop(context, builder, [name, _WORD(kind.ndim), _WORD(-1), _WORD(0), _WORD(0)], place)
    shape = cgutils.unpack_tuple(builder, array.shape, kind.ndim)
    limit, inherited = builder.udiv(number, _WORD(LIMIT)), number
    for axis, part_type, part in _axes(context, builder, kind.ndim, index_type, index):
        size = shape[axis]
        if axis == kind.ndim - 1:
            inherited = builder.and_(number, _WORD(LIMIT - 1))
            size = builder.select(builder.icmp_unsigned("!=", limit, _WORD(0)), limit, size)
        if isinstance(part_type, numba.types.Integer):
            at = context.cast(builder, part, part_type, numba.types.int64)
            # Without its sign, a negative index lies beyond every size.
            with cgutils.if_unlikely(builder, builder.icmp_unsigned(">=", at, size)):
                _stop(context, builder, [name, _WORD(kind.ndim), _WORD(axis), at, size], place)
    return inherited


def _axes(context: Any, builder: Any, dimensions: int, kind: Any, index: Any) -> Iterator[tuple[int, Any, Any]]:
    """Yield each axis of an index, with the type and the value of its part of the index."""
    is_tuple = isinstance(kind, numba.types.BaseTuple)
    types = list(kind.types) if is_tuple else [kind]
    values = cgutils.unpack_tuple(builder, index, count=len(types)) if is_tuple else [index]
    types, values = arrayobj.normalize_indices(context, builder, types, values)
    is_axis = [part is not numba.types.ellipsis and not isinstance(part, numba.types.NoneType) for part in types]
    axis = 0
    for part, value, counts in zip(types, values, is_axis, strict=True):
        if counts:
            yield axis, part, value
            axis += 1
        elif part is numba.types.ellipsis:
            axis += dimensions - sum(is_axis)


def _reading(generate: Callable[..., Any]) -> Callable[..., Any]:
    """Return numba's code for reading elements or making a view, with checks before it."""

    def read(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        kind, index_type = signature.args
        array = arrayobj.make_array(kind)(context, builder, arguments[0])
        number = _check(context, builder, kind, array, index_type, arguments[1], writes=False)
        value = generate(context, builder, signature, arguments)
        if not isinstance(signature.return_type, Guarded):
            return value
        return numbered(context, builder, signature.return_type, value, number)

    return read


def numbered(context: Any, builder: Any, kind: Any, value: Any, number: Any) -> Any:
    """Write code that gives a guarded array its number, 1 to 255, plus `READ_ONLY` and `LIMIT` times a size."""
    array = arrayobj.make_array(kind)(context, builder, value)
    array.parent = builder.inttoptr(number, array.parent.type)
    return array._getvalue()


for _index in (numba.types.Integer, numba.types.SliceType, numba.types.NoneType):
    lower_builtin(operator.getitem, Guarded, _index)(_reading(arrayobj.getitem_arraynd_intp))
lower_builtin(operator.getitem, Guarded, numba.types.BaseTuple)(_reading(arrayobj.getitem_array_tuple))


def _write(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
    kind, index_type, _ = signature.args
    array = arrayobj.make_array(kind)(context, builder, arguments[0])
    _check(context, builder, kind, array, index_type, arguments[1], writes=True)
    return arrayobj.setitem_array(context, builder, signature, arguments)


lower_builtin(operator.setitem, Guarded, numba.types.Any, numba.types.Any)(_write)


# `_defn` is the function that types the calls of an intrinsic.
@intrinsic  # type: ignore[untyped-decorator]
def _guarded_array_at(typing_context: Any, address: Any, shape: Any, dtype: Any) -> Any:
    signature, generate = array_at._defn(typing_context, address, shape, dtype)
    return guarded_type(signature.return_type)(*signature.args), generate


@intrinsic(prefer_literal=True)  # type: ignore[untyped-decorator]
def _guarded_scratch(typing_context: Any, count: Any, dtype: Any) -> Any:
    found = scratch._defn(typing_context, count, dtype)
    return found and (guarded_type(found[0].return_type)(*found[0].args), found[1])


def _below(plain: Any, count: int, typing_context: Any, values: Any, first: Any, limit: Any) -> Any:
    signature, generate_plain = plain._defn(typing_context, values, first, limit)

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        array = arrayobj.make_array(values)(context, builder, arguments[0])
        for ahead in (0, count - 1):
            at = builder.add(arguments[1], _WORD(ahead))
            _check(context, builder, values, array, numba.types.int64, at, writes=False)
        return generate_plain(context, builder, signature, arguments)

    return signature, generate


@intrinsic  # type: ignore[untyped-decorator]
def _guarded_below_8(typing_context: Any, values: Any, first: Any, limit: Any) -> Any:
    return _below(below_8, 8, typing_context, values, first, limit)


@intrinsic  # type: ignore[untyped-decorator]
def _guarded_below_64(typing_context: Any, values: Any, first: Any, limit: Any) -> Any:
    return _below(below_64, 64, typing_context, values, first, limit)


#: A digest of the checks, which are in the machine code of every guarded kernel.
VERSION = digest(_reading) + digest(_write)

#: The guarded forms of the functions that make arrays, or read many elements at once.
REPLACED: dict[Any, Any] = {
    array_at: _guarded_array_at,
    scratch: _guarded_scratch,
    below_8: _guarded_below_8,
    below_64: _guarded_below_64,
}
