"""The learned teams of Fig. 11: each replicate of a cell is an exploration of its own, in the world of the setting."""

from __future__ import annotations

import numpy as np
import pytest

from teamsight import CMOMMT
from teamsight.agents.presets import PRESETS
from teamsight.analysis.learning.explore import Exploration, explore
from teamsight.analysis.papers.touzet2000.experiments import LEARNED, READINGS, described, experiments_of, exploration
from teamsight.analysis.runs.experiment import Experiment, Run, make_tables
from teamsight.analysis.runs.grid import Grid
from teamsight.analysis.runs.seeds import ROOTS, canonical
from teamsight.policies.memory import LazyMemory

SPEEDS = {"robot_speed": 0.2, "target_speed": 0.1}
SMALL = Grid((2, 3), (2.0, 3.0))


def learned() -> dict[str, Experiment]:
    return {one.name: one for one in experiments_of(LEARNED)}


@pytest.mark.short
def test_explorations_are_the_papers_and_have_seeds_of_a_root_of_their_own() -> None:
    memories = [exploration(number) for number in range(3)]
    assert len({memory.settings["seed"] for memory in memories}) == 3
    for memory in memories:
        assert memory == explore(Exploration(seed=memory.settings["seed"]))
        assert len(memory) == 600
    assert memories[1] is exploration(1)
    assert ROOTS["figure 11: explore"] == (-41,)


def test_another_world_is_explored_at_its_own_speeds() -> None:
    setting = SPEEDS | {"policy_options": {"idle": "stay"}}
    memory = learned()["slopes-cooperative"].variant(setting).treatment["policy"].memory
    assert memory == explore(Exploration(seed=memory.settings["seed"], world=SPEEDS))
    assert memory != exploration(0)


@pytest.mark.parametrize("setting", [{}, SPEEDS, PRESETS["touzet2000"]], ids=str)
def test_all_learners_of_a_replicate_use_one_memory_with_their_own_inputs(setting: dict[str, object]) -> None:
    experiments = learned()
    assert set(experiments) == LEARNED
    for replicate in (0, 7):
        found = {name: one.variant(setting, replicate).treatment for name, one in experiments.items()}
        assert len({id(one["policy"].memory) for one in found.values()}) == 1
        for reading in READINGS:
            cooperative, collective = found[f"{reading.name}-cooperative"], found[f"{reading.name}-collective"]
            assert (cooperative["policy"].inputs, cooperative["awareness"]) == (32, "ring")
            assert (collective["policy"].inputs, collective["awareness"]) == (16, "none")
    for experiment in experiments.values():
        first, later = (experiment.parameters(setting, replicate) for replicate in (0, 7))
        assert canonical(first["policy"]) != canonical(later["policy"])
        CMOMMT(**first, rng=1).run(2)


def test_each_replicate_of_every_cell_is_one_exploration_on_worlds_common_to_all_teams() -> None:
    experiments = learned()
    (tables,) = make_tables([({}, list(experiments.values()))], grid=SMALL, root=5, runs=1, steps=3)
    columns = ["robots", "radius", "replicate", "seed", "exploration", "transitions"]
    for table in tables.values():
        assert len(table) == 4 * 5
        assert (table.groupby("replicate")["exploration"].nunique() == 1).all()
        assert table["exploration"].nunique() == 5
        assert table[columns].equals(tables["literal-cooperative"][columns])


def test_the_cost_of_a_run_includes_comparisons_with_the_memory() -> None:
    policy = learned()["literal-cooperative"].variant({}).treatment["policy"]
    scenario = {"robots": 10, "targets": 15, "radius": 3.0}
    literal, designed = (Run(scenario | {"policy": one}, seed=1, steps=600).cost for one in (policy, "a-cmommt"))
    assert literal > 5 * designed


def test_actions_that_are_not_random_have_a_small_p_value() -> None:
    memory = exploration(0)
    about = described(memory)
    assert min(about["rotation_p"], about["distance_p"]) > 0.01
    action = np.array(memory.action)
    action[:, 0] = np.abs(action[:, 0])  # left turns only
    action[:, 1] = 1.0
    facts = {name: memory.fact(name) for name in memory.facts}
    other = LazyMemory.of(
        memory.situation, action, memory.next_situation, facts, own=memory.own, settings=dict(memory.settings)
    )
    wrong = described(other)
    assert wrong["rotation_p"] < 1e-20
    assert wrong["distance_p"] < 1e-20
    assert {name: wrong[name] for name in about if not name.endswith("_p")} == {
        name: value for name, value in about.items() if not name.endswith("_p")
    }
