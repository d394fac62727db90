"""The constants that the paper leaves open of lazy learning, and the values that are searched."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any

from teamsight.agents.cmommt import DEFAULTS
from teamsight.analysis.learning.explore import Exploration, explore
from teamsight.analysis.paper.lazy_teams import treatments_on, world_of
from teamsight.policies.handmade.random_walk import RandomWalk
from teamsight.policies.memory import LazyMemory
from teamsight.policies.rewards import GainReward

#: The values of each constant.
VALUES: dict[str, tuple[Any, ...]] = {
    "radius": (2.0, 3.0, 4.0, 5.0),
    "distance": ("random", "full"),
    "speed_ratio": (1.0, 2.0, 4.0, 8.0),
    "steps": (60, 120, 240),
    "k": (1, 3, 10, 30),
    "discount": (0.0, 0.5, 0.7, 0.9),
    "sweeps": (1, 3, 10, 30),
    "scope": ("own", "team", "alone"),
    "both": ("gain", "loss", "none", "net"),
}


@dataclass(frozen=True)
class Constants:
    """Constants of exploration, reward and learner.

    The defaults are those that the search compares others with, and those of `LazyQ` and `Exploration`.

    Parameters
    ----------
    radius : float
        Radius of the explored arena [sensing ranges].
    distance : {"random", "full"}
        Whether exploring robots move a random fraction of their speed, or at full speed.
    speed_ratio : float
        Speed of exploring robots, relative to those that use what was learned.
    steps : int
        Steps of the exploration by five robots; 120 give 600 transitions, as in the paper.
    k, discount, sweeps
        See `LazyLearner`.
    scope, both
        See `GainReward`.
    """

    radius: float = 3.0
    distance: str = "random"
    speed_ratio: float = 1.0
    steps: int = 120
    k: int = 10
    discount: float = 0.7
    sweeps: int = 10
    scope: str = "own"
    both: str = "gain"

    def memory(self, seed: int, setting: Mapping[str, Any] = MappingProxyType({})) -> LazyMemory:
        """Return the transitions of the exploration with a seed, in the world of a setting."""
        walk = RandomWalk(random_distance=self.distance == "random")
        world = world_of(setting)
        world["robot_speed"] = self.speed_ratio * world.get("robot_speed", DEFAULTS["robot_speed"])
        return explore(
            Exploration(radius=float(self.radius), steps=int(self.steps), policy=walk, seed=seed, world=world)
        )

    def treatments(self, memory: LazyMemory) -> dict[str, dict[str, Any]]:
        """Return the treatments of the two surfaces of Fig. 11, learned from a memory."""
        reward = GainReward(self.scope, self.both)
        return treatments_on(
            memory, reward=reward, k=int(self.k), discount=float(self.discount), sweeps=int(self.sweeps)
        )
