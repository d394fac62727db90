"""The search over what the paper leaves open of lazy learning: every constant, and the luck of one short exploration.

Worlds have root seeds below 0, which no command accepts, so that the ledger never judges constants on noise that helped
to choose them. What chooses and what reports share neither worlds nor memories.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from typing import Any, NamedTuple

import numpy as np
import pandas as pd

from teamsight.agents.cmommt import DEFAULTS
from teamsight.analysis.claims import judge
from teamsight.analysis.claims.interface import average, gain, part, peak, percent
from teamsight.analysis.claims.learning import CLAIMS, OPEN
from teamsight.analysis.crew import Crew
from teamsight.analysis.execute import Request, make_tables
from teamsight.analysis.explore import Exploration, explore
from teamsight.analysis.study import Experiment, Grid
from teamsight.policies.lazy_memory import LazyMemory
from teamsight.policies.lazy_q import LazyQ
from teamsight.policies.random_walk import RandomWalk
from teamsight.policies.rewards import GainReward


@dataclass(frozen=True)
class Constants:
    """What the paper leaves open; the defaults are what the search chose.

    Parameters
    ----------
    radius : float
        Of the arena that is explored.
    distance : {"random", "full"}
        Whether exploring robots go a random share of their speed, or all of it.
    pace : float
        The speed of exploring robots, in speeds of those that act.
    steps : int
        How long five robots explore.
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

    def exploration(self, seed: int) -> Exploration:
        """Return the exploration of this seed."""
        walk = RandomWalk(random_distance=self.distance == "random")
        speed = self.pace * DEFAULTS["robot_speed"]
        return Exploration(
            radius=self.radius, steps=self.steps, policy=walk, seed=seed, world={"robot_speed": speed}
        )

    def learners(self, memory: LazyMemory) -> dict[str, LazyQ]:
        """Return the cooperative and the collective learner on one memory."""
        reward = GainReward(self.scope, self.both)
        return {
            name: LazyQ(memory, reward, inputs=inputs, k=self.k, gamma=self.gamma, sweeps=self.sweeps)
            for name, inputs in (("lazy-cooperative", memory.inputs), ("lazy-collective", memory.own))
        }
