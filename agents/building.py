"""Building: check a user's values, and make groups and agents that join them."""

from __future__ import annotations

import inspect
import itertools
import math
import re
from collections.abc import Callable, Iterable, Mapping
from functools import lru_cache
from numbers import Real
from types import EllipsisType
from typing import TYPE_CHECKING, Any, NamedTuple, TypeVar

import numpy as np
import numpy.typing as npt

from teamsight.agents.awareness import Awareness
from teamsight.agents.body import Body, checked_headings, checked_positions
from teamsight.agents.decisions import EVERY_STEP, Cycle, OtherPolicy, Timetable, cycle_of, new_timetable, put_timetable
from teamsight.agents.fixed import put
from teamsight.agents.group import Group
from teamsight.agents.policy_state import state_of_more
from teamsight.agents.resolve import check_needs
from teamsight.core import checks
from teamsight.policies.interface import Action, Policy
from teamsight.policies.percept_of_one import Rule
from teamsight.world.bodies import Abilities, Bodies
from teamsight.world.motion import limit_of_turn
from teamsight.world.motion import turn_limit as turn_limit_of
from teamsight.world.placement import PLACEMENTS, Founders, starts

if TYPE_CHECKING:
    from teamsight.agents.host import WorldHost
    from teamsight.agents.world_data import WorldData
    from teamsight.world.arena import Arena
    from teamsight.world.limits import Limits

Floats = npt.NDArray[np.float64]


A = TypeVar("A", bound=Body)

MOST_AGENTS = 10_000_000
"""The largest size of a group; larger ones would not fit in memory."""

_METHODS = frozenset(name for name, value in vars(Body).items() if inspect.isfunction(value))


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


def make_group(data: WorldData, agent_class: type[A], size: int, plan: Plan, host: WorldHost) -> Group[A]:
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
    group: Group[A] = Group(
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
    # From now on, only known attributes can be set.
    put(group, is_made=True)
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


#: The parameters of `World.add` and `Group.add` that are not arguments of agents.
OWN_OF_WORLD = (
    "policy", "policy_options", "awareness", "team", "sensing_range", "awareness_range", "range_shape", "speed",
    "turn_limit", "placement", "position", "heading", "cycle", "name",
)  # fmt: skip
OWN_OF_GROUP = ("sensing_range", "awareness_range", "speed", "turn_limit", "placement", "position", "heading", "cycle")


class Arguments(NamedTuple):
    """The further keyword arguments of `add`.

    Attributes
    ----------
    each : list of dict
        For each agent, the arguments of its ``__init__``.
    columns : dict of str to object
        Values of columns.
    """

    each: list[dict[str, Any]]
    columns: dict[str, Any]


def check_keywords(made: Any, given: Mapping[str, Any]) -> None:
    """Refuse keyword arguments that the ``__init__`` of a class of worlds does not take, with the nearest that it does.

    Raises
    ------
    TypeError
        Naming the argument.
    """
    taken, _, is_open = _parameters(made.__init__, 1)
    for name in given:
        if name not in taken and not is_open:
            raise TypeError(
                f"{name}={checks.shown(given[name])}: unknown; {checks.suggestion(name, taken)}{made.__name__} takes "
                f"{', '.join(taken) or 'no arguments'}"
            )


def divided(
    agent_class: Any, size: int, given: Mapping[str, Any], own: Iterable[str], columns: Iterable[str] = ()
) -> Arguments:
    """Divide arguments among the agents: lists, tuples and arrays of length `size` by element, others as they are.

    Parameters
    ----------
    agent_class : type
        The class of the agents.
    size : int
        The number of agents.
    given : mapping of str to object
        The arguments.
    own : iterable of str
        The parameters of `add` itself.
    columns : iterable of str
        The columns of the group; an argument that ``__init__`` does not take sets one.

    Raises
    ------
    TypeError
        If neither takes an argument, if one is missing, or if a parameter of ``__init__`` is also one of `add`.
    """
    if not given and not _parameters(agent_class.__init__)[0]:
        return Arguments([{}] * size, {})
    taken, needed, is_open = _parameters(agent_class.__init__)
    name, own, columns = f"{agent_class.__name__}.__init__", tuple(own), tuple(columns)
    for parameter in taken:
        if parameter in own:
            raise TypeError(
                f"{parameter}: is a parameter of add and of {name}; rename that of {name}, or leave it out if it is "
                "meant for add, which sets it before the agents are made"
            )
    of_columns = {key: value for key, value in given.items() if key not in taken and key in columns}
    of_init = {key: value for key, value in given.items() if key not in of_columns}
    for key in of_init:
        if key not in taken and not is_open:
            known = f"{name} takes {', '.join(taken)}" if taken else f"{name} takes no arguments of its own"
            known += f", and the columns are {', '.join(columns)}" if columns else ""
            raise TypeError(
                f"{key}={checks.shown(of_init[key])}: unknown; {checks.suggestion(key, (*taken, *columns, *own))}"
                f"{known}; add itself takes {', '.join(own)}"
            )
    missing = [key for key in needed if key not in of_init]
    if missing:
        raise TypeError(f"{name} needs {', '.join(missing)}; give it to add, as in add(…, {missing[0]}=…)")
    if not of_init:
        return Arguments([{}] * size, of_columns)
    each = [{key: _part(value, row, size) for key, value in of_init.items()} for row in range(size)]
    return Arguments(each, of_columns)


@lru_cache(maxsize=64)
def _parameters(init: Callable[..., None], first: int = 2) -> tuple[tuple[str, ...], tuple[str, ...], bool]:
    """Return the names of an ``__init__``'s parameters from the first, those without a default, and whether it has **.

    That of an agent has the agent and the model before.
    """
    try:
        parameters = list(inspect.signature(init).parameters.values())[first:]
    except ValueError:
        # Some classes written in C have no signature.
        return (), (), True
    named = [one for one in parameters if one.kind in (one.POSITIONAL_OR_KEYWORD, one.KEYWORD_ONLY)]
    is_open = any(one.kind is one.VAR_KEYWORD for one in parameters)
    return tuple(one.name for one in named), tuple(one.name for one in named if one.default is one.empty), is_open


def _part(value: Any, row: int, size: int) -> Any:
    """Return the part of a value for one agent, divided as by mesa's ``create_agents``."""
    is_sequence = isinstance(value, (list, tuple)) or (isinstance(value, np.ndarray) and value.ndim > 0)
    return value[row] if is_sequence and len(value) == size else value


Integers = npt.NDArray[np.int64]


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
