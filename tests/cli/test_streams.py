"""Results outlast a standard output that is full or gone, and the status is 0, 2 or 130 whatever becomes of the streams."""

from __future__ import annotations

import contextlib
import os
import subprocess
import sys
from pathlib import Path

import pytest

from teamsight.cli import main

ROOT = Path(__file__).parents[2]
RUN = ("run", "--steps", "5")
DELTA = ("delta", "--robots", "5", "--runs", "3", "--steps", "5", "--risk", "0.5")
EXPLORE = ("learn", "explore", "--runs", "1")
WRITTEN = {RUN: ("--save", "out.parquet"), DELTA: ("--out", "out"), EXPLORE: ("--out", "out.safetensors")}

pytestmark = pytest.mark.skipif(not Path("/dev/full").exists(), reason="needs a device that is full")


def teamsight(folder: Path, *arguments: str, output: int, errors: int = subprocess.PIPE) -> tuple[int, str]:
    environment = dict(os.environ, PYTHONPATH=str(ROOT))
    found = subprocess.run(
        [sys.executable, "-m", "teamsight", *arguments],
        stdout=output, stderr=errors, cwd=folder, env=environment, text=True, check=False,
    )  # fmt: skip
    return found.returncode, found.stderr or ""


@pytest.fixture
def full() -> int:
    return os.open("/dev/full", os.O_WRONLY)


@pytest.fixture
def gone() -> int:
    """Return a pipe that nobody reads."""
    read, write = os.pipe()
    os.close(read)
    return write


def within(
    arguments: tuple[str, ...], folder: Path, monkeypatch: pytest.MonkeyPatch, *, output: int, errors: int | None = None
) -> int:
    """Run a command in this process, with these streams, and return its status."""
    with contextlib.ExitStack() as opened, monkeypatch.context() as patch:
        patch.chdir(folder)
        streams = {"stdout": output} if errors is None else {"stdout": output, "stderr": errors}
        for name, number in streams.items():
            patch.setattr(sys, name, opened.enter_context(open(os.dup(number), "w", encoding="utf-8")))
        with pytest.raises(SystemExit) as left:
            main(arguments)
    return int(left.value.code or 0)


def test_a_program_reports_a_full_output_and_loses_no_file(tmp_path: Path, full: int) -> None:
    status, errors = teamsight(tmp_path, *RUN, *WRITTEN[RUN], output=full)
    assert (status, errors) == (2, "teamsight: standard output: No space left on device\n")
    assert (tmp_path / WRITTEN[RUN][1]).exists()


def test_to_a_program_a_reader_that_goes_away_is_no_error(tmp_path: Path, gone: int) -> None:
    assert teamsight(tmp_path, *RUN, *WRITTEN[RUN], output=gone) == (0, "")
    assert (tmp_path / WRITTEN[RUN][1]).exists()


@pytest.mark.parametrize("command", WRITTEN)
def test_commands_write_before_they_print(
    command: tuple[str, ...], tmp_path: Path, full: int, gone: int, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    for output, status, said in ((full, 2, "teamsight: standard output: No space left on device\n"), (gone, 0, "")):
        folder = tmp_path / str(status)
        folder.mkdir()
        assert within((*command, *WRITTEN[command]), folder, monkeypatch, output=output) == status
        assert capsys.readouterr().err == said
        assert (folder / WRITTEN[command][1]).exists()


def test_an_evaluation_is_written_before_it_is_printed(
    tmp_path: Path, full: int, gone: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    nowhere = os.open(os.devnull, os.O_WRONLY)
    assert within((*EXPLORE, *WRITTEN[EXPLORE]), tmp_path, monkeypatch, output=nowhere) == 0
    for output, status in ((full, 2), (gone, 0)):
        place = f"{status}.parquet"
        small = ("--runs", "1", "--steps", "5", "--workers", "1", "--save", place)
        evaluate = ("learn", "evaluate", "out.safetensors", *small)
        assert within(evaluate, tmp_path, monkeypatch, output=output) == status
        assert (tmp_path / place).exists()


def test_help_without_a_reader_or_a_place(tmp_path: Path, full: int, gone: int) -> None:
    assert teamsight(tmp_path, "run", "--help", output=gone) == (0, "")
    assert teamsight(tmp_path, "run", "--help", output=full) == (
        2,
        "teamsight: standard output: No space left on device\n",
    )


def test_a_failing_standard_error_changes_no_status_of_a_program(tmp_path: Path, full: int, gone: int) -> None:
    assert teamsight(tmp_path, "--version", output=subprocess.DEVNULL, errors=full)[0] == 0
    for errors in (full, gone):
        assert teamsight(tmp_path, "runn", output=subprocess.DEVNULL, errors=errors)[0] == 2


@pytest.mark.parametrize(("arguments", "status"), [(RUN, 0), (("run", "--steps", "0"), 2)])
def test_a_failing_standard_error_changes_no_status(
    arguments: tuple[str, ...], status: int, tmp_path: Path, full: int, gone: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    for errors in (full, gone):
        output = os.open(os.devnull, os.O_WRONLY)
        assert within(arguments, tmp_path, monkeypatch, output=output, errors=errors) == status
