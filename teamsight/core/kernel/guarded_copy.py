"""Copies of kernels in which all arrays are guarded, including those that they make themselves."""

from __future__ import annotations

import hashlib
import types as python_types
from typing import Any

from numba.core.dispatcher import Dispatcher

from teamsight.core.kernel.guard import REPLACED, VERSION
from teamsight.core.kernel.guarded_record import guarded_at
from teamsight.core.kernel.layout import Node
from teamsight.core.kernel.parts import Part
from teamsight.core.kernel.uses import enclosed, is_library, names_in

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
