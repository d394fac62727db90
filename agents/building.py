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

from teamsight.agents.attributes import put
from teamsight.agents.body import Body, checked_headings, checked_positions
from teamsight.agents.decisions import EVERY_STEP, Cycle, cycle_of, give_timetable
from teamsight.agents.group import Group
from teamsight.agents.policy_state import columns_of_state, state_of_more
from teamsight.agents.resolve import awareness_of, check_needs, policy_or_none
from teamsight.core import checks
from teamsight.world.limits import shape_given
from teamsight.world.motion import is_watched, limit_of_turn
from teamsight.world.motion import turn_limit as turn_limit_of
from teamsight.world.placement import PLACEMENTS, Founders, starts

if TYPE_CHECKING:
    from teamsight.agents.host import WorldHost
    from teamsight.agents.world_data import WorldData
    from teamsight.world.arena import Arena
    from teamsight.world.limits import Limits

Floats = npt.NDArray[np.float64]

A = TypeVar("A", bound=Body)

# So many agents are placed in one call when the first of them comes.
_AHEAD = 64

_METHODS = frozenset(name for name, value in vars(Body).items() if inspect.isfunction(value))


def make_group(
    data: WorldData, agent_class: type[A], size: int, given: Mapping[str, Any], host: WorldHost
) -> Group[A]:
    """Return a new group without agents; `given` are the settings of `World.add`."""
    decides_alone = agent_class.decide is not Body.decide
    policy = policy_or_none(given["policy"], given["policy_options"], agent_class.__name__, decides_alone)
    awareness, cycle, team = awareness_of(given["awareness"]), cycle_of(given["cycle"]), given["team"]
    if isinstance(team, EllipsisType):
        team = agent_class.team
    elif team is not None and (not isinstance(team, str) or not team):
        raise TypeError(
            f"team={checks.shown(team)}: must be the name of a team, such as 'robots', or None for no team"
        )
    number, range_shape = len(data.groups), shape_given(given["range_shape"])
    abilities = abilities_of(data.limits, size, given)
    founders = founders_of(data.arena, number, 0, size, given, abilities)
    start = starts(data.arena, [founders], data.key[np.newaxis])
    name = given["name"] or _free_name(data, plural(agent_class.__name__.lower()))
    if name in [group.name for group in data.groups]:
        raise ValueError(f"name={name!r}: another group has this name; give a different one")
    group: Group[A] = Group(name, number, team, agent_class, size, policy, awareness, host, range_shape)
    check_needs(group)
    group.founders = [founders]
    group.members.arrived_at[:] = data.timeline.tick
    group.bodies.position[:], group.bodies.heading[:] = start.position[0], start.heading[0]
    for ability, values in abilities.items():
        group.bodies[ability][:] = group.members[ability][:] = values
    group.time = data.time
    group.first_cycle = cycle
    if cycle != EVERY_STEP:
        give_timetable(data, group, cycle.numbers(size))
    group.decides_alone = decides_alone
    # From now on, only known attributes can be set.
    put(group, is_made=True)
    return group


def check_names(agent_class: type[Body], attributes: Iterable[str]) -> None:
    """Refuse attributes of an agent that would hide a method."""
    hidden = _METHODS.intersection(attributes)
    if hidden:
        name = min(hidden)
        raise TypeError(f"{agent_class.__name__}.__init__ sets {name}, a method of all agents; take another name")


def abilities_of(limits: Limits, size: int, given: Mapping[str, Any]) -> dict[str, Any]:
    """Return the columns of the abilities that are given to so many agents."""
    found: dict[str, Any] = {}
    for name, limit in (
        ("sensing_range", limits.range), ("awareness_range", limits.range), ("speed", limits.speed)
    ):  # fmt: skip
        if name in given:
            found[name] = column(name, given[name], size, limit)
    if given.get("turn_limit") is not None:
        found["turn_cosine"], found["turn_sine"] = turn_columns(given["turn_limit"], size)
    return found


