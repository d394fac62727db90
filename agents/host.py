"""The host of groups and agents: it makes, adds, changes, moves and removes them."""

from __future__ import annotations

import inspect
import itertools
import math
import re
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import is_dataclass
from functools import cached_property, lru_cache
from numbers import Real
from types import EllipsisType
from typing import TYPE_CHECKING, Any, NamedTuple, TypeVar

import numpy as np
import numpy.typing as npt

from teamsight.agents.attributes import put
from teamsight.agents.body import Body, checked_headings, checked_positions
from teamsight.agents.channel import TEAMMATES, changed
from teamsight.agents.decisions import EVERY_STEP, Cycle, cycle_of, give_timetable
from teamsight.agents.engine.engine import Deliberation
from teamsight.agents.group import Changes, Group, sizes_of, team_of
from teamsight.agents.mesa.bases import Agent
from teamsight.agents.resolve import (
    awareness_of,
    check_channels,
    check_fit,
    check_needs,
    columns_of_state,
    first_state,
    policy_of,
    policy_or_none,
    put_rows,
    state_of_more,
    take_rows,
)
from teamsight.agents.sensing.lidar import lidar_of
from teamsight.agents.settings import MOST_AGENTS
from teamsight.agents.world_data import LATER
from teamsight.core import checks
from teamsight.core.interrupts import deferred
from teamsight.policies.registry import label
from teamsight.world.arena import Arena, Obstructed
from teamsight.world.contact import SKIN, Pass, contact_of
from teamsight.world.drive import drive_of
from teamsight.world.limits import shape_given
from teamsight.world.motion import is_watched, limit_of_turn
from teamsight.world.motion import turn_limit as turn_limit_of
from teamsight.world.placement import PLACEMENTS, Founders, Solid, starts
from teamsight.world.walls import clearance, joined, repeated

if TYPE_CHECKING:
    from teamsight.agents.channel import Channel
    from teamsight.agents.engine.engine import Engine
    from teamsight.agents.mesa.bases import Model
    from teamsight.agents.mesa.space import WorldSpace
    from teamsight.agents.sensing.sensor import Sensor
    from teamsight.agents.world_data import WorldData
    from teamsight.policies.percept_of_one import PerceptOfOne
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
    drive, abilities = drive_of(given["drive"]), abilities_of(data.limits, size, given)
    founders = founders_of(data, number, 0, size, given, abilities)
    start = starts(data.arena, [founders], data.key[np.newaxis], taken_in(data))
    name = given["name"] or _free_name(data, plural(agent_class.__name__.lower()))
    if name in [group.name for group in data.groups]:
        raise ValueError(f"name={name!r}: another group has this name; give a different one")
    lidar = lidar_of(given["lidar"], data)
    group: Group[A] = Group(
        name, number, team, agent_class, size, policy=policy, awareness=awareness, host=host, range_shape=range_shape,
        drive=drive, lidar=lidar,
    )  # fmt: skip
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
        ("sensing_range", limits.range), ("awareness_range", limits.range), ("speed", limits.speed),
        ("radius", limits.radius),
    ):  # fmt: skip
        if name in given:
            found[name] = column(name, given[name], size, limit)
    if given.get("turn_limit") is not None:
        found["turn_cosine"], found["turn_sine"] = turn_columns(given["turn_limit"], size)
    return found


def founders_of(
    data: WorldData, number: int, first: int, size: int, given: Mapping[str, Any], abilities: Mapping[str, Any]
) -> Founders:
    """Return the rule for the places of new agents, whose members are numbered from `first`."""
    placement, position, heading, arena = given["placement"], given["position"], given["heading"], data.arena
    if position is not None:
        if not isinstance(placement, str) or placement != "uniform":
            raise ValueError(f"placement={checks.shown(placement)}: applies without position; give one of them")
        placement = checked_positions(arena, position, (size, 2))
    elif isinstance(placement, str):
        placement = checks.choice("placement", placement, PLACEMENTS)
    else:
        placement = checked_positions(arena, placement, (size, 2))
    heading = None if heading is None else checked_headings(heading, (size, 2))
    radius = None if isinstance(data.contact, Pass) else np.broadcast_to(abilities["radius"], size).astype(float)
    if radius is not None and radius.any():
        check_steps(data, radius, abilities["speed"])
    else:
        radius = None
    turn = 1 + max((one.turn for group in data.groups for one in group.founders), default=-1)
    return Founders(number, size, placement, float(np.max(abilities["sensing_range"])), heading, first, radius, turn)


