"""Worlds whose groups have sensors, and what a user can see of them."""

from __future__ import annotations

import math
import pickle
from collections.abc import Callable
from typing import Any

import numpy as np

from teamsight import Box, Circle, Disc, Robot, Sensor, Target, Torus, World
from teamsight.core.neighbour_list import NeighbourList
from teamsight.policies import ACmommt, Centroid

WIDE = math.radians(120)
SENSORS = {
    "view": Sensor(field_of_view=WIDE), "range": Sensor(range_noise=0.1), "bearing": Sensor(bearing_noise=0.2),
    "missed": Sensor(missed=0.3), "false": Sensor(false_positives=0.4), "delay": Sensor(delay=3),
    "all": Sensor(WIDE, 0.1, 0.2, 0.2, 0.3, 2),
}  # fmt: skip
# One arena in which sight is blocked, and one large enough for the search in cells.
ARENAS = {
    "disc": Disc(2.0), "torus": Torus(4.0, 5.0),
    "obstacles": Box(4.0, 4.0).with_obstacles(Circle((0.5, 0.5), 0.4), Circle((-1.0, 0.0), 0.3)),
}  # fmt: skip


def herd(sensors: dict[str, Sensor], arena: Any = ARENAS["disc"], seed: int = 1, **options: Any) -> World:
    """Return a world of two groups of robots, two of targets, and predators, with these sensors by channel."""
    world = World(arena, rng=seed)
    degree = options.get("awareness", "shared")
    fast = world.add(Robot, 6, policy=options.get("policy", ACmommt()), awareness=degree, speed=0.1, name="fast")
    slow = world.add(Robot, 3, policy=Centroid(), awareness=degree, awareness_range=[0.5, 1.0, 1.8], name="slow")
    deer = world.add(Target, 5, policy="evasive", speed=0.08, sensing_range=0.7, name="deer")
    flies = world.add(Target, options.get("flies", 9), policy="random-walk", name="flies")
    for robots in (fast, slow):
        world.senses(robots, deer, sensor=sensors.get("targets"))
        world.senses(robots, flies)
        world.senses(robots, deer, as_="large", sensor=sensors.get("large"))
        if "teammates" in sensors:
            robots.sensors["teammates"] = sensors["teammates"]
    world.senses(deer, fast)
    return world


def percept_of(group: Any) -> Any:
    """Return the percept at the present positions."""
    assert group[0].percept is not None
    return group.percept


def shown(percept: NeighbourList) -> list[dict[int, tuple[float, float]]]:
    return [
        {int(percept.identity[k]): tuple(percept.offset[k].tolist()) for k in range(begin, end)}
        for begin, end in zip(percept.start[:-1], percept.start[1:], strict=True)
    ]


def fingerprint(world: World) -> list[bytes]:
    """Return all that a user can see of what has happened."""
    seen: list[Any] = [world.tick, world.observed, world.observed_fraction, world.mean_degree, world.max_neighbours]
    for group in world.groups:
        seen += [group.position, group.heading, group.identity, *(group.policy_state or ())]
        for channel in group.channels:
            seen += list(group.neighbours(channel))
            seen += [[each.unique_id for each in agent.sensed(channel)] for agent in group]
        percept = percept_of(group)
        seen += [*percept.targets, *percept.teammates, *percept.relayed, percept.situation]
        seen += [agent.situation for agent in group if isinstance(agent, Robot)]
    return [*(np.asarray(part, float).tobytes() for part in seen), world.recording.history.to_csv().encode()]


PATHS: list[Callable[[World], None]] = [
    lambda world: [world.step() for _ in range(30)] and None,
    lambda world: [world.run(k) for k in (1, 2, 3, 5, 7, 11, 1)] and None,
    lambda world: [world.run(9), world.step(), world.reset(), world.run(14), world.step(), world.run(15)] and None,
    lambda world: [world.run(14), world.step(), _restored(world), world.run(15)] and None,
]


def _restored(world: World) -> None:
    saved = pickle.loads(pickle.dumps(world.state()))
    world.run(7)
    world.restore(saved)


def assert_one_answer(make: Callable[[], World]) -> None:
    reference = make()
    reference.run(30)
    wanted = fingerprint(reference)
    for number, path in enumerate(PATHS):
        world = make()
        path(world)
        found = fingerprint(world)
        assert [k for k, pair in enumerate(zip(wanted, found, strict=True)) if pair[0] != pair[1]] == [], number
