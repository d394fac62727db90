"""Building: check a user's values and make a group from them."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable
from numbers import Real
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from teamsight.agents.awareness import Awareness
from teamsight.agents.body import Body
from teamsight.agents.group import Group, Host
from teamsight.agents.resolve import awareness_of, check_needs
from teamsight.agents.world_data import WorldData
from teamsight.core import checks
from teamsight.world.arena import Arena
from teamsight.world.bodies import Abilities, Bodies
from teamsight.world.limits import Limits
from teamsight.world.motion import turn_limit as turn_limit_of
from teamsight.world.starts import Founders, starts

MOST_AGENTS = 10_000_000
"""The largest size of a group; larger ones would not fit in memory."""

Floats = npt.NDArray[np.float64]


class Plan(NamedTuple):
    """The arguments of `World.add`."""

    policy: Any
    awareness: Awareness | str
    sensing_range: npt.ArrayLike
    awareness_range: npt.ArrayLike
    speed: npt.ArrayLike
    turn_limit: npt.ArrayLike | None
    placement: str | npt.ArrayLike
    name: str | None


def make_group(data: WorldData, agent_class: type[Body], count: int, plan: Plan, host: Host) -> Group:
    """Return a new group without agents."""
    if not isinstance(agent_class, type) or not issubclass(agent_class, Body):
        raise TypeError(f"agent_class={checks.shown(agent_class)}: must be Robot, Target or a subclass")
    size = checks.count("count", count, most=MOST_AGENTS)
    number = len(data.groups)
    policy, awareness = plan.policy, awareness_of(plan.awareness)
    abilities = _abilities(plan, size, data.limits)
    placement: str | Floats
    if isinstance(plan.placement, str):
        placement = checks.choice("placement", plan.placement, ("uniform", "spread"))
    else:
        placement = checked_positions(data.arena, plan.placement, (size, 2))
    founders = Founders(number, size, placement, float(abilities.sensing_range.max()))
    start = starts(data.arena, [founders], data.key[np.newaxis])
    own = Abilities(*(array.copy() for array in abilities))
    bodies = Bodies(
        np.zeros(size, np.int64), np.arange(size), start.position[0], start.heading[0], np.zeros((size, 2)),
        own.speed, own.turn_cosine, own.turn_sine, np.array(data.arena.size, float),
    )  # fmt: skip
    ranges = own.sensing_range, own.awareness_range
    name = plan.name or _free_name(data, f"{agent_class.__name__.lower()}s")
    if name in [group.name for group in data.groups]:
        raise ValueError(f"name={name!r}: another group has this name; give a different one")
    group = Group(name, number, agent_class.team, bodies, ranges, policy, awareness, host)
    check_needs(group)
    group.founders, group.first_abilities = founders, abilities
    return group


def _abilities(plan: Plan, size: int, limits: Limits) -> Abilities:
    sensing = column("sensing_range", plan.sensing_range, size, limits.range)
    aware = column("awareness_range", plan.awareness_range, size, limits.range)
    turning = turn_columns(math.pi if plan.turn_limit is None else plan.turn_limit, size)
    return Abilities(column("speed", plan.speed, size, limits.speed), *turning, sensing, aware)


def _free_name(data: WorldData, name: str) -> str:
    taken = {group.name for group in data.groups}
    numbered = (f"{name}-{number}" for number in itertools.count(2))
    return next(free for free in itertools.chain([name], numbered) if free not in taken)


def column(name: str, value: npt.ArrayLike, size: int, check: Callable[[str, float], float]) -> Floats:
    """Check each number with ``check(name, number)``; return an array with one number for each agent."""
    if isinstance(value, Real) and not isinstance(value, bool):
        return np.full(size, check(name, value))
    try:
        array = np.asarray(value)
    except ValueError:
        array = np.asarray(None)
    if array.dtype.kind not in "iuf":
        raise TypeError(f"{name}={checks.shown(value)}: must be a number, or one for each agent")
    if array.shape not in ((), (size,)):
        raise ValueError(f"{name}: has the shape {array.shape}; give one number, or {size}, one for each agent")
    for number in np.unique(array) if array.size > 1 else array.ravel():
        check(name, float(number))
    return np.array(np.broadcast_to(array, size), float)


def turn_columns(limit: npt.ArrayLike, size: int) -> tuple[Floats, Floats]:
    """Return the cosines and sines of the turning limits."""
    angles = column("turn_limit", limit, size, lambda name, number: checks.number(name, number, least=0))
    cosine, sine = np.array([turn_limit_of(angle) for angle in angles]).reshape(-1, 2).T
    return np.ascontiguousarray(cosine), np.ascontiguousarray(sine)


def checked_positions(arena: Arena, value: npt.ArrayLike, shape: tuple[int, ...]) -> Floats:
    """Check positions; return them as an array of this shape.

    Raises
    ------
    ValueError
        If the shape is wrong, a number is not finite, or a position lies outside.
    """
    try:
        position = np.array(value, float)
    except (TypeError, ValueError, OverflowError):
        raise TypeError(f"position={checks.shown(value)}: must be numbers of shape {shape}") from None
    if position.shape != shape:
        raise ValueError(f"position: has the shape {position.shape}; it must be {shape}")
    inside = arena.contains(position) & np.isfinite(position).all(axis=-1)
    if not inside.all():
        wrong = position[~inside][0] if position.ndim == 2 else position
        raise ValueError(f"position={tuple(wrong.tolist())}: must be two finite numbers inside {arena}")
    return position
