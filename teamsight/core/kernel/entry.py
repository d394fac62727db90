"""Entries: compiled functions with one signature, which a loop calls by address."""

from __future__ import annotations

import ctypes
import threading
import types as python_types
from collections.abc import Callable
from contextlib import suppress
from functools import cache, cached_property
from time import perf_counter
from typing import Any
from weakref import WeakSet

from teamsight.core.interrupts import deferred
from teamsight.core.kernel.cache import Code, KernelCache, Place
from teamsight.core.kernel.parts import OPTIONS
from teamsight.core.kernel.record import Packed
from teamsight.core.kernel.report import REPORT

#: The entries that this process uses.
READY: WeakSet[Entry] = WeakSet()


class Entry:
    """A kernel with the signature ``int64 (int64)``, compiled on first use and cached on disk.

    Parameters
    ----------
    function : callable
        Takes the address of a record and returns a status; 0 means done.
    """

    def __init__(self, function: Callable[[int], int]) -> None:
        self.function = function
        # What keeps the machine code, and its address; 0 before it is used.
        self._code: Any = None
        self._address = 0
        # Of two threads that load it, the later would free the code that the other one runs.
        self._one_at_a_time = threading.RLock()

    @property
    def address(self) -> int:
        """The address of the machine code."""
        if not self._address:
            began = perf_counter()
            try:
                with self._one_at_a_time:
                    if not self._address:
                        self._get_ready()
                        READY.add(self)
            finally:
                REPORT.taken += perf_counter() - began
        return self._address

    def __call__(self, record: Packed[Any] | int) -> int:
        """Run on a record, or on the record at an address, without the interpreter's lock."""
        return int(self._callable(record if isinstance(record, int) else record.address))

    @cached_property
    def _callable(self) -> Any:
        return ctypes.CFUNCTYPE(ctypes.c_int64, ctypes.c_int64)(self.address)

    def is_missing(self) -> bool:
        """Whether it has to be compiled: it is not in use, and not in the cache."""
        return not self._address and not self.is_kept()

    def is_kept(self) -> bool:
        """Whether another process finds its machine code."""
        return self._cache.contains()

    @cached_property
    def _cache(self) -> KernelCache:
        return KernelCache(self.function)

    def _get_ready(self) -> None:
        """Load the machine code from the cache, or compile it."""
        if self._load():
            return
        # Before numba is imported, which may change its settings.
        place = self._cache.kept
        # In callbacks from LLVM an interrupt would be lost, and numba would report it as an error of its own.
        with place.turn(), deferred():
            if not self._load():
                self._compile(place)

    def _load(self) -> bool:
        """Load the machine code from the cache; return whether that was possible."""
        # What is intact but cannot be loaded is compiled and replaced.
        with suppress(Exception):
            if code := self._cache.load():
                self._code, self._address = code.load()
        return bool(self._address)

    def _compile(self, place: Place) -> None:
        announce(self.function.__qualname__)
        from teamsight.core.kernel.compiler import compiled
        from teamsight.core.kernel.errors import COMPILE_ERRORS, explained, refuse_random_numbers

        try:
            refuse_random_numbers(self.function)
            *parts, is_portable = compiled(self.function, OPTIONS)
            code = Code(*parts)
            self._code, self._address = code.load()
            if is_portable:
                place.save(code)
        except COMPILE_ERRORS as error:
            raise TypeError(explained(self.function, error)) from error
        finally:
            REPORT.end(is_done=bool(self._address))

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
