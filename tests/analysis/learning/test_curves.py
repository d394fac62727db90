"""Learning curves: equal samples for all, the same worlds for all, and nothing made twice."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from teamsight.agents.recording.explore import explore as explore_one
from teamsight.analysis.learning import curves as module
from teamsight.analysis.learning.curve_figure import draw
from teamsight.analysis.learning.curve_points import awareness_gains, curve_points
from teamsight.analysis.learning.curves import Curves, make_curves
from teamsight.analysis.learning.evaluation import DESIGNED, RANDOM
from teamsight.analysis.runs.workers import WorkerPool

SMALL = Curves(samples=(40, 300), memories=2, worlds=2, robots=5, targets=4, radius=2.0, steps=8, seed=6)


@pytest.fixture(scope="module")
def table() -> pd.DataFrame:
    with WorkerPool(1) as pool:
        return make_curves(SMALL, pool)


@pytest.mark.short
def test_every_learner_meets_the_same_worlds_with_as_many_samples(table: pd.DataFrame) -> None:
    learned = table[table["pairs"] > 0]
    assert len(learned) == 4 * 3 * 2 * 2 * 2
    assert set(learned["pairs"]) == {40, 300}
    for _, rows in table.groupby("memory"):
        assert rows.groupby("replicate")["seed"].nunique().eq(1).all()
    assert table["seed"].nunique() == 4
    assert set(table[table["pairs"] == 0]["learner"]) == {RANDOM, DESIGNED}
    widths = learned.groupby("degree")["inputs"].unique().map(list).to_dict()
    assert widths == {"none": [16], "ring": [32], "pairwise": [24], "shared": [80]}
    assert np.allclose(learned["log10_size"], learned["inputs"] * np.log10(2))


def test_only_the_table_of_shared_awareness_is_too_large(table: pd.DataFrame) -> None:
    refused = table[table["observed_fraction"].isna()]
    assert set(zip(refused["learner"], refused["degree"], strict=True)) == {("tabular", "shared")}
    assert len(refused) == 2 * 2 * 2


def test_points_are_means_over_memories_not_worlds(table: pd.DataFrame) -> None:
    points = curve_points(table)
    assert len(points) == 4 * 3 * 2 - 2 + 2
    one = points[(points["learner"] == "linear") & (points["degree"] == "ring") & (points["pairs"] == 40)].iloc[0]
    rows = table[(table["learner"] == "linear") & (table["degree"] == "ring") & (table["pairs"] == 40)]
    trials = rows.groupby("memory")["observed_fraction"].mean()
    assert one["count"] == 2
    assert one["mean"] == pytest.approx(trials.mean())
    assert one["high"] - one["mean"] == pytest.approx(12.7062 * trials.std() / np.sqrt(2), rel=1e-4)


def test_gains_are_paired_on_memories(table: pd.DataFrame) -> None:
    gains = awareness_gains(table)
    assert len(gains) == 2 * (3 * 3 - 1)
    one = gains[(gains["learner"] == "lazy") & (gains["degree"] == "shared") & (gains["pairs"] == 300)].iloc[0]
    rows = table[(table["learner"] == "lazy") & (table["pairs"] == 300)]
    trials = rows.groupby(["degree", "memory"])["observed_fraction"].mean()
    differences = trials["shared"] - trials["none"]
    assert one["count"] == 2
    assert one["mean"] == pytest.approx(differences.mean())
    assert one["high"] - one["mean"] == pytest.approx(12.7062 * differences.std() / np.sqrt(2), rel=1e-4)


def test_the_drawing_is_a_picture(table: pd.DataFrame) -> None:
    assert draw(curve_points(table), table, SMALL).startswith(b"\x89PNG")
    lone = replace(SMALL, learners=("tabular",), degrees=("shared",))
    rows = table[((table["learner"] == "tabular") & (table["degree"] == "shared")) | (table["pairs"] == 0)]
    assert draw(curve_points(rows), rows, lone).startswith(b"\x89PNG")


def test_what_was_made_before_an_interruption_is_kept(
    table: pd.DataFrame, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def stop(done: float, total: float) -> None:
        if done > total / 2:
            raise KeyboardInterrupt

    with WorkerPool(1) as pool, pytest.raises(KeyboardInterrupt):
        make_curves(SMALL, pool, folder=tmp_path, progress=stop)
    kept = len(list(tmp_path.iterdir()))
    assert 0 < kept < 10
    made: list[str] = []
    learned = module._learned
    monkeypatch.setattr(module, "_learned", lambda lecture: (made.append(lecture.degree), learned(lecture))[1])
    with WorkerPool(1) as pool:
        assert make_curves(SMALL, pool, folder=tmp_path).equals(table)
    assert len(made) + kept >= 9
    assert len(made) < 8
    assert module.kept_lectures(SMALL, tmp_path) == (10, 10)
    # Other curves do not take them for theirs, and do not touch them.
    with WorkerPool(1) as pool:
        other = make_curves(replace(SMALL, discount=0.1), pool, folder=tmp_path)
    assert not other["observed_fraction"].equals(table["observed_fraction"])
    (tmp_path / "notes.txt").write_text("my own")
    module.forget_lectures(replace(SMALL, discount=0.1), tmp_path)
    assert module.kept_lectures(SMALL, tmp_path) == (10, 10)
    module.forget_lectures(SMALL, tmp_path)
    assert [path.name for path in tmp_path.iterdir()] == ["notes.txt"]


def test_memories_share_no_world_and_no_pair() -> None:
    one, other = (SMALL.exploration("ring", memory) for memory in (0, 1))
    assert one.run_seed(0) != other.run_seed(0)
    assert one.pairs >= max(SMALL.samples)
    assert explore_one(one.model(0), 5) != explore_one(other.model(0), 5)


@pytest.mark.parametrize(
    ("settings", "told"),
    [
        ({"degrees": ("non",)}, "degree='non': unknown; did you mean 'none'"),
        ({"learners": ("deep",)}, "learner='deep': unknown"),
        ({"reward": "mine"}, "reward='mine': unknown"),
        ({"memories": 0}, "memories=0: must be at least 1"),
        ({"samples": (0,)}, "samples=0: must be at least 1"),
    ],
)
def test_bad_settings_are_refused(settings: dict[str, object], told: str) -> None:
    with pytest.raises(ValueError, match=told):
        replace(SMALL, **settings)  # type: ignore[arg-type]
