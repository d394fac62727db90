"""The numbers of a `CMOMMT` that can be rewritten in a built world: arena, ranges and speeds."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple

from teamsight.world.arena import Disc
from teamsight.world.limits import Limits, length


class Numbers(NamedTuple):
    """The settings that differ between runs of equal worlds; see the parameters of `CMOMMT`."""

    arena: Disc
    limits: Limits
    sensing_range: float
    awareness_range: float
    robot_speed: float
    target_speed: float


def checked_numbers(plan: Mapping[str, Any]) -> Numbers:
    """Return the arena, the ranges and the speeds of a plan.

    Raises
    ------
    TypeError, ValueError
        If one is not a number or outside its limits.
    """
    arena = Disc(length("radius", plan["radius"]))
    limits = Limits(arena)
    sensing, aware = (limits.range(name, plan[name]) for name in ("sensing_range", "awareness_range"))
    speeds = (limits.speed(name, plan[name]) for name in ("robot_speed", "target_speed"))
    return Numbers(arena, limits, sensing, aware, *speeds)
