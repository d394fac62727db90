"""Standard output and standard error that cannot be written: find out which failed, and exit without a traceback."""

from __future__ import annotations

import contextlib
import errno
import os
import sys
from typing import TextIO

OUTPUT = "standard output"

_OF_WRITING = {errno.ENOSPC, errno.EDQUOT, errno.EFBIG, errno.EIO} if hasattr(errno, "EDQUOT") else {errno.ENOSPC}


def failure_of(output: TextIO | None, error: OSError) -> OSError | None:
    """Return the error of standard output, or None if it has none; after an error, its output is discarded.

    Parameters
    ----------
    output : TextIO or None
        Standard output.
    error : OSError
        What ended the command. Errors of files are of other types or have a file name; one without is of the output.
    """
    try:
        if output is not None:
            output.flush()
    except OSError as found:
        error = found
    else:
        if error.filename is not None or error.errno not in _OF_WRITING:
            return None
    if output is not None:
        give_up(output)
    return named(error)


def named(error: OSError) -> OSError:
    """Return an error of standard output with a name in place of the file name that it lacks."""
    return OSError(error.errno, error.strerror or str(error), OUTPUT)


def settle() -> None:
    """Discard the buffers of streams that cannot be written; otherwise Python would exit with a status of its own."""
    for stream in (sys.__stdout__, sys.__stderr__, sys.stdout, sys.stderr):  # click may have wrapped them
        if stream is not None:
            try:
                stream.flush()
            except (OSError, ValueError):
                give_up(stream)


def give_up(stream: TextIO) -> None:
    """Discard what is written to a stream from now on."""
    with contextlib.suppress(OSError, ValueError):
        nowhere = os.open(os.devnull, os.O_WRONLY)
        os.dup2(nowhere, stream.fileno())
        os.close(nowhere)


class LossyStream:
    """A stream for progress, which ignores errors: they must not lose the results.

    Parameters
    ----------
    stream : TextIO
        The stream.
    """

    def __init__(self, stream: TextIO) -> None:
        self._stream = stream

    def __getattr__(self, name: str) -> object:
        return getattr(self._stream, name)

    def write(self, text: str) -> int:
        """Write a text; errors are ignored."""
        with contextlib.suppress(OSError):
            self._stream.write(text)
        return len(text)

    def flush(self) -> None:
        """Flush the stream; errors are ignored."""
        with contextlib.suppress(OSError):
            self._stream.flush()
