"""Guards: kernels on trial, as plain Python that checks each index, and compiled between bytes that must not change.

Machine code checks no index. Before a check of a component runs it, the same functions run as plain Python on arrays
that refuse an index outside, a negative one, and writes into what is read-only. Numbers there are NumPy's, so that they
divide by zero, overflow and round as in machine code.
"""

from __future__ import annotations

import builtins
import dis
import math
import types as python_types
import warnings
from collections.abc import Callable, Iterator, Mapping
from functools import cache
from operator import attrgetter
from typing import Any, Generic, NamedTuple, TypeVar, cast

import numpy as np
import numpy.typing as npt

from teamsight.core.contracts import are_equal
from teamsight.core.kernel.cache import enclosed, is_library, names_in
from teamsight.core.kernel.entry import Entry
from teamsight.core.kernel.intrinsics import scratch
from teamsight.core.kernel.parts import Intrinsic, shown
from teamsight.core.kernel.record import Leaf, Node, Record

# Accesses in one check, a second or two; a kernel that needs more is checked as far as they reach.
_MOST_ACCESSES = 1_000_000
# Bytes on either side of an array: a multiple of a cache line, so that arrays are aligned as in a world.
_WIDTH = 4096
_FILLING = 0xA5
# Larger arrays that a kernel only reads, such as the table of a learner, are not copied.
_LARGE = 1 << 24

T = TypeVar("T", bound=tuple[Any, ...])


class Axis(NamedTuple):
    """An axis of an array: the name of its elements, and the cure for a wrong index."""

    what: str
    cure: str


class _ForbiddenError(Exception):
    """An access that a kernel must not make."""


class _SpentError(Exception):
    """The accesses of this check are used up."""


_left = 0


def begin_check() -> None:
    """Let kernels run as plain Python for the next million accesses."""
    global _left
    _left = _MOST_ACCESSES


class _Checked(np.ndarray[Any, Any]):
    """An array that refuses what numba would not: a wrong index, a negative one, and a write if it is read-only."""

    path = "an array of its own"
    axes: tuple[Axis, ...] = ()
    # The number of elements of the last axis that may be used, where that is not all.
    limit: int | None = None

    def __array_finalize__(self, origin: Any) -> None:
        if isinstance(origin, _Checked):
            self.path, self.axes, self.limit = origin.path, origin.axes, origin.limit

    def __iter__(self) -> Iterator[Any]:
        return (self[at] for at in range(len(self)))

    def __getitem__(self, index: Any) -> Any:
        axes = self._check(index)
        found = super().__getitem__(index)
        if self.limit is not None and axes == self.ndim and isinstance(found, _Checked):
            found.limit = None
        return found

    def __setitem__(self, index: Any, value: Any) -> None:
        if not self.flags.writeable:
            raise _ForbiddenError(f"writes into {self.path}, which is read-only; copy its numbers and change the copy")
        self._check(index)
        super().__setitem__(index, value)

    def _check(self, index: Any) -> int:
        """Check an index; return the number of axes for which it has a part."""
        global _left
        _left -= 1
        if _left < 0:
            raise _SpentError
        parts = index if isinstance(index, tuple) else (index,)
        shape = self.shape if self.limit is None else (*self.shape[:-1], self.limit)
        axis = 0
        for part in parts:
            if part is Ellipsis:
                axis += len(shape) - sum(one is not None and one is not Ellipsis for one in parts)
            elif part is not None:
                if part.__class__ is not slice and not 0 <= part < shape[axis]:
                    raise _ForbiddenError(self._account(axis, part, shape[axis]))
                axis += 1
        return axis

    def _account(self, axis: int, at: Any, size: int) -> str:
        # Views have lost axes from the left.
        declared = self.axes[axis - self.ndim :] if axis - self.ndim >= -len(self.axes) else ()
        what, cure = declared[0] if declared else ("elements", "stay within its shape")
        if at < 0:
            cure = "indices count from 0, and negative ones do not count from the end"
        return f"uses index {at} of {self.path}, whose number of {what} is {size}; {cure}"


# All elements of all arrays may be used.
_ALL: Mapping[str, int] = {}


