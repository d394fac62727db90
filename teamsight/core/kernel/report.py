"""What is said while kernels are compiled: which of how many, and for how long.

On a terminal or in a notebook, one line shows the state. Elsewhere one line says that kernels are compiled. When all
that a world needs are there, one line says how many were compiled. A thread may pass it to a function instead.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from contextvars import ContextVar
from time import monotonic
from typing import TYPE_CHECKING

from teamsight.core.status_line import StatusLine, has_reader, in_notebook, seconds

if TYPE_CHECKING:
    from teamsight.core.kernel.entry import Entry

_NOTICE = "teamsight: compiling kernels that are new to this machine; they are kept, so this happens once"

# Each thread has its own.
_LISTENER: ContextVar[Callable[[str], None] | None] = ContextVar("listener", default=None)


@contextmanager
def listening(listener: Callable[[str], None]) -> Iterator[None]:
    """Call a function with the number of each kernel that this thread compiles, as in ``"3 of 8"``; print nothing."""
    before = _LISTENER.set(listener)
    try:
        yield
    finally:
        _LISTENER.reset(before)


class CompilationReport:
    """The report of a process. Kernels that another process compiles first are not counted.

    Attributes
    ----------
    taken : float
        How long this process has compiled kernels, or read them from the cache [s].
    """

    def __init__(self) -> None:
        self.taken = 0.0
        self._needed: Callable[[], Sequence[Entry]] = lambda: ()
        self._line: StatusLine | None = None
        self._is_announced = self._is_compiling = False
        self._number, self._began = 0, 0.0

    def plan(self, needed: Callable[[], Sequence[Entry]]) -> None:
        """Set the kernels that will be needed, which are counted if one of them has to be compiled.

        Parameters
        ----------
        needed : callable
            Returns the kernels, with those that are there already. It is not called if nothing is compiled.
        """
        self._needed = needed

    def begin(self, name: str) -> None:
        """Say that a kernel is about to be compiled.

        Parameters
        ----------
        name : str
            Its name.
        """
        if self._number == 0:
            self._began = monotonic()
        self._number += 1
        self._is_compiling = True
        if (listener := _LISTENER.get()) is not None:
            listener(self._which())
        elif has_reader():
            self._line = self._line or StatusLine()
            taken = seconds(monotonic() - self._began)
            self._line.show(f"teamsight: compiling kernel {self._which()}, once per machine ({taken}): {name}")
        elif not self._is_announced:
            self._is_announced = True
            print(_NOTICE, file=sys.stderr)

    def _which(self) -> str:
        """Return the number of the kernel, of how many if that is known."""
        needed = self._needed()
        missing = max(sum(kernel.is_missing() for kernel in needed), 1)
        return f"{self._number} of {self._number - 1 + missing}" if needed else f"{self._number}"

    def end(self, *, is_done: bool) -> None:
        """Say that the kernel is compiled, or, if not `is_done`, that this failed."""
        if not self._is_compiling:
            return
        self._is_compiling = False
        if self._line is not None:
            self._line.close()
        if not is_done:
            # The world is not made; the next one begins from 1.
            self._number, self._line = 0, None
            return
        needed = self._needed()
        if not needed or any(kernel.is_missing() for kernel in needed):
            return
        count = f"{self._number} kernel" if self._number == 1 else f"{self._number} kernels"
        closing = f"teamsight: compiled {count} in {seconds(monotonic() - self._began)}"
        if self._line is not None and in_notebook():
            self._line.show(closing)
        elif _LISTENER.get() is None:
            print(closing, file=sys.stderr)
        self._number, self._line = 0, None


#: The report of this process.
REPORT = CompilationReport()
