"""``teamsight learn curve``: the learning curve of a task whose team learns while it acts."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from teamsight.analysis.learning.training import training_points
from teamsight.analysis.stats.paired import interval_of
from teamsight.cli import main

SMALL = ["--task", "pursuit", "--set", "side=5", "--trainings", "2", "--runs", "2", "--steps", "60", "--workers", "1"]


def call(capsys: pytest.CaptureFixture[str], *arguments: str) -> tuple[int, str, str]:
    with pytest.raises(SystemExit) as left:
        main(["learn", "curve", *arguments])
    return int(left.value.code or 0), *capsys.readouterr()


def test_a_curve_is_written_and_kept(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    line = [*SMALL, "--learned", "100,10", "--awareness", "none,pairwise", "--out", str(tmp_path), "--format", "svg"]
    status, out, _ = call(capsys, *line)
    answer, *table, _ = out.splitlines()
    assert (status, len(table)) == (0, 5)
    assert answer.startswith("PairwiseAwareness() is better than NoAwareness() by ")
    assert answer.endswith(" after 100 steps of learning")
    assert answer.split(" by ")[1].split(" after ")[0] in table[-1]
    tests = pd.read_parquet(tmp_path / "learning-curve.parquet")
    assert len(tests) == 2 * 2 * 2 * 2
    assert tests.attrs["learning curve"]["scenario"]["side"] == 5
    points = pd.read_parquet(tmp_path / "learning-curve-points.parquet")
    pd.testing.assert_frame_equal(points, training_points(tests), check_like=True)
    gains = pd.read_parquet(tmp_path / "learning-curve-gains.parquet")
    assert set(gains["awareness"]) == {"PairwiseAwareness()"}
    assert (tmp_path / "learning-curve.svg").read_bytes().startswith(b"<?xml")
    assert call(capsys, *line)[0] == 0
    status, _, err = call(capsys, *line, "--seed", "1")
    assert (status, "other settings" in err, "--force" in err) == (2, True, True)


def test_points_are_means_over_trainings() -> None:
    rng = np.random.default_rng(1)
    rows = [
        ("none", amount, training, value, min(value, 60.0))
        for amount in (10, 100) for training in range(3) for value in (*rng.uniform(1, 60, 3), np.inf)
    ]  # fmt: skip
    curve = pd.DataFrame(rows, columns=["awareness", "learned", "training", "value", "counted"])
    points = training_points(curve)
    for point in points.to_dict("records"):
        part = curve[curve["learned"] == point["learned"]]
        means = np.array([part[part["training"] == training]["counted"].mean() for training in range(3)])
        assert (point["mean"], point["low"], point["high"]) == pytest.approx(interval_of(means))
        assert point["censored"] == 0.25


@pytest.mark.parametrize(
    ("line", "message"),
    [
        (["--task", "graze"], "task='graze': its team does not learn; give one whose team does: pursuit"),
        (["--set", "sied=5"], "sied: is no parameter of the scenario of pursuit; did you mean 'side'?"),
        (["--learned", "100000000"], "learned=100000000: must be at most 10000000; let teams learn for less long"),
        (["--awareness", "pairwize"], "awareness='pairwize': unknown; did you mean 'pairwise'?"),
    ],
)
def test_wrong_options_are_named(capsys: pytest.CaptureFixture[str], line: list[str], message: str) -> None:
    status, _, err = call(capsys, *line)
    assert (status, message in err) == (2, True), err
