"""What the paper leaves open of lazy learning, constant by constant, and which values are searched."""

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

_DEFAULTS: Mapping[str, Any] = MappingProxyType({})

#: The values that are searched.
VALUES: dict[str, tuple[Any, ...]] = {
    "radius": (2.0, 3.0, 4.0, 5.0),
    "distance": ("random", "full"),
    "pace": (1.0, 2.0, 4.0, 8.0),
    "steps": (60, 120, 240),
    "k": (1, 3, 10, 30),
    "gamma": (0.0, 0.5, 0.7, 0.9),
    "sweeps": (1, 3, 10, 30),
    "scope": ("own", "team", "alone"),
    "both": ("gain", "loss", "none", "net"),
}


@dataclass(frozen=True)
class Constants:
    """What the paper leaves open of lazy learning; the defaults are what trials before the search had found to work.

    Parameters
    ----------
    radius : float
        Of the arena that is explored [sensing ranges].
    distance : {"random", "full"}
        Whether exploring robots go a random share of their speed, or all of it.
    pace : float
        The speed of exploring robots, in speeds of those that act on what was explored.
    steps : int
        How long five robots explore; with 120 there are 600 pairs, as in the paper.
    k, gamma, sweeps
        See `LazyLearner`.
    scope, both
        See `GainReward`.
    """

    radius: float = 3.0
    distance: str = "random"
    pace: float = 1.0
    steps: int = 120
    k: int = 10
    gamma: float = 0.7
    sweeps: int = 10
    scope: str = "own"
    both: str = "gain"

    def exploration(self, seed: int, setting: Mapping[str, Any] = _DEFAULTS) -> Exploration:
        """Return the exploration of this seed, in a world of this setting."""
        walk = RandomWalk(random_distance=self.distance == "random")
        world = world_of(setting)
        world["robot_speed"] = self.pace * world.get("robot_speed", DEFAULTS["robot_speed"])
        return Exploration(radius=float(self.radius), steps=int(self.steps), policy=walk, seed=seed, world=world)

    def memory(self, seed: int, setting: Mapping[str, Any] = _DEFAULTS) -> LazyMemory:
        """Return what that exploration leaves."""
        return explore(self.exploration(seed, setting))

    def treatments(self, memory: LazyMemory) -> dict[str, dict[str, Any]]:
        """Return the treatments of the two surfaces of Fig. 11 on a memory."""
        reward = GainReward(self.scope, self.both)
        return treatments_on(memory, reward=reward, k=int(self.k), discount=float(self.gamma), sweeps=int(self.sweeps))


#: What the search chose (docs/lazy-search.md): nothing is clearly nearer to the paper than what was given. The defaults
#: of `LazyQ` and of `Exploration` are these.
CHOSEN = Constants()
