"""Ctrl-C ends the program with status 130 and one line, also while it starts and while it ends."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path
from typing import NoReturn

import pytest

from teamsight.cli import main
from teamsight.cli.look import RunSettings

ROOT = Path(__file__).parents[2]

# The program, with a signal at the import of the module with a given number after that of the command line. With the mode
# "forks" a copy of the process gets it, at each import whose number is a multiple of that, and writes to files of its own.
PROGRAM = """
import atexit, os, runpy, signal, sys

class Interrupting:
    met = -1
    is_original = True
    def find_spec(self, name, path=None, target=None):
        if self.is_original and (name == "teamsight.cli" or self.met >= 0):
            self.met += 1
            if mode != "forks":
                if self.met == number:
                    signal.raise_signal(kind)
            elif self.met % number == 0:
                self.fork()
    def fork(self):
        if process := os.fork():
            status = os.waitstatus_to_exitcode(os.waitpid(process, 0)[1])
            os.rename("out", f"{self.met} {status} out")
            os.rename("err", f"{self.met} {status} err")
            return
        self.is_original = False
        for stream, name in ((1, "out"), (2, "err")):
            os.dup2(os.open(name, os.O_WRONLY | os.O_CREAT), stream)
        signal.raise_signal(kind)

kind = signal.SIGTERM if "SIGTERM" in sys.argv[1] else signal.SIGINT
mode, number, sys.argv = sys.argv[1], int(sys.argv[2]), ["teamsight", *sys.argv[3:]]
signal.signal(signal.SIGINT, signal.SIG_IGN if "ignored" in mode else signal.default_int_handler)
sys.meta_path.insert(0, Interrupting())
if mode == "at exit":
    atexit.register(signal.raise_signal, signal.SIGINT)
runpy.run_module("teamsight", run_name="__main__", alter_sys=True)
"""
RUN = ["run", "--robots", "2", "--targets", "2", "--steps", "2"]


def program(mode: str, number: int, *arguments: str, folder: Path = ROOT) -> tuple[int, str, str]:
    done = subprocess.run(
        [sys.executable, "-c", PROGRAM, mode, str(number), *arguments],
        cwd=folder, env=dict(os.environ, PYTHONPATH=str(ROOT)), capture_output=True, text=True,
    )  # fmt: skip
    return done.returncode, done.stdout, done.stderr


def interrupted(folder: Path, every: int, *arguments: str) -> list[tuple[int, str, str]]:
    """Return how copies of a program left that were interrupted at each import with a multiple of this number."""
    status, _, err = program("forks", every, *arguments, folder=folder)
    assert status == 0, err
    return [
        (int(out.name.split()[1]), out.read_text(), out.with_name(out.name.replace("out", "err")).read_text())
        for out in folder.glob("* out")
    ]


INTERRUPTED = (130, "", "teamsight: interrupted\n")


@pytest.mark.short
@pytest.mark.skipif(not hasattr(os, "fork"), reason="cannot fork")
def test_while_the_command_line_is_imported(tmp_path: Path) -> None:
    found = interrupted(tmp_path, 4, "--help")
    assert len(found) > 10
    assert set(found) == {INTERRUPTED}


@pytest.mark.skipif(not hasattr(os, "fork"), reason="cannot fork")
def test_while_a_command_imports_what_it_needs(tmp_path: Path) -> None:
    found = interrupted(tmp_path, 100, *RUN)
    assert len(found) > 10
    for status, out, err in found:
        # click ends the line of a terminal's ^C where work has begun.
        assert (status, out, err.strip().count("\n")) == (130, "", 0), err
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
