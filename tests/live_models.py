"""Models for the tests of the live page."""

from __future__ import annotations

from typing import Any, Literal

from teamsight import CMOMMT, Disc, Robot, Target, World
from teamsight.agents.components.failures import Failures


class Failing(CMOMMT):
    """A model whose robots cannot decide from a tick on."""

    def __init__(self, breaks_at: int = 5, **parameters: Any) -> None:
        super().__init__(robots=4, targets=4, policy=self._decide, **parameters)
        self._breaks_at = breaks_at

    def _decide(self, percept: Any, rng: Any) -> tuple[float, float]:
        if self.tick >= self._breaks_at:
            raise RuntimeError("the battery is on fire")
        return 0.1, 0.05


def hives(
    hives: int = 3, size: float = 4.0, fast: bool = False, shape: Literal["disc", "other"] = "disc", seed: int = 0
) -> World:
    """Return a world of robots that fail."""
    if hives > 20:
        raise ValueError(f"hives={hives}: must be at most 20; give fewer")
    world = World(Disc(size), seed=seed)
    robots = world.add(Robot, hives, policy="random-walk", speed=0.2 if fast else 0.1)
    targets = world.add(Target, 5, policy="random-walk")
    world.senses(robots, targets)
    world.attach(Failures(20, 10), robots)
    return world


def meeting(sensing_range: float = 1.0, seed: int = 0) -> World:
    """Return a world that logs contacts of robots with each other and with targets, and in which one robot fails."""
    world = World(Disc(3.0), seed=seed)
    robots = world.add(Robot, 12, policy="random-walk", speed=0.2, sensing_range=sensing_range)
    world.senses(robots, world.add(Target, 9, policy="random-walk"))
    world.log_contacts(robots)
    world.log_contacts(robots, "targets")
    world.clock.at(3, lambda: world.log("painted", robots[0], colour="red"))
    return world


def stopping(seed: int = 0) -> CMOMMT:
    """Return a world that stops after as many steps as its seed says."""
    world = CMOMMT(4, 5, seed=seed)
    world.clock.at(seed, lambda: setattr(world, "running", False))
    return world
