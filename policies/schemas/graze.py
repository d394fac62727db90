"""Graze by motor schemas: wander until there is fresh ground, and go over it."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

from teamsight.core.kernel import inlined
from teamsight.policies.channels import column_of
from teamsight.policies.schemas.automaton import FOLLOW, WANDER, WORK, Schemas, drive, followed


@inlined
def _graze(percept: Any, arrays: Any, noise: Any, action: Any) -> None:
    for i in range(percept.heading.shape[0]):
        x = column_of(percept.columns.probe_x, percept.identity[i])
        y = column_of(percept.columns.probe_y, percept.identity[i])
        mode = WORK
        # Not a number for a robot that does not probe.
        if (x == 0.0 and y == 0.0) or math.isnan(x) or math.isnan(y):
            found, x, y = followed(i, percept, arrays)
            mode = FOLLOW if found > 0.0 else WANDER
        drive(i, percept, arrays, noise, action, mode, x, y)


@dataclass(frozen=True)
class GrazeSchemas(Schemas):
    """Wander until there is fresh ground within reach of the probe, then go to the nearest.

    Parameters
    ----------
    communication, obstacles, goal, obstacle, obstacle_sphere, robot, robot_at_work, robot_sphere, noise, noise_at_work,
    persistence
        As for `Schemas`.

    Notes
    -----
    *Source:* Balch and Arkin (1994). *Departs:* as `ForageSchemas`; their probe schema is unknown, this one goes to the
    nearest fresh ground.
    """

    columns = ("probe_x", "probe_y", "mode", "goal_x", "goal_y")
    kernel = _graze
