"""A toy world with declared settings, its task, and a toy policy: each setting is one field."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Annotated, Any, Literal, Self

import numpy as np

from teamsight import Box, Objective, Robot, Target, Task, World
from teamsight.core.component import Allowed, Component, Count, built_from
from teamsight.policies import Policy
from teamsight.policies.interface import Action, Percept


@dataclass(frozen=True)
class Swamp(Component):
    """The settings of a swamp.

    Parameters
    ----------
    walkers : int
        Number of robots.
    drag : float
        By which share of their speed robots are slower.
    depth : {"shallow", "deep"}
        How deep the swamp is.
    rng : int, optional
        The seed.
    """

    walkers: Count = 4
    drag: Annotated[float, Allowed(least=0, most=1, cure="a robot with a drag of 1 stays")] = 0.5
    depth: Literal["shallow", "deep"] = "shallow"
    rng: int | None = None

    @classmethod
    def of(cls, values: Mapping[str, Any]) -> Self:
        return cls(**values)


class SwampWorld(World):
    """Robots in a swamp, and a target."""

    @built_from(Swamp)
    def __init__(self, settings: Swamp) -> None:
        super().__init__(Box(4.0, 4.0), rng=settings.rng)
        self.drag = settings.drag
        robots = self.add(
            Robot, settings.walkers, policy="random-walk", speed=0.1 * (1.0 - settings.drag), team="walkers", name="robots"
        )
        self.senses(robots, self.add(Target, 1, policy="stationary", name="targets"))


SWAMP = Task(
    name="swamp",
    title="Robots in a swamp",
    world=SwampWorld,
    scenario={"walkers": 3, "drag": 0.25},
    objective=Objective("drag", "less"),
    metrics={"drag": lambda world: float(world.drag)},  # type: ignore[attr-defined]
    explore={},
    skilled={},
    team="walkers",
    size="walkers",
    steps=10,
)


@dataclass(frozen=True)
class Drift(Policy):
    """Turn a little and go ahead.

    Parameters
    ----------
    pull : float
        By which share of its speed a robot is slower.
    side : {"left", "right"}
        To which side it turns.
    """

    pull: Annotated[float, Allowed(least=0, most=1, cure="with 1 it stays")] = 0.5
    side: Literal["left", "right"] = "left"

    def decide(self, percept: Percept, state: Any, noise: Any) -> tuple[Action, Any]:
        turn = 0.1 if self.side == "left" else -0.1
        turned = np.array([[np.cos(turn), np.sin(turn)], [-np.sin(turn), np.cos(turn)]])
        return Action(percept.heading @ turned, percept.speed * (1.0 - self.pull)), state
