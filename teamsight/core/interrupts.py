"""Blocks of code that Ctrl-C does not interrupt.

Python raises KeyboardInterrupt between any two instructions of the main thread. Inside a callback from C it is printed
and lost; between two changes that belong together it leaves them inconsistent. In a block, the signal is recorded, and
handled at the end of the block.
"""

from __future__ import annotations

# The public functions of `signal` convert their arguments to enums first, which takes ten times as long as the call.
import _signal  # type: ignore[import-not-found, unused-ignore]
import sys
import threading
from _thread import get_ident
from types import FrameType, TracebackType
from typing import Any

_SIGINT = int(_signal.SIGINT)

# Whether there was an interrupt in the present block.
_received = False


class deferred:  # noqa: N801  used like a function, as contextlib.suppress is
    """Handle Ctrl-C at the end of the block.

    The handler that was installed before (by default, the one that raises KeyboardInterrupt) is called once when the
    block ends, normally or with an exception. The block has no effect in threads other than the main one, inside
    another such block, and if Ctrl-C is ignored or ends the process.

    Keep blocks short: until the end of the outermost one the program does not react to Ctrl-C.

    Notes
    -----
    Entering and leaving takes less than a microsecond.
    """

    __slots__ = ("_before",)

    def __enter__(self) -> None:
        global _received
        self._before: Any = None
        before = _signal.getsignal(_SIGINT)
        if before is _record or not callable(before) or get_ident() != threading.main_thread().ident:
            return
        _received = False
        try:
            # Python handles pending signals before it changes the handler, so none is lost.
            self._before = _signal.signal(_SIGINT, _record)
        except ValueError:  # a subinterpreter, which receives no signals
            return

    def __exit__(
        self, kind: type[BaseException] | None, value: BaseException | None, trace: TracebackType | None
    ) -> None:
        before = self._before
        if before is None:
            return
        # A handler that was installed inside the block stays.
        if _signal.getsignal(_SIGINT) is _record:
            _signal.signal(_SIGINT, before)
        if _received:
            before(_SIGINT, sys._getframe())


def _record(number: int, frame: FrameType | None) -> None:
    global _received
    _received = True


def is_interrupt(error: BaseException | None) -> bool:
    """Return whether Python or a library made this error out of an interrupt; an error while handling one is none."""
    if isinstance(error, OSError | ValueError):
        return False
    while error is not None and not isinstance(error, KeyboardInterrupt):
        error = error.__cause__ or error.__context__
    return error is not None


def is_pending() -> bool:
    """Whether Ctrl-C waits for the end of a block, for what takes long inside one."""
    return _received
