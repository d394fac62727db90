"""Building: check a user's values and make a group from them."""

from __future__ import annotations

import inspect
import itertools
import math
import re
from collections.abc import Callable, Iterable
from numbers import Real
from types import EllipsisType
from typing import TYPE_CHECKING, NamedTuple, TypeVar

import numpy as np
import numpy.typing as npt

from teamsight.agents.awareness import Awareness
from teamsight.agents.body import Body
from teamsight.agents.decisions.cycle import EVERY_STEP, Cycle
from teamsight.agents.decisions.new_timetable import new_timetable, put_timetable
from teamsight.agents.group import Group
from teamsight.agents.host_protocol import Host
from teamsight.agents.places import checked_headings, checked_positions
from teamsight.agents.resolve import check_needs
from teamsight.agents.world_data import WorldData
from teamsight.core import checks
from teamsight.policies.interface import Policy
from teamsight.policies.percept_of_one import Rule
from teamsight.world.arena import Arena
from teamsight.world.bodies import Abilities, Bodies
from teamsight.world.limits import Limits
from teamsight.world.motion import turn_limit as turn_limit_of
from teamsight.world.placement import PLACEMENTS
from teamsight.world.starts import Founders, starts

A = TypeVar("A", bound=Body)

MOST_AGENTS = 10_000_000
"""The largest size of a group; larger ones would not fit in memory."""

_METHODS = frozenset(name for name, value in vars(Body).items() if inspect.isfunction(value))

Floats = npt.NDArray[np.float64]


class Places(NamedTuple):
    """Where new agents are put; see `World.add`."""

    placement: str | npt.ArrayLike
    position: npt.ArrayLike | None
    heading: npt.ArrayLike | None


class Plan(NamedTuple):
    """What is said of a new group; see `World.add`."""

    policy: Policy | Rule
    awareness: Awareness
    team: str | None
    name: str | None
    places: Places
    speed: npt.ArrayLike
    turn_limit: npt.ArrayLike
    sensing_range: npt.ArrayLike
    awareness_range: npt.ArrayLike
    cycle: Cycle
    range_shape: str = "disc"


class _GroupToBe(Group[A]):
    """A group while it is made: its attributes are set without the check for unknown names, which takes time."""

    if not TYPE_CHECKING:
        __setattr__ = object.__setattr__


def make_group(data: WorldData, agent_class: type[A], size: int, plan: Plan, host: Host) -> Group[A]:
    """Return a new group without agents."""
    number = len(data.groups)
    abilities = abilities_of(
        size, data.limits, speed=plan.speed, turn_limit=plan.turn_limit, sensing_range=plan.sensing_range,
        awareness_range=plan.awareness_range,
    )  # fmt: skip
    founders = founders_of(data.arena, number, 0, size, plan.places, abilities)
    bodies = bodies_of(data, founders, abilities)
    name = plan.name or _free_name(data, plural(agent_class.__name__.lower()))
    if name in [group.name for group in data.groups]:
        raise ValueError(f"name={name!r}: another group has this name; give a different one")
    ranges = abilities.sensing_range.copy(), abilities.awareness_range.copy()
    group = _GroupToBe(
        name, number, plan.team, agent_class, bodies, ranges, plan.policy, plan.awareness, host, plan.range_shape
    )
    check_needs(group)
    group.founders, group.first_abilities = [founders], abilities
    group.time = data.time
    group.arrived_at[:] = data.timeline.tick
    group.first_cycle = plan.cycle
    if plan.cycle != EVERY_STEP:
        put_timetable(group, new_timetable(data, group, plan.cycle))
    group.decides_alone = agent_class.decide is not Body.decide
    group.__class__ = Group  # type: ignore[assignment]
    return group


def check_class(agent_class: type[Body]) -> None:
    """Refuse what is not a class of bodies."""
    if not isinstance(agent_class, type) or not issubclass(agent_class, Body):
        raise TypeError(f"agent_class={checks.shown(agent_class)}: must be Robot, Target, Body or a subclass")


def check_names(agent_class: type[Body], attributes: Iterable[str]) -> None:
    """Refuse attributes of an agent that would hide a method."""
    hidden = _METHODS.intersection(attributes)
    if hidden:
        name = min(hidden)
        raise TypeError(f"{agent_class.__name__}.__init__ sets {name}, a method of all agents; take another name")


def team_given(team: str | EllipsisType | None, agent_class: type[Body]) -> str | None:
    """Return the team of a new group; by default that of its class."""
    if isinstance(team, EllipsisType):
        return agent_class.team
    if team is not None and (not isinstance(team, str) or not team):
        raise TypeError(f"team={checks.shown(team)}: must be the name of a team, such as 'robots', or None for no team")
    return team


def abilities_of(
    size: int,
    limits: Limits,
    *,
    speed: npt.ArrayLike,
    turn_limit: npt.ArrayLike,
    sensing_range: npt.ArrayLike,
    awareness_range: npt.ArrayLike,
) -> Abilities:
    """Return the abilities of new agents, one array each."""
    sensing = column("sensing_range", sensing_range, size, limits.range)
    aware = column("awareness_range", awareness_range, size, limits.range)
    turning = turn_columns(turn_limit, size)
    return Abilities(column("speed", speed, size, limits.speed), *turning, sensing, aware)


def founders_of(
    arena: Arena, number: int, first: int, size: int, given: Places, abilities: Abilities
) -> Founders:
    """Return the rule for the places of new agents, whose members are numbered from `first`."""
    placement: str | Floats
    if given.position is not None:
        if not isinstance(given.placement, str) or given.placement != "uniform":
            shown = checks.shown(given.placement)
            raise ValueError(f"placement={shown}: applies without position; give one of them")
        placement = checked_positions(arena, given.position, (size, 2))
    elif isinstance(given.placement, str):
        placement = checks.choice("placement", given.placement, PLACEMENTS)
    else:
        placement = checked_positions(arena, given.placement, (size, 2))
    heading = None if given.heading is None else checked_headings(given.heading, (size, 2))
    return Founders(number, size, placement, float(abilities.sensing_range.max()), heading, first)


def bodies_of(data: WorldData, founders: Founders, abilities: Abilities) -> Bodies:
    """Return the bodies of new agents at their places, without identities."""
    size, first = founders.size, founders.first
    start = starts(data.arena, [founders], data.key[np.newaxis])
    return Bodies(
        np.zeros(size, np.int64), np.arange(first, first + size), start.position[0], start.heading[0],
        np.zeros((size, 2)), abilities.speed.copy(), abilities.turn_cosine.copy(), abilities.turn_sine.copy(),
        np.array(data.arena.size, float), np.ones(size, bool),
    )  # fmt: skip


def plural(name: str) -> str:
    """Return the plural of an English noun."""
    return f"{name[:-1]}ies" if re.search("[^aeiou]y$", name) else f"{name}s"


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
    if isinstance(limit, float):
        # The usual case, in a tenth of the time.
        cosine, sine = turn_limit_of(checks.angle("turn_limit", limit, math.tau))
        return np.full(size, cosine), np.full(size, sine)
    angles = column("turn_limit", limit, size, lambda name, number: checks.angle(name, number, math.tau))
    cosines, sines = np.array([turn_limit_of(angle) for angle in angles]).reshape(-1, 2).T
    return np.ascontiguousarray(cosines), np.ascontiguousarray(sines)
