"""Explorations of many worlds depend on their settings alone; what was made of one is kept."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from teamsight.agents.exploration import explore as explore_one
from teamsight.analysis.explore import Exploration, explore
from teamsight.policies.lazy_memory import LazyMemory

SMALL = Exploration(robots=3, targets=4, radius=2.0, steps=10, runs=7, seed=3)


def bits(memory: LazyMemory) -> bytes:
    return memory.table.tobytes()


@pytest.mark.short
def test_the_papers_exploration_gives_exactly_600_pairs() -> None:
    memory = explore()
    assert (len(memory), memory.own, memory.added) == (600, 16, 16)
    told = memory.settings
    assert (told["robots"], told["targets"], told["steps"], told["runs"]) == (5, 10, 120, 1)
    assert (told["radius"], told["awareness"], told["seed"]) == (3.0, "RingAwareness(delta=16)", 0)
    # Any direction and any distance are equally likely: their means lie within 5 standard errors.
    assert abs(memory.action[:, 0].mean()) < 5 * np.pi / np.sqrt(3 * 600)
    assert abs(memory.action[:, 1].mean() - 0.5) < 5 / np.sqrt(12 * 600)


def test_one_run_is_one_world() -> None:
    alone = replace(SMALL, runs=1)
    assert bits(explore(alone)) == bits(explore_one(alone.model(0), alone.steps))


def test_the_treatment_does_not_change_the_stage() -> None:
    one, other = SMALL, replace(SMALL, awareness="none", world={"robot_speed": 0.05})
    assert one.run_seed(2) == other.run_seed(2)
    assert np.array_equal(one.model(2).targets.position, other.model(2).targets.position)


@pytest.mark.parametrize(
    ("settings", "told"),
    [
        ({"runs": 0}, "runs=0: must be at least 1"),
        ({"steps": 1.5}, "steps=1.5: must be a whole"),
        ({"seed": -1}, "seed=-1"),
    ],
)
def test_bad_numbers_are_refused(settings: dict[str, float], told: str) -> None:
    with pytest.raises((TypeError, ValueError), match=told):
        Exploration(**settings)  # type: ignore[arg-type]
