"""The functions and values that a kernel uses, and their digest."""

from __future__ import annotations

import hashlib
import sys
import types as python_types
from collections.abc import Callable, Iterator
from typing import Any

import llvmlite
import numba
import numpy as np

from teamsight.core.kernel.parts import FLAGS

_LIBRARIES = {*sys.stdlib_module_names, "llvmlite", "numba", "numpy"} - {"__main__"}


def is_library(module: str | None) -> bool:
    """Return whether a module changes with its version only, and accesses arrays through numba's own code only."""
    return (module or "").partition(".")[0] in _LIBRARIES


def names_in(code: python_types.CodeType) -> Iterator[str]:
    """Yield the global names and attributes in a function's code, and in that of the functions inside it."""
    yield from code.co_names
    for constant in code.co_consts:
        if isinstance(constant, python_types.CodeType):
            yield from names_in(constant)


def enclosed(function: python_types.FunctionType) -> list[Any]:
    """Return the values of the variables that a function uses from functions around it."""
    return [cell.cell_contents for cell in function.__closure__ or ()]


def globals_of(function: python_types.FunctionType) -> Iterator[tuple[str, Any]]:
    """Yield the globals that a function uses, and the attributes of modules, as in ``forces.attract``."""
    names = list(names_in(function.__code__))
    for name in names:
        if name not in function.__globals__:
            continue
        value = function.__globals__[name]
        yield name, value
        if isinstance(value, python_types.ModuleType) and not is_library(value.__name__):
            yield from ((part, getattr(value, part)) for part in names if hasattr(value, part))


def digest(function: Callable[..., Any]) -> str:
    """Return a digest of a function's code, of all kernels that it calls and of all constants that it uses."""
    hasher = hashlib.blake2b(digest_size=16)
    flags = sorted(FLAGS.items())
    hasher.update(f"{numba.__version__} {llvmlite.__version__} {np.__version__} {flags}".encode())
    for part in _parts(function, set()):
        hasher.update(part)
    return hasher.hexdigest()


def _parts(value: Any, met: set[int]) -> Iterator[bytes]:
    if (options := getattr(value, "targetoptions", None)) is not None:
        # Such as whether the kernel is inlined.
        yield repr(sorted(options.items())).encode()
    value = getattr(value, "py_func", value)
    # The function that generates the machine code of an intrinsic.
    value = getattr(value, "_defn", value)
    if not isinstance(value, python_types.FunctionType):
        # Of a NamedTuple class kernels use the fields; an object, such as the layout of a record, shows what it holds.
        fields = getattr(value, "_fields", None) if isinstance(value, type) else None
        yield repr(fields if fields else value if not isinstance(value, python_types.ModuleType) else "").encode()
        return
    if id(value) in met:
        return
    met.add(id(value))
    if is_library(value.__module__):
        yield f"{value.__module__}.{value.__qualname__}".encode()
        return
    yield value.__qualname__.encode()
    yield repr((value.__defaults__, value.__kwdefaults__)).encode()
    yield from _code_parts(value.__code__)
    for used in enclosed(value):
        yield from _parts(used, met)
    for name, used in globals_of(value):
        yield name.encode()
        yield from _parts(used, met)


def _code_parts(code: python_types.CodeType) -> Iterator[bytes]:
    yield code.co_code
    for constant in code.co_consts:
        if isinstance(constant, python_types.CodeType):
            yield from _code_parts(constant)
        else:
            yield repr(constant).encode()
    yield repr(code.co_names).encode()
