"""The command line as a program: ``teamsight`` and ``python -m teamsight``.

Ctrl-C ends the program with status 130 and one line, whenever it comes. So this module imports nothing that Python has
not loaded before: the time in which Python itself would answer with a traceback is as short as it can be.
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
_ROOMS = ("teamsight.agents", "teamsight.analysis", "teamsight.policies", "teamsight.world")


def main() -> NoReturn:
    """Run the command line and exit; see `teamsight.cli.main`."""
    # A program in the background of a shell ignores Ctrl-C, and goes on doing so.
    if _signal.getsignal(_signal.SIGINT) is _signal.default_int_handler:
        _signal.signal(_signal.SIGINT, _interrupt)
    try:
        from teamsight.cli import main as run

        run()
    except KeyboardInterrupt:
        _leave("teamsight: interrupted\n")
    except SystemExit as end:
        # All is done. Python would answer Ctrl-C with a traceback while it clears up.
        _signal.signal(_signal.SIGINT, _signal.SIG_IGN)
        if end.code == _INTERRUPTED:
            _leave()
        raise


def _interrupt(number: int, frame: FrameType | None) -> None:
    if _is_loading(frame):
        # Modules that are interrupted while they load report other errors instead, or go on half loaded. Nothing has
        # begun that would have to be cleared up.
        try:
            os.write(2, b"teamsight: interrupted\n")
        finally:  # nobody may be there to read it
            os._exit(_INTERRUPTED)
    raise KeyboardInterrupt


def _is_loading(frame: FrameType | None) -> bool:
    """Say whether the command line is importing what it needs, and no work is under way meanwhile."""
    loading = working = False
    while frame is not None:
        if frame.f_code.co_filename.startswith("<frozen importlib"):
            # What a module runs when it is imported is no work.
            loading, working = True, False
        elif str(frame.f_globals.get("__name__")).startswith(_ROOMS):
            working = True
        frame = frame.f_back
    return loading and not working


def _leave(message: str = "") -> NoReturn:
    """End after an interrupt; Python itself may end by the signal instead of the status."""
    _signal.signal(_signal.SIGINT, _signal.SIG_IGN)
    import atexit
    import contextlib

    with contextlib.suppress(OSError, ValueError, AttributeError):  # nobody may be there to read it
        sys.stderr.write(message)
    atexit._run_exitfuncs()
    for stream in (sys.stdout, sys.stderr):
        with contextlib.suppress(OSError, ValueError, AttributeError):
            stream.flush()
    os._exit(_INTERRUPTED)


if __name__ == "__main__":
    main()
