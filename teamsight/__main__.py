"""The command line as a program: ``teamsight`` and ``python -m teamsight``.

Ctrl-C ends the program with status 130 and one line, at any time, and so does SIGTERM, which clusters send before they
kill a job. So this module imports nothing that Python has not
loaded before: until the handler below is set, Python itself would print a traceback.
"""

from __future__ import annotations

import _signal  # type: ignore[import-not-found, unused-ignore]
import os
import sys

TYPE_CHECKING = False  # importing `typing` takes longer than everything above
if TYPE_CHECKING:
    from types import FrameType
    from typing import NoReturn

_INTERRUPTED = 130
_SIGNALS = (_signal.SIGINT, _signal.SIGTERM)
_PACKAGES = ("teamsight.agents", "teamsight.analysis", "teamsight.policies", "teamsight.world")


def main() -> NoReturn:
    """Run the command line and exit; see `teamsight.cli.main`."""
    # A program that a shell runs in the background ignores Ctrl-C; leave that as it is.
    if _signal.getsignal(_signal.SIGINT) is _signal.default_int_handler:
        _signal.signal(_signal.SIGINT, _interrupt)
    if _signal.getsignal(_signal.SIGTERM) == _signal.SIG_DFL:
        _signal.signal(_signal.SIGTERM, _terminate)
    try:
        import gc

        # Imports make a million objects that stay; to look for garbage every 700 takes a sixth of a short command.
        gc.set_threshold(100_000)

        from teamsight.cli import main as run

        run()
    except KeyboardInterrupt:
        _leave("teamsight: interrupted\n")
    except SystemExit as end:
        # The work is done. While Python shuts down, Ctrl-C would print a traceback.
        _ignore_signals()
        if end.code == _INTERRUPTED:
            _leave()
        raise


def _interrupt(number: int, frame: FrameType | None) -> None:
    if _is_loading(frame):
        # A module that is interrupted while it loads may raise another error, or stay half loaded. No work has begun,
        # so there is nothing to clean up.
        try:
            os.write(2, b"teamsight: interrupted\n")
        finally:  # standard error may be closed
            os._exit(_INTERRUPTED)
    raise KeyboardInterrupt


def _terminate(number: int, frame: FrameType | None) -> None:
    """Do what Ctrl-C would do now, which may be deferred; end also a program in the background, which ignores it."""
    if _signal.getsignal(_signal.SIGINT) == _signal.SIG_IGN:
        _interrupt(number, frame)
    _signal.raise_signal(_signal.SIGINT)


def _ignore_signals() -> None:
    for number in _SIGNALS:
        _signal.signal(number, _signal.SIG_IGN)


def _is_loading(frame: FrameType | None) -> bool:
    """Return whether modules are being imported while no work is in progress."""
    loading = working = False
    while frame is not None:
        if frame.f_code.co_filename.startswith("<frozen importlib"):
            # Code that a module runs while it is imported is not work.
            loading, working = True, False
        elif str(frame.f_globals.get("__name__")).startswith(_PACKAGES):
            working = True
        frame = frame.f_back
    return loading and not working


def _leave(message: str = "") -> NoReturn:
    """Exit after an interrupt; Python itself may exit by the signal instead of with the status."""
    _ignore_signals()
    import atexit
    import contextlib

    with contextlib.suppress(OSError, ValueError, AttributeError):  # standard error may be closed
        sys.stderr.write(message)
    atexit._run_exitfuncs()
    for stream in (sys.stdout, sys.stderr):
        with contextlib.suppress(OSError, ValueError, AttributeError):
            stream.flush()
    os._exit(_INTERRUPTED)


if __name__ == "__main__":
    main()
