"""Kernels and intrinsics as Python sees them: numba is imported when one is compiled, not before.

numba takes an object for what its attribute ``_numba_type_`` says. So a kernel is a plain object with its function,
which can be imported, hashed and pickled at no cost; a command whose entries are all in the cache never imports numba.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Callable
from functools import cached_property, update_wrapper
from inspect import signature
from typing import Any, TypeVar, cast

# fastmath stays off: it would break the checks for NaN and the equality of the two paths to the last bit.
OPTIONS = {"nopython": True, "nogil": True, "error_model": "numpy", "_nrt": False}


class Kernel:
    """A kernel for entries and other kernels; from Python it runs too, compiled as a whole.

    Parameters
    ----------
    function : callable
        The kernel's Python function.
    options : dict
        As for `numba.njit`.
    """

    __qualname__: str

    def __init__(self, function: Callable[..., Any], options: dict[str, Any]) -> None:
        update_wrapper(self, function)
        self.py_func, self.targetoptions = function, options

    @cached_property
    def dispatcher(self) -> Any:
        """What numba compiles it with."""
        from teamsight.core.kernel.compiler import Part

        made = Part(self.py_func, {}, self.targetoptions)
        made.kernel = self
        return made

    @cached_property
    def _numba_type_(self) -> Any:
        return self.dispatcher._numba_type_

    @cached_property
    def _whole(self) -> Callable[..., Any]:
        import numba

        if numba.config.DISABLE_JIT:
            return self.py_func
        # Another function, since numba takes a call of the same one for recursion.
        part = self
        return cast(Callable[..., Any], numba.jit(**OPTIONS)(lambda *arguments: part(*arguments)))

    def __call__(self, *arguments: Any, **named: Any) -> Any:
        """Run it from Python."""
        bound = signature(self.py_func).bind(*arguments, **named)
        bound.apply_defaults()
        return self._whole(*bound.args)

    def __reduce__(self) -> Any:
        name, module = self.__qualname__, sys.modules.get(self.__module__)
        # What a script defines has no place in another process.
        if self.__module__ != "__main__" and getattr(module, name, None) is self:
            return name
        # Python does not pickle functions that have no name in a module; numba does, each once.
        return _of_dispatcher, (self.dispatcher,)


def _of_dispatcher(dispatcher: Any) -> Kernel:
    """Return the kernel of what numba unpickled, always the same one."""
    if not hasattr(dispatcher, "kernel"):
        dispatcher.kernel = Kernel(dispatcher.py_func, dispatcher.targetoptions)
        dispatcher.kernel.dispatcher = dispatcher
    return cast(Kernel, dispatcher.kernel)


class Intrinsic:
    """A function whose machine code is written by hand, for kernels; from Python its plain form runs.

    Parameters
    ----------
    function : callable
        The plain form.
    identity : object
        What, beside its name, decides its machine code; it has a distinct `repr`.
    """

    __name__: str
    is_intrinsic = True

    def __init__(self, function: Callable[..., Any], identity: Any = None) -> None:
        update_wrapper(self, function)
        self.function, self.identity = function, identity

    @cached_property
    def _numba_type_(self) -> Any:
        from teamsight.core.kernel.generators import type_of

        return type_of(self)

    def __call__(self, *arguments: Any) -> Any:
        """Run its plain form."""
        return self.function(*arguments)


F = TypeVar("F", bound=Callable[..., Any])


def kernel(function: F) -> F:
    """Mark a function as a kernel: compiled with the first entry that uses it, never at import."""
    return cast(F, Kernel(function, OPTIONS))


def inlined(function: F) -> F:
    """Mark a small kernel that is always compiled into its caller, so that loops around it can use SIMD lanes."""
    return cast(F, Kernel(function, dict(OPTIONS, forceinline=True)))


def intrinsic(function: F) -> F:
    """Mark the plain form of a function that `teamsight.core.kernel.generators` has as machine code."""
    return cast(F, Intrinsic(function))


def plain(function: F) -> F:
    """Return the Python function behind a kernel."""
    return cast(F, getattr(function, "py_func", function))


def shown(file: str, line: int) -> str:
    """Return a file and line; the path is relative if the file is in the current folder."""
    if file.startswith("<"):
        return f"{file}:{line}"
    path = os.path.abspath(file)
    near = os.path.relpath(path) if path.startswith(os.getcwd() + os.sep) else path
    return f"{near}:{line}"
