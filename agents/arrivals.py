"""Arrivals: agents that join a group, in the same arrays."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from teamsight.agents.building import MOST_AGENTS, Places, abilities_of, bodies_of, founders_of
from teamsight.agents.decisions.cycle import EVERY_STEP, cycle_of
from teamsight.agents.decisions.new_timetable import new_timetable
from teamsight.agents.decisions.other_policies import OtherPolicy
from teamsight.agents.decisions.timetable import Timetable
from teamsight.agents.fixed import put
from teamsight.agents.group import Group
from teamsight.agents.policy_state import state_of_more
from teamsight.agents.world_data import WorldData
from teamsight.core import checks
from teamsight.policies.interface import Action
from teamsight.world.bodies import Abilities, Bodies
from teamsight.world.motion import limit_of_turn
from teamsight.world.starts import Founders

Integers = npt.NDArray[np.int64]
Floats = npt.NDArray[np.float64]


class Extended(NamedTuple):
    """The arrays of a group with new agents after those that it has."""

    founders: list[Founders]
    first_abilities: Abilities
    bodies: Bodies
    ranges: tuple[Any, Any]
    policy_state: Any
    arrived_at: Integers
    timetable: Timetable | None
    others: list[OtherPolicy]
    columns: dict[str, Any]
    decided: Action | None


def extended(data: WorldData, group: Group, count: int, given: dict[str, Any], columns: dict[str, Any]) -> Extended:
    """Return the arrays of a group with more agents; `given` is as for `Group.add`, `columns` the values of columns.

    Raises
    ------
    TypeError, ValueError
        If a value does not fit, or must be given.
    """
    members, size = group.members_so_far, len(group)
    checks.count("count", count, most=MOST_AGENTS - size)
    own = _abilities(data, group, count, given)
    places = Places(*(given[name] for name in Places._fields))
    founders = founders_of(data.arena, group.number, members, count, places, own)
    sensing, aware = group.ranges
    after = members + count
    present = np.append(group.bodies.member, np.arange(members, after))
    return Extended(
        [*group.founders[:-1], *group.founders[-1].followed_by(founders)],
        group.first_abilities.followed_by(own),
        group.bodies.followed_by(bodies_of(data, founders, own)),
        (np.append(sensing, own.sensing_range), np.append(aware, own.awareness_range)),
        state_of_more(group.policy, group.policy_state, size, present, after),
        np.append(group.arrived_at, np.full(count, data.timeline.tick)),
        _timetable(data, group, count, given.get("cycle")),
        [other.extended(size, present, after) for other in group.others],
        group.columns.extended(count, columns),
        _decided(group, count),
    )


def join(group: Group, new: Extended) -> None:
    """Replace the arrays of a group."""
    group.founders, group.first_abilities = new.founders, new.first_abilities
    group.bodies, group.ranges, group.arrived_at = new.bodies, new.ranges, new.arrived_at
    put(group, timetable=new.timetable, others=tuple(new.others))
    group.columns.replace(new.columns)
    for channel in group.channels.values():
        channel.works = np.append(channel.works, np.ones(len(group) - len(channel.works), bool))
    group.begin(new.policy_state, new.decided)


def _decided(group: Group, count: int) -> Action | None:
    """Return what a group had decided in a step that failed; new agents, which had not, stay in the next one."""
    if group.decided is None:
        return None
    heading, distance = group.decided
    return Action(np.concatenate([heading, np.zeros((count, 2))]), np.append(distance, np.zeros(count)))


def forget_members(group: Group, size: int) -> None:
    """Forget the members from number `size` on, who have all left: the next to arrive get their numbers, and noise."""
    founders = (one.cut(size) for one in group.founders)
    group.founders = [one for one in founders if one.size]
    group.first_abilities, group.arrived_at = group.first_abilities.cut(size), group.arrived_at[:size].copy()


def _timetable(data: WorldData, group: Group, count: int, given: Any) -> Timetable | None:
    """Return the timetable with new agents, whose cycles begin now."""
    table = group.timetable
    cycle = None if given is None else cycle_of(given)
    if table is None:
        if cycle in (None, EVERY_STEP):
            return None
        table = new_timetable(data, group)
    cycle = cycle or table.usual()
    if cycle is None:
        raise ValueError(
            f"cycle: the agents of {group.name!r} have different ones; give that of the new ones, as in "
            "add(…, cycle=5)"
        )
    size, tick, so_far = len(group), data.timeline.tick, group.members_so_far
    fresh = Action(np.zeros((count, 2)), np.zeros(count))
    new = Timetable.made(group.number, cycle, np.arange(count), count, np.full(count, -1), fresh)
    both = table.followed_by(new, so_far)
    members = np.append(group.bodies.member, np.arange(so_far, so_far + count))
    both.begin(np.arange(size, size + count), data.key, members, tick)
    return both


def _usual(group: Group, name: str, present: Floats, first: Floats) -> float:
    """Return the ability that all agents of a group have; in an empty group, with which all have begun."""
    values = present if len(present) else first
    _check_same(group, name, values)
    return float(values[0])


def _check_same(group: Group, name: str, values: Floats) -> None:
    if (values != values[0]).any():
        low, high = values.min(), values.max()
        raise ValueError(
            f"{name}: the agents of {group.name!r} have different ones, from {low:g} to {high:g}; give that of the new "
            f"ones, as in add(…, {name}={low:g})"
        )


def _check_speed(data: WorldData, group: Group) -> None:
    """Refuse to take the speed of new agents from a group whose speeds an interaction may have written."""
    present, first = group.bodies.speed, group.first_abilities.speed[group.bodies.member]
    if (present != first).any() and any(group in one.groups for one in data.interactions):
        raise ValueError(
            f"speed: that of {group.name!r} is not the one with which they began, and an interaction may have changed "
            f"it; give that of the new ones, as in add(…, speed={first[0]:g})"
        )


def _abilities(data: WorldData, group: Group, count: int, given: dict[str, Any]) -> Abilities:
    """Return the abilities of new agents: those given, or those of the group."""
    bodies, first, limits = group.bodies, group.first_abilities, data.limits
    known = {
        "speed": (bodies.speed, first.speed),
        "sensing_range": (group.ranges[0], first.sensing_range),
        "awareness_range": (group.ranges[1], first.awareness_range),
    }
    if given["speed"] is None:
        _check_speed(data, group)
    values = {name: _usual(group, name, *pair) if given[name] is None else given[name] for name, pair in known.items()}
    if given["turn_limit"] is not None:
        return abilities_of(count, limits, turn_limit=given["turn_limit"], **values)
    limited = bodies if len(bodies) else first
    _check_same(group, "turn_limit", limit_of_turn(limited.turn_cosine, limited.turn_sine))
    # Not by way of the angle, which would round.
    own = abilities_of(count, limits, turn_limit=math.pi, **values)
    own.turn_cosine[:], own.turn_sine[:] = limited.turn_cosine[0], limited.turn_sine[0]
    return own
