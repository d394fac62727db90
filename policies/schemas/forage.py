"""Forage and consume by motor schemas: wander, acquire an attractor, deliver it or work on it."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

from teamsight.core.component import Flag
from teamsight.core.kernel import inlined
from teamsight.policies.channels import column_of
from teamsight.policies.schemas.automaton import ACQUIRE, FOLLOW, WANDER, WORK, Schemas, drive, followed
from teamsight.policies.schemas.vectors import home_offset

_DELIVERS = 10


@inlined
def _nearest_attractor(i: int, percept: Any) -> tuple[float, float, float]:
    """Return whether robot `i` senses an attractor that still has mass, and the offset to the nearest."""
    seen = percept.targets
    nearest = math.inf
    x = 0.0
    y = 0.0
    for k in range(seen.start[i], seen.start[i + 1]):
        if seen.distance[k] < nearest and column_of(percept.columns.mass, seen.identity[k]) > 0.0:
            nearest = seen.distance[k]
            x = seen.offset[k, 0]
            y = seen.offset[k, 1]
    return 1.0 if nearest < math.inf else 0.0, x, y


@inlined
def _forage(percept: Any, arrays: Any, noise: Any, action: Any) -> None:
    for i in range(percept.heading.shape[0]):
        mode = WANDER
        x = 0.0
        y = 0.0
        if column_of(percept.columns.attached, percept.identity[i]) > 0.0:
            mode = WORK
            if arrays.parameters[_DELIVERS] > 0.0:
                x, y = home_offset(i, percept)
        else:
            found, x, y = _nearest_attractor(i, percept)
            if found > 0.0:
                mode = ACQUIRE
            else:
                found, x, y = followed(i, percept, arrays)
                mode = FOLLOW if found > 0.0 else WANDER
        drive(i, percept, arrays, noise, action, mode, x, y)
        if mode == WORK:
            # The goal that others can help with is the attractor, which is here, and not home.
            home_x, home_y = home_offset(i, percept)
            arrays.state.floats[i, 0, 1] = -home_x
            arrays.state.floats[i, 0, 2] = -home_y


@dataclass(frozen=True)
class ForageSchemas(Schemas):
    """Wander until an attractor is sensed, go to it, and deliver it at home, or stay with it.

    Parameters
    ----------
    communication, obstacles, goal, obstacle, obstacle_sphere, robot, robot_at_work, robot_sphere, noise, noise_at_work,
    persistence
        As for `Schemas`.
    delivers : bool
        Whether an attached robot goes home; otherwise it stays where it is.

    Notes
    -----
    *Source:* Balch and Arkin (1994); their gains are unknown, and these are plausible ones.
    *Departs:* a robot that follows another does not show that it is at work, so that two robots cannot follow each
    other; the goal that a robot shows is its attractor, also while it carries it; repulsion is at most 1 instead of
    infinite. The robots know where obstacles are, and how far home is.
    """

    delivers: Flag = True

    columns = ("attached", "mass", "mode", "goal_x", "goal_y")
    kernel = _forage

    @property
    def parameters(self) -> tuple[float, ...]:
        return (*super().parameters, float(self.delivers))
