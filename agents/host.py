"""The host of groups and agents: it adds, changes, moves and removes them."""

from __future__ import annotations

from collections.abc import Callable
from functools import cached_property
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np
import numpy.typing as npt

from teamsight.agents import building
from teamsight.agents.adjusting import adjust, adjust_one
from teamsight.agents.arguments import OWN_OF_GROUP, divided
from teamsight.agents.arrivals import extended, join
from teamsight.agents.body import Body
from teamsight.agents.building import Plan, check_names
from teamsight.agents.channel import TEAMMATES, Channel
from teamsight.agents.condition import set_active, set_works
from teamsight.agents.decisions.timetabling import (
    set_cycle_of_one,
    set_policy_of_one,
)
from teamsight.agents.engine.engine import Engine
from teamsight.agents.engine.python_policies import Deliberation
from teamsight.agents.engine.state_rows import take_rows
from teamsight.agents.fixed import put
from teamsight.agents.group import Group
from teamsight.agents.mesa_bases import Agent, Model
from teamsight.agents.places import checked_positions
from teamsight.agents.senses import set_sensor
from teamsight.agents.sensing.sensor import Sensor
from teamsight.agents.undo import Undo
from teamsight.agents.world_data import WorldData
from teamsight.core import checks
from teamsight.core.interrupts import deferred
from teamsight.policies.compiled import CompiledPolicy, check_state
from teamsight.policies.interface import Action
from teamsight.policies.percept_of_one import PerceptOfOne
from teamsight.policies.registry import label
from teamsight.world.bodies import Abilities

A = TypeVar("A", bound=Body)

if TYPE_CHECKING:
    from teamsight.agents.space import WorldSpace


