"""Toy tasks for tests: one whose team gathers, and one whose team learns, by a function."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

from teamsight import Box, Objective, Robot, Target, Task, World


class Beacon(World):
    """Robots in a box; those with skill go to a beacon, which all of them sense everywhere."""

    def __init__(
        self,
        walkers: int = 6,
        side: float = 6.0,
        *,
        policy: Any = "centroid",
        awareness: Any = "none",
        rng: int | None = None,
    ) -> None:
        super().__init__(Box(side, side), rng=rng)
        walking = self.add(
            Robot, walkers, policy=policy, awareness=awareness, sensing_range=2 * side, team="walkers", name="walkers"
        )
        beacon = self.add(Target, 1, policy="stationary", speed=0.0, name="beacon")
        self.senses(walking, beacon)


def closeness(world: World) -> float:
    """Return the mean number of neighbours over robots and steps."""
    return float(world.recording.mean_neighbours)


def gathered_after(world: World) -> float:
    """Return the first step after which a robot has all others as neighbours; infinite if there is none."""
    history = world.recording.history
    all_there = history["max_neighbours"] == len(world.teammates.awareness_range) - 1
    return float(all_there.to_numpy().argmax() + 1) if all_there.any() else math.inf


GATHER = Task(
    name="gather",
    title="Robots go to a beacon",
    world=Beacon,
    scenario={"walkers": 6, "side": 6.0},
    objective=Objective("closeness", "more"),
    metrics={"closeness": closeness, "gathered_after": gathered_after},
    explore={"policy": "random-walk"},
    skilled={"policy": "centroid"},
    team="walkers",
    size="walkers",
    steps=100,
    gathers=True,
)

#: Of which less is better, and which random walkers seldom complete.
SOON = replace(GATHER, name="soon", objective=Objective("gathered_after", "less"))


def train(scenario: Mapping[str, Any], awareness: Any, rng: int) -> dict[str, Any]:
    """Return the team that knows the way: what was learned is the same for each seed."""
    return {"policy": "centroid"}


LEARN = replace(GATHER, name="learn", skilled=train)