def founders_of(
    arena: Arena, number: int, first: int, size: int, given: Mapping[str, Any], abilities: Mapping[str, Any]
) -> Founders:
    """Return the rule for the places of new agents, whose members are numbered from `first`."""
    placement, position, heading = given["placement"], given["position"], given["heading"]
    if position is not None:
        if not isinstance(placement, str) or placement != "uniform":
            raise ValueError(f"placement={checks.shown(placement)}: applies without position; give one of them")
        placement = checked_positions(arena, position, (size, 2))
    elif isinstance(placement, str):
        placement = checks.choice("placement", placement, PLACEMENTS)
    else:
        placement = checked_positions(arena, placement, (size, 2))
    heading = None if heading is None else checked_headings(heading, (size, 2))
    return Founders(number, size, placement, float(np.max(abilities["sensing_range"])), heading, first)


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
        The settings that `add` itself takes.
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


class Newcomers(NamedTuple):
    """New agents of a group, checked and computed, but not yet in it.

    Attributes
    ----------
    size : int
        Their number.
    bodies, members : dict of str to ndarray
        Their elements of the columns of both tables of the group.
    founders : Founders
        The rule by which they are placed.
    states : list
        The states of all policies with them; for a state in the table, their own.
    cycle : Cycle or None
        Their cycle, in a group with a timetable, or that gets one by them.
    """

    size: int
    bodies: dict[str, Any]
    members: dict[str, Any]
    founders: Founders
    states: list[Any]
    cycle: Cycle | None


def newcomers(
    data: WorldData, group: Group, count: int, given: Mapping[str, Any], arguments: Mapping[str, Any]
) -> tuple[Newcomers, list[dict[str, Any]]]:
    """Return new agents for a group, and the arguments of each one's ``__init__``; parameters are as for `Group.add`.

    Raises
    ------
    TypeError, ValueError
        If a value does not fit, or must be given.
    """
    each, columns = divided(group.agent_class, count, arguments, given, group.columns)
    first, tick = len(group.members), data.timeline.tick
    abilities = _abilities(data, group, count, given)
    founders = founders_of(data.arena, group.number, first, count, given, abilities)
    position, heading = _start_of(data, group, founders)
    member = np.arange(first, first + count)
    own = group.columns.of_new(count, columns)
    cycle = _cycle_of_new(group, given.get("cycle"))
    numbers = {} if cycle is None else cycle.numbers(count)._asdict()
    present = group.bodies.member
    states = [
        state_of_more(policy, state, present, member, is_in_table=group.is_in_table(index))
        for index, (policy, state) in enumerate(zip(group.policies, group.states, strict=True))
    ]
    bodies = {
        "identity": -1, "member": member, "position": position, "heading": heading, **abilities, **numbers, **own,
    }  # fmt: skip
    for index, state in enumerate(states):
        if group.is_in_table(index):
            bodies |= zip(columns_of_state(index), state, strict=True)
    begun = {name: bodies[name] for name in group.members.fields if name in bodies}
    return Newcomers(count, bodies, {**begun, **numbers, "arrived_at": tick}, founders, states, cycle), each


def join(data: WorldData, group: Group, new: Newcomers) -> bool:
    """Take new agents into the tables of a group; return whether columns were moved or declared."""
    had = group.timetable
    if new.cycle is not None and had is None:
        # Those that are there decide at every step, as before.
        give_timetable(data, group, EVERY_STEP.numbers(len(group)))
    size = len(group)
    is_moved = group.bodies.append(new.size, new.bodies)
    group.members.append(new.size, new.members)
    group.founders[-1:] = group.founders[-1].followed_by(new.founders)
    for index, state in enumerate(new.states):
        if not group.is_in_table(index):
            group.set_state(index, state)
    if group.timetable is not None:
        has_more = group.timetable.begin(np.arange(size, size + new.size), data.key, data.timeline.tick)
        is_moved = is_moved or has_more or had is None
    return is_moved


