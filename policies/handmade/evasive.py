"""The evasive policy: targets that avoid robots (last remark of §5)."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

from teamsight.core.component import Probability
from teamsight.core.kernel import inlined
from teamsight.policies.compiled import CompiledPolicy
from teamsight.policies.handmade.random_walk import walk_step


@inlined
def _evade(percept: Any, arrays: Any, noise: Any, action: Any) -> None:
    seen = percept.targets
    for i in range(percept.heading.shape[0]):
        x = 0.0
        y = 0.0
        for k in range(seen.start[i], seen.start[i + 1]):
            # The unit vector away from the robot, divided by its distance.
            square = max(seen.distance[k] * seen.distance[k], 1e-12)
            x -= seen.offset[k, 0] / square
            y -= seen.offset[k, 1] / square
        length = math.sqrt(x * x + y * y)
        if length > 1e-9:
            action.heading[i, 0] = x / length
            action.heading[i, 1] = y / length
            action.distance[i] = percept.speed[i]
        else:
            walk_step(i, percept, arrays.parameters, noise, action)


@dataclass(frozen=True)
class Evasive(CompiledPolicy):
    """Move away from the robots in sensing range, each weighted by 1 / distance; otherwise walk at random.

    Parameters
    ----------
    turn_probability : float, default 0.05
        Probability of a turn per step while no robot is sensed.

    Raises
    ------
    ValueError, TypeError
        If the probability is not in [0, 1].

    Notes
    -----
    *Source:* §5, "targets avoiding robots". *Departs:* the paper does not say how they avoid them.
    """

    turn_probability: Probability = 0.05

    kernel = _evade
    draws = 2
    needs = ("targets",)

    @property
    def parameters(self) -> tuple[float, ...]:
        return self.turn_probability, 1.0, 0.0
