"""``teamsight calibrate`` and ``teamsight evolve`` pass their options on, and report what is wrong in one line."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

import pytest

from teamsight.analysis.papers import calibration, evolution
from teamsight.analysis.papers.reproduction import Paper
from teamsight.analysis.papers.training import Evolution
from teamsight.analysis.runs.run import Outcome
from teamsight.cli import main


def call(capsys: pytest.CaptureFixture[str], *arguments: str) -> tuple[int, str, str]:
    with pytest.raises(SystemExit) as left:
        main(arguments)
    out, err = capsys.readouterr()
    return int(left.value.code or 0), out, err


def test_calibrate_passes_its_options_on(
    capsys: pytest.CaptureFixture[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    asked: list[Any] = []

    def reproduce(paper: Any, plan: object, folder: Path, pool: object, watch: Any, *, force: bool) -> None:
        watch("searching", 1, 2)
        asked.extend((paper, folder, force))

    monkeypatch.setattr(Paper, "reproduce", reproduce)
    status, out, err = call(capsys, "calibrate", "--out", str(tmp_path), "--workers", "1", "--force")
    assert (status, out.strip(), err) == (0, f"{tmp_path / 'calibration.parquet'}, {tmp_path / 'calibration.md'}", "")
    assert asked == [calibration.SEARCH, tmp_path, True]


def test_calibrate_says_what_it_keeps_when_it_is_interrupted(
    capsys: pytest.CaptureFixture[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def reproduce(paper: Any, plan: object, folder: Path, *given: object, force: bool) -> None:
        paper.checkpoint(folder).add({("a run",): Outcome(0.5, 3)})
        raise KeyboardInterrupt

    monkeypatch.setattr(Paper, "reproduce", reproduce)
    status, out, err = call(capsys, "calibrate", "--out", str(tmp_path), "--workers", "1")
    kept = f"1 runs are kept in {tmp_path}; the same command continues from there"
    assert (status, out, err.strip()) == (130, "", f"teamsight: interrupted; {kept}")


def test_evolve_train_continues_where_it_was_interrupted(
    capsys: pytest.CaptureFixture[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def train(plan: Evolution, generations: int, folder: Path, *given: object, force: bool) -> None:
        assert (plan, generations, folder, force) == (Evolution(population=6, seed=3), 7, tmp_path, False)
        raise KeyboardInterrupt

    monkeypatch.setattr(evolution, "train", train)
    options = ["--population", "6", "--seed", "3", "--generations", "7", "--out", str(tmp_path), "--workers", "1"]
    kept = f"finished generations are kept in {tmp_path}; the same command continues from there"
    status, out, err = call(capsys, "evolve", "train", *options)
    assert (status, out, err.strip()) == (130, "", f"teamsight: interrupted; {kept}")


def test_evolve_test_passes_its_files_on(
    capsys: pytest.CaptureFixture[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    asked: dict[str, Any] = {}
    monkeypatch.setattr(
        Paper, "reproduce", lambda self, plan, folder, pool, watch, force: asked.update(plan=plan, folder=folder, force=force)
    )
    files = ["--constants", "c.json", "--training", "t", "--further", "f"]
    options = [*files, "--runs", "2", "--out", str(tmp_path), "--workers", "1"]
    assert call(capsys, "evolve", "test", *options)[0] == 0
    assert asked == {
        "plan": evolution.Comparison(Path("c.json"), Path("t"), Path("f"), 2), "folder": tmp_path, "force": False,
    }  # fmt: skip


def test_an_optional_package_that_is_missing_is_named_with_its_cure(
    capsys: pytest.CaptureFixture[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "cma", None)
    status, out, err = call(capsys, "evolve", "train", "--out", str(tmp_path / "new"))
    assert (status, out, err.count("\n")) == (2, "", 1)
    assert "cma" in err
    assert "pip install 'teamsight[evolve]'" in err
    assert "bug" not in err
    assert not (tmp_path / "new").exists()


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["calibrate", "model"], "Got unexpected extra argument (model)"),
        (["evolve", "train", "--generations", "0"], "generations=0: must be at least 1"),
        (["evolve", "train", "--population", "1"], "population=1: must be at least 2"),
        (["evolve", "test", "--runs", "100000"], "runs=100000: must be at most 1000"),
    ],
)
def test_what_is_wrong_is_reported(capsys: pytest.CaptureFixture[str], arguments: list[str], message: str) -> None:
    status, out, err = call(capsys, *arguments)
    assert (status, out, err.count("\n")) == (2, "", 1)
    assert err.startswith(f"teamsight: {message}")