def check_steps(data: WorldData, radius: Any, speed: Any) -> None:
    """Refuse bodies that in one step could meet another on both sides of an arena that repeats."""
    reach = float(np.max((np.asarray(radius) > 0) * (np.asarray(radius) + speed), initial=0.0))
    limit = min((side / 4 for side in data.arena.period if side > 0), default=math.inf)
    if reach > limit:
        raise ValueError(
            f"speed: {reach:g} with the radius; of bodies that meet it must be at most {limit:g} in {data.arena}, a "
            "quarter of the shorter side; take a lower speed, a smaller radius or a larger torus"
        )


def taken_in(data: WorldData, but: Body | None = None) -> Solid | None:
    """Return the bodies of a world that others must not overlap, `but` that of one agent."""
    solid = [
        (group.bodies, group.bodies.active & (group.bodies.radius > 0) & _all_but(group, but)) for group in data.solid
    ]
    if not solid:
        return None
    return Solid(*(np.concatenate([bodies[name][rows] for bodies, rows in solid]) for name in Solid._fields))


def _all_but(group: Group, agent: Body | None) -> npt.NDArray[np.bool_]:
    own = agent.row if agent is not None and agent.group is group else -1
    rows: npt.NDArray[np.bool_] = np.arange(len(group)) != own
    return rows


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
    founders = founders_of(data, group.number, first, count, given, abilities)
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
    if not is_drawn or is_watched(data.arena) or founders.radius is not None:
        start = starts(data.arena, [founders], data.key[np.newaxis], taken_in(data))
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
    for name in ("sensing_range", "awareness_range", "speed", "radius"):
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


def _check_apart(data: WorldData, agent: Body, place: Floats) -> None:
    """Refuse a place at which the body of an agent would overlap another or a wall."""
    group, row = agent.group, agent.row
    radius = group.bodies.radius[row : row + 1]
    if group not in data.solid or not radius[0] > 0:
        return
    here = Founders(group.number, 1, place[np.newaxis], 0.0, radius=radius)
    starts(data.arena, [here], data.key[np.newaxis], taken_in(data, agent))


def _plain(arena: Arena) -> Arena:
    """Return an arena without its obstacles."""
    return arena.arena if isinstance(arena, Obstructed) else arena


def _check_free(arena: Arena, group: Group, *, is_solid: bool) -> None:
    """Refuse an arena in whose obstacles an agent of a group would be, or its body."""
    position = group.bodies.position
    free = np.array(arena.contains(position))
    if is_solid and isinstance(arena, Obstructed):
        # Bodies may touch the walls that were there before.
        room = clearance(repeated(joined([one.faces for one in arena.obstacles]), arena.period, arena.bounds), position)
        extent = float(np.max(arena.bounds[1] - arena.bounds[0]))
        free &= room >= group.bodies.radius - SKIN * extent
    if not free.all():
        agent = group._agents[int(np.argmin(free))]
        x, y = agent.position.tolist()
        others = f", and {np.sum(~free) - 1} more" if np.sum(~free) > 1 else ""
        raise ValueError(
            f"arena={checks.shown(arena)}: {agent!r} at ({x:.4g}, {y:.4g}){others} would be in an obstacle; move it "
            "first, as in agent.position = …, or make the obstacle smaller"
        )


def _check_range(data: WorldData, sensor: Any) -> None:
    if sensor is not None and sensor.range is not None:
        data.limits.range("sensor.range", sensor.range)


