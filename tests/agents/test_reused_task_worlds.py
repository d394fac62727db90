"""Reused worlds of tasks: a run in a built world gives the same bits as one in a new world."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import cache, partial
from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from teamsight import Robot, World, run_many
from teamsight.agents.awareness import NoAwareness, RingAwareness
from teamsight.agents.reused_worlds import ReusedWorlds
from teamsight.policies import PreyQ
from teamsight.tasks import TASKS
from teamsight.tasks.foraging import Forage
from teamsight.tasks.pursuit import Pursuit
from teamsight.world.arena import Box

# Steps for which a team learns here, instead of some hundred thousand.
_LEARNING = 200


@cache
def team(name: str, treatment: str) -> dict[str, Any]:
    """Return the parameters of a team, whose learning is cut short."""
    task: Any = TASKS[name]
    if treatment == "skilled" and callable(task.skilled):
        task = replace(task, skilled=partial(task.skilled, steps=_LEARNING))
    found: dict[str, Any] = task.parameters(treatment)
    return found


def cases() -> Iterator[tuple[str, Callable[..., World], Callable[[], dict[str, Any]]]]:
    for name in TASKS:
        for treatment in ("explore", "skilled"):
            yield f"{name} {treatment}", TASKS[name].world, partial(team, name, treatment)
    yield "online learners", Pursuit, lambda: {"policy": PreyQ(4), "prey": 2}
    yield "a torus", Pursuit, lambda: {"policy": PreyQ(2, partner=2), "awareness": "pairwise", "depth": 2, "torus": True}
    yield "four around one", Pursuit, lambda: {"hunters": 4, "rule": "surround", "side": 4}
    yield "scouts", Pursuit, lambda: {"scouts": 2, "awareness": RingAwareness(4)}
    yield "nobody communicates", Forage, lambda: {"communication": "none", "awareness": NoAwareness(), "obstacles": 0.0}


CASES = {name: (model, parameters) for name, model, parameters in cases()}


def left_behind(world: World) -> str:
    """Return all that a run leaves in a world."""
    groups = [
        (
            group.bodies.position.tobytes(), group.bodies.heading.tobytes(), group.bodies.reward.tobytes(),
            {name: values.tobytes() for name, values in group.columns.arrays().items()},
            [np.asarray(part).tobytes() for part in group.policy_state or ()],
        )
        for group in world.groups
    ]  # fmt: skip
    states = [[part.tobytes() for part in one.state] for one in world._data.interactions]
    collected = {name: np.array(values).tobytes() for name, values in world.datacollector.model_vars.items()}
    return repr((
        groups, states, collected, world.tick, world.steps, world.seed_used, world.random.random(), world.rng.random(),
        world.recording.history.to_csv(), world.recording.max_neighbours(),
    ))  # fmt: skip


@pytest.mark.parametrize("name", CASES)
@settings(max_examples=6, deadline=None, suppress_health_check=list(HealthCheck))
@given(st.data())
def test_a_reused_world_gives_the_bits_of_a_new_one(name: str, data: st.DataObject) -> None:
    model, make = CASES[name]
    parameters = make()
    seeds = data.draw(st.lists(st.integers(0, 2**53), min_size=2, max_size=4))
    worlds, seen = ReusedWorlds(), set()
    worlds.expect([(parameters, seed) for seed in seeds[data.draw(st.integers(0, 1)) :]])
    for seed in seeds:
        steps = data.draw(st.integers(0, 120))
        world, new = worlds.begin(model, parameters, seed), model(**parameters, rng=seed)
        for each in (world, new):
            each.run(steps)
            each.step()
            each.run(3)
        assert left_behind(world) == left_behind(new)
        seen.add(id(world))
        new.close()
    worlds.close()
    assert len(seen) == 1


CHANGES: dict[str, Callable[[Any], None]] = {
    "masses are set": lambda world: world.attractors.columns["mass"].__setitem__(slice(None), 1.0),
    "an attractor leaves": lambda world: world.attractors[0].remove(),
    "robots are given another policy": lambda world: setattr(world.robots, "policy", "random-walk"),
    "a column is added": lambda world: world.robots.add_column("battery", 1.0),
}


@pytest.mark.parametrize("steps", [0, 30])
@pytest.mark.parametrize("change", CHANGES)
def test_what_a_run_changes_does_not_stay_for_the_next(change: str, steps: int) -> None:
    worlds, parameters = ReusedWorlds(), {"obstacles": 0.0, "side": 30.0}
    world = worlds.begin(Forage, parameters, 1)
    world.run(steps)
    CHANGES[change](world)
    world.run(20)
    following, new = worlds.begin(Forage, parameters, 2), Forage(**parameters, rng=2)
    for each in (following, new):
        each.run(60)
    assert left_behind(following) == left_behind(new)
    worlds.close()


def test_other_numbers_and_other_classes_are_built_anew() -> None:
    worlds = ReusedWorlds()
    first = worlds.begin(Pursuit, {"side": 5}, 1)
    assert worlds.begin(Pursuit, {"side": 5}, 2) is first
    second = worlds.begin(Pursuit, {"side": 6}, 2)
    assert second is not first
    assert str(second.arena) == str(Pursuit(side=6).arena)
    assert worlds.begin(Forage, {}, 2) is not second
    worlds.close()


class Own(World):
    """A world whose places do not come from the seed alone as `World.reset` draws them."""

    def __init__(self, rng: int | None = None) -> None:
        super().__init__(Box(4, 4), rng=rng)
        self.add(Robot, 3, policy="random-walk", position=np.random.default_rng(rng).uniform(-2, 2, (3, 2)))


def test_worlds_of_a_class_of_ones_own_are_built_anew() -> None:
    worlds = ReusedWorlds()
    for seed in (1, 2):
        world, new = worlds.begin(Own, {}, seed), Own(rng=seed)
        assert left_behind(world) == left_behind(new)
    worlds.close()


def test_run_many_gives_the_bits_of_single_runs() -> None:
    task = TASKS["consume"]
    settings = {"treatment": ["explore", "skilled"], "robots": [2, 3], "obstacles": [0.0, 0.1]}
    table = run_many(settings, task=task, steps=60, replicates=3, rng=4)
    for row in table.itertuples():
        world = task.build(row.treatment, rng=row.seed, robots=row.robots, obstacles=row.obstacles)
        world.run(60)
        assert task.measure(world) == {name: getattr(row, name) for name in task.metrics}
