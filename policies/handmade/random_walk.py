"""The random walk: the policy of targets, and of exploring robots."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Annotated, Any

from teamsight.core.angles import direction
from teamsight.core.component import Allowed, Flag, Probability
from teamsight.core.kernel import inlined
from teamsight.policies.actions import turned_by
from teamsight.policies.compiled import CompiledPolicy

_TURN_PROBABILITY, _TURN_RANGE, _RANDOM_DISTANCE = range(3)


@inlined
def walk_step(i: int, percept: Any, parameters: Any, noise: Any, action: Any) -> None:
    """Write the action of agent `i`."""
    x = percept.heading[i, 0]
    y = percept.heading[i, 1]
    probability = parameters[_TURN_PROBABILITY]
    if probability >= 1.0 or (probability > 0.0 and noise[1, i] < probability):
        share = parameters[_TURN_RANGE]
        if share >= 1.0:
            x, y = direction(noise[0, i])
        else:
            # Angles are in turns: half a turn to either side is a share of 1.
            x, y = turned_by(x, y, share * (noise[0, i] - 0.5))
    action.heading[i, 0] = x
    action.heading[i, 1] = y
    action.distance[i] = percept.speed[i]
    if parameters[_RANDOM_DISTANCE] > 0.0:
        action.distance[i] *= noise[2, i]


@inlined
def _walk(percept: Any, arrays: Any, noise: Any, action: Any) -> None:
    for i in range(percept.heading.shape[0]):
        walk_step(i, percept, arrays.parameters, noise, action)


@dataclass(frozen=True)
class RandomWalk(CompiledPolicy):
    """Go straight on, and turn to a random direction with a probability per step.

    Parameters
    ----------
    turn_probability : float, default 1
        Probability of a turn per step; 1 for exploring robots (§8.2), 0.05 for targets (§5).
    turn_range : float, default π
        Largest turn to either side [rad]; turns are uniformly distributed. Parker: π/2.
    random_distance : bool, default False
        Draw the distance of each step uniformly between 0 and the speed, as in the exploration of §8.2.

    Raises
    ------
    ValueError, TypeError
        If the probability is not in [0, 1] or the range not in [0, π].
    """

    turn_probability: Probability = 1.0
    turn_range: Annotated[float, Allowed(least=0, most=math.pi)] = math.pi
    random_distance: Flag = False

    kernel = _walk

    @property
    def is_sound(self) -> bool:
        # It copies headings and speeds or makes headings from noise; a subclass may have another kernel.
        return type(self).kernel is _walk

    @property
    def draws(self) -> int:  # type: ignore[override]
        if self.random_distance:
            return 3
        return 2 if self.turn_probability < 1 else 1

    @property
    def parameters(self) -> tuple[float, ...]:
        return self.turn_probability, self.turn_range / math.pi, float(self.random_distance)
