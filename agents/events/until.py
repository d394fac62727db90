"""Waiting: events of a world for which processes wait."""

from __future__ import annotations

from collections.abc import Callable, Generator
from typing import Annotated, Any, NamedTuple

import numpy as np
import numpy.typing as npt

from teamsight.agents.body import Body
from teamsight.agents.channel import TEAMMATES, channel_of
from teamsight.agents.engine.engine import Engine
from teamsight.agents.engine.records import Bound, Watcher, relation_at
from teamsight.agents.world_data import CONDITION, AgentLeftError, WorldData
from teamsight.core import checks
from teamsight.core.kernel import Entry, Record, kernel
from teamsight.world.clock import Event, Kept

OBSERVED, CONTACT, NOTHING, OVER = range(4)
_FEWEST = 8


class WaitArrays(NamedTuple):
    """The record of the waits.

    Attributes
    ----------
    moment : ndarray, shape (1,), int64
        The tick of the present positions.
    rows : ndarray, shape (room, 7), int64
        For each wait: what for (`OBSERVED`, `CONTACT`, `NOTHING` if no such channel is left, so that it is not so, or
        `OVER` if an agent has left); the address of a relation; the row of the observer, or the index of the observed
        body in `met`; the index of the other agent, or −1 for any; whether the channel is that of teammates in range;
        whether it is to be so, or no longer; and, as the result, whether it has come.
    length : ndarray, shape (1,), int64
        The number of waits.
    """

    moment: Annotated[npt.NDArray[np.int64], 1]
    rows: Annotated[npt.NDArray[np.int64], "room", 7]
    length: Annotated[npt.NDArray[np.int64], 1]


WAITS = Record(WaitArrays)
waits_at = WAITS.at


@kernel
def _has_contact(address: int, row: int, other: int, in_range: int) -> bool:
    """Whether an observer has an agent, or a certain one, in range or senses it."""
    relation = relation_at(address)
    start, index = relation.true_start, relation.true_index
    if in_range != 0:
        start, index = relation.neighbours.start, relation.neighbours.identity
    if other < 0:
        return bool(start[row + 1] > start[row])
    for k in range(start[row], start[row + 1]):  # noqa: SIM110 (kernels have no generators)
        if index[k] == other:
            return True
    return False


@kernel
def _is_observed(address: int, body: int, tick: int) -> bool:
    # After a step, or before one; see `_record_relation` in the loop.
    met = relation_at(address).met[body]
    return bool(met == -1 - tick or (tick > 0 and met == tick))


def _wait(address: int) -> int:
    waits = waits_at(address)
    rows = waits.rows
    found = 0
    for w in range(waits.length[0]):
        is_so = False
        if rows[w, 0] == OBSERVED:
            is_so = _is_observed(rows[w, 1], rows[w, 2], waits.moment[0])
        elif rows[w, 0] == CONTACT:
            is_so = _has_contact(rows[w, 1], rows[w, 2], rows[w, 3], rows[w, 4])
        rows[w, 6] = rows[w, 0] == OVER or is_so == (rows[w, 5] != 0)
        found += rows[w, 6]
    return found


WAIT = Entry(_wait)