class WorldHost:
    """Operations of a world on its groups and agents; implements `Host`, through which these reach their world.

    An operation that fails changes nothing: everything is checked and prepared first.
    """

    def __init__(self, model: Model, data: WorldData, engine: Engine) -> None:
        self._model, self._data, self._engine = model, data, engine

    @cached_property
    def space(self) -> WorldSpace:
        """The space of the world for mesa, made when it is first used."""
        from teamsight.agents.space import WorldSpace

        return WorldSpace(self._model, self._data)

    def agents_near(self, agent: Body, radius: float) -> tuple[list[Any], npt.NDArray[np.float64]]:
        """Return the other agents within a radius of an agent, and their distances."""
        return self.space.get_neighbors_in_radius(agent, radius)

    def nearest_agents(self, agent: Body, count: int) -> tuple[list[Any], npt.NDArray[np.float64]]:
        """Return the other agents that are nearest to an agent, and their distances."""
        return self.space.get_nearest_neighbors(agent, count)

    def add(self, agent_class: type[A], size: int, plan: Plan, each: list[dict[str, Any]]) -> Group[A]:
        """Add a group; see `World.add`. `each` has the arguments of each agent's ``__init__``."""
        group = building.make_group(self._data, agent_class, size, plan, self)
        undo = Undo(self._model, self._data, self._engine)
        try:
            self._data.groups.append(group)
            self._make_agents(group, each)
            self._engine.is_bound = False
        except BaseException:
            undo.undo()
            raise
        self._data.sources.joined(group._agents)
        return group

    def extend(self, group: Group[A], count: int, given: dict[str, Any], arguments: dict[str, Any]) -> list[A]:
        """Add agents to a group; see `Group.add`."""
        data = self._data
        data.timeline.check_undecided("add()", "plan it with world.clock.at(world.clock.now, group.add)")
        self._check_complete(group, "add()")
        size, count = len(group), checks.count("count", count, most=building.MOST_AGENTS)
        own = divided(group.agent_class, count, arguments, OWN_OF_GROUP, group.columns)
        new = extended(data, group, count, given, own.columns)
        undo = Undo(self._model, data, self._engine)
        try:
            with deferred():
                join(group, new)
                self._engine.is_bound = False
            self._make_agents(group, own.each)
            self._engine.is_bound = False
        except BaseException:
            undo.undo()
            raise
        data.sources.joined(group[size:])
        return group[size:]

    def _make_agents(self, group: Group[A], each: list[dict[str, Any]]) -> None:
        """Make the agents of the last rows of a group, each with its arguments."""
        timeline, made, model = self._data.timeline, group.agent_class, self._model
        if made.__init__ is Body.__init__:
            self._make_plain_agents(group, len(each))
            return
        group.is_growing = True
        with timeline.calling(timeline.inside or f"{made.__name__}.__init__"):
            for row, arguments in enumerate(each, len(group) - len(each)):
                # Its row comes first, so that __init__ can use all that an agent has.
                agent = made.__new__(made)
                attributes = agent.__dict__
                attributes["group"], attributes["_row"] = group, row
                agent.__init__(model, **arguments)  # type: ignore[misc]
                if "unique_id" not in attributes:
                    raise TypeError(f"{made.__name__}.__init__ must call super().__init__(model)")
                check_names(made, attributes)
                group._agents.append(agent)
        group.is_growing = False
        # What __init__ has set is what the agents begin with, after a reset too.
        if group.timetable is not None:
            group.timetable.note_first(group.bodies.member, len(each))
        bodies, first = group.bodies, group.first_abilities
        present = Abilities(bodies.speed, bodies.turn_cosine, bodies.turn_sine, *group.ranges)
        for array, values in zip(first, present, strict=True):
            array[len(array) - len(each) :] = values[len(values) - len(each) :]

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
            raise RuntimeError(
                f"{what}: called in {name}.__init__, while agents of {group.name!r} are made; plan it with "
                "world.clock.at(world.clock.now, …)"
            )
        if group not in self._data.groups:
            raise ValueError(f"{what}: {group.name!r} is not in this world; add a group with world.add")

    def adjust(self, group: Group, **changes: Any) -> None:
        """Change the settings of a group; see `World.adjust`."""
        adjust(self._data, self._engine, group, changes)

    def adjust_one(self, agent: Body, name: str, value: float) -> None:
        """Change one ability of one agent: its speed, its turning limit, or one of its ranges."""
        adjust_one(self._data, self._engine, agent, name, value)

    def set_cycle(self, agent: Body, value: Any) -> None:
        """Give one agent a cycle of its own."""
        set_cycle_of_one(self._data, self._engine, agent, value)

    def set_policy(self, agent: Body, value: Any) -> None:
        """Give one agent a policy of its own."""
        set_policy_of_one(self._data, self._engine, agent, value)
        self._data.sources.note_change("switched policy", agent, policy=label(agent.policy))

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
        state = take_rows(group.policy_state, keep, size)
        if isinstance(group.policy, CompiledPolicy):
            check_state(group.policy, state, size - 1)
        others = [other.rows(keep, size) for other in group.others]
        columns = {name: array[keep] for name, array in group.columns.arrays().items()}
        decided = group.decided and Action(*(array[keep] for array in group.decided))
        # Nothing after this can fail.
        leave()
        group.bodies = group.bodies.rows(keep)
        for channel in group.channels.values():
            channel.works = channel.works[keep]
        group.ranges = group.ranges[0][keep], group.ranges[1][keep]
        group.columns.replace(columns)
        put(group, others=tuple(others))
        if group.timetable is not None:
            put(group, timetable=group.timetable.rows(keep))
        group._agents.pop(row)
        for place in range(row, size - 1):
            group._agents[place].row = place
        agent.row = -1
        group.departed[member] = agent
        group.begin(state, decided)
        self._engine.is_bound = False
        self._data.sources.left(agent, member)

    def find_neighbours(self) -> tuple[int, int]:
        """Update all neighbour lists; return a value that changes whenever anything may have moved."""
        self._engine.prepare()
        return self._data.timeline.tick, self._engine.searches

    def perceive(self, group: Group) -> None:
        """Update ``group.percept``."""
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
        """Let an agent take part, or not."""
        set_active(self._data, self._engine, agent, active)

    def set_works(self, agent: Body, channel: str, works: bool) -> None:
        """Put one agent's sensor of a channel in order, or out of order."""
        set_works(self._data, self._engine, agent, channel, works)

    def set_sensor(self, channel: Channel, sensor: Sensor | None) -> None:
        """Replace the sensor of a channel; None makes it perfect."""
        set_sensor(self._data, self._engine, channel, sensor)
