"""Entries: compiled functions with one signature, which a loop calls by address."""

from __future__ import annotations

import ctypes
import sys
import types as python_types
from collections.abc import Callable
from typing import Any

import numba
from numba.core.ccallback import CFunc

from teamsight.core.interrupts import deferred
from teamsight.core.kernel.cache import KernelCache
from teamsight.core.kernel.decorators import FLAGS
from teamsight.core.kernel.errors import COMPILE_ERRORS, explained
from teamsight.core.kernel.record import Packed


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
        self._callable: Any = None

    @property
    def address(self) -> int:
        """The address of the machine code."""
        if self._compiled is None:
            # In callbacks from LLVM an interrupt would be lost, and numba would report it as an error of its own.
            with deferred():
                self._compiled = self._compile()
        return int(self._compiled.address)

    def __call__(self, record: Packed[Any] | int) -> int:
        """Run on a record, or on the record at an address, without the interpreter's lock."""
        if self._callable is None:
            self._callable = ctypes.CFUNCTYPE(ctypes.c_int64, ctypes.c_int64)(self.address)
        return int(self._callable(record if isinstance(record, int) else record.address))

    def _compile(self) -> Any:
        signature = numba.types.int64(numba.types.int64)
        # numba.cfunc would compile at once and use numba's own cache.
        compiled: Any = CFunc(
            self.function, (signature.args, signature.return_type), locals={}, options=dict(FLAGS, nopython=True)
        )
        compiled._cache = KernelCache(self.function, lambda name: announce(name))
        try:
            compiled.compile()
        except COMPILE_ERRORS as error:
            raise TypeError(explained(self.function, error)) from error
        return compiled

    def __reduce__(self) -> tuple[Any, ...]:
        return (Entry, (self.function,))


def specialise(template: Callable[..., Any], name: str, **kernels: Any) -> Entry:
    """Make an entry from a template whose free names are bound to the kernels given.

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


def _announce_once(name: str) -> None:
    global announce
    announce = _silent
    message = "teamsight: compiling kernels that are new to this machine; they are kept, so this happens once"
    print(message, file=sys.stderr)


def _silent(name: str) -> None:
    pass


# Called with the name of each entry that is about to be compiled; a command line may put its own announcement here.
announce: Callable[[str], None] = _announce_once
