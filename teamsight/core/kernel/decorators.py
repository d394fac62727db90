"""Decorators of kernels: functions that numba compiles with the first entry that uses them, never at import."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeVar, cast

import numba

F = TypeVar("F", bound=Callable[..., Any])

# fastmath stays off: it would break the checks for NaN and the equality of the two paths to the last bit.
FLAGS = {"nogil": True, "error_model": "numpy", "_nrt": False}


def kernel(function: F) -> F:
    """Mark a function as a kernel: compiled with the first entry that uses it, never at import."""
    return cast(F, numba.njit(**FLAGS)(function))


def inlined(function: F) -> F:
    """Mark a small kernel that is always compiled into its caller, so that loops around it can use SIMD lanes."""
    return cast(F, numba.njit(forceinline=True, **FLAGS)(function))


def plain(function: F) -> F:
    """Return the Python function behind a kernel."""
    return cast(F, getattr(function, "py_func", function))
