"""``teamsight delta --trajectories`` with a file of several recordings."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from teamsight.cli import main


def call(capsys: pytest.CaptureFixture[str], file: Path, *arguments: str) -> tuple[int, str, str]:
    with pytest.raises(SystemExit) as left:
        main(["delta", "--trajectories", str(file), "--awareness-range", "1", *arguments])
    out, err = capsys.readouterr()
    return int(left.value.code or 0), " ".join(out.split()), err


@pytest.fixture
def file(tmp_path: Path) -> Path:
    """Twelve recordings of 14 samples, in three of which two robots meet; each clock starts at 0."""
    rows = [
        (run, t, robot, robot * (0.5 if run < 3 else 5.0), t)
        for run in range(12)
        for t in range(14)
        for robot in (1, 2)
    ]
    place = tmp_path / "trajectories.csv"
    pd.DataFrame(rows, columns=["run", "time", "robot", "x", "y"]).to_csv(place, index=False)
    return place


def test_each_recording_is_a_trial(capsys: pytest.CaptureFixture[str], file: Path, tmp_path: Path) -> None:
    status, text, err = call(capsys, file, "--risk", "0.3", "--out", str(tmp_path / "out"))
    assert (status, err) == (0, "")
    assert "in 12 runs" in text
    assert "The record holds 12 runs of 14." in text
    curve = pd.read_parquet(tmp_path / "out" / "delta_exceedance.parquet")
    assert curve["probability"].tolist() == [0.25, 0.0]
    frames = pd.read_parquet(tmp_path / "out" / "delta_over_time.parquet")
    assert frames["run"].tolist() == np.repeat(np.arange(12), 14).tolist()


def test_a_window_longer_than_all_recordings_is_refused(capsys: pytest.CaptureFixture[str], file: Path) -> None:
    status, out, err = call(capsys, file, "--window", "20")
    assert (status, out) == (2, "")
    assert err.count("\n") == 1
    assert "window=20: longer than the longest of 12 pieces, 14; give a window of at most 14" in err


def test_recordings_without_a_number_are_reported_the_cure(capsys: pytest.CaptureFixture[str], file: Path) -> None:
    pd.read_csv(file).drop(columns="run").to_csv(file, index=False)
    status, out, err = call(capsys, file)
    assert (status, out) == (2, "")
    assert "goes back from time 13" in err
    assert "column run" in err


def test_a_range_in_another_unit_is_an_error_or_the_first_line(capsys: pytest.CaptureFixture[str], file: Path) -> None:
    record = pd.read_csv(file)
    record.assign(x=1000 * record["x"], y=1000 * record["y"]).to_csv(file, index=False)
    status, out, err = call(capsys, file)
    assert (status, out, err.count("\n")) == (2, "", 1)
    assert "robots move 1,000 ranges between samples (median 1,000), at most 10" in err
    assert "give the range in the unit of the positions, which span 9,500 × 13,000, or record at least every 0.0005" in err
    record.assign(x=3 * record["x"] + 20 * record["robot"], y=3 * record["y"]).to_csv(file, index=False)
    status, out, err = call(capsys, file)
    assert (status, err) == (0, "")
    cautions, delta = out.index("Check the unit: no two robots were ever within"), out.index("δ = 0")
    assert out.index("Check the unit: robots move 3 awareness ranges") < cautions < delta
    assert "NoAwareness" not in out
