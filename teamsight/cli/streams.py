"""Standard output and standard error that cannot be written: which of them failed, and an end without a complaint."""

from __future__ import annotations

import contextlib
import errno
import os
import sys
from typing import TextIO

OUTPUT = "standard output"

_OF_WRITING = {errno.ENOSPC, errno.EDQUOT, errno.EFBIG, errno.EIO} if hasattr(errno, "EDQUOT") else {errno.ENOSPC}


def flush(output: TextIO | None) -> None:
    """Write what waits for standard output, unless there is none.

    Raises
    ------
    OSError
        If it cannot be written.
    """
    if output is not None:
        output.flush()


def failure_of(output: TextIO | None, error: OSError) -> OSError | None:
    """Return what is wrong with standard output, None if nothing is; nothing more is written to it then.

    Parameters
    ----------
    output : TextIO or None
        Standard output.
    error : OSError
        What ended the command. Errors in writing files are of other types, or have names; so one without is of it.
    """
    try:
        flush(output)
    except OSError as found:
        error = found
    else:
        if error.filename is not None or error.errno not in _OF_WRITING:
            return None
    if output is not None:
        give_up(output)
    return named(error)


def named(error: OSError) -> OSError:
    """Return an error of standard output, which has no name of a file, with one."""
    return OSError(error.errno, error.strerror or str(error), OUTPUT)


def settle() -> None:
    """Give up what waits for a stream that cannot be written; Python would end with a status of its own."""
    for stream in (sys.__stdout__, sys.__stderr__, sys.stdout, sys.stderr):  # click may have wrapped them
        if stream is not None:
            try:
                stream.flush()
            except (OSError, ValueError):
                give_up(stream)


def give_up(stream: TextIO) -> None:
    """Let what is written to a stream go nowhere from now on."""
    with contextlib.suppress(OSError, ValueError):
        nowhere = os.open(os.devnull, os.O_WRONLY)
        os.dup2(nowhere, stream.fileno())
        os.close(nowhere)


class Forgiving:
    """A stream that tells of progress: that it cannot be written is no reason to lose the results.

    Parameters
    ----------
    stream : TextIO
        What is written to.
    """

    def __init__(self, stream: TextIO) -> None:
        self._stream = stream

    def __getattr__(self, name: str) -> object:
        return getattr(self._stream, name)

    def write(self, text: str) -> int:
        """Write a text, if the stream takes it."""
        with contextlib.suppress(OSError):
            self._stream.write(text)
        return len(text)

    def flush(self) -> None:
        """Pass on what was written, if the stream takes it."""
        with contextlib.suppress(OSError):
            self._stream.flush()
