"""The host of groups and agents: it adds, changes, moves and removes them."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from functools import cached_property
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np
import numpy.typing as npt

from teamsight.agents.attributes import put
from teamsight.agents.body import Body, checked_positions
from teamsight.agents.building import (
    abilities_of,
    check_names,
    divided,
    join,
    make_group,
    newcomers,
)
from teamsight.agents.channel import TEAMMATES, changed, channel_of
from teamsight.agents.decisions import EVERY_STEP, cycle_of, give_timetable
from teamsight.agents.engine.python_policies import Deliberation
from teamsight.agents.group import Changes, Group, team_of
from teamsight.agents.mesa import compat as mesa_compat
from teamsight.agents.mesa.compat import Agent
from teamsight.agents.policy_state import first_state, put_rows, take_rows
from teamsight.agents.resolve import awareness_of, check_channels, check_fit, policy_of
from teamsight.agents.settings import MOST_AGENTS
from teamsight.core import checks
from teamsight.core.interrupts import deferred
from teamsight.policies.registry import label

if TYPE_CHECKING:
    from teamsight.agents.channel import Channel
    from teamsight.agents.decisions import CycleNumbers
    from teamsight.agents.engine.engine import Engine
    from teamsight.agents.mesa.compat import Model
    from teamsight.agents.mesa.space import WorldSpace
    from teamsight.agents.sensing.sensor import Sensor
    from teamsight.agents.world_data import WorldData
    from teamsight.policies.percept_of_one import PerceptOfOne


def _check_range(data: WorldData, sensor: Any) -> None:
    if sensor is not None and sensor.range is not None:
        data.limits.range("sensor.range", sensor.range)


def note_conditions(group: Group) -> None:
    """Note whether an agent of a group is inactive, or a sensor out of order, after its arrays were replaced."""
    works = all(channel.works.all() for channel in group.channels.values())
    group.has_conditions = group.has_conditions or not (works and group.bodies.active.all())


Integers = npt.NDArray[np.int64]

_WHEN = "plan it with world.clock.at(world.clock.now, …)"


def check_not_recorded(engine: Engine, group: Group, what: str) -> None:
    """Refuse robots that do not decide at every step where their transitions are recorded."""
    if group in engine.transitions.groups:
        raise ValueError(
            f"{what}: transitions of {group.name!r} are recorded, which takes a decision of each robot at every step; "
            "record them in a world with Cycle()"
        )


def numbers_of_cycle(engine: Engine, group: Group, value: Any) -> CycleNumbers | None:
    """Return another cycle of a group, robot by robot; None if it goes on without a timetable."""
    cycle = cycle_of(value)
    if cycle != EVERY_STEP:
        check_not_recorded(engine, group, f"cycle={checks.shown(value)}")
    return cycle.numbers(len(group)) if group.timetable or cycle != EVERY_STEP else None


def check_policies(group: Group, policies: list[Any], team: list[Group]) -> None:
    """Refuse policies that do not fit the degree of awareness of a group; see `check_fit`."""
    before = group.rules
    try:
        for policy in policies:
            put(group, rules=(policy, before[1]))
            check_fit(group, team)
    finally:
        put(group, rules=before)


def back_to_group(group: Group) -> None:
    """Let all robots decide by the policy of the group; those that had another begin anew."""
    table = group.timetable
    if table is not None and table.policy.any():
        start_again(group, 0, np.flatnonzero(table.policy))
        table.policy[:] = 0


def index_of(group: Group, policy: Any) -> int:
    """Return the index of a policy among those of a group; −1 if it is not known to the group."""
    for index, known in enumerate(group.policies):
        if known is policy or (type(known) is type(policy) and _is_equal(known, policy)):
            return index
    return -1


def _is_equal(one: Any, other: Any) -> bool:
    # Only dataclasses, such as those of the package, compare by their options.
    return bool(hasattr(type(one), "__dataclass_fields__") and one == other)


def start_again(group: Group, index: int, rows: Integers) -> None:
    """Set the state of some robots to that before the first decision of a policy."""
    size = len(group)
    fresh = take_rows(first_state(group.policies[index], size), rows, size)
    group.set_state(index, put_rows(group.states[index], rows, fresh, size))


def _policy_given(group: Group, given: dict[str, Any]) -> Any:
    """Return the new policy of a group; without one its present."""
    if "policy" in given:
        policy = policy_of(given["policy"], given.get("policy_options"))
        check_channels(group, policy)
        return policy
    if "policy_options" in given:
        shown = checks.shown(given["policy_options"])
        raise ValueError(f"policy_options={shown}: applies to a policy given by name; give policy too")
    return group.rules[0]


class Undo:
    """What was there before agents are added: copies of all tables, and what is beside them.

    The ``__init__`` of an agent may add groups and agents, remove others, and write into all of them.
    """

    def __init__(self, model: Model, data: WorldData, engine: Engine) -> None:
        self._model, self._data, self._engine = model, data, engine
        # Ctrl-C may come where `Timeline.calling` cannot set it back.
        self._inside = data.timeline.inside
        self._first = mesa_compat.next_identity(model)
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
            mesa_compat.set_next_identity(self._model, self._first)
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


A = TypeVar("A", bound=Body)


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

    def agents_near(self, agent: Body, radius: float) -> tuple[list[Any], npt.NDArray[np.float64]]:
        """Return the other agents within a radius of an agent, and their distances."""
        return self.space.get_neighbors_in_radius(agent, radius)

    def nearest_agents(self, agent: Body, count: int) -> tuple[list[Any], npt.NDArray[np.float64]]:
        """Return the other agents that are nearest to an agent, and their distances."""
        return self.space.get_nearest_neighbors(agent, count)

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
        data.timeline.check_undecided("add()", "plan it with world.clock.at(world.clock.now, group.add)")
        self._check_complete(group, "add()")
        size = len(group)
        count = checks.count("count", count, most=MOST_AGENTS - size)
        new, each = newcomers(data, group, count, given, arguments)
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
            raise RuntimeError(f"{what}: called in {name}.__init__, while agents of {group.name!r} are made; {_WHEN}")
        if group not in self._data.groups:
            raise ValueError(f"{what}: {group.name!r} is not in this world; add a group with world.add")

    def adjust(self, group: Group, changes: Mapping[str, Any]) -> None:
        """Change the settings of a group; see `World.adjust`."""
        data, engine = self._data, self._engine
        data.timeline.check_undecided("adjust()", _WHEN)
        if group not in data.groups:
            raise ValueError(f"adjust({checks.shown(group)}): must be a group or an interaction of this world")
        known = Changes.__annotations__
        for name in changes.keys() - known.keys():
            cure = f"{checks.suggestion(name, known)}a group has {', '.join(known)}"
            raise TypeError(f"adjust(): {name}={checks.shown(changes[name])}: unknown; {cure}")
        given = {name: value for name, value in changes.items() if value is not None}
        size = len(group)
        values = abilities_of(data.limits, size, given)
        numbers = numbers_of_cycle(engine, group, given["cycle"]) if "cycle" in given else None
        before, policy = group.rules, _policy_given(group, given)
        awareness = awareness_of(given["awareness"]) if "awareness" in given else before[1]
        try:
            put(group, rules=(policy, awareness))
            stay = group.policies if policy is before[0] else [policy]
            check_policies(group, stay, team_of(data.groups, group))
            state = first_state(policy, size) if policy is not before[0] else None
        except BaseException:
            put(group, rules=before)
            raise
        with deferred():
            if "policy" in given and policy is before[0]:
                back_to_group(group)
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
        with deferred():
            for column, values in found.items():
                agent.group.bodies[column][row] = values[0]
            if name.endswith("range"):
                self._engine.is_bound = False

    def set_cycle(self, agent: Body, value: Any) -> None:
        """Give one robot a cycle that begins now; a reset goes back to that of the group."""
        data, engine = self._data, self._engine
        data.timeline.check_undecided("cycle", _WHEN)
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
        data.timeline.check_undecided("policy", _WHEN)
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
        with deferred():
            group.bodies.position[row] = place
            self._engine.is_seen = False

    def turn(self, agent: Body, heading: npt.NDArray[np.float64]) -> None:
        """Set the heading of an agent, a unit vector."""
        with deferred():
            agent.group.bodies.heading[agent.row] = heading
            self._engine.is_seen = False

    def remove(self, agent: Body, leave: Callable[[], None]) -> None:
        """Remove an agent from the arrays of its group; `leave` removes it from mesa's sets."""
        self._data.timeline.check_undecided("remove()", "plan it with world.clock.at(world.clock.now, robot.remove)")
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

    def observers_of(self, agent: Body) -> list[Body]:
        """Return the agents that sense this one in a channel other than "teammates"."""
        self._engine.prepare()
        sensing = [relation for relation in self._engine.relations if relation.name != TEAMMATES]
        found = [observer for relation in sensing for observer in relation.observers_of(agent)]
        # One that senses it in two channels is one observer.
        return list(dict.fromkeys(found))

    def is_observed(self, agent: Body) -> bool:
        """Whether an agent is sensed in a channel that counts in the observed fraction."""
        self._engine.prepare()
        return any(relation.observers_of(agent) for relation in self._engine.relations if relation.counts)

    def set_active(self, agent: Body, active: bool) -> None:
        """Let an agent take part, or not; neighbour lists show it at once."""
        # A mask of NumPy's has elements of its own type.
        active = checks.flag("active", bool(active) if isinstance(active, np.bool_) else active)
        if self._switch(agent, agent.group.bodies.active, active, "active", None):
            self._data.sources.note_change("active" if active else "inactive", agent)

    def set_works(self, agent: Body, channel: str, works: bool) -> None:
        """Put one agent's sensor of a channel in order, or out of order; neighbour lists show it at once."""
        what = "repair_sensor()" if works else "break_sensor()"
        self._switch(agent, channel_of(agent.group, channel).works, works, what, channel)

    def _switch(self, agent: Body, column: npt.NDArray[np.bool_], on: bool, what: str, channel: str | None) -> bool:
        """Set the element of an agent in a column, and call the sources; return whether that has changed it."""
        group, row = agent.group, agent.row
        self._data.timeline.check_undecided(what, _WHEN)
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
        data.timeline.check_undecided("sensors[…]", _WHEN)
        _check_range(data, sensor)
        with deferred():
            channel.sensor = sensor
            engine.is_bound = False

    def declare(self, groups: tuple[Group, Group], name: str, sensor: Sensor | None, counts: bool | None) -> None:
        """Let the first of two groups sense the other in the channel `name`; see `World.senses`."""
        data, engine = self._data, self._engine
        data.timeline.check_undecided("senses()", "declare it before the run, or by world.clock.at(world.clock.now, …)")
        observers, observed = groups
        for group in groups:
            if not isinstance(group, Group):
                given = checks.shown(group)
                raise TypeError(f"senses({given}): give a group, not a list or an agent; world.add returns it")
            if group not in data.groups:
                shown = f"senses({checks.shown(observers)}, {checks.shown(observed)})"
                raise ValueError(f"{shown}: both groups must have been added to this world")
        before = observers.channels.get(name) if isinstance(name, str) else None
        is_team = observers.team is not None
        channel = changed(before, name, sensor, counts, on_team=is_team, bodies=observers.bodies)
        _check_range(data, channel.sensor)
        if observed not in channel.observed:
            channel.observed.append(observed)
        with deferred():
            observers.channels[name] = channel
            engine.is_bound = False
