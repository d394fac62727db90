"""How a command ends: its exit status, and its errors as one line each, without a traceback.

The status is 0 if all went well, 2 if the input is wrong or results cannot be written, and 130 after Ctrl-C or SIGTERM.
If the reader of standard output exits, as ``head`` does, that is not an error, since all files are written before
anything is printed. If standard error cannot be written, the status alone says what happened.
"""

from __future__ import annotations

import contextlib
import io
import os
import sys
from collections.abc import Sequence
from typing import NoReturn

import click

from teamsight.cli import streams
from teamsight.cli.errors import lines, one_line

WRONG_INPUT, INTERRUPTED = 2, 130

_COMPLETE = "every file written so far is complete"


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
        context = error.ctx if isinstance(error, click.UsageError) else None
        hint = f"; see {context.command_path} --help" if context else ""
        _leave([error.format_message().rstrip(".") + hint], WRONG_INPUT)
    except SystemExit:
        # click raises it when the reader of standard output has gone away.
        _leave([], 0)
    except Exception as error:
        if _is_interrupt(error):
            _leave([f"interrupted; {_COMPLETE}"], INTERRUPTED)
        failure = streams.failure_of(output, error) if isinstance(error, OSError) else None
        if isinstance(failure, BrokenPipeError):
            _leave([], 0)
        _fail(failure or error)
    _leave([], status or 0)


def _fail(error: Exception) -> NoReturn:
    if os.environ.get("TEAMSIGHT_TRACEBACK"):
        raise error
    _leave(lines(error), WRONG_INPUT)


def _is_interrupt(error: BaseException | None) -> bool:
    """Return whether Python or a library made this error out of an interrupt; an error while handling one is none."""
    if isinstance(error, OSError | ValueError):
        return False
    while error is not None and not isinstance(error, KeyboardInterrupt):
        error = error.__cause__ or error.__context__
    return error is not None


def _leave(messages: Sequence[str], status: int) -> NoReturn:
    with contextlib.suppress(OSError):
        for message in messages:
            click.echo(f"teamsight: {one_line(message)}", err=True)
    streams.settle()
    sys.exit(status)
