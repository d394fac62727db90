"""How a command ends: its exit status, and its errors as one line each, without a traceback.

The status is 0 if all went well, 2 if the input is wrong or results cannot be written, and 130 after Ctrl-C or SIGTERM.
If the reader of standard output exits, as ``head`` does, that is not an error, since all files are written before
anything is printed. If standard error cannot be written, the status alone says what happened.
"""

from __future__ import annotations

import contextlib
import errno
import io
import os
import re
import shutil
import sys
import traceback
from collections.abc import Sequence
from typing import NoReturn, TextIO

import click

from teamsight.cli.options import InputError, usage
from teamsight.core.interrupts import is_interrupt
from teamsight.core.plain_text import broken_lines
from teamsight.core.references import place_of

WRONG_INPUT, INTERRUPTED = 2, 130

_COMPLETE = "every file written so far is complete"
# A line that is too long keeps its end, which is the cure.
_MOST, _END = 360, 140
_OF_WRITING = {errno.ENOSPC, errno.EFBIG, errno.EIO, getattr(errno, "EDQUOT", errno.ENOSPC)}


def run_and_exit(commands: click.Group, arguments: Sequence[str] | None) -> NoReturn:
    """Run a command line and exit.

    Parameters
    ----------
    commands : click.Group
        The commands.
    arguments : sequence of str, optional
        The command line; by default that of the process.
    """
    if isinstance(sys.stdout, io.TextIOWrapper):
        # δ and file names may not be encodable in the terminal or pipe; that must not lose the results.
        sys.stdout.reconfigure(errors="backslashreplace")
    output = sys.stdout
    try:
        status = commands.main(args=arguments, prog_name="teamsight", standalone_mode=False)
        if output is not None:
            output.flush()
    except (click.Abort, KeyboardInterrupt) as stop:
        if isinstance(stop.__cause__, EOFError):
            # click takes the end of any file for the end of the terminal's input.
            _fail(stop.__cause__)
        # click wraps the interrupt; what the command added to it is in the cause.
        _leave([f"interrupted; {str(stop.__cause__ or stop) or _COMPLETE}"], INTERRUPTED)
    except click.ClickException as error:
        _leave([usage(error)], WRONG_INPUT)
    except SystemExit:
        # click raises it when the reader of standard output has gone away.
        _leave([], 0)
    except Exception as error:
        if is_interrupt(error):
            _leave([f"interrupted; {_COMPLETE}"], INTERRUPTED)
        failure = _failure_of(output, error) if isinstance(error, OSError) else None
        if isinstance(failure, BrokenPipeError):
            _leave([], 0)
        _fail(failure or error)
    _leave([], status or 0)


def _fail(error: Exception) -> NoReturn:
    if os.environ.get("TEAMSIGHT_TRACEBACK"):
        raise error
    _leave(lines(error), WRONG_INPUT)


def _leave(messages: Sequence[str], status: int) -> NoReturn:
    with contextlib.suppress(OSError):
        for message in messages:
            line = f"teamsight: {one_line(message)}"
            if sys.stderr is not None and sys.stderr.isatty():
                line = broken_lines(line, shutil.get_terminal_size().columns)
            click.echo(line, err=True)
    # The buffers of streams that cannot be written; otherwise Python would exit with a status of its own.
    for stream in (sys.__stdout__, sys.__stderr__, sys.stdout, sys.stderr):  # click may have wrapped them
        if stream is not None:
            try:
                stream.flush()
            except (OSError, ValueError):
                give_up(stream)
    sys.exit(status)


def lines(error: Exception) -> list[str]:
    """Return the messages of `error`, each on one line.

    An error that comes neither from the input nor from the user's code is a bug in teamsight; its line asks to report
    it.
    """
    from teamsight.analysis.runs.executor import JobError

    if isinstance(error, InputError):
        return list(map(one_line, error.messages))
    text = str(error)
    if isinstance(error, JobError) and (place := _place(error)):
        text = f"{text} (in {place}; TEAMSIGHT_TRACEBACK=1 shows how it came there)"
    elif isinstance(error, OSError):
        text = f"{error.filename or 'a file'}: {error.strerror or error}"
    elif isinstance(error, MemoryError):
        text = f"not enough memory ({error or 'none left'}); give fewer robots, targets, steps or runs"
    # An optional package has an error that says how to install it.
    elif not (
        isinstance(error, ValueError | TypeError | JobError)
        or (isinstance(error, ModuleNotFoundError) and error.name is None)
    ):
        place = _place(error)
        whose = f"in {place}; TEAMSIGHT_TRACEBACK=1 shows how it came there" if place else (
            "a bug in teamsight: please report it, with the output under TEAMSIGHT_TRACEBACK=1"
        )
        text = f"{type(error).__name__}: {error} ({whose})"
    return [one_line(text)]


def _place(error: Exception) -> str:
    """Return the file and line in the code of the user that raised an error; "" if none did.

    A job may have failed in another process, whose traceback is a text.
    """
    from teamsight.analysis.runs.executor import JobError

    of_job = re.findall(r'^  File "(.+)", line (\d+)', str(error.__cause__ or ""), re.MULTILINE)
    own = [(frame.f_code.co_filename, line) for frame, line in traceback.walk_tb(error.__traceback__)]
    found = place_of(of_job if isinstance(error, JobError) else own)
    return f"{found[0]}:{found[1]}" if found else ""


def printable(text: str) -> str:
    """Return a text with control characters, and characters that cannot be encoded, as escape sequences."""
    return "".join(c if c.isprintable() else ascii(c)[1:-1] for c in text)


def one_line(text: str) -> str:
    """Return a text on one printable line; the middle of a long text is left out."""
    shown = printable(" ".join(text.split()))
    return shown if len(shown) <= _MOST else f"{shown[: _MOST - _END - 3]} … {shown[-_END:]}"


def _failure_of(output: TextIO | None, error: OSError) -> OSError | None:
    """Return the error of standard output, or None if it has none; after an error, its output is discarded.

    Errors of files are of other types or have a file name; one without is of the output.
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
    return OSError(error.errno, error.strerror or str(error), "standard output")


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
