"""Guards: copies of kernels whose arrays report an index outside, for the checks of components."""

from __future__ import annotations

import ctypes
import hashlib
import operator
import sys
import types as python_types
import warnings
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any, NamedTuple

import llvmlite.binding
import numba
import numpy as np
import numpy.typing as npt
from llvmlite import ir
from numba.core import cgutils
from numba.core.datamodel import models, register_default
from numba.core.dispatcher import Dispatcher
from numba.core.lowering import BaseLower
from numba.extending import intrinsic, lower_builtin
from numba.np import arrayobj

from teamsight.core.kernel import Entry, Packed, array_at, below_8, below_64, scratch
from teamsight.core.kernel.digest import digest, enclosed, is_library, names_in
from teamsight.core.kernel.errors import shown
from teamsight.core.kernel.parts import Part
from teamsight.core.kernel.record import Leaf, Node, Record, load_word, unpacking

# Bytes on either side: a multiple of a cache line, so that arrays are aligned as in a world.
_WIDTH = 4096
_FILLING = 0xA5


class Fences:
    """A set of arrays, each between two stretches of bytes that must not change."""

    def __init__(self) -> None:
        # Bytes that must not change, each with its name and its first content.
        self._fixed: list[tuple[str, npt.NDArray[np.uint8], bytes]] = []

    def put(self, name: str, value: Any, *, read_only: bool = False) -> Any:
        """Return a copy of an array, or of each array of a NamedTuple, between fences; other values as they are.

        Parameters
        ----------
        name : str
            Its name in errors.
        value : object
            The array or arrays.
        read_only : bool, default False
            Whether the content must not change either.
        """
        if isinstance(value, tuple):
            parts = zip(getattr(value, "_fields", ()), value, strict=True)
            return type(value)(*(self.put(f"{name}.{part}", inner, read_only=read_only) for part, inner in parts))
        if not isinstance(value, np.ndarray):
            return value
        array = np.ascontiguousarray(value)
        block = np.full(array.nbytes + 2 * _WIDTH + 64, _FILLING, np.uint8)
        first = _WIDTH + -block.ctypes.data % 64
        last = first + array.nbytes
        copy = block[first:last].view(array.dtype).reshape(array.shape)
        copy[...] = array
        for part in [block] if read_only else [block[:first], block[last:]]:
            self._fixed.append((name, part, part.tobytes()))
        return copy

    def broken(self) -> str:
        """Return the name of the first array with a forbidden write; "" if there is none."""
        return next((name for name, part, before in self._fixed if part.tobytes() != before), "")


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


class Axis(NamedTuple):
    """An axis of an array: the name of its elements, and the cure for a wrong index."""

    what: str
    cure: str


class Named(NamedTuple):
    """An array of a guarded kernel: its name in the kernel, and its axes."""

    name: str
    axes: tuple[Axis, ...]


def run_guarded(
    owner: str, kernel: str, entry: Callable[[Packed[Any]], int], record: Packed[Any], arrays: Sequence[Named],
    fences: Fences | None = None,
) -> int:  # fmt: skip
    """Run the entry of a guarded kernel on a record; return its status.

    Parameters
    ----------
    owner : str
        The class of the kernel, for errors.
    kernel : str
        The kernel's name, for errors.
    entry : callable
        The entry.
    record : Packed
        The record.
    arrays : sequence of Named
        The arrays by number; see `GuardedRecord`.
    fences : Fences, optional
        The fences around these arrays.

    Raises
    ------
    ValueError
        If the kernel reads or writes outside of its arrays, writes into a read-only one, or raises an exception.
    """
    with watched() as watch:
        status = entry(record)
    if watch.accesses:
        access = watch.accesses[0]
        raise ValueError(f"{owner}: {access.place}: {kernel} {_account(access, arrays)}")
    if watch.raised:
        error = watch.raised[0]
        raise ValueError(
            f"{owner}: {kernel} raises {type(error).__name__}({str(error)[:80]!r}); exceptions of kernels are lost in "
            "a world: check indices and values where they are used"
        )
    if fences and (broken := fences.broken()):
        raise ValueError(
            f"{owner}: {kernel} writes next to {broken}, or into it although it is read-only; index arrays within "
            "their shape"
        )
    return status


def _account(access: Access, arrays: Sequence[Named]) -> str:
    named = arrays[access.array]
    if access.axis < 0:
        return f"writes into {named.name}, which is read-only; copy its numbers and change the copy"
    # Views have lost axes from the left.
    axis = len(named.axes) - access.dimensions + access.axis
    what, cure = named.axes[axis] if 0 <= axis < len(named.axes) else ("elements", "stay within its shape")
    if access.at < 0:
        cure = "indices count from 0, and negative ones do not count from the end"
    return f"uses index {access.at} of {named.name}, whose number of {what} is {access.size}; {cure}"


def machine_code(owner: str, kernel: str, entry: Entry, plain: Entry) -> Entry | None:
    """Return the entry of a guarded kernel once it is compiled.

    Parameters
    ----------
    owner, kernel : str
        The class and the name of the kernel, for the warning.
    entry : Entry
        The entry of the guarded kernel.
    plain : Entry
        The entry of the kernel as worlds run it.

    Returns
    -------
    Entry or None
        None, with a warning, if the kernel compiles for worlds but not on guarded arrays.

    Raises
    ------
    TypeError
        If the kernel cannot be compiled for worlds.
    """
    try:
        entry.address  # noqa: B018
    except TypeError as error:
        # Raises if the mistake is in the kernel.
        plain.address  # noqa: B018
        warnings.warn(
            f"{owner}: the memory accesses of {kernel} are not checked, since it uses arrays in a way that guarded "
            f"arrays do not support ({error}); use their elements one by one",
            stacklevel=2,
        )
        return None
    return entry


