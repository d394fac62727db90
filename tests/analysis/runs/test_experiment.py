"""Experiments describe runs; equal runs have equal keys whatever the types of their settings."""

from __future__ import annotations

from teamsight.agents.cmommt import DEFAULTS
from teamsight.analysis.runs.experiment import Experiment, Variant
from teamsight.analysis.runs.grid import FULL, QUICK
from teamsight.analysis.runs.run import Run, outcome
from teamsight.policies import ACmommt


def test_the_treatment_leaves_seeds_alone_and_a_new_setting_changes_no_other() -> None:
    cells = ((5, 2.0), (10, 3.0))
    one = Experiment("one", {"policy": "a-cmommt"}, cells)
    other = Experiment("other", {"policy": "centroid", "awareness": "ring", "delta": 4}, (*cells, (3, 1.0)))
    seeds = [[columns["seed"] for columns, _ in experiment.rows({}, 3, 2, 10)] for experiment in (one, other)]
    assert seeds[0] == seeds[1][: len(seeds[0])]
    more = [columns["seed"] for columns, _ in one.rows({"robot_speed": 0.3}, 3, 3, 99)]
    assert [more[0:2], more[3:5]] == [seeds[0][0:2], seeds[0][2:4]]


def test_a_policy_is_given_only_the_settings_that_it_listens_to() -> None:
    setting = {"robot_speed": 0.2, "policy_options": {"idle": "stay", "weights": "none"}}
    given_to = {
        name: Experiment("x", {"policy": name}, ((1, 1.0),)).parameters(setting)
        for name in ("a-cmommt", "centroid", "random-walk")
    }
    assert given_to["a-cmommt"]["policy_options"] == {"idle": "stay", "weights": "none"}
    assert given_to["centroid"]["policy_options"] == {"idle": "stay"}
    assert given_to["random-walk"] == {"policy": "random-walk", "robot_speed": 0.2}
    wandering = {"policy_options": {"idle": "wander", "turn_probability": 0.01, "gain": 2.0}}
    walk = Experiment("x", {"policy": "random-walk"}, ((1, 1.0),)).parameters(wandering)
    # The turn probability of an idle robot is not that of a random walk.
    assert walk == {"policy": "random-walk"}
    assert Experiment("x", {"policy": "a-cmommt"}, ((1, 1.0),)).parameters(wandering) == {
        "policy": "a-cmommt", **wandering,
    }  # fmt: skip
    of_an_object = Experiment("x", {"policy": ACmommt()}, ((1, 1.0),)).parameters(setting)
    assert of_an_object == {"policy": ACmommt(), "robot_speed": 0.2}


def test_a_setting_of_defaults_makes_no_runs_of_its_own() -> None:
    experiment = Experiment("x", {"policy": "random-walk"}, ((4, 2.0),))
    setting = {"robot_speed": DEFAULTS["robot_speed"], "target_speed": 0.05, "uniform_target_speed": False}
    keys = [run.key for given in (setting, {"target_speed": 0.05}, {}) for _, run in experiment.rows(given, 0, 1, 5)]
    assert keys[0] == keys[1] != keys[2]


def test_each_replicate_may_have_a_treatment_of_its_own() -> None:
    def treat(setting: object, replicate: int) -> Variant:
        return Variant({"policy": "random-walk", "robot_speed": 0.1 * (replicate + 2)}, {"speed_number": replicate})

    experiment = Experiment("x", treat, ((4, 2.0), (5, 2.0)), replicates=2)
    rows = list(experiment.rows({"robot_speed": 0.7}, 0, 2, 5))
    assert [columns["speed_number"] for columns, _ in rows] == [0, 1, 2, 3] * 2
    assert [columns["replicate"] for columns, _ in rows] == [0, 1, 2, 3] * 2
    assert [run.parameters["robot_speed"] for _, run in rows[:4]] == [0.2, 0.1 * 3, 0.4, 0.5]
    designed = Experiment("y", {"policy": "a-cmommt"}, experiment.cells, replicates=2)
    assert [run.seed for _, run in rows] == [run.seed for _, run in designed.rows({}, 0, 2, 5)]


def test_a_sweep_runs_every_combination_on_the_same_scenario() -> None:
    experiment = Experiment(
        "x", {"policy": "a-cmommt"}, ((4, 2.0),), sweep={"delta": (1, 2), "awareness_range": (0.5, 1.0)}
    )
    rows = list(experiment.rows({}, 0, 1, 5))
    assert [(columns["delta"], columns["awareness_range"]) for columns, _ in rows] == [
        (1, 0.5),
        (1, 1.0),
        (2, 0.5),
        (2, 1.0),
    ]
    assert len({columns["seed"] for columns, _ in rows}) == 1
    assert len({run.key for _, run in rows}) == 4


def test_runs_are_the_same_when_their_settings_are_equal() -> None:
    assert Run({"robots": 2, "radius": 2}, 1, 10).key == Run({"radius": 2.0, "robots": 2}, 1, 10).key
    keys = {
        Run({"robots": 2}, seed, steps, measure).key
        for seed in (1, 2)
        for steps in (10, 11)
        for measure in (outcome, repr)
    }
    assert len(keys) == 8
    one, other = ({"policy_options": options} for options in ({"a": 1, "b": 2}, {"b": 2.0, "a": 1.0}))
    assert Run(one, 1, 10).key == Run(other, 1, 10).key


def test_a_run_with_a_long_policy_is_described_in_one_line() -> None:
    policy = "policy " * 100
    text = Run({"robots": 3, "radius": 2.0, "policy": policy, "awareness": "ring\n" * 50}, 77, 600).describe()
    assert "\n" not in text
    assert len(text) < 200
    assert text.startswith("the run robots=3, radius=2.0, policy=policy")
    assert text.endswith("steps=600, rng=77")


def test_the_papers_grid_and_the_quick_one() -> None:
    assert len(FULL.cells) == 270
    assert set(QUICK.cells) < set(FULL.cells)
