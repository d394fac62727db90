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
from teamsight.analysis.learning.curves import Curves, curve_jobs, make_curves
from teamsight.analysis.learning.evaluation import DESIGNED, RANDOM
from teamsight.analysis.runs.checkpoint import Checkpoint
from teamsight.analysis.runs.workers import WorkerPool

SMALL = Curves(
    degrees=("none", "ring", "pairwise", "shared"), samples=(40, 300), memories=2, worlds=2, robots=5, targets=4, radius=2.0,
    steps=8, seed=6,
)  # fmt: skip


@pytest.fixture(scope="module")
def table() -> pd.DataFrame:
    return make_curves(SMALL)


@pytest.mark.short
def test_every_learner_meets_the_same_worlds_with_as_many_samples(table: pd.DataFrame) -> None:
    learned = table[table["transitions"] > 0]
    assert len(learned) == 4 * 3 * 2 * 2 * 2
    assert set(learned["transitions"]) == {40, 300}
    for _, rows in table.groupby("memory"):
        assert rows.groupby("replicate")["seed"].nunique().eq(1).all()
    assert table["seed"].nunique() == 4
    assert set(table[table["transitions"] == 0]["learner"]) == {RANDOM, DESIGNED}
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
    one = points[(points["learner"] == "linear") & (points["degree"] == "ring") & (points["transitions"] == 40)].iloc[0]
    rows = table[(table["learner"] == "linear") & (table["degree"] == "ring") & (table["transitions"] == 40)]
    trials = rows.groupby("memory")["observed_fraction"].mean()
    assert one["count"] == 2
    assert one["mean"] == pytest.approx(trials.mean())
    assert one["high"] - one["mean"] == pytest.approx(12.7062 * trials.std() / np.sqrt(2), rel=1e-4)


def test_gains_are_paired_on_memories(table: pd.DataFrame) -> None:
    gains = awareness_gains(table)
    assert len(gains) == 2 * (3 * 3 - 1)
    one = gains[(gains["learner"] == "lazy") & (gains["degree"] == "shared") & (gains["transitions"] == 300)].iloc[0]
    rows = table[(table["learner"] == "lazy") & (table["transitions"] == 300)]
    trials = rows.groupby(["degree", "memory"])["observed_fraction"].mean()
    differences = trials["shared"] - trials["none"]
    assert one["count"] == 2
    assert one["mean"] == pytest.approx(differences.mean())
    assert one["high"] - one["mean"] == pytest.approx(12.7062 * differences.std() / np.sqrt(2), rel=1e-4)


def test_the_drawing_is_a_picture(table: pd.DataFrame) -> None:
    assert draw(curve_points(table), table, SMALL).startswith(b"\x89PNG")
    lone = replace(SMALL, learners=("tabular",), degrees=("shared",))
    rows = table[((table["learner"] == "tabular") & (table["degree"] == "shared")) | (table["transitions"] == 0)]
    assert draw(curve_points(rows), rows, lone).startswith(b"\x89PNG")


def test_the_table_does_not_depend_on_workers(table: pd.DataFrame) -> None:
    with WorkerPool(2) as pool:
        assert make_curves(SMALL, pool).equals(table)


def test_finished_jobs_are_kept_after_an_interruption(
    table: pd.DataFrame, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def stop(done: float, total: float) -> None:
        if done > total / 2:
            raise KeyboardInterrupt

    kept = Checkpoint(tmp_path / "kept")
    with pytest.raises(KeyboardInterrupt):
        make_curves(SMALL, checkpoint=kept, progress=stop)
    finished = kept.count(job.key for job in curve_jobs(SMALL))
    assert 0 < finished < 10
    made: list[str] = []
    learnt_rows = module._learnt_rows
    monkeypatch.setattr(module, "_learnt_rows", lambda job: (made.append(job.degree), learnt_rows(job))[1])
    assert make_curves(SMALL, checkpoint=kept).equals(table)
    assert len(made) + finished >= 9
    assert len(made) < 8
    # The entries of other curves are neither used nor deleted.
    other = replace(SMALL, discount=0.1)
    found = make_curves(other, checkpoint=kept)
    assert not found["observed_fraction"].equals(table["observed_fraction"])
    kept.forget(job.key for job in curve_jobs(other))
    assert kept.count(job.key for job in curve_jobs(SMALL)) == kept.count() == 10
    kept.forget(job.key for job in curve_jobs(SMALL))
    assert not kept.path.exists()


def test_memories_share_no_world_and_no_transition() -> None:
    one, other = (SMALL.exploration("ring", memory) for memory in (0, 1))
    assert one.run_seed(0) != other.run_seed(0)
    assert one.transitions >= max(SMALL.samples)
    assert explore_one(one.model(0), 5) != explore_one(other.model(0), 5)


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        ({"degrees": ("non",)}, "degree='non': unknown; did you mean 'none'"),
        ({"learners": ("deep",)}, "learner='deep': unknown"),
        ({"reward": "mine"}, "reward='mine': unknown"),
        ({"memories": 0}, "memories=0: must be at least 1"),
        ({"samples": (0,)}, "samples=0: must be at least 1"),
    ],
)
def test_bad_settings_are_refused(settings: dict[str, object], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        replace(SMALL, **settings)  # type: ignore[arg-type]