class Guard(Generic[T]):
    """The trial of kernels that get their arrays from one kind of record.

    Parameters
    ----------
    record : Record
        The record.
    writable : tuple of str
        Prefixes of the paths of the arrays that a kernel may write; all others are read-only.
    axes : mapping of str to Axis
        The axis for each name of a length, or path and name as in ``"noise lanes"``; the key ``"2"`` is for axes of
        that fixed length.
    """

    def __init__(self, record: Record[T], writable: tuple[str, ...], axes: Mapping[str, Axis]) -> None:
        self._record, self._writable, self._axes = record, writable, axes

    def run(
        self, owner: str, kernel: str, entry: Entry, value: T, noise: Mapping[str, int] = _ALL
    ) -> tuple[int, T]:
        """Run an entry on copies of the arrays of a record, both ways; see `interpret` and `execute`.

        Rows of noise are longer than there are bodies, as in a world: `noise` has the number of bodies for the path of
        each array of noise. The numbers behind must have no effect.
        """
        self.interpret(owner, kernel, entry, value, noise)
        rows = {path: attrgetter(path)(value)[..., size:] for path, size in noise.items()}
        for beyond in rows.values():
            beyond[:] = np.nan
        found = self.execute(owner, kernel, entry, value)
        leaves = self._record.leaves
        written = [path for path in leaves if path.startswith(self._writable)]
        for path, beyond in rows.items():
            beyond[:] = 0.5
            again = self.execute(owner, kernel, entry, value)[1]
            if not are_equal(*([attrgetter(each)(done) for each in written] for done in (found[1], again))):
                what, cure = self._axis(path, (leaves[path].lengths or ())[-1])
                raise ValueError(
                    f"{owner}: {kernel} uses {path} beyond the {noise[path]} {what}, or other random numbers; {cure}"
                )
        return found

    def interpret(
        self, owner: str, kernel: str, entry: Entry, value: T, limits: Mapping[str, int] = _ALL
    ) -> None:
        """Run an entry as plain Python on copies of the arrays of a record.

        It ends early when the accesses of the check are used up; see `begin_check`.

        Parameters
        ----------
        owner, kernel : str
            The class and the name of the kernel, for errors.
        entry : Entry
            The entry.
        value : NamedTuple
            The content of the record.
        limits : mapping of str to int, optional
            For the path of an array, the number of elements of its last axis that may be used.

        Raises
        ------
        TypeError
            If the kernel cannot be compiled.
        ValueError
            If the kernel reads or writes outside of its arrays, writes into a read-only one, or raises an exception.

        Warns
        -----
        UserWarning
            If the kernel cannot run as plain Python.
        """
        # Raises if it cannot be compiled.
        entry.address  # noqa: B018
        run, given = _as_python(entry.function), self._checked(value, limits)
        try:
            with np.errstate(all="ignore"):
                run(given)
        except _SpentError:
            pass
        except _ForbiddenError as error:
            raise ValueError(f"{owner}: {_place(error)[0]}: {kernel} {error}") from None
        except Exception as error:
            place, is_its_own = _place(error)
            said = f"raises {type(error).__name__}({str(error)[:80]!r})"
            if is_its_own or isinstance(error, IndexError):
                raise ValueError(
                    f"{owner}: {place}: {kernel} {said}; exceptions of kernels are lost in a world: check indices and "
                    "values where they are used"
                ) from error
            warnings.warn(
                f"{owner}: {place}: from here on the memory accesses of {kernel} are not checked, since as plain "
                f"Python it {said}; write it so that it runs as plain Python too",
                stacklevel=2,
            )

    def execute(self, owner: str, kernel: str, entry: Entry, value: T) -> tuple[int, T]:
        """Run an entry on copies of the arrays of a record; return its status and the copies.

        Raises
        ------
        TypeError
            If the kernel cannot be compiled.
        ValueError
            If the kernel writes into a read-only array, or next to an array.
        """
        fixed: list[tuple[str, npt.NDArray[np.uint8], bytes]] = []

        def fenced(path: str, leaf: Leaf, array: Any) -> Any:
            is_read_only = not path.startswith(self._writable)
            if leaf.lengths is None or (is_read_only and array.nbytes > _LARGE):
                return array
            block = np.full(array.nbytes + 2 * _WIDTH + 64, _FILLING, np.uint8)
            first = _WIDTH + -block.ctypes.data % 64
            last = first + array.nbytes
            copy = block[first:last].view(array.dtype).reshape(array.shape)
            copy[...] = array
            for part in [block] if is_read_only else [block[:first], block[last:]]:
                fixed.append((path, part, part.tobytes()))
            return copy

        def packed(records: list[Any]) -> Any:
            return [record.pack(inner) for record, inner in records]

        copies = _mapped(self._record.node, value, fenced, packed)
        status = entry(self._record.pack(copies))
        for path, part, before in fixed:
            if part.tobytes() != before:
                raise ValueError(
                    f"{owner}: {kernel} writes next to {path}, or into it although it is read-only; index arrays "
                    "within their shape"
                )
        return status, copies

    def _checked(self, value: T, limits: Mapping[str, int]) -> T:
        def checked(path: str, leaf: Leaf, old: Any) -> Any:
            if leaf.lengths is None:
                return old if leaf.dtype is None else leaf.dtype.type(old)
            is_writable = path.startswith(self._writable)
            array = np.array(old, copy=is_writable or None).view(_Checked)
            array.flags.writeable = is_writable
            array.path, array.limit = path, limits.get(path)
            array.axes = tuple(self._axis(path, length) for length in leaf.lengths)
            return array

        def checked_records(records: list[Any]) -> Any:
            array = np.empty(len(records), object)
            array[:] = [inner for _, inner in records]
            return array.view(_Checked)

        return cast(T, _mapped(self._record.node, value, checked, checked_records))

    def _axis(self, path: str, length: Any) -> Axis:
        key = f"{length.name} + {length.plus}" if length.name and length.plus else length.name or str(length.plus)
        return self._axes[f"{path} {key}"] if f"{path} {key}" in self._axes else self._axes[key]


