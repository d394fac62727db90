"""Batteries, which drain as agents move, decide, and wait."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from teamsight.agents.columns import Column
from teamsight.agents.components.disabling import Disabling
from teamsight.agents.components.drain import EMPTY, LOW, Drain
from teamsight.agents.events.agent_left import AgentLeftError
from teamsight.core import checks

if TYPE_CHECKING:
    from teamsight.agents.body import Body

#: The column with the charge of each agent.
BATTERY = "battery"


class Batteries(Disabling):
    """Each agent has a battery; one whose battery is empty is inactive until it is charged.

    The charge is the column "battery" of the group: ``robot.battery``, ``robots.battery``. It can be set, from 0 to
    the capacity; what follows from it, follows after the next step. All batteries are full when the source is attached
    and at each reset, and those of agents that come later are, unless ``group.add(battery=…)`` says otherwise. The log
    says "low" and "empty".

    Parameters
    ----------
    capacity : float
        The charge of a full battery [charge], above 0.
    per_distance : float
        Drain for each unit of length moved [charge / length], at least 0.
    per_tick, per_decision : float
        Drain in each step and for each decision of an active agent [charge], at least 0.
    low_level : float, optional
        The charge from which on downwards a battery is low [charge], less than the capacity; by default a fifth of it.

    Raises
    ------
    TypeError, ValueError
        If a value is not a number or outside its limits; when attached, if the agents have an attribute "battery".

    Notes
    -----
    The charge after a step is that before it, less the drain of that step; below a billionth of the capacity it is 0.
    So a battery becomes empty at a whole tick, and its agent is inactive from that tick on. A compiled watcher, the
    attribute `drain`, computes it; a run is interrupted only where a battery becomes low or empty. `ChargingPlaces`
    charge batteries.
    """

    def __init__(
        self,
        capacity: float,
        per_distance: float = 1.0,
        per_tick: float = 0.0,
        per_decision: float = 0.0,
        low_level: float | None = None,
    ) -> None:
        self.capacity = checks.number("capacity", capacity, above=0, cure="leave Batteries out for no limit")
        self.per_distance = checks.number("per_distance", per_distance, least=0, cure="0 is no drain")
        self.per_tick = checks.number("per_tick", per_tick, least=0, cure="0 is no drain")
        self.per_decision = checks.number("per_decision", per_decision, least=0, cure="0 is no drain")
        if not self.per_distance + self.per_tick + self.per_decision:
            raise ValueError(
                f"per_distance={per_distance:g}, per_tick={per_tick:g}, per_decision={per_decision:g}: nothing drains "
                "the batteries; give one of them above 0"
            )
        self.low_level = 0.2 * self.capacity if low_level is None else checks.number("low_level", low_level, least=0)
        if self.low_level >= self.capacity:
            raise ValueError(f"low_level={self.low_level:g}: must be less than the capacity, {self.capacity:g}")

    def connect(self) -> None:
        """Add the column, and watch."""
        group = self._its_group()
        if "drain" not in vars(self):
            group.add_column(BATTERY, self.capacity)
            rates = (self.capacity, self.low_level, self.per_distance, self.per_tick, self.per_decision)
            self.drain = Drain(group, BATTERY, rates, self._report)
        elif BATTERY in group.columns:
            # A state has brought it back, but not the charge of agents that come later.
            group.columns.create(BATTERY, group.columns.array(BATTERY), self.capacity)
        else:
            group.add_column(BATTERY, self.capacity)
        group.columns.limit(BATTERY, self._check_charge)
        self.world._engine.watch(self.drain)

    def disconnect(self) -> None:
        """Remove the column, and watch no longer."""
        # If the column could not be added, there is one of the user's.
        if "drain" in vars(self):
            self.world._engine.unwatch(self.drain)
            self._its_group().columns.pop(BATTERY, None)

    def begin(self) -> None:
        """Fill all batteries."""
        super().begin()
        self._its_group().columns.assign(BATTERY, ..., self.capacity)
        self.drain.begin()
        # The levels of which events have been planned, by member.
        self._reported = self.drain.level.copy()
        # The SimPy events for which users wait, by member and level.
        self._awaited: dict[tuple[int, int], Any] = {}

    @property
    def charge(self) -> Column:
        """The charge of each agent, shape (n,) [charge]: the column "battery" of the group."""
        return self._its_group().columns[BATTERY]

    def low(self, agent: Body) -> Any:
        """Return a SimPy event that happens when the battery of an agent is low; at once if it is already.

        If the agent leaves the world before, waiting raises `AgentLeftError`; so for `empty`.
        """
        return self._event(agent, LOW)

    def empty(self, agent: Body) -> Any:
        """Return a SimPy event that happens when the battery of an agent is empty; at once if it is already."""
        return self._event(agent, EMPTY)

    def level(self, member: int) -> int:
        """Return the level of the battery of a member: 0 for enough, 1 for low, 2 for empty."""
        return int(self.drain.level[member])

    def supply(self, member: int, per_step: float) -> None:
        """Charge the battery of a member by this much in each step, in place of its drain; 0 ends that."""
        self.drain.make_room()
        self.drain.supply[member] = per_step

    def set_charge(self, member: int, charge: float) -> None:
        """Set the charge of a member; it becomes active at once if only its battery has kept it inactive."""
        self.charge[self.row(member)] = charge
        if charge > 0:
            self.enable(member)

    def reach(self, member: int, before: int, level: int) -> None:
        """Act on a level that the battery of an agent has fallen to, or risen to."""
        agent = self.agent(member)
        if agent is None:
            return
        if level == EMPTY:
            self.disable(member)
            self.log("empty", agent)
        else:
            self.enable(member)
            if before < level:
                self.log("low", agent)
        for reached in range(LOW, level + 1):
            event = self._awaited.pop((member, reached), None)
            if event is not None:
                event.succeed(agent)
        if level >= LOW:
            for source in self.world.sources:
                if source.group is self.group and isinstance(source, NeedsCharge):
                    source.is_low(member)

    def left(self, agent: Body, member: int) -> None:
        """Forget an agent that has left; processes that wait for its battery get an `AgentLeftError`."""
        super().left(agent, member)
        for level, name in ((LOW, "low"), (EMPTY, "empty")):
            event = self._awaited.pop((member, level), None)
            if event is not None and not event.triggered:
                # An event that nobody waits for must not stop the run; processes get the error nevertheless.
                event.defused = True
                event.fail(AgentLeftError(f"{name}({agent!r}): it has left the world, and its battery with it"))

    def save(self) -> Any:
        """Return the levels, and who is being charged or inactive."""
        return self.drain.level.copy(), self.drain.supply.copy(), self._reported.copy(), super().save()

    def load(self, data: Any) -> None:
        """Go back to what `save` returned."""
        level, supply, reported, disabled = data
        self.drain.level, self.drain.supply, self._reported = level.copy(), supply.copy(), reported.copy()
        super().load(disabled)
        self._awaited = {}

    def _check_charge(self, charge: npt.NDArray[Any]) -> None:
        """Refuse charges that a battery cannot have. What is no number at all, columns refuse."""
        given = np.ravel(charge) if charge.dtype.kind in "iuf" else np.zeros(0)
        wrong = given[~((given >= 0) & (given <= self.capacity))]
        if len(wrong):
            raise ValueError(
                f"battery={wrong[0]:g}: must be at least 0 and at most the capacity, {self.capacity:g}; give "
                f"min(max(charge, 0), {self.capacity:g}), or attach Batteries with a larger capacity"
            )

    def _event(self, agent: Body, level: int) -> Any:
        group = self._its_group()
        if getattr(agent, "group", None) is not group:
            raise ValueError(f"{checks.shown(agent)}: has none of these batteries; give an agent of {group.name!r}")
        member = self.member(agent)
        event = self._awaited.get((member, level)) or self.clock.event()
        charge = self.charge[agent.row]
        if not event.triggered and charge <= (0.0 if level == EMPTY else self.low_level):
            return event.succeed(agent)
        self._awaited[member, level] = event
        return event

    def _report(self) -> None:
        """Plan an event for each battery whose level has changed."""
        level = self.drain.level
        before = np.zeros(len(level), np.int64)
        before[: len(self._reported)] = self._reported
        self._reported = level.copy()
        for member in np.flatnonzero(level != before).tolist():
            self.plan(self.now, "reach", member, int(before[member]), int(level[member]))


class NeedsCharge:
    """A source that is called when a battery of its group is low."""

    def is_low(self, member: int) -> None:
        """Called when the battery of a member is low, or empty."""
        raise NotImplementedError
