"""A task as a model: its parameters by name, what it passes on to the world, and when a team learns."""

from __future__ import annotations

import inspect
from dataclasses import replace
from typing import Any

import pytest
from toy_tasks import GATHER

from teamsight import TASKS
from teamsight.tasks.model import TaskModel


def test_a_setting_has_scenario_team_and_further_parameters() -> None:
    model = TaskModel(GATHER)
    found = model.parameters({"walkers": 4, "treatment": "explore", "awareness": "ring"})
    assert found == {"walkers": 4, "side": 6.0, "policy": "random-walk", "awareness": "ring"}
    world = model(walkers=4, treatment="explore", rng=2)
    assert (len(world.groups[0]), world.seed_used) == (4, 2)


def test_the_team_with_skill_is_the_default_if_there_is_one() -> None:
    assert TaskModel(GATHER).parameters({})["policy"] == "centroid"
    assert TaskModel(replace(GATHER, skilled=None)).parameters({})["policy"] == "random-walk"


def test_its_signature_names_what_a_setting_may_have() -> None:
    found = inspect.signature(TaskModel(GATHER)).parameters
    assert list(found) == ["treatment", "walkers", "side", "policy", "awareness", "rng"]
    assert (found["walkers"].default, found["walkers"].annotation) == (6, int)
    assert {"robots", "treatment", "policy", "events"} <= set(inspect.signature(TaskModel(TASKS["cmommt"])).parameters)


def test_unknown_names_are_refused() -> None:
    with pytest.raises(ValueError, match="walker: is no parameter of the task gather; did you mean 'walkers'"):
        TaskModel(GATHER)(walker=3)


def test_a_team_learns_once_for_each_scenario_and_degree() -> None:
    learned: list[Any] = []

    def train(scenario: Any, awareness: Any, rng: int) -> dict[str, Any]:
        learned.append((scenario["walkers"], awareness, rng))
        return {"policy": "stationary"}

    model = TaskModel(replace(GATHER, skilled=train), rng=7)
    for setting in ({}, {}, {"walkers": 3}, {"awareness": "none"}, {"policy": "centroid"}, {"treatment": "explore"}):
        model.parameters(setting)
    assert [(walkers, rng) for walkers, _, rng in learned] == [(6, 7), (3, 7), (6, 7)]
    assert learned[0][1] is None
    assert learned[2][1].name == "none"
    assert model.parameters({"policy": "centroid"})["policy"] == "centroid"
