"""A line that shows how far a long operation is: on a terminal, or below a cell of a notebook."""

from __future__ import annotations

import contextlib
import html
import multiprocessing
import os
import shutil
import sys
import threading
from typing import Any

#: Work that takes longer shows its progress [s].
PATIENCE = 2.0
#: Runs within runs, as of a recorder that runs a world of its own, and of a batch leave the line to the outermost.
shown_lines: list[object] = []
_CLEAR = "\r\x1b[K"


def has_reader() -> bool:
    """Whether a line would be read: by a terminal or a notebook, in the main thread of a process that is no worker."""
    if multiprocessing.parent_process() is not None or threading.current_thread() is not threading.main_thread():
        return False
    return in_notebook() or _is_terminal()


def in_notebook() -> bool:
    """Whether this process runs the cells of a notebook."""
    shell = getattr(sys.modules.get("IPython"), "get_ipython", lambda: None)()
    return getattr(shell, "kernel", None) is not None


class StatusLine:
    """A line that replaces itself. It is removed by `close`, so that nothing is left after an error or Ctrl-C.

    Make one only if there is a reader; see `has_reader`.
    """

    def __init__(self) -> None:
        self._is_shown = False
        # What updates the output of a notebook's cell; None on a terminal.
        self._output: Any = None
        self._in_notebook = in_notebook()

    def show(self, text: str) -> None:
        """Show a text in place of the last one.

        Parameters
        ----------
        text : str
            One line; a terminal shows what fits.
        """
        if self._in_notebook:
            self._display(text)
        else:
            # A line that is wrapped cannot be removed.
            width = shutil.get_terminal_size().columns - 1
            _write(_CLEAR + text[:width])
        self._is_shown = True

    def close(self) -> None:
        """Remove the line. Idempotent."""
        if not self._is_shown:
            return
        if self._in_notebook:
            self._display("")
        else:
            _write(_CLEAR)
        self._is_shown = False

    def _display(self, text: str) -> None:
        """Show a text below the cell, without widgets."""
        from IPython.display import display

        shown = {"text/plain": text, "text/html": f"<small>{html.escape(text)}</small>" if text else ""}
        with contextlib.suppress(OSError):
            if self._output is None:
                self._output = display(shown, raw=True, display_id=True)
            else:
                self._output.update(shown, raw=True)


def seconds(duration: float) -> str:
    """Return a duration [s] as people say it: ``7 s``, ``3 min 20 s``, ``2 h 5 min``."""
    whole = round(duration)
    if whole < 60:
        return f"{whole} s"
    if whole < 3600:
        return f"{whole // 60} min {whole % 60} s"
    return f"{whole // 3600} h {whole % 3600 // 60} min"


def _is_terminal() -> bool:
    try:
        # A stream in its place, such as that of a progress bar, would write the line among others.
        is_own = sys.stderr is not None and sys.stderr is sys.__stderr__
        return is_own and sys.stderr.isatty() and os.environ.get("TERM") != "dumb"
    except ValueError:  # a closed stream
        return False


def _write(text: str) -> None:
    # Without a reader, results must not be lost.
    with contextlib.suppress(OSError, ValueError):
        sys.stderr.write(text)
        sys.stderr.flush()