def _mapped(node: Node, value: Any, leaf: Callable[..., Any], records: Callable[..., Any], within: str = "") -> Any:
    """Return a NamedTuple with each leaf, by path, and each list of records replaced."""

    def new(part: Any, old: Any) -> Any:
        if isinstance(part, Node):
            return _mapped(part, old, leaf, records, within)
        path = within + part.path
        if part.is_list:
            inside = [_mapped(one.record.node, one.value, leaf, records, f"{path}.") for one in old]
            return records([(one.record, inner) for one, inner in zip(old, inside, strict=True)])
        return leaf(path, part, old)

    return type(value)(*map(new, node.parts, value))


# In the globals of all plain Python forms.
_MARK = "__of_a_kernel__"


def _place(error: BaseException) -> tuple[str, bool]:
    """Return the innermost place in a kernel in a traceback, and whether it is a statement `raise` or `assert`."""
    trace, found = error.__traceback__, None
    while trace is not None:
        found = trace if _MARK in trace.tb_frame.f_globals else found
        trace = trace.tb_next
    assert found is not None
    code = found.tb_frame.f_code
    is_raised = found.tb_next is None and code.co_code[found.tb_lasti] == dis.opmap["RAISE_VARARGS"]
    return shown(code.co_filename, found.tb_lineno), is_raised


@cache
def _as_python(function: python_types.FunctionType) -> Callable[..., Any]:
    """Return the plain Python form of an entry's function, which takes the content of a record for its address."""
    return cast(Callable[..., Any], _copy(function, {}))


def _copy(function: python_types.FunctionType, copies: dict[Any, Any]) -> Any:
    if function not in copies:
        cells = tuple(python_types.CellType() for _ in function.__closure__ or ())
        names: dict[str, Any] = {"__builtins__": builtins, _MARK: None, "int": _whole, "float": np.float64}
        copies[function] = copy = python_types.FunctionType(
            function.__code__, names, function.__name__, function.__defaults__, cells
        )
        copy.__kwdefaults__ = function.__kwdefaults__
        # Last, since a kernel may call itself.
        used = set(names_in(function.__code__))
        names |= {name: _replaced(function.__globals__[name], used, copies) for name in used & {*function.__globals__}}
        for cell, value in zip(cells, enclosed(function), strict=True):
            cell.cell_contents = _replaced(value, used, copies)
    return copies[function]


def _replaced(value: Any, used: set[str], copies: dict[Any, Any]) -> Any:
    """Return what plain Python uses in place of a value that a kernel uses."""
    if hasattr(value, "py_func"):
        return _copy(value.py_func, copies)
    if getattr(value, "__module__", None) == "math":
        return _like_machine_code(value)
    if isinstance(value, python_types.ModuleType) and (value is math or not is_library(value.__name__)):
        module = python_types.ModuleType(value.__name__)
        parts = {name: getattr(value, name) for name in used if hasattr(value, name)}
        vars(module).update({name: _replaced(part, used, copies) for name, part in parts.items()})
        return module
    if value is scratch:
        return lambda count, dtype: np.empty(count, dtype).view(_Checked)
    return value.function if isinstance(value, Intrinsic) else value


# What x86-64 makes of NaN and of numbers that are too large.
_NO_INTEGER = -(1 << 63)


def _whole(value: Any) -> int:
    return int(value) if np.isfinite(value) else _NO_INTEGER


def _like_machine_code(function: Callable[..., Any]) -> Callable[..., Any]:
    """Return a function of `math` that raises nothing, and whose fractions divide by zero."""
    failed = _NO_INTEGER if function in (math.floor, math.ceil, math.trunc) else np.nan

    def called(*arguments: Any) -> Any:
        try:
            value = function(*arguments)
        except (ValueError, OverflowError):
            return failed
        return np.float64(value) if isinstance(value, float) else value

    return called