def note_conditions(group: Group) -> None:
    """Note whether an agent of a group is inactive, or a sensor out of order, after its arrays were replaced."""
    works = all(channel.works.all() for channel in group.channels.values())
    group.has_conditions = group.has_conditions or not (works and group.bodies.active.all())


Integers = npt.NDArray[np.int64]

def check_not_recorded(engine: Engine, group: Group, what: str) -> None:
    """Refuse robots that do not decide at every step where their transitions are recorded."""
    if group in engine.transitions.groups:
        raise ValueError(
            f"{what}: transitions of {group.name!r} are recorded, which takes a decision of each robot at every step; "
            "record them in a world with Cycle()"
        )


def check_policies(group: Group, policies: list[Any], team: list[Group]) -> None:
    """Refuse policies that do not fit the degree of awareness of a group; see `check_fit`."""
    before = group.rules
    try:
        for policy in policies:
            put(group, rules=(policy, before[1]))
            check_fit(group, team)
    finally:
        put(group, rules=before)


def index_of(group: Group, policy: Any) -> int:
    """Return the index of a policy among those of a group; −1 if it is not known to the group."""
    for index, known in enumerate(group.policies):
        # Only dataclasses, such as those of the package, compare by their options.
        if known is policy or (type(known) is type(policy) and is_dataclass(policy) and known == policy):
            return index
    return -1


def start_again(group: Group, index: int, rows: Integers) -> None:
    """Set the state of some robots to that before the first decision of a policy."""
    size = len(group)
    fresh = take_rows(first_state(group.policies[index], size), rows, size)
    group.set_state(index, put_rows(group.states[index], rows, fresh, size))


class Undo:
    """What was there before agents are added: copies of all tables, and what is beside them.

    The ``__init__`` of an agent may add groups and agents, remove others, and write into all of them.
    """

    def __init__(self, model: Model, data: WorldData, engine: Engine) -> None:
        self._model, self._data, self._engine = model, data, engine
        # Ctrl-C may come where `Timeline.calling` cannot set it back.
        self._inside = data.timeline.inside
        self._first = model.agent_id_counter
        self._interactions = [(one, one.changes) for one in data.interactions]
        self._kept = [_Kept(group) for group in data.groups]

    def undo(self) -> None:
        """Go back."""
        with deferred():
            self._data.timeline.inside = self._inside
            added = self._data.groups[len(self._kept) :]
            del self._data.groups[len(self._kept) :]
            for agent in [agent for agent in self._model.agents if agent.unique_id >= self._first]:
                self._model.deregister_agent(agent)
                # Somebody may have kept it; its row will be another's.
                agent.row = -1
            for kept in self._kept:
                kept.put_back(self._model)
            self._model.agent_id_counter = self._first
            for group in added:
                self._engine.leave_out(group)
            self._data.interactions[:] = [one for one, _ in self._interactions]
            for one, changes in self._interactions:
                one.take(changes)
            self._engine.is_bound = False


class _Kept:
    """A group as it is: its attributes, tables and agents."""

    def __init__(self, group: Group) -> None:
        self._group = group
        self._attributes: dict[str, Any] = vars(group).copy()
        self._bodies, self._members = group.bodies.copy(), group.members.copy()
        self._lists = group._agents.copy(), group._states.copy(), group.founders.copy()
        self._channels, self._rules = group.channels.copy(), group.columns.rules()

    def put_back(self, model: Model) -> None:
        """Give the group what it had."""
        group = self._group
        vars(group).update(self._attributes)
        group.bodies.assign(self._bodies)
        group.members.assign(self._members)
        group._agents, group._states, group.founders = self._lists
        group.channels = self._channels
        group.columns.put_rules(self._rules)
        group.begin(has_decided=group.has_decided)
        for row, agent in enumerate(group._agents):
            if agent._row < 0:
                group.departed.pop(int(group.bodies.member[row]), None)
                # mesa 3.5 would give it a new number.
                identity = agent.unique_id
                model.register_agent(agent)
                agent.unique_id = identity
            agent.row = row



