"""An exploration's memory holds what the robots met, and records how it was made."""

from __future__ import annotations

import json
from typing import Any

import numpy as np
import pytest

from teamsight import CMOMMT, Disc, Robot, Target, World
from teamsight.agents.recording.explore import explore, memory_of, record_run
from teamsight.policies import RandomWalk
from teamsight.policies.memory import LazyMemory

pytestmark = pytest.mark.filterwarnings("ignore:run.. makes its steps one by one")


def wander(percept: Any, rng: np.random.Generator) -> tuple[float, float]:
    return rng.uniform(-1, 1), percept.speed


def same(one: LazyMemory, other: LazyMemory) -> bool:
    return one.table.tobytes() == other.table.tobytes() and one.settings == other.settings


@pytest.mark.short
def test_a_memory_is_the_transitions_in_the_order_of_its_content() -> None:
    world, other = (CMOMMT(robots=5, targets=10, radius=3.0, awareness="ring", rng=1) for _ in range(2))
    memory = explore(world, 120)
    met = record_run(other, other.robots, 120)
    assert (len(memory), memory.own, memory.added) == (600, 16, 16)
    columns = [met.situation, met.action, met.next_situation]
    rows = np.concatenate([*columns, *(met.facts[name][:, None] for name in sorted(met.facts))], axis=1)
    assert np.array_equal(rows[np.lexsort(rows.T[::-1])], memory.table.T)


@pytest.mark.parametrize("degree", ["none", "ring", "nearest", "pairwise", "shared"])
def test_every_degree_can_be_explored(degree: str) -> None:
    world = CMOMMT(robots=3, radius=2.0, awareness=degree, rng=1)
    memory = explore(world, 10)
    assert (len(memory), memory.added) == (30, {"none": 0, "ring": 16, "nearest": 32, "pairwise": 4, "shared": 32}[degree])
    assert (memory.settings["degree"], memory.settings["awareness"]) == (degree, repr(world.robots.awareness))


def test_any_world_can_be_explored_and_is_described() -> None:
    world = World(Disc(2.0), rng=7)
    scouts = world.add(Robot, 4, policy=wander, awareness="ring", speed=np.array([0.1, 0.2, 0.3, 0.1]))
    world.add(Robot, 2, policy=RandomWalk(), name="others")
    prey = world.add(Target, 6, policy="evasive", speed=0.05)
    world.senses(scouts, prey)
    memory = explore(world, 25)
    settings = dict(memory.settings)
    assert len(memory) == 100
    assert settings["policy"] == "wander"
    assert (settings["robots"], settings["targets"], settings["steps"], settings["runs"], settings["seed"]) == (6, 6, 25, 1, 7)
    assert (settings["arena"], settings["radius"], settings["robot_speed"], settings["target_speed"]) == (
        "Disc(radius=2.0)", 2.0, [0.1, 0.3], 0.05,
    )  # fmt: skip
    json.dumps(settings)
    assert len(explore(world, 5, prey)) == 30


def test_an_exploration_that_goes_on_holds_the_new_pairs_alone() -> None:
    world, whole = (CMOMMT(radius=3.0, awareness="ring", rng=1) for _ in range(2))
    parts = [record_run(world, world.robots, steps) for steps in (10, 20)]
    assert [len(part.situation) for part in parts] == [100, 200]
    settings = {"awareness": "ring"}
    once = memory_of([record_run(whole, whole.robots, 30)], whole.robots, settings)
    assert same(memory_of(parts, world.robots, settings), once)
    assert same(memory_of(parts[::-1], world.robots, settings), once)


def test_what_cannot_be_explored_is_refused() -> None:
    world = CMOMMT(rng=1)
    with pytest.raises(ValueError, match="steps=0: must be at least 1"):
        explore(world, 0)
    with pytest.raises(ValueError, match="must be a group that was added to this world"):
        explore(world, 5, CMOMMT(rng=1).robots)
    empty = World(Disc(2.0), rng=1)
    with pytest.raises(ValueError, match="no robot is on a team"):
        explore(empty, 5)
    small, large = (CMOMMT(robots=n, awareness="pairwise", rng=1) for n in (2, 3))
    parts = [record_run(model, model.robots, 2) for model in (small, large)]
    with pytest.raises(ValueError, match=r"18 and 20 inputs.*RingAwareness"):
        memory_of(parts, small.robots, {})


@pytest.mark.parametrize(
    ("world", "message"),
    [
        (CMOMMT, "world=CMOMMT: is a class; give a world, such as CMOMMT"),
        ("ring", "world='ring': is not a world; give one, such as"),
        (None, "world=None: is not a world"),
    ],
)
def test_what_is_no_world_is_refused(world: Any, message: str) -> None:
    with pytest.raises(TypeError, match=message):
        explore(world, 10)
