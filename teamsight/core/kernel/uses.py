"""What a function uses: global names, attributes of modules, and the variables of functions around it."""

from __future__ import annotations

import sys
import types as python_types
from collections.abc import Iterator
from typing import Any

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
