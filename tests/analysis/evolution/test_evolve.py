"""The two commands of evolution, from their parameters to their files, on worlds small enough for a test."""

from __future__ import annotations

import json
from pathlib import Path

import pandas as pd
import pytest

from teamsight.analysis.evolution import cma, compare, evolve
from teamsight.analysis.evolution.cma import Evolution
from teamsight.analysis.runs.experiment import Grid
from teamsight.policies.evolved import Evolved


@pytest.fixture(autouse=True)
def few_worlds(monkeypatch: pytest.MonkeyPatch) -> None:
    for module in (cma, compare):
        monkeypatch.setattr(module, "GRID", Grid((2, 5), (2.0, 3.0)))
        monkeypatch.setattr(module, "STEPS", 5)
    monkeypatch.setattr(evolve, "_SCREEN_RUNS", 1)
    monkeypatch.setattr(evolve, "_VALIDATE_RUNS", 2)


def test_what_training_finds_can_be_evaluated(tmp_path: Path) -> None:
    phases: list[str] = []
    evolve.train(Evolution(population=4), 2, tmp_path, watch=lambda phase, done, total: phases.append(phase))
    constants, training = tmp_path / "constants.json", tmp_path / "training.json"
    assert Evolved.load(constants) != Evolved()
    points = json.loads(training.read_text(encoding="utf-8"))["points"]
    assert [point["generation"] for point in points] == [0, 2]
    assert points[1]["robot_steps"] == 2 * 4 * cma.robot_steps()
    evolve.evaluate(tmp_path, watch=lambda phase, done, total: phases.append(phase), constants=constants,
                    training=tmp_path, runs=2)  # fmt: skip
    assert list(dict.fromkeys(phases)) == ["evolving", "screening", "validating", "comparing", "ablating"]
    table = pd.read_parquet(tmp_path / "evolved.parquet")
    assert table.attrs["made"]["command"] == "teamsight evolve train --generations 2 --population 4 --seed 1"
    assert table["part"].value_counts().to_dict() == {
        "screen": 24, "cell": 4, "overall": 1, "ablation": 5, "training": 2,
    }  # fmt: skip
    assert "# The evolved policy" in (tmp_path / "evolved.md").read_text(encoding="utf-8")
    assert (tmp_path / "images" / "evolved.png").stat().st_size > 10_000


def test_the_shipped_constants_are_evaluated_without_their_training(tmp_path: Path) -> None:
    evolve.evaluate(tmp_path, runs=2)
    table = pd.read_parquet(tmp_path / "evolved.parquet")
    assert table.attrs["made"]["trials"] == 16_000
    assert "training" not in set(table["part"])
    assert "| generation |" not in (tmp_path / "evolved.md").read_text(encoding="utf-8")


@pytest.mark.parametrize("name", ["constants.json", "training.json"])
def test_training_refuses_to_replace_other_files_before_it_begins(name: str, tmp_path: Path) -> None:
    (tmp_path / name).write_text("mine")
    with pytest.raises(ValueError, match=rf"{name}.*--force"):
        evolve.train(Evolution(population=4), 1, tmp_path)
    assert [path.name for path in tmp_path.iterdir()] == [name]


def test_evaluation_refuses_to_replace_other_files_before_it_begins(tmp_path: Path) -> None:
    (tmp_path / "evolved.md").write_text("mine")
    with pytest.raises(ValueError, match=r"evolved.md.*--force"):
        evolve.evaluate(tmp_path)
    assert [path.name for path in tmp_path.iterdir()] == ["evolved.md"]