class GuardedRecord:
    """The code that reads a record with guarded arrays, and their names in errors.

    Parameters
    ----------
    record : Record
        The record.
    writable : tuple of str
        Prefixes of the paths of the arrays that a kernel may write; all others are read-only.
    axes : mapping of str to Axis
        The axis for each name of a length, or path and name as in ``"noise lanes"``; the key ``"2"`` is for axes of
        that fixed length.
    limits : mapping of str to str, optional
        For a path, the name of a length shorter than the last axis, beyond which elements must not be used.

    Attributes
    ----------
    at : kernel
        Returns the NamedTuple for the address of a record; its arrays are guarded.
    arrays : list of Named
        The arrays by number, for `run_guarded`.
    """

    def __init__(
        self,
        record: Record[Any],
        writable: tuple[str, ...],
        axes: Mapping[str, Axis],
        limits: Mapping[str, str] | None = None,
    ) -> None:
        leaves = [leaf for leaf in record.node.leaves() if leaf.lengths is not None]
        self.arrays = [Named("an array of its own", ())] + [_named(leaf, axes) for leaf in leaves]
        slots = {length.name: length.slot for leaf in leaves for length in leaf.lengths or ()}
        limiting = {path: slots[name] for path, name in (limits or {}).items()}
        numbers = {
            leaf.path: (number + (0 if leaf.path.startswith(writable) else READ_ONLY), limiting.get(leaf.path, -1))
            for number, leaf in enumerate(leaves, 1)
        }
        self.at = unpacking(record.node, Guards(numbers))


def _named(leaf: Leaf, axes: Mapping[str, Axis]) -> Named:
    found = []
    for length in leaf.lengths or ():
        key = f"{length.name} + {length.plus}" if length.name and length.plus else length.name or str(length.plus)
        found.append(axes[f"{leaf.path} {key}"] if f"{leaf.path} {key}" in axes else axes[key])
    return Named(leaf.path, tuple(found))


def guarded_at(node: Node) -> Any:
    """Return the kernel that reads a record in guarded copies of kernels."""
    return unpacking(node, Guards({}))


class Guards:
    """Makes the arrays of a record guarded.

    Parameters
    ----------
    numbers : dict of str to tuple
        For each array's path: its number, with `READ_ONLY` if it is, and the word that limits its last axis, or −1. An
        array that is missing here has the number 0.
    """

    def __init__(self, numbers: dict[str, tuple[int, int]]) -> None:
        self._numbers = numbers

    def __repr__(self) -> str:
        # Part of the digest of kernels, since the checks are part of the machine code.
        return f"{VERSION} {digest(Guards.value)} {self._numbers}"

    def kind(self, array: Any) -> Any:
        """Return numba's type of a guarded array, from that of the plain one."""
        return guarded_type(array)

    def value(self, context: Any, builder: Any, leaf: Leaf, kind: Any, array: Any, words: Any) -> Any:
        """Write code that makes a guarded array of this type from a plain one."""
        number, limit = self._numbers.get(leaf.path, (0, -1))
        flags: Any = _WORD(number)
        if limit >= 0:
            flags = builder.add(flags, builder.mul(load_word(builder, words, limit), _WORD(LIMIT)))
        return numbered(context, builder, kind, array, flags)


# Calls in place of code inlined everywhere compile faster.
_DROPPED = {"boundscheck", "cache", "forceinline", "nopython"}


def guarded(kernel: Any) -> Any:
    """Return a copy, for guarded arrays, of a kernel and all that it calls; anything else is returned unchanged."""
    return _copy(kernel, {}) if isinstance(kernel, Dispatcher) else kernel


def _copy(kernel: Any, copies: dict[int, Any]) -> Any:
    if id(kernel) not in copies:
        function = kernel.py_func
        cells = tuple(python_types.CellType() for _ in function.__closure__ or ())
        names: dict[str, Any] = {}
        copy = python_types.FunctionType(function.__code__, names, function.__name__, function.__defaults__, cells)
        copy.__kwdefaults__, copy.__module__ = function.__kwdefaults__, function.__module__
        copy.__qualname__ = f"{function.__qualname__}-{_lines(function.__code__)}"
        kept = {name: value for name, value in kernel.targetoptions.items() if name not in _DROPPED}
        copies[id(kernel)] = Part(copy, options=dict(kept, boundscheck=True))
        # Last, since a kernel may call itself.
        used = set(names_in(function.__code__))
        for name, value in function.__globals__.items():
            if name in used or name.startswith("__"):
                names[name] = _replaced(value, used, copies)
        for cell, value in zip(cells, enclosed(function), strict=True):
            cell.cell_contents = _replaced(value, used, copies)
    return copies[id(kernel)]


def _replaced(value: Any, used: set[str], copies: dict[int, Any]) -> Any:
    """Return what a copy uses in place of a value that the original uses."""
    if isinstance(value, Dispatcher):
        return value if is_library(value.py_func.__module__) else _copy(value, copies)
    if isinstance(value, python_types.ModuleType) and not is_library(value.__name__):
        module = python_types.ModuleType(value.__name__)
        parts = ((name, getattr(value, name)) for name in used if hasattr(value, name))
        vars(module).update({name: _replaced(part, used, copies) for name, part in parts})
        return module
    if isinstance(node := getattr(value, "node", None), Node):
        return guarded_at(node)
    return next((new for old, new in REPLACED.items() if value is old), value)


def _lines(code: python_types.CodeType) -> str:
    """Return a digest of where code is written, because the machine code contains file and lines."""
    where = f"{code.co_filename} {code.co_firstlineno} {code.co_linetable!r} {VERSION}"
    return hashlib.blake2b(where.encode(), digest_size=8).hexdigest()
