"""Random numbers of numba's own are refused: they have a hidden state, and runs could not be repeated."""

from __future__ import annotations

import dis
import random
import types as python_types
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np

from teamsight.core.kernel.errors import shown
from teamsight.core.kernel.uses import enclosed, globals_of, is_library


def refuse_random_numbers(function: Callable[..., Any]) -> None:
    """Refuse an entry if it, or a kernel that it calls, uses ``numpy.random`` or ``random``.

    Raises
    ------
    TypeError
        Naming file and line.
    """
    for kernel in _functions(function, set()):
        for line, name in _random_names(kernel):
            raise TypeError(
                f"{shown(kernel.__code__.co_filename, line)}: kernels cannot use {name}; take random numbers from "
                "noise and declare draws"
            )


def _functions(value: Any, met: set[int]) -> Iterator[python_types.FunctionType]:
    """Yield the kernels that could use random numbers: reading instructions takes long, and this runs for all."""
    value = getattr(value, "py_func", value)
    if not isinstance(value, python_types.FunctionType) or id(value) in met or is_library(value.__module__):
        return
    met.add(id(value))
    uses = [*enclosed(value), *(used for _, used in globals_of(value))]
    if "random" in value.__code__.co_names or any(_is_random(used) for used in uses):
        yield value
    for used in uses:
        yield from _functions(used, met)


def _random_names(function: python_types.FunctionType) -> Iterator[tuple[int, str]]:
    """Yield each use of ``numpy.random`` or ``random`` in a function: the line and the name."""
    value: Any = None
    line = function.__code__.co_firstlineno
    for instruction in dis.get_instructions(function.__code__):
        line = (instruction.positions and instruction.positions.lineno) or line
        if instruction.opname == "LOAD_GLOBAL":
            value = function.__globals__.get(instruction.argval)
        elif instruction.opname in ("LOAD_ATTR", "LOAD_METHOD") and isinstance(value, python_types.ModuleType):
            value = getattr(value, instruction.argval, None)
        elif instruction.opname.startswith("LOAD_"):
            value = None
        else:
            continue
        if _is_random(value) and not isinstance(value, python_types.ModuleType):
            module = "random" if isinstance(value.__self__, random.Random) else "numpy.random"
            yield line, f"{module}.{value.__name__}"


def _is_random(value: Any) -> bool:
    """Return whether this is a module of random numbers, or a method of its hidden generator."""
    generator = getattr(value, "__self__", None)
    return value is random or value is np.random or isinstance(generator, (random.Random, np.random.RandomState))