class Wait:
    """One event, which happens when an agent is observed, or a robot has a contact; or no longer.

    Parameters
    ----------
    engine : Engine
        That of the world.
    event : Event
        The event.
    channel : str or None
        That of the contact; None if it is about an agent that is observed.
    wanted : bool
        Whether it is to be so, or no longer.
    agents : tuple of Body
        The agent that is observed; or the robot, and the other agent if that may not be any.
    """

    def __init__(
        self, engine: Engine, event: Event, channel: str | None, wanted: bool, agents: tuple[Body, ...]
    ) -> None:  # fmt: skip
        self._engine, self._kept, self._agents = engine, Kept(event), agents
        self._channel, self._wanted = channel, wanted

    @property
    def is_forgotten(self) -> bool:
        """Whether nobody can ever wait for the event, or it has happened."""
        event = self._kept.event()
        return event is None or event.triggered

    @property
    def has_come(self) -> bool:
        """Whether it is so now."""
        return bool(self._present()) == self._wanted

    def place(self, bound: Bound) -> tuple[int, ...]:
        """Return the first six numbers of a row of `WaitArrays`."""
        agent, *others = self._agents
        row: tuple[int, ...] = (NOTHING, 0, 0, 0, 0)
        if self._gone() is not None:
            row = (OVER, 0, 0, 0, 0)
        elif self._channel is None:
            for relation, record in zip(bound.relations, bound.relation_records, strict=True):
                if relation.counts:
                    # All relations that count share one array of who was met.
                    row = (OBSERVED, record.address, bound.first_body[agent.group.number] + agent._row, 0, 0)
                    break
        elif (found := bound.relation(agent.group, self._channel)) is not None:
            first = agent.group.relations[self._channel].first
            index = [first[one.group.number] + one._row for one in others if one.group.number in first]
            if len(index) == len(others):
                row = (CONTACT, found.address, agent._row, *(index or [-1]), self._channel == TEAMMATES)
        return (*row, self._wanted)

    def end(self) -> None:
        """Let the event happen, with its value or with the error that it cannot."""
        if self.is_forgotten:
            return
        event, gone = self._kept.event(), self._gone()
        agent, *others = self._agents
        if not self._wanted:
            event.succeed(agent if self._channel is None else others[0] if others else None)
        elif gone is None:
            present = self._present()
            event.succeed(present if self._channel is None else present[0])
        else:
            # An event that nobody waits for must not stop the run.
            if not event.callbacks.is_awaited:
                event.defused = True
            name, given = "observed" if self._channel is None else "contact", ", ".join(map(repr, self._agents))
            event.fail(AgentLeftError(f"until.{name}({given}): {gone!r} has left the world, so this cannot come"))

    def _gone(self) -> Body | None:
        return next((one for one in self._agents if one._row < 0), None)

    def _present(self) -> list[Any]:
        """Return who observes the agent, or the agents with which the robot has a contact."""
        if self._gone() is not None:
            return []
        agent, *others = self._agents
        if self._channel is None:
            return agent.group.host.observers_of(agent, counted=True)
        found = agent.neighbours if self._channel == TEAMMATES else agent.sensed(self._channel)
        return [one for one in found if not others or one is others[0]]


class Waits(Watcher):
    """All events of a world for which processes wait."""

    entry = WAIT
    sees_changes = True

    def __init__(self, data: WorldData, engine: Engine) -> None:
        self._data, self._engine = data, engine
        self.waits: list[Wait] = []
        self._bound: Bound | None = None
        self._is_watching = False
        self._rows, self._length = np.zeros((_FEWEST, 7), np.int64), np.zeros(1, np.int64)

    def add(self, wait: Wait) -> None:
        """Let an event happen at the first tick at which it has come."""
        self.waits.append(wait)
        if not self._is_watching:
            self._is_watching = True
            self._engine.watch(self)
        elif self._bound is None or not self._engine.is_bound or len(self.waits) > len(self._rows):
            self._engine.rewatch()
        else:
            self._rows[len(self.waits) - 1, :6] = wait.place(self._bound)
            self._length[0] = len(self.waits)

    def bind(self, bound: Bound) -> None:
        """Write the rows of all waits."""
        self._bound = bound
        if len(self.waits) > len(self._rows):
            self._rows = np.zeros((2 * len(self.waits), 7), np.int64)
        self._write(bound)
        self.record = WAITS.pack(WaitArrays(bound.moment, self._rows, self._length))

    def _write(self, bound: Bound) -> None:
        for row, wait in zip(self._rows, self.waits, strict=False):
            row[:6] = wait.place(bound)
        self._length[0] = min(len(self.waits), len(self._rows))

    def happened(self) -> None:
        """Let those events happen whose aim has come, in the order in which they were asked for."""
        come = self._rows[: self._length[0], 6].tolist()
        # Those after them have no row yet.
        placed, rest = self.waits[: len(come)], self.waits[len(come) :]
        ended = [wait for wait, is_so in zip(placed, come, strict=True) if is_so]
        self._keep([wait for wait, is_so in zip(placed, come, strict=True) if not is_so] + rest)
        for wait in ended:
            wait.end()

    def tidy(self) -> None:
        """Drop the events that nobody waits for; without any, the loop is not slowed down."""
        if any(wait.is_forgotten for wait in self.waits):
            self._keep([wait for wait in self.waits if not wait.is_forgotten])
        if not self.waits:
            self._is_watching, self._bound = False, None
            self._engine.unwatch(self)

    def forget(self) -> None:
        """Drop all: no waiting process continues after a jump of the clock."""
        self._keep([])

    def _keep(self, waits: list[Wait]) -> None:
        self.waits = waits
        if self._bound is not None and self._engine.is_bound:
            self._write(self._bound)
        else:
            self._length[0] = len(waits)