class WorldHost:
    """Operations of a world on its groups and agents, through which these reach their world.

    An operation that fails changes nothing: everything is checked and prepared first.
    """

    def __init__(self, model: Model, data: WorldData, engine: Engine) -> None:
        self._model, self._data, self._engine = model, data, engine

    def bind_again(self) -> None:
        """Bind all arrays again before the next step."""
        self._engine.is_bound = False

    @cached_property
    def space(self) -> WorldSpace:
        """The space of the world for mesa, made when it is first used."""
        from teamsight.agents.mesa.space import WorldSpace

        return WorldSpace(self._model, self._data)

    def add(
        self, agent_class: type[A], count: int, given: Mapping[str, Any], arguments: Mapping[str, Any]
    ) -> Group[A]:
        """Add a group; see `World.add`."""
        if not isinstance(agent_class, type) or not issubclass(agent_class, Body):
            raise TypeError(f"agent_class={checks.shown(agent_class)}: must be Robot, Target, Body or a subclass")
        size = checks.count("count", count, most=MOST_AGENTS)
        each, _ = divided(agent_class, size, arguments, given)
        group = make_group(self._data, agent_class, size, given, self)
        if agent_class.__init__ is Body.__init__:
            with deferred():
                self._data.groups.append(group)
                self._make_plain_agents(group, size)
                self._engine.is_bound = False
        else:
            with self._undoing():
                self._data.groups.append(group)
                self._make_agents(group, each)
                self._engine.is_bound = False
        self._data.sources.joined(group._agents)
        return group

    @contextmanager
    def _undoing(self) -> Iterator[None]:
        """Undo what was done if it fails: agents whose ``__init__`` is the user's may do anything."""
        undo = Undo(self._model, self._data, self._engine)
        try:
            yield
        except BaseException:
            undo.undo()
            raise

    def extend(self, group: Group, count: int, given: dict[str, Any], arguments: dict[str, Any]) -> list[Any]:
        """Add agents to a group; see `Group.add`."""
        data = self._data
        data.timeline.check_undecided("add()")
        self._check_complete(group, "add()")
        size = len(group)
        count = checks.count("count", count, most=MOST_AGENTS - size)
        new, each = newcomers(data, group, count, given, arguments)
        for other in (team := team_of(data.groups, group)):
            other.awareness.check_team(*(before + count for before in sizes_of(team)))
        if group.agent_class.__init__ is Body.__init__:
            # Nothing of it can fail.
            with deferred():
                is_moved = join(data, group, new)
                self._make_plain_agents(group, count)
                self._engine.resize(group, is_moved=is_moved)
        else:
            with self._undoing():
                with deferred():
                    join(data, group, new)
                    self._engine.resize(group, is_moved=True)
                self._make_agents(group, each)
                self._engine.is_bound = False
        data.sources.joined(group._agents[size:])
        return group._agents[size:]

    def _make_agents(self, group: Group[A], each: list[dict[str, Any]]) -> None:
        """Make the agents of the last rows of a group, each with its arguments."""
        timeline, made, model = self._data.timeline, group.agent_class, self._model
        group.is_growing = True
        with timeline.calling(timeline.inside or f"{made.__name__}.__init__"):
            for row, arguments in enumerate(each, len(group) - len(each)):
                # Its row comes first, so that __init__ can use all that an agent has.
                agent = made.__new__(made)
                attributes = agent.__dict__
                attributes["group"], attributes["_row"] = group, row
                try:
                    agent.__init__(model, **arguments)  # type: ignore[misc]
                    if "unique_id" not in attributes:
                        raise TypeError(f"{made.__name__}.__init__ must call super().__init__(model)")
                    check_names(made, attributes)
                except BaseException:
                    # Somebody may have kept it; its row will be another's.
                    attributes["_row"] = -1
                    raise
                group._agents.append(agent)
        group.is_growing = False
        # What __init__ has set is what the agents begin with, after a reset too.
        new = slice(len(group) - len(each), None)
        for name in group.members.fields:
            if name in group.bodies:
                group.members[name][group.bodies.member[new]] = group.bodies[name][new]

    def _make_plain_agents(self, group: Group[A], count: int) -> None:
        """Make agents whose class has no ``__init__`` of its own: as above, without what that could need or change."""
        made, model, init = group.agent_class, self._model, Agent.__init__
        first = len(group) - count
        for row in range(first, len(group)):
            agent = made.__new__(made)
            attributes = agent.__dict__
            attributes["group"], attributes["_row"] = group, row
            init(agent, model)
            group._agents.append(agent)
        group.bodies.identity[first:] = [agent.unique_id for agent in group._agents[first:]]

    def _check_complete(self, group: Group, what: str) -> None:
        """Refuse to change the agents of a group that are being made."""
        if group.is_growing:
            name = group.agent_class.__name__
            raise RuntimeError(f"{what}: called in {name}.__init__, while agents of {group.name!r} are made; {LATER}")
        if group not in self._data.groups:
            raise ValueError(f"{what}: {group.name!r} is not in this world; add a group with world.add")

    def adjust(self, group: Group, changes: Mapping[str, Any]) -> None:
        """Change the settings of a group; see `World.adjust`."""
        data, engine = self._data, self._engine
        data.timeline.check_undecided("adjust()")
        if group not in data.groups:
            raise ValueError(f"adjust({checks.shown(group)}): must be a group or an interaction of this world")
        known = Changes.__annotations__
        for name in changes.keys() - known.keys():
            cure = f"{checks.suggestion(name, known)}a group has {', '.join(known)}"
            raise TypeError(f"adjust(): {name}={checks.shown(changes[name])}: unknown; {cure}")
        given = {name: value for name, value in changes.items() if value is not None}
        size = len(group)
        values = abilities_of(data.limits, size, given)
        if "speed" in values and group in data.solid:
            check_steps(data, group.bodies.radius, values["speed"])
        numbers, before = None, group.rules
        if "cycle" in given:
            cycle = cycle_of(given["cycle"])
            if cycle != EVERY_STEP:
                check_not_recorded(engine, group, f"cycle={checks.shown(given['cycle'])}")
            if group.timetable or cycle != EVERY_STEP:
                numbers = cycle.numbers(size)
        policy = before[0]
        if "policy" in given:
            policy = policy_of(given["policy"], given.get("policy_options"))
            check_channels(group, policy)
        elif "policy_options" in given:
            shown = checks.shown(given["policy_options"])
            raise ValueError(f"policy_options={shown}: applies to a policy given by name; give policy too")
        awareness = awareness_of(given["awareness"]) if "awareness" in given else before[1]
        try:
            put(group, rules=(policy, awareness))
            stay = group.policies if policy is before[0] else [policy]
            team = team_of(data.groups, group)
            check_policies(group, stay, team)
            if team and "awareness" in given:
                awareness.check_team(*sizes_of(team))
            state = first_state(policy, size) if policy is not before[0] else None
        except BaseException:
            put(group, rules=before)
            raise
        with deferred():
            table = group.timetable
            if "policy" in given and policy is before[0] and table is not None and table.policy.any():
                # All robots decide by the policy of the group; those that had another begin anew.
                start_again(group, 0, np.flatnonzero(table.policy))
                table.policy[:] = 0
            for name, array in values.items():
                group.bodies[name][:] = array
            if numbers is not None:
                give_timetable(data, group, numbers)
            if policy is not before[0]:
                group.set_policies((), [state])
                if group.timetable is not None:
                    group.timetable.policy[:] = 0
                group.begin()
            engine.is_bound = False

    def adjust_one(self, agent: Body, name: str, value: float) -> None:
        """Change one ability of one agent: its speed, its turning limit, or one of its ranges."""
        row, found = agent.row, abilities_of(self._data.limits, 1, {name: value})
        if "speed" in found and agent.group in self._data.solid:
            check_steps(self._data, agent.radius, found["speed"])
        with deferred():
            for column, values in found.items():
                agent.group.bodies[column][row] = values[0]
            if name.endswith("range"):
                self._engine.is_bound = False

    def set_cycle(self, agent: Body, value: Any) -> None:
        """Give one robot a cycle that begins now; a reset goes back to that of the group."""
        data, engine = self._data, self._engine
        data.timeline.check_undecided("cycle")
        group, row = agent.group, agent.row
        cycle = cycle_of(value)
        given = cycle.numbers(1)
        if cycle != EVERY_STEP:
            check_not_recorded(engine, group, f"cycle={checks.shown(value)}")
        with deferred():
            is_new = group.timetable is None
            table = group.timetable or give_timetable(data, group, EVERY_STEP.numbers(len(group)))
            for present, one in zip(table.numbers, given, strict=True):
                present[row] = one[0]
            if table.begin(np.array([row]), data.key, data.timeline.tick) or is_new:
                engine.is_bound = False

    def set_policy(self, agent: Body, value: Any) -> None:
        """Give one robot a policy, with the policy's first state; a reset goes back to that of the group."""
        data, engine = self._data, self._engine
        data.timeline.check_undecided("policy")
        group, row = agent.group, agent.row
        policy = policy_of(value)
        if group.is_growing:
            raise RuntimeError(
                f"policy={checks.shown(value)}: set in {group.agent_class.__name__}.__init__, and a reset would not "
                "call that again; set it after world.add(…), or add a group for these agents"
            )
        index, state = index_of(group, policy), None
        if index < 0:
            check_channels(group, policy)
            check_policies(group, [policy], team_of(data.groups, group))
            state = first_state(policy, len(group))
        with deferred():
            if group.timetable is None:
                give_timetable(data, group, EVERY_STEP.numbers(len(group)))
                engine.is_bound = False
            if index >= 0:
                start_again(group, index, np.array([row]))
            else:
                index = len(group.others) + 1
                group.set_policies((*group.others, policy), [*group.states, state])
                # The buffers for noise and situations depend on all policies.
                group.begin(has_decided=group.has_decided)
                engine.is_bound = False
            assert group.timetable is not None
            group.timetable.policy[row] = index
        data.sources.note_change("switched policy", agent, policy=label(agent.policy))

    def place(self, agent: Body, position: npt.ArrayLike) -> None:
        """Move an agent to a position in the arena."""
        group, row = agent.group, agent.row
        place = checked_positions(self._data.arena, position, (2,))
        _check_apart(self._data, agent, place)
        with deferred():
            group.bodies.position[row] = place
            self._engine.is_seen = False

    def change_obstacles(self, arena: Any) -> None:
        """Put other obstacles into the arena; see `World.arena`."""
        data = self._data
        data.timeline.check_undecided("arena")
        if not isinstance(arena, Arena) or _plain(arena) != _plain(data.arena):
            raise ValueError(
                f"arena={checks.shown(arena)}: only the obstacles in {_plain(data.arena)} can be changed in a run, as "
                "in world.arena = world.arena.with_obstacles(Circle((1, 0), 0.5)); otherwise build another world"
            )
        if not isinstance(data.contact, Pass):
            contact_of(data.contact, arena)
        for group in data.groups:
            _check_free(arena, group, is_solid=group in data.solid)
        for one in data.interactions:
            one.interaction.check_fit(arena, tuple(sorted(one.roles, key=lambda role: one.roles[role].number)))
        with deferred():
            data.put_arena(arena)
            self._engine.is_bound = False

    def turn(self, agent: Body, heading: npt.NDArray[np.float64]) -> None:
        """Set the heading of an agent, a unit vector."""
        with deferred():
            agent.group.bodies.heading[agent.row] = heading
            self._engine.is_seen = False

    def remove(self, agent: Body, leave: Callable[[], None]) -> None:
        """Remove an agent from the arrays of its group; `leave` removes it from mesa's sets."""
        self._data.timeline.check_undecided("remove()")
        self._check_complete(agent.group, "remove()")
        group, size, row = agent.group, len(agent.group), agent.row
        member = int(group.bodies.member[row])
        keep = np.arange(size) != row
        states = [
            None if group.is_in_table(index) else take_rows(state, keep, size)
            for index, state in enumerate(group.states)
        ]
        # Nothing after this can fail.
        leave()
        group.bodies.remove(row)
        for index, state in enumerate(states):
            if not group.is_in_table(index):
                group.set_state(index, state)
        group._agents.pop(row)
        for place in range(row, size - 1):
            group._agents[place].row = place
        agent.row = -1
        group.departed[member] = agent
        self._engine.resize(group)
        self._data.sources.left(agent, member)

    def find_neighbours(self) -> tuple[int, int]:
        """Update all neighbour lists; return a value that changes whenever anything may have moved."""
        self._engine.prepare()
        return self._data.timeline.tick, self._engine.searches

    def perceive(self, group: Group) -> None:
        """Let a group perceive the present; see `Group.perceived`."""
        self._engine.perceive(group)

    def decide(self, agent: Body, percept: PerceptOfOne, rng: np.random.Generator) -> tuple[float, float]:
        """Return (turn [rad], distance [length]) that the policy of an agent's group decides on a percept."""
        row, group = agent.row, agent.group
        # A policy can also be called between steps; its new state is dropped.
        under_way = self._engine.deliberations.get(group)
        deliberation = under_way or Deliberation(group, self._data.timeline.tick, self._data.key)
        return deliberation.policy_decides(row, percept, rng)

    def observers_of(self, agent: Body, *, counted: bool = False) -> list[Body]:
        """Return the agents that sense this one in a channel other than "teammates", or in one that counts."""
        self._engine.prepare()
        sensing = [one for one in self._engine.relations if (one.counts if counted else one.name != TEAMMATES)]
        # One that senses it in two channels is one observer.
        return list(dict.fromkeys(observer for one in sensing for observer in one.observers_of(agent)))

    def set_active(self, agent: Body, active: bool) -> None:
        """Let an agent take part, or not; neighbour lists show it at once."""
        # A mask of NumPy's has elements of its own type.
        active = checks.flag("active", bool(active) if isinstance(active, np.bool_) else active)
        if self.switch(agent, agent.group.bodies.active, active, "active", None):
            self._data.sources.note_change("active" if active else "inactive", agent)

    def switch(self, agent: Body, column: npt.NDArray[np.bool_], on: bool, what: str, channel: str | None) -> bool:
        """Set the element of an agent in a column, and call the sources; return whether that has changed it."""
        group, row = agent.group, agent.row
        self._data.timeline.check_undecided(what)
        self._data.sources.switched(agent, channel, on)
        if is_changed := bool(column[row] != on):
            with deferred():
                column[row] = on
                if not group.has_conditions:
                    group.has_conditions, self._engine.is_bound = True, False
                self._engine.is_seen = False
        return is_changed

    def set_sensor(self, channel: Channel, sensor: Sensor | None) -> None:
        """Replace the sensor of a channel from the next step on."""
        data, engine = self._data, self._engine
        data.timeline.check_undecided("sensors[…]")
        _check_range(data, sensor)
        with deferred():
            channel.sensor = sensor
            engine.is_bound = False

    def declare(self, groups: tuple[Group, Group], name: str, sensor: Sensor | None, counts: bool | None) -> None:
        """Let the first of two groups sense the other in the channel `name`; see `World.senses`."""
        data, engine = self._data, self._engine
        data.timeline.check_undecided("senses()")
        observers, observed = groups
        for group in groups:
            data.check_group(group, "senses({})")
        before = observers.channels.get(name) if isinstance(name, str) else None
        is_team = observers.team is not None
        channel = changed(before, name, sensor, counts, on_team=is_team, bodies=observers.bodies)
        _check_range(data, channel.sensor)
        if observed not in channel.observed:
            channel.observed.append(observed)
        with deferred():
            observers.channels[name] = channel
            engine.is_bound = False
