"""Ctrl-C ends the program with status 130 and one line, also while it starts and while it ends."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path
from typing import NoReturn

import pytest

from teamsight.cli import main
from teamsight.cli.look import RunSettings

ROOT = Path(__file__).parents[2]

# The program, with an interrupt at the import of the module with a given number after that of the command line.
PROGRAM = """
import atexit, runpy, signal, sys

class Interrupting:
    met = -1
    def find_spec(self, name, path=None, target=None):
        if name == "teamsight.cli" or self.met >= 0:
            self.met += 1
            if self.met == number:
                signal.raise_signal(kind)

kind = signal.SIGTERM if "SIGTERM" in sys.argv[1] else signal.SIGINT
mode, number, sys.argv = sys.argv[1], int(sys.argv[2]), ["teamsight", *sys.argv[3:]]
signal.signal(signal.SIGINT, signal.SIG_IGN if "ignored" in mode else signal.default_int_handler)
finder = Interrupting()
sys.meta_path.insert(0, finder)
if mode == "at exit":
    atexit.register(signal.raise_signal, signal.SIGINT)
if mode == "count":
    atexit.register(lambda: print(finder.met, file=sys.stderr))
runpy.run_module("teamsight", run_name="__main__", alter_sys=True)
"""
RUN = ["run", "--robots", "2", "--targets", "2", "--steps", "2"]


def program(mode: str, number: int, *arguments: str) -> tuple[int, str, str]:
    done = subprocess.run(
        [sys.executable, "-c", PROGRAM, mode, str(number), *arguments],
        cwd=ROOT, capture_output=True, text=True,
    )  # fmt: skip
    return done.returncode, done.stdout, done.stderr


INTERRUPTED = (130, "", "teamsight: interrupted\n")


@pytest.mark.short
def test_while_the_command_line_is_imported() -> None:
    last = int(program("count", -1, "--help")[2])
    for number in (*range(0, last, 1 + last // 12), last):
        assert program("interrupt", number, "--help") == INTERRUPTED, number


def test_while_a_command_imports_what_it_needs() -> None:
    # The first may have to compile, which imports more and prints so.
    last = [int(program("count", -1, *RUN)[2].split()[-1]) for _ in range(2)][1]
    for number in range(last // 20, last, last // 10):
        status, out, err = program("interrupt", number, *RUN)
        # click ends the line of a terminal's ^C where work has begun.
        assert (status, out, err.strip().count("\n")) == (130, "", 0), (number, err)
        assert err.strip().startswith("teamsight: interrupted")


@pytest.mark.short
@pytest.mark.skipif(sys.platform == "win32", reason="has no SIGTERM")
@pytest.mark.parametrize("mode", ["SIGTERM", "SIGTERM with Ctrl-C ignored"])
def test_sigterm_is_treated_as_ctrl_c(mode: str) -> None:
    """A program in the background ignores Ctrl-C, and ends nevertheless."""
    assert program(mode, 3, "--help") == INTERRUPTED


@pytest.mark.short
def test_after_the_end() -> None:
    status, out, err = program("at exit", -1, "--version")
    assert (status, out.split()[0], err) == (0, "teamsight", "")


@pytest.mark.short
def test_a_program_in_the_background_goes_on_ignoring_it() -> None:
    status, out, err = program("ignored", 3, "--version")
    assert (status, out.split()[0], err) == (0, "teamsight", "")


def call(capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch, error: BaseException) -> tuple[int, str]:
    def fail(settings: RunSettings) -> NoReturn:
        raise error

    monkeypatch.setattr(RunSettings, "check", fail)
    with pytest.raises(SystemExit) as left:
        main(["run"])
    return int(left.value.code or 0), capsys.readouterr().err.strip()


@pytest.mark.short
def test_what_python_makes_of_an_interrupt_is_one(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    error = RuntimeError("Error calling __set_name__ on 'Field' instance")
    error.__cause__ = KeyboardInterrupt()
    status, message = call(capsys, monkeypatch, error)
    assert status == 130
    assert message.startswith("teamsight: interrupted")
    assert "\n" not in message


@pytest.mark.short
def test_an_error_in_handling_an_interrupt_is_reported(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    error = OSError(28, "No space left on device", "kept.parquet")
    error.__context__ = KeyboardInterrupt()
    assert call(capsys, monkeypatch, error) == (2, "teamsight: kept.parquet: No space left on device")


@pytest.mark.short
def test_the_end_of_a_file_is_no_interrupt(capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("TEAMSIGHT_TRACEBACK", raising=False)
    status, message = call(capsys, monkeypatch, EOFError("Ran out of input"))
    assert status == 2
    assert message.startswith("teamsight: EOFError: Ran out of input")