class Until:
    """Events of a world for processes: ``yield world.until.observed(target)``; see docs/time.md.

    Each method returns a SimPy event. It happens at the first tick at which it is so, and at once if it is so already;
    a process that yields it continues there, before the next step. The steps until then are made in compiled code. The
    events can be combined (``seen | world.clock.timeout(50)``) as all of SimPy's. When a state is restored or the world
    is reset, waiting processes never continue.
    """

    def __init__(self, data: WorldData, engine: Engine) -> None:
        self._data, self._engine = data, engine
        self._waits = Waits(data, engine)

    def observed(self, target: Body) -> Event:
        """Return the event that an agent is observed: sensed in a channel that counts in `observed_fraction`.

        Its value is the list of the agents that sense it. If the agent leaves the world before, waiting raises
        `AgentLeftError`.
        """
        return self._when(None, True, self._observable("observed", target))

    def lost(self, target: Body) -> Event:
        """Return the event that an agent is not observed, also because it has left. Its value is the agent."""
        return self._when(None, False, self._observable("lost", target))

    def contact(self, robot: Body, other: Body | None = None, channel: str = TEAMMATES) -> Event:
        """Return the event that a robot has another agent in a channel.

        Parameters
        ----------
        robot : Body
            The agent that senses.
        other : Body, optional
            The agent that it senses; by default any.
        channel : str
            "teammates": within its awareness range, as in `Body.neighbours`. Other channels: sensed, as in
            `Body.sensed`.

        Returns
        -------
        simpy.Event
            Its value is the other agent; if there are several, the first of that list. If one of the two leaves the
            world before, waiting raises `AgentLeftError`.

        Raises
        ------
        TypeError, ValueError
            If one of them is not an agent of this world, or the robot does not sense the other in that channel.
        """
        return self._when(channel, True, *self._in_contact("contact", robot, other, channel))

    def contact_ended(self, robot: Body, other: Body | None = None, channel: str = TEAMMATES) -> Event:
        """Return the event that a robot does not have the other agent, or any, in a channel; see `contact`.

        It also happens when one of them leaves the world. Its value is `other`.
        """
        return self._when(channel, False, *self._in_contact("contact_ended", robot, other, channel))

    def battery_empty(self, robot: Body) -> Event:
        """Return the event that the battery of an agent is empty; its value is the agent.

        If the agent leaves the world before, waiting raises `AgentLeftError`.

        Raises
        ------
        ValueError
            If no `Batteries` are attached to its group.
        """
        from teamsight.agents.components.batteries import Batteries

        shown = f"until.battery_empty({checks.shown(robot)})"
        self._check_agent(shown, robot)
        for source in self._data.sources.attached:
            if source.group is robot.group and isinstance(source, Batteries):
                return source.empty(robot)
        name = robot.group.name
        raise ValueError(f"{shown}: {name} have no batteries; add them, as in world.attach(Batteries(100), {name})")

    def __call__(self, condition: Callable[[], Any]) -> Event:
        """Return the event that a condition in Python is true. Its value is what the condition returned.

        It is tested now, after each step, and before the next if an event comes between. So while a process waits for
        it, steps are made one by one; the other events of this class do not need that.

        Parameters
        ----------
        condition : callable
            Called without arguments.

        Raises
        ------
        TypeError
            If it cannot be called, or returns a generator or an event, which would be true at once.
        """
        if not callable(condition):
            raise TypeError(
                f"until({checks.shown(condition)}): must be a function that is called after each step, as in "
                "until(lambda: world.observed > 0.5)"
            )
        event = self._data.timeline.clock.event()
        with self._data.timeline.calling(CONDITION):
            value = condition()
        if isinstance(value, Generator | Event):
            raise TypeError(
                f"until({checks.shown(condition)}): returned {checks.shown(value)}, which counts as true at once; a "
                "process waits for an event by yield event, and for a function that yields by yield from f()"
            )
        if value:
            return event.succeed(value)
        self._data.conditions.append(Condition(condition, event, self._data.conditions))
        return event

    def _when(self, channel: str | None, wanted: bool, *agents: Body) -> Event:
        event = self._data.timeline.clock.event()
        wait = Wait(self._engine, event, channel, wanted, agents)
        if wait.has_come:
            wait.end()
        else:
            self._waits.add(wait)
        return event

    def _check_agent(self, shown: str, agent: Any, *, may_have_left: bool = False) -> None:
        if not isinstance(agent, Body):
            raise TypeError(f"{shown}: must be an agent of this world, such as robots[0]")
        if agent._row < 0 and not may_have_left:
            raise AgentLeftError(f"{shown}: {agent!r} has left the world")
        if not any(group is agent.group for group in self._data.groups):
            raise ValueError(f"{shown}: {agent!r} is in another world; give an agent of this one")

    def _observable(self, name: str, target: Body) -> Body:
        shown = f"until.{name}({checks.shown(target)})"
        self._check_agent(shown, target, may_have_left=name == "lost")
        counting = [one for group in self._data.groups for one in group.channels.values() if one.counts]
        if not any(group is target.group for channel in counting for group in channel.observed):
            raise ValueError(
                f"{shown}: no group senses {target.group.name} in a channel that counts as observed; declare it, as in "
                f"world.senses(robots, {target.group.name}), or wait for until.contact(robot, target, channel=…)"
            )
        return target

    def _in_contact(self, name: str, robot: Body, other: Body | None, channel: str) -> tuple[Body, ...]:
        given = (robot,) if other is None else (robot, other)
        shown = f"until.{name}({', '.join(map(checks.shown, given))}, channel={checks.shown(channel)})"
        for agent in given:
            self._check_agent(shown, agent, may_have_left=name == "contact_ended")
        self._engine.prepare()
        channels, seen = robot.group.channels, channel_of(robot.group, channel, shown).observed
        if other is None:
            return given
        if other is robot:
            raise ValueError(f"{shown}: no robot senses itself; give another agent, or none for any")
        if not any(group is other.group for group in seen):
            names = ", ".join(group.name for group in seen) or "no group"
            fitting = [name for name, one in channels.items() if any(group is other.group for group in one.observed)]
            cure = (
                f"give channel={fitting[0]!r}"
                if fitting
                else f"declare it: world.senses({robot.group.name}, {other.group.name})"
            )
            raise ValueError(
                f"{shown}: {robot.group.name} sense {names} in this channel, not {other.group.name}; {cure}"
            )
        return given


class Condition:
    """A condition in Python, tested before and after each step, and the event that happens when it is true."""

    def __init__(self, condition: Callable[[], Any], event: Event, conditions: list[Callable[[], bool]]) -> None:
        self._condition, self._conditions = condition, conditions
        self._kept = Kept(event)

    def __call__(self) -> bool:
        """Test it; return whether the event was planned."""
        event = self._kept.event()
        value: Any = None
        if event is not None and not event.triggered:
            try:
                value = self._condition()
            except Exception as error:
                # The waiting process receives it at its yield.
                event.fail(error)
                value = error
            else:
                if not value:
                    return False
                event.succeed(value)
        self._conditions[:] = [other for other in self._conditions if other is not self]
        return value is not None
