"""Failures: what is kept of a run that raised."""

from __future__ import annotations

import re
import signal
import threading
import traceback
from typing import NamedTuple

from teamsight.analysis.runs.executor import shortened, without_middle

# Characters of an error, and of its traceback, that are kept.
_LONGEST_ERROR, _LONGEST_TRACEBACK = 280, 20_000
_ADDRESS = re.compile(r"\b0x[0-9a-fA-F]{6,}\b")
# Errors that are meant to be read alone; others are named.
_READABLE = (ValueError, TypeError, OSError)


class Failure(NamedTuple):
    """Why a run failed.

    Attributes
    ----------
    error : str
        The error on one line.
    traceback : str
        The traceback, from the shard's function on; empty for a run whose workers died.
    """

    error: str
    traceback: str


def failure_of(error: BaseException) -> Failure:
    """Return what is kept of an error; raise it again if it is an interrupt of this process.

    Addresses in memory are left out, so that the same error gives the same text in each process.
    """
    if isinstance(error, KeyboardInterrupt) and _receives_interrupts():
        raise error
    text, name = _plain(" ".join(message_of(error).split())), type(error).__name__
    if not isinstance(error, _READABLE):
        text = f"{name}: {text}" if text else name
    trace = _plain("".join(traceback.format_exception(error)))
    return Failure(one_line(text or name), without_middle(trace, _LONGEST_TRACEBACK))


def message_of(error: BaseException) -> str:
    """Return the message of an error, also of one whose class cannot make it."""
    try:
        return str(error)
    except Exception:
        return "(its message cannot be shown)"


def _receives_interrupts() -> bool:
    """Whether Ctrl-C reaches this thread; in workers it does not, so there it is the model that raises it."""
    is_main = threading.current_thread() is threading.main_thread()
    return is_main and signal.getsignal(signal.SIGINT) is not signal.SIG_IGN


def one_line(text: str) -> str:
    """Return a text on one line, without the middle of a long one."""
    return shortened(text, _LONGEST_ERROR)


def _plain(text: str) -> str:
    """Return a text without addresses, with what no file holds, or a terminal acts on, escaped."""
    text = _ADDRESS.sub("0x…", text)
    if text.isprintable():
        return text
    return "".join(one if one.isprintable() or one == "\n" else ascii(one)[1:-1] for one in text)
