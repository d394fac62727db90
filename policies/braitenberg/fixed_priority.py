"""Behaviours by fixed priority: avoid, goal, slow, follow, find."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from teamsight.core.kernel import inlined
from teamsight.policies.braitenberg.behaviours import AVOID, FIND, FOLLOW, GOAL, SLOW, behave
from teamsight.policies.braitenberg.cues import cues_of, has
from teamsight.policies.braitenberg.recovery import BEHAVIOUR, CUES, recovers
from teamsight.policies.braitenberg.vehicle import Vehicle


@inlined
def by_priority(cues: int) -> int:
    """Return the first behaviour whose condition holds."""
    if has(cues, 0) or has(cues, 1):
        return AVOID
    if has(cues, 4):
        return GOAL
    if has(cues, 10):
        return SLOW
    return FOLLOW if has(cues, 9) else FIND


@inlined
def _decide(percept: Any, arrays: Any, noise: Any, action: Any) -> None:
    kept = arrays.state.ints
    for i in range(percept.heading.shape[0]):
        if recovers(i, percept, arrays, noise[0, i], action):
            continue
        kept[i, 0, CUES] = cues_of(i, percept, arrays.parameters)
        kept[i, 0, BEHAVIOUR] = by_priority(kept[i, 0, CUES])
        behave(kept[i, 0, BEHAVIOUR], i, percept, arrays.parameters, noise[0, i], action)


@dataclass(frozen=True)
class FixedPriority(Vehicle):
    """The behaviour of the highest priority whose condition holds: avoid, goal, slow, follow, find.

    *Avoid* acts if a robot is ahead within `obstacle_range`; *goal* if the box is sensed, and goes to it; *slow* if the
    nearest perceived teammate is ahead within `slow_range`; *follow* if it is ahead anywhere, and goes to it; *find*
    wanders.

    Parameters
    ----------
    obstacle_range, slow_range, agility, swerve, recovery, patience, contact
        As for `Vehicle`.

    Notes
    -----
    *Source:* C. R. Kube and H. Zhang, "Collective robotics: from social insects to robots" (Adaptive Behavior 2(2),
    1994), as Touzet (2000, §9) reports it; the order is recalled, not verified. *Departs:* sensors, wires and ranges
    are ours. Walls reflect, so there is no need to avoid them. Recovery comes before all behaviours.
    """

    kernel = _decide
