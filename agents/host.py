"""The host of groups and agents: it adds, changes, moves and removes them."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import mesa
import numpy as np
import numpy.typing as npt

from teamsight.agents import building, mesa_compat
from teamsight.agents.body import Body
from teamsight.agents.building import Plan, column, turn_columns
from teamsight.agents.channel import TEAMMATES, Channel
from teamsight.agents.engine.engine import Engine
from teamsight.agents.engine.python_policies import Deliberation
from teamsight.agents.engine.state_rows import take_rows
from teamsight.agents.group import Group, first_state, team_of
from teamsight.agents.resolve import awareness_of, check_channels, check_fit, policy_of
from teamsight.agents.senses import set_sensor
from teamsight.agents.sensing.sensor import Sensor
from teamsight.agents.world_data import WorldData
from teamsight.core import checks
from teamsight.core.interrupts import deferred
from teamsight.policies.compiled import CompiledPolicy, check_state
from teamsight.policies.percept_of_one import PerceptOfOne


class WorldHost:
    """Operations of a world on its groups and agents; implements `Host`, through which these reach their world.

    An operation that fails changes nothing: everything is checked and prepared first.
    """

    def __init__(self, model: mesa.Model, data: WorldData, engine: Engine) -> None:
        self._model, self._data, self._engine = model, data, engine

    def add(self, agent_class: type[Body], count: int, plan: Plan) -> Group:
        """Add a group; see `World.add`. The identities of its agents are their ``unique_id``."""
        model, groups = self._model, self._data.groups
        group = building.make_group(self._data, agent_class, count, plan, self)
        first, before = mesa_compat.next_identity(model), len(groups)
        try:
            groups.append(group)
            group.agents = [agent_class(model, group, row) for row in range(len(group))]
            group.bodies.identity[:] = [agent.unique_id for agent in group.agents]
            group.decides_alone = agent_class.decide is not Body.decide
            self._engine.is_bound = False
        except BaseException:
            with deferred():
                # The __init__ of an agent may have added groups too.
                added = groups[before:]
                del groups[before:]
                # mesa has also registered the agent whose __init__ failed.
                for agent in [agent for agent in model.agents if vars(agent).get("group") in added]:
                    model.deregister_agent(agent)
                mesa_compat.set_next_identity(model, first)
                for other in added:
                    self._engine.leave_out(other)
            raise
        return group

    def adjust(self, group: Group, **changes: Any) -> None:
        """Change the settings of a group; see `World.adjust`."""
        self._data.timeline.check_undecided("adjust()", "plan it with world.clock.at(world.clock.now, …)")
        if group not in self._data.groups:
            raise ValueError(f"adjust({checks.shown(group)}): the group must have been added to this world")
        given = {name: value for name, value in changes.items() if value is not None}
        size, limits, bodies = len(group), self._data.limits, group.bodies
        ranges = [
            column(name, given[name], size, limits.range) if name in given else before
            for name, before in zip(("sensing_range", "awareness_range"), group.ranges, strict=True)
        ]
        speed = column("speed", given["speed"], size, limits.speed) if "speed" in given else bodies.speed
        turning = bodies.turn_cosine, bodies.turn_sine
        if "turn_limit" in given:
            turning = turn_columns(given["turn_limit"], size)
        policy, awareness = before = group.rules
        if "awareness" in given:
            awareness = awareness_of(given["awareness"])
        if "policy" in given:
            policy = policy_of(given["policy"], given.get("policy_options"))
            check_channels(group, policy)
        elif "policy_options" in given:
            shown = checks.shown(given["policy_options"])
            raise ValueError(f"policy_options={shown}: applies to a policy given by name; give policy too")
        try:
            group.rules = policy, awareness
            check_fit(group, team_of(self._data.groups, group))
            state = first_state(policy, size) if policy is not before[0] else None
        except BaseException:
            group.rules = before
            raise
        with deferred():
            group.ranges = ranges[0], ranges[1]
            bodies.speed, (bodies.turn_cosine, bodies.turn_sine) = speed, turning
            if policy is not before[0]:
                group.begin(state)
            self._engine.is_bound = False

    def adjust_one(self, agent: Body, name: str, value: float) -> None:
        """Change one ability of one agent: its speed, its turning limit, or one of its ranges."""
        group, row, bodies, limits = agent.group, agent.row, agent.group.bodies, self._data.limits
        if name == "turn_limit":
            (cosine,), (sine,) = turn_columns(value, 1)
            with deferred():
                bodies.turn_cosine[row], bodies.turn_sine[row] = cosine, sine
            return
        number = column(name, value, 1, limits.speed if name == "speed" else limits.range)[0]
        if name == "speed":
            bodies.speed[row] = number
        else:
            with deferred():
                group.ranges[name == "awareness_range"][row] = number
                self._engine.is_bound = False

    def place(self, agent: Body, position: npt.ArrayLike) -> None:
        """Move an agent to a position in the arena."""
        group, row = agent.group, agent.row
        place = building.checked_positions(self._data.arena, position, (2,))
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
        group, size, row = agent.group, len(agent.group), agent.row
        keep = np.arange(size) != row
        state = take_rows(group.policy_state, keep, size)
        if isinstance(group.policy, CompiledPolicy):
            check_state(group.policy, state, size - 1)
        columns = {name: array[keep] for name, array in group.columns.arrays().items()}
        # Nothing after this can fail.
        leave()
        group.bodies = group.bodies.rows(keep)
        group.ranges = group.ranges[0][keep], group.ranges[1][keep]
        group.columns.replace(columns)
        group.agents.pop(row)
        for place, other in enumerate(group.agents):
            other.row = place
        group.begin(state)
        self._engine.is_bound = False

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

    def observers_of(self, agent: Body) -> list[Any]:
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

    def set_sensor(self, channel: Channel, sensor: Sensor | None) -> None:
        """Replace the sensor of a channel; None makes it perfect."""
        set_sensor(self._data, self._engine, channel, sensor)