def _start_of(data: WorldData, group: Group, founders: Founders) -> tuple[Floats, Floats]:
    """Return the positions and headings of new agents.

    Those that are drawn, by a rule for each alone, are drawn ahead for all who come soon.
    """
    first, last = founders.first, founders.first + founders.size
    is_drawn = isinstance(founders.placement, str) and founders.placement == "uniform" and founders.heading is None
    # The user's own arena may refuse places of agents who never come.
    if not is_drawn or is_watched(data.arena):
        start = starts(data.arena, [founders], data.key[np.newaxis])
        return start.position[0], start.heading[0]
    drawn = data.arena, data.key.tobytes()
    ahead = group.drawn_ahead
    if ahead is None or ahead[0] != drawn or not ahead[1] <= first <= last <= ahead[1] + len(ahead[2].position[0]):
        more = founders._replace(size=max(founders.size, _AHEAD))
        group.drawn_ahead = ahead = drawn, first, starts(data.arena, [more], data.key[np.newaxis])
    rows = slice(first - ahead[1], last - ahead[1])
    return ahead[2].position[0, rows], ahead[2].heading[0, rows]


def forget_members(group: Group, size: int) -> None:
    """Forget the members from number `size` on, who have all left: the next to arrive get their numbers, and noise."""
    founders = (one.cut(size) for one in group.founders)
    group.founders = [one for one in founders if one.size]
    group.members.cut(size)


def _cycle_of_new(group: Group, given: Any) -> Cycle | None:
    """Return the cycle of new agents, which begins now; None in a group without a timetable that needs none."""
    table = group.timetable
    cycle = None if given is None else cycle_of(given)
    if table is None:
        return None if cycle == EVERY_STEP else cycle
    cycle = cycle or table.usual()
    if cycle is None:
        raise ValueError(
            f"cycle: the agents of {group.name!r} have different ones; give that of the new ones, as in add(…, cycle=5)"
        )
    return cycle


def _usual(group: Group, name: str) -> float:
    """Return the ability that all agents of a group have; in an empty group, with which all have begun."""
    values = (group.bodies if len(group) else group.members)[name]
    _check_same(group, name, values)
    return float(values[0])


def _check_same(group: Group, name: str, values: Floats) -> None:
    # Equal bytes are equal numbers, in a quarter of the time.
    if values.tobytes() != values[:1].tobytes() * len(values) and (values != values[0]).any():
        low, high = values.min(), values.max()
        raise ValueError(
            f"{name}: the agents of {group.name!r} have different ones, from {low:g} to {high:g}; give that of the new "
            f"ones, as in add(…, {name}={low:g})"
        )


def _check_speed(data: WorldData, group: Group) -> None:
    """Refuse to take the speed of new agents from a group whose speeds an interaction may have written."""
    if not any(group in one.groups for one in data.interactions):
        return
    first = group.members.speed[group.bodies.member]
    if (group.bodies.speed != first).any():
        raise ValueError(
            f"speed: that of {group.name!r} is not the one with which they began, and an interaction may have changed "
            f"it; give that of the new ones, as in add(…, speed={first[0]:g})"
        )


def _abilities(data: WorldData, group: Group, count: int, given: Mapping[str, Any]) -> dict[str, Any]:
    """Return the abilities of new agents by column, one number or one for each: those given, or those of the group."""
    if given["speed"] is None:
        _check_speed(data, group)
    own = abilities_of(data.limits, count, {name: one for name, one in given.items() if one is not None})
    for name in ("sensing_range", "awareness_range", "speed"):
        if name not in own:
            own[name] = _usual(group, name)
    if "turn_cosine" in own:
        return own
    limited = group.bodies if len(group) else group.members
    turning = limited.turn_cosine, limited.turn_sine
    if any(one.tobytes() != one[:1].tobytes() * len(one) for one in turning):
        _check_same(group, "turn_limit", limit_of_turn(*turning))
    # Not by way of the angle, which would round.
    own["turn_cosine"], own["turn_sine"] = (one[0] for one in turning)
    return own
