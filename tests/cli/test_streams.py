"""Results outlast a standard output that is full or gone, and the status is 0, 2 or 130 whatever becomes of the streams."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

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


@pytest.mark.parametrize("command", WRITTEN)
def test_a_full_output_is_reported_and_loses_no_file(command: tuple[str, ...], tmp_path: Path, full: int) -> None:
    status, errors = teamsight(tmp_path, *command, *WRITTEN[command], output=full)
    assert (status, errors) == (2, "teamsight: standard output: No space left on device\n")
    assert (tmp_path / WRITTEN[command][1]).exists()


@pytest.mark.parametrize("command", WRITTEN)
def test_a_reader_that_goes_away_is_no_error(command: tuple[str, ...], tmp_path: Path, gone: int) -> None:
    assert teamsight(tmp_path, *command, *WRITTEN[command], output=gone) == (0, "")
    assert (tmp_path / WRITTEN[command][1]).exists()


def test_an_evaluation_is_written_before_it_is_printed(tmp_path: Path, full: int, gone: int) -> None:
    assert teamsight(tmp_path, *EXPLORE, *WRITTEN[EXPLORE], output=subprocess.DEVNULL) == (0, "")
    for output, status in ((full, 2), (gone, 0)):
        place = f"{status}.parquet"
        small = ("--runs", "1", "--steps", "5", "--workers", "1", "--save", place)
        assert teamsight(tmp_path, "learn", "evaluate", "out.safetensors", *small, output=output)[0] == status
        assert (tmp_path / place).exists()


def test_help_without_a_reader_or_a_place(tmp_path: Path, full: int, gone: int) -> None:
    assert teamsight(tmp_path, "run", "--help", output=gone) == (0, "")
    assert teamsight(tmp_path, "run", "--help", output=full) == (
        2,
        "teamsight: standard output: No space left on device\n",
    )


@pytest.mark.parametrize(("arguments", "status"), [(RUN, 0), (("run", "--steps", "0"), 2), (("runn",), 2)])
def test_a_failing_standard_error_changes_no_status(
    arguments: tuple[str, ...], status: int, tmp_path: Path, full: int, gone: int
) -> None:
    for errors in (full, gone):
        assert teamsight(tmp_path, *arguments, output=subprocess.DEVNULL, errors=errors)[0] == status
