"""Decorators of kernels: functions that numba compiles with the first entry that uses them, never at import."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeVar, cast

from teamsight.core.kernel.parts import FLAGS, Part

F = TypeVar("F", bound=Callable[..., Any])


def kernel(function: F) -> F:
    """Mark a function as a kernel: compiled with the first entry that uses it, never at import."""
    return cast(F, Part(function, options=FLAGS))


def inlined(function: F) -> F:
    """Mark a small kernel that is always compiled into its caller, so that loops around it can use SIMD lanes."""
    return cast(F, Part(function, options=dict(FLAGS, forceinline=True)))


def plain(function: F) -> F:
    """Return the Python function behind a kernel."""
    return cast(F, getattr(function, "py_func", function))
