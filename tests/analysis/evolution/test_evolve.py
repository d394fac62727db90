"""The two commands of evolution, from their parameters to their files, on worlds small enough for a test."""

from __future__ import annotations

import json
from pathlib import Path

import pandas as pd
import pytest

from teamsight.analysis.evolution import cma, compare, evolve, generalise
from teamsight.analysis.evolution.cma import Evolution
from teamsight.analysis.runs.experiment import Grid
from teamsight.policies.evolved import Evolved, made, to_json


@pytest.fixture(autouse=True)
def few_worlds(monkeypatch: pytest.MonkeyPatch) -> None:
    for module in (cma, compare):
        monkeypatch.setattr(module, "GRID", Grid((2, 5), (2.0, 3.0)))
    for module in (cma, compare, generalise):
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
    assert list(dict.fromkeys(phases)) == ["evolving", "screening", "validating", "comparing", "ablating", "generalising"]
    table = pd.read_parquet(tmp_path / "evolved.parquet")
    assert table.attrs["made"]["command"] == "teamsight evolve train --generations 2 --population 4 --seed 1"
    counts = table["part"].value_counts().to_dict()
    # 24 rules, and the further constants under the best 3: as many as 19 gains and turn probabilities if it wanders.
    assert 24 + 3 * 4 <= counts.pop("screen") <= 24 + 3 * 19
    assert counts == {"cell": 4, "overall": 1, "ablation": 5, "training": 2, "generalisation": 21}
    assert table.attrs["trained"] == json.loads(training.read_text(encoding="utf-8"))["options"]
    assert "# The evolved policy" in (tmp_path / "evolved.md").read_text(encoding="utf-8")
    assert (tmp_path / "images" / "evolved.png").stat().st_size > 10_000


def test_an_evolution_continues_from_constants_in_other_worlds(tmp_path: Path) -> None:
    start = Evolved().constants
    # One generation with so small a spread finds the same constants.
    evolve.train(Evolution(population=4, spread=1e-9, start=start), 1, tmp_path)
    constants = tmp_path / "constants.json"
    assert Evolved.load(constants).constants == pytest.approx(start, abs=1e-6)
    command = "teamsight evolve train --generations 1 --population 4 --seed 1 --start constants.json --spread 1e-09"
    assert made(constants)["command"] == command
    assert Evolution(start=start).root != Evolution().root
    evolve.evaluate(tmp_path, further=tmp_path, runs=2)
    table = pd.read_parquet(tmp_path / "evolved.parquet")
    assert table["part"].value_counts()["further"] == 2
    text = (tmp_path / "evolved.md").read_text(encoding="utf-8")
    assert "--further further" in text
    assert command in text.replace("\n", " ")


def test_the_shipped_constants_are_evaluated_without_their_training(tmp_path: Path) -> None:
    evolve.evaluate(tmp_path, runs=2)
    table = pd.read_parquet(tmp_path / "evolved.parquet")
    assert table.attrs["made"]["trials"] == 16_000
    assert "training" not in set(table["part"])
    assert "| generation |" not in (tmp_path / "evolved.md").read_text(encoding="utf-8")


def test_training_replaces_constants_of_another_evolution_only_with_force(tmp_path: Path) -> None:
    evolve.train(Evolution(population=4), 1, tmp_path)
    constants = tmp_path / "constants.json"
    before = constants.read_bytes()
    evolve.train(Evolution(population=4), 2, tmp_path)
    extended = constants.read_bytes()
    assert extended != before
    with pytest.raises(ValueError, match=r"constants.json.*other settings.*--force"):
        evolve.train(Evolution(population=4, seed=2), 1, tmp_path)
    assert constants.read_bytes() == extended
    evolve.train(Evolution(population=4, seed=2), 1, tmp_path, force=True)
    assert constants.read_bytes() != extended


def test_training_refuses_a_file_in_place_of_its_checkpoint(tmp_path: Path) -> None:
    (tmp_path / "evolution.checkpoint").write_text("mine")
    with pytest.raises(ValueError, match=r"evolution.checkpoint.*holds something else"):
        evolve.train(Evolution(population=4), 1, tmp_path)


@pytest.mark.parametrize("content", ["", "[]", "{}", '{"points": [1]}', '{"points": [{"generation": 1}]}', '{"points": [], "options": {"idle": "stay"}}'])
def test_evaluation_refuses_a_damaged_training_file_before_it_begins(content: str, tmp_path: Path) -> None:
    (tmp_path / "training.json").write_text(content)
    with pytest.raises(ValueError, match=r"training.json: holds no validated generations.*evolve train"):
        evolve.evaluate(tmp_path, training=tmp_path)


@pytest.mark.parametrize("made", [None, {}, {"command": "x", "trials": "many", "robot_steps": 1, "version": "1"}])
def test_evaluation_refuses_constants_of_unknown_origin_before_it_begins(made: object, tmp_path: Path) -> None:
    file = tmp_path / "constants.json"
    file.write_text(json.dumps({**to_json(Evolved().constants, {}), "made": made}))
    with pytest.raises(ValueError, match=r"constants.json: does not say.*evolve train"):
        evolve.evaluate(tmp_path, constants=file)


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
