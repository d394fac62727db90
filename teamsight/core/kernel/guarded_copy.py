"""Copies of kernels in which all arrays are guarded, including those that they make themselves."""

from __future__ import annotations

import hashlib
import sys
import types as python_types
from collections.abc import Callable, Iterator
from typing import Any, cast

import numba
from numba.core.dispatcher import Dispatcher

from teamsight.core.kernel.guard import REPLACED, VERSION
from teamsight.core.kernel.guarded_record import guarded_at
from teamsight.core.kernel.layout import Node

# Modules whose functions access a kernel's arrays through numba's own code only.
_OTHERS = {*sys.stdlib_module_names, "llvmlite", "numba", "numpy"} - {"__main__"}

# Calls in place of code inlined everywhere compile faster.
_DROPPED = {"boundscheck", "cache", "forceinline", "nopython"}
_OPTIONS = {"boundscheck": True, "no_cpython_wrapper": True, "no_cfunc_wrapper": True}


def guarded(kernel: Any) -> Callable[..., Any]:
    """Return a copy, for guarded arrays, of a kernel and all that it calls; anything else is returned unchanged."""
    if not isinstance(kernel, Dispatcher):
        return cast(Callable[..., Any], kernel)
    return cast(Callable[..., Any], _copy(kernel, {}))


def _copy(kernel: Any, copies: dict[int, Any]) -> Any:
    if id(kernel) not in copies:
        function = kernel.py_func
        cells = tuple(python_types.CellType() for _ in function.__closure__ or ())
        names: dict[str, Any] = {}
        copy = python_types.FunctionType(function.__code__, names, function.__name__, function.__defaults__, cells)
        copy.__kwdefaults__, copy.__module__ = function.__kwdefaults__, function.__module__
        copy.__qualname__ = f"{function.__qualname__}-{_lines(function.__code__)}"
        kept = {name: value for name, value in kernel.targetoptions.items() if name not in _DROPPED}
        copies[id(kernel)] = numba.njit(**kept, **_OPTIONS)(copy)
        # Last, since a kernel may call itself.
        used = set(_names(function.__code__))
        for name, value in function.__globals__.items():
            if name in used or name.startswith("__"):
                names[name] = _replaced(value, used, copies)
        for cell, original in zip(cells, function.__closure__ or (), strict=True):
            cell.cell_contents = _replaced(original.cell_contents, used, copies)
    return copies[id(kernel)]


def _replaced(value: Any, used: set[str], copies: dict[int, Any]) -> Any:
    """Return what a copy uses in place of a value that the original uses."""
    if isinstance(value, Dispatcher):
        return value if _root(value.py_func.__module__) in _OTHERS else _copy(value, copies)
    if isinstance(value, python_types.ModuleType) and _root(value.__name__) not in _OTHERS:
        module = python_types.ModuleType(value.__name__)
        parts = ((name, getattr(value, name)) for name in used if hasattr(value, name))
        vars(module).update({name: _replaced(part, used, copies) for name, part in parts})
        return module
    if isinstance(node := getattr(value, "node", None), Node):
        return guarded_at(node)
    return next((new for old, new in REPLACED.items() if value is old), value)


def _root(module: str | None) -> str:
    return (module or "").partition(".")[0]


def _names(code: python_types.CodeType) -> Iterator[str]:
    yield from code.co_names
    for constant in code.co_consts:
        if isinstance(constant, python_types.CodeType):
            yield from _names(constant)


def _lines(code: python_types.CodeType) -> str:
    """Return a digest of where code is written, because the machine code contains file and lines."""
    where = f"{code.co_filename} {code.co_firstlineno} {code.co_linetable!r} {VERSION}"
    return hashlib.blake2b(where.encode(), digest_size=8).hexdigest()
