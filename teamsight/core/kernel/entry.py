"""Entries: compiled functions with one signature, which a loop calls by address."""

from __future__ import annotations

import ctypes
import types as python_types
from collections.abc import Callable
from functools import cache, cached_property
from time import perf_counter
from typing import Any

import numba
from numba.core.ccallback import CFunc
from numba.core.registry import cpu_target

from teamsight.core.interrupts import deferred
from teamsight.core.kernel.cache import KernelCache
from teamsight.core.kernel.errors import COMPILE_ERRORS, explained, refuse_random_numbers
from teamsight.core.kernel.parts import FLAGS, CompilerOfEntries
from teamsight.core.kernel.record import Packed
from teamsight.core.kernel.report import REPORT

_SIGNATURE = numba.types.int64(numba.types.int64)


class Entry:
    """A kernel with the signature ``int64 (int64)``, compiled on first use and cached on disk.

    Parameters
    ----------
    function : callable
        Takes the address of a record and returns a status; 0 means done.
    """

    def __init__(self, function: Callable[[int], int]) -> None:
        self.function = function
        self._compiled: Any = None

    @property
    def address(self) -> int:
        """The address of the machine code."""
        if self._compiled is None:
            began = perf_counter()
            # In callbacks from LLVM an interrupt would be lost, and numba would report it as an error of its own.
            try:
                with deferred():
                    self._compile()
            finally:
                REPORT.taken += perf_counter() - began
        return int(self._compiled.address)

    def __call__(self, record: Packed[Any] | int) -> int:
        """Run on a record, or on the record at an address, without the interpreter's lock."""
        return int(self._callable(record if isinstance(record, int) else record.address))

    @cached_property
    def _callable(self) -> Any:
        return ctypes.CFUNCTYPE(ctypes.c_int64, ctypes.c_int64)(self.address)

    def is_missing(self) -> bool:
        """Whether it has to be compiled: it is not in use, and not in the cache."""
        return self._compiled is None and not self._kept.contains(_SIGNATURE, cpu_target.target_context)

    @cached_property
    def _kept(self) -> KernelCache:
        return KernelCache(self.function, lambda name: announce(name))

    def _compile(self) -> None:
        # numba.cfunc would compile at once and use numba's own cache.
        compiled: Any = CFunc(
            self.function, (_SIGNATURE.args, _SIGNATURE.return_type), locals={}, options=dict(FLAGS, nopython=True),
            pipeline_class=CompilerOfEntries,
        )  # fmt: skip
        compiled._cache = self._kept
        is_done = False
        try:
            refuse_random_numbers(self.function)
            compiled.compile()
            is_done = True
        except COMPILE_ERRORS as error:
            raise TypeError(explained(self.function, error)) from error
        finally:
            # Set before the report, which counts what is missing.
            self._compiled = compiled if is_done else None
            REPORT.end(is_done=is_done)

    def __reduce__(self) -> tuple[Any, ...]:
        return (Entry, (self.function,))


@cache
def specialise(template: Callable[..., Any], name: str, **kernels: Any) -> Entry:
    """Return the entry of a template whose free names are bound to the kernels given, always the same one.

    Parameters
    ----------
    template : callable
        A plain function of one address that uses the names in `kernels` as globals.
    name : str
        A name for the entry and its file in the cache.
    **kernels
        The kernel for each free name.
    """
    bound = python_types.FunctionType(template.__code__, {**template.__globals__, **kernels}, name)
    bound.__qualname__ = f"{template.__name__}-{name}"
    bound.__module__ = template.__module__
    return Entry(bound)


# Called with the name of each entry that is about to be compiled; tests and commands may put another function here.
announce: Callable[[str], None] = REPORT.begin
