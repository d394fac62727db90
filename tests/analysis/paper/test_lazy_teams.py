"""The learned teams of Fig. 11: one memory for both, the shipped one or one of the setting's own world."""

from __future__ import annotations

import pytest

from teamsight import CMOMMT
from teamsight.agents.presets import PRESETS
from teamsight.analysis.learning.explore import Exploration, explore
from teamsight.analysis.paper.experiments import LEARNED, chosen
from teamsight.analysis.paper.lazy_teams import COLLECTIVE, COOPERATIVE, memory_for, treatments
from teamsight.analysis.runs.experiment import QUICK, Run
from teamsight.analysis.runs.seeds import canonical
from teamsight.policies.lazy.lazy_q import shipped

SPEEDS = {"robot_speed": 0.2, "target_speed": 0.1}


@pytest.mark.short
def test_the_default_world_has_the_shipped_exploration() -> None:
    assert memory_for({}) is shipped()
    assert memory_for({"robot_speed": 0.1, "policy_options": {"idle": "stay", "weights": "shared"}}) is shipped()
    assert shipped() == explore(Exploration())


def test_another_world_has_an_exploration_of_its_own() -> None:
    for world in ({"robot_speed": 0.3}, SPEEDS):
        memory = memory_for(world | {"policy_options": {"idle": "stay"}})
        assert memory != shipped()
        assert memory is memory_for(world)
        assert memory == explore(Exploration(world=world))
        assert dict(memory.settings) == dict(shipped().settings) | world
        assert len(memory) == 600


@pytest.mark.parametrize("setting", [{}, SPEEDS, PRESETS["touzet2000"]], ids=str)
def test_both_learners_use_one_memory_with_their_own_inputs(setting: dict[str, object]) -> None:
    found = treatments(setting)
    assert {name: (of["policy"].inputs, of["awareness"]) for name, of in found.items()} == {
        COOPERATIVE: (32, "ring"),
        COLLECTIVE: (16, "none"),
    }
    assert found[COOPERATIVE]["policy"].memory is found[COLLECTIVE]["policy"].memory
    experiments = chosen(LEARNED, QUICK, setting)
    assert {experiment.name for experiment in experiments} == LEARNED
    for experiment in experiments:
        parameters = experiment.parameters(setting)
        assert canonical(parameters["policy"]) == canonical(found[experiment.name]["policy"])
        CMOMMT(**parameters, rng=1).run(2)


def test_the_policies_by_name_are_the_same() -> None:
    for name, treatment in treatments({}).items():
        one, other = (
            CMOMMT(policy=policy, awareness=treatment["awareness"], rng=3) for policy in (name, treatment["policy"])
        )
        one.run(20)
        other.run(20)
        assert one.robots.position.tobytes() == other.robots.position.tobytes()


def test_the_cost_of_a_run_includes_comparisons_with_the_memory() -> None:
    scenario = {"robots": 10, "targets": 15, "radius": 3.0}
    learned, designed = (
        Run(scenario | {"policy": policy}, seed=1, steps=600).cost
        for policy in (treatments({})[COOPERATIVE]["policy"], "a-cmommt")
    )
    assert learned > 5 * designed
