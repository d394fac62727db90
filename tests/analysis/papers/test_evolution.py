"""Evolution resumes with the same bits, and what it finds is compared with A-CMOMMT, on worlds small enough for a test."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest

from teamsight import CMOMMT, Box
from teamsight.agents.awareness import NoAwareness
from teamsight.analysis.papers import evolution
from teamsight.analysis.papers.evolution import VARIATIONS, WORST, Variation, checkpoint_in, options_of, train
from teamsight.analysis.papers.training import Evolution
from teamsight.analysis.runs import checkpoint
from teamsight.analysis.runs.grid import Grid
from teamsight.analysis.runs.processes import WorkerPool
from teamsight.policies import ACmommt, Stationary
from teamsight.policies.evolved import Evolved, made

DOCS = Path(__file__).resolve().parents[3] / "docs"
SMALL = Evolution(population=4)
OPTIONS = {"idle": "wander", "gain": 2.0}


@pytest.fixture
def few_worlds(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(evolution, "GRID", Grid((2, 5), (2.0, 3.0)))
    monkeypatch.setattr(evolution, "STEPS", 5)
    monkeypatch.setattr(evolution, "_SCREEN_RUNS", 1)
    monkeypatch.setattr(evolution, "_VALIDATE_RUNS", 2)


@pytest.fixture
def few_options(few_worlds: None, monkeypatch: pytest.MonkeyPatch) -> None:
    """Few worlds, and few options of A-CMOMMT and variations, for tests that are not about these."""
    monkeypatch.setattr(evolution, "RULES", {"idle": ("stay",), "idle_when": ("no-force",), "weights": ("none",)})
    monkeypatch.setattr(evolution, "TUNED", {"turn_probability": (0.05,), "gain": (1.0, 2.0)})
    monkeypatch.setattr(evolution, "VARIATIONS", VARIATIONS[:2])


@pytest.fixture
def tried(monkeypatch: pytest.MonkeyPatch) -> list[int]:
    """Numbers of the generations that are tried."""
    monkeypatch.setattr(evolution, "GRID", Grid((5,), (2.0, 3.0)))
    monkeypatch.setattr(evolution, "STEPS", 30)
    numbers: list[int] = []

    def fitness(candidates: list[Evolved], generation: int, pool: WorkerPool | None, *, root: int) -> list[float]:
        numbers.append(generation)
        return original(candidates, generation, pool, root=root)

    original = evolution.fitness
    monkeypatch.setattr(evolution, "fitness", fitness)
    return numbers


def evaluate(folder: Path, watch: Any = lambda phase, done, total: None, **given: Any) -> None:
    evolution.COMPARISON.reproduce(evolution.Comparison(**given), folder, watch=watch)


def run(generations: int, folder: Path, what: Evolution = SMALL) -> list[np.ndarray]:
    return list(evolution.evolve(what, generations, checkpoint_in(folder)))


def test_an_interrupted_evolution_resumes_with_the_same_bits(tmp_path: Path, tried: list[int]) -> None:
    whole, parts = tmp_path / "ints", tmp_path / "parts"
    whole.mkdir(), parts.mkdir()
    expected = run(4, whole)
    run(1, parts)
    with checkpoint_in(parts).path.open("a") as file:
        file.write('\n["half a li')
    run(3, parts)
    found = run(4, parts)
    assert np.array_equal(expected, found)
    assert tried == 2 * [0, 1, 2, 3]
    assert np.array_equal(run(2, whole), expected[:2])


def test_another_evolution_is_not_mixed_in(tmp_path: Path, tried: list[int], monkeypatch: pytest.MonkeyPatch) -> None:
    run(1, tmp_path)
    run(1, tmp_path, Evolution(population=4, seed=2))
    run(1, tmp_path, Evolution(population=5))
    monkeypatch.setattr(evolution, "STEPS", 31)
    run(1, tmp_path)
    monkeypatch.setattr(checkpoint, "code_digest", lambda *modules: "0123456789abcdef")
    run(1, tmp_path)
    assert tried == 5 * [0]


@pytest.mark.usefixtures("few_worlds")
def test_a_generation_has_the_same_worlds_for_all_and_the_next_has_others() -> None:
    constants = evolution.begin(SMALL)
    one, other = Evolved(tuple(constants)), Evolved(tuple(0.9 * constants))
    (alone,) = evolution.fitness([one], 0)
    assert evolution.fitness([other, one], 0)[1] == alone
    assert evolution.fitness([one], 1) != [alone]


@pytest.mark.usefixtures("few_worlds", "few_options")
@pytest.mark.parametrize("policy", ["adaptive-forces", "group-forces"])
def test_the_constants_of_another_policy_are_sought_too(policy: Any, tmp_path: Path) -> None:
    plan = Evolution(population=4, spread=0.5, policy=policy)
    train(plan, 1, tmp_path)
    kind = evolution.kind_of(plan)
    assert kind.load(tmp_path / "constants.json") != kind(tuple(evolution.begin(plan)))
    command = f"teamsight evolve train --policy {policy} --generations 1 --population 4 --seed 1 --spread 0.5"
    assert made(tmp_path / "constants.json")["command"] == command


def test_the_interval_rests_on_the_replicates() -> None:
    table = pd.DataFrame(
        {
            "policy": "evolved", "robots": [5, 9] * 3, "radius": 2.0, "replicate": [0, 0, 1, 1, 2, 2], "base": 0.5,
            "difference": [0.0, 0.02, 0.01, 0.03, 0.02, 0.04],
        }
    )  # fmt: skip
    (gain,) = evolution.gains_by(table, "policy").to_dict("records")
    # Student's t with two degrees of freedom: 4.303 times the standard error of 1, 2, 3.
    half = 4.3027 / 3**0.5
    assert [gain[name] for name in ("mean", "low", "high")] == pytest.approx([2.0, 2.0 - half, 2.0 + half], rel=1e-4)


@pytest.mark.usefixtures("few_worlds")
def test_what_training_finds_can_be_evaluated(tmp_path: Path) -> None:
    phases: list[str] = []
    train(SMALL, 2, tmp_path, watch=lambda phase, done, total: phases.append(phase))
    constants, training = tmp_path / "constants.json", tmp_path / "training.json"
    assert Evolved.load(constants) != Evolved()
    points = json.loads(training.read_text(encoding="utf-8"))["points"]
    assert [point["generation"] for point in points] == [0, 2]
    assert points[1]["robot_steps"] == 2 * 4 * evolution.robot_steps()
    evaluate(tmp_path, watch=lambda phase, done, total: phases.append(phase), constants=constants, training=tmp_path,
             runs=2)  # fmt: skip
    assert list(dict.fromkeys(phases)) == ["evolving", "screening", "validating", "comparing", "ablating", "planning", "generalising", "comparing others",
                                           "ablating others"]
    table = pd.read_parquet(tmp_path / "evolved.parquet")
    assert table.attrs["made"]["command"] == "teamsight evolve train --generations 2 --population 4 --seed 1"
    counts = table["part"].value_counts().to_dict()
    # 24 rules, and the further constants under the best 3: as many as 19 gains and turn probabilities if it wanders.
    assert 24 + 3 * 4 <= counts.pop("screen") <= 24 + 3 * 19
    assert counts == {"cell": 4, "overall": 1, "ceiling": 5, "ablation": 5, "training": 2, "generalisation": 21, "adaptive": 4,
                      "removed": 4}
    assert table.attrs["trained"] == json.loads(training.read_text(encoding="utf-8"))["options"]
    assert table[table["part"] == "generalisation"]["name"].tolist() == [one.name for one in VARIATIONS]
    assert "# The evolved policy" in (tmp_path / "evolved.md").read_text(encoding="utf-8")
    assert (tmp_path / "images" / "evolved.png").stat().st_size > 10_000


@pytest.mark.usefixtures("few_options")
def test_an_evolution_continues_from_constants_in_other_worlds(tmp_path: Path) -> None:
    start = Evolved().constants
    # One generation with so small a spread finds the same constants.
    train(Evolution(population=4, spread=1e-6, start=start), 1, tmp_path)
    constants = tmp_path / "constants.json"
    assert Evolved.load(constants).constants == pytest.approx(start, abs=1e-4)
    command = "teamsight evolve train --generations 1 --population 4 --seed 1 --start constants.json --spread 1e-06"
    assert made(constants)["command"] == command
    evaluate(tmp_path, further=tmp_path, runs=2)
    table = pd.read_parquet(tmp_path / "evolved.parquet")
    assert table["part"].value_counts()["further"] == 2
    assert table.attrs["made"]["trials"] == 16_000
    text = (tmp_path / "evolved.md").read_text(encoding="utf-8")
    assert "--further further" in text
    assert "Gain on other worlds" not in text
    assert command in text.replace("\n", " ")


@pytest.mark.usefixtures("few_options")
def test_training_replaces_constants_of_another_evolution_only_with_force(tmp_path: Path) -> None:
    train(SMALL, 1, tmp_path)
    constants = tmp_path / "constants.json"
    before = constants.read_bytes()
    train(SMALL, 2, tmp_path)
    extended = constants.read_bytes()
    assert extended != before
    with pytest.raises(ValueError, match=r"constants.json.*other settings.*--force"):
        train(Evolution(population=4, seed=2), 1, tmp_path)
    assert constants.read_bytes() == extended
    train(Evolution(population=4, seed=2), 1, tmp_path, force=True)
    assert constants.read_bytes() != extended


@pytest.mark.parametrize("content", ["", "[]", "{}", '{"points": [1]}', '{"points": [{"generation": 1}]}', '{"points": [], "options": {"idle": "stay"}}'])
def test_evaluation_refuses_a_damaged_training_file_before_it_begins(content: str, tmp_path: Path) -> None:
    (tmp_path / "training.json").write_text(content)
    with pytest.raises(ValueError, match=r"training.json: holds no validated generations.*evolve train"):
        evaluate(tmp_path, training=tmp_path)


def test_evaluation_refuses_constants_of_unknown_origin_before_it_begins(tmp_path: Path) -> None:
    file = tmp_path / "constants.json"
    file.write_text(json.dumps({**Evolved().content({}), "made": {}}))
    with pytest.raises(ValueError, match=r"constants.json: does not say.*evolve train"):
        evaluate(tmp_path, constants=file)


@pytest.mark.parametrize(("name", "cure"), [("constants.json", "--force"), ("training.json", "--force"), ("evolution.checkpoint", "move it away"), ("evolved.md", "--force")])
def test_other_files_are_refused_before_the_work(name: str, cure: str, tmp_path: Path) -> None:
    (tmp_path / name).write_text("mine")
    with pytest.raises(ValueError, match=rf"{name}.*{cure}"):
        evaluate(tmp_path) if name == "evolved.md" else train(SMALL, 1, tmp_path)
    assert [path.name for path in tmp_path.iterdir()] == [name]


@pytest.fixture
def screened(monkeypatch: pytest.MonkeyPatch) -> list[dict[str, Any]]:
    """The options that are screened; wandering and a large gain are made to look best."""
    found: list[dict[str, Any]] = []

    def observed(options: Sequence[Mapping[str, Any]], *given: Any) -> pd.DataFrame:
        found.extend(map(dict, options))
        table = pd.DataFrame(options)
        value = table["gain"] + 10 * (table["idle"] == "wander") + 5 * (table["weights"] == "shared")
        return table.assign(observed=value).sort_values("observed", ascending=False, kind="stable")

    monkeypatch.setattr(evolution, "_screen_all", observed)
    return found


def test_rules_are_screened_first_and_constants_under_the_best_three(screened: list[dict[str, Any]]) -> None:
    table = evolution.screen(1)
    rules, constants = screened[:24], screened[24:]
    usual = {"turn_probability": 0.05, "gain": 1.0}
    assert all(one | usual == one for one in rules)
    assert len({tuple(one.items()) for one in rules}) == 24
    # 5 gains and 4 turn probabilities without the default ones, which were screened with the rules.
    assert len(constants) == len({tuple(one.items()) for one in constants}) == 3 * 19
    assert {one["idle"] for one in constants} == {"wander"}
    assert len(table) == len(screened)
    best = options_of(table)[0]
    assert (best["idle"], best["weights"], best["gain"]) == ("wander", "shared", 8.0)
    ACmommt(**best)


@pytest.mark.usefixtures("few_worlds")
def test_robots_that_do_not_wander_have_no_turn_probability(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(evolution, "RULES", {"idle": ("stay",), "idle_when": ("no-force",), "weights": ("none",)})
    table = evolution.screen(1)
    assert sorted(table["gain"]) == [0.5, 1.0, 2.0, 4.0, 8.0]
    assert set(table["turn_probability"]) == {0.05}


@pytest.mark.parametrize("ratio", [1.0, 4.0])
def test_a_box_has_the_area_of_the_disc_and_the_agents_of_the_model(ratio: float) -> None:
    parts = {"robots": 3, "targets": 4, "radius": 2.0, "policy": Stationary(), "awareness": NoAwareness()}
    world, model = evolution.boxed(ratio=ratio, **parts, rng=1), CMOMMT(**parts, rng=1)
    assert isinstance(world.arena, Box)
    assert world.arena.width * world.arena.height == pytest.approx(math.pi * 2.0**2)
    assert world.arena.width / world.arena.height == pytest.approx(ratio)
    for ours, theirs in zip(world.groups, model.groups, strict=True):
        assert (len(ours), ours.policy, ours.awareness) == (len(theirs), theirs.policy, theirs.awareness)
        assert ours.bodies.speed.tolist() == theirs.bodies.speed.tolist()
        assert ours.sensing_range.tolist() == theirs.sensing_range.tolist()
        assert ours.awareness_range.tolist() == theirs.awareness_range.tolist()
    world.run(3)
    assert world.observed_fraction > 0


def test_the_gain_is_paired_by_the_world(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(evolution, "STEPS", 20)
    still = Variation("x", {"robot_speed": 0.0}, ((4, 2.0),))
    found = evolution.compare({"evolved": Evolved()}, OPTIONS, root=-1, runs=3, variations=(still,))
    (row,) = evolution.gains_by(found, "variation").to_dict("records")
    # Robots that cannot move observe the same under every policy.
    assert (row["mean"], row["low"], row["high"]) == (0.0, 0.0, 0.0)
    assert 0 < row["observed"] < 100


def test_the_policy_observes_more_and_nowhere_significantly_less() -> None:
    table = pd.read_parquet(DOCS / "evolved.parquet")
    overall, cells = table[table["part"] == "overall"], table[table["part"] == "cell"]
    assert len(cells) == len(evolution.GRID.cells)
    assert overall["low"].item() > 0
    assert not (cells["high"] < WORST).any()
