"""Until: events of a world for which SimPy processes can wait."""

from __future__ import annotations

from collections.abc import Callable, Generator
from typing import Any

from teamsight.agents.body import Body
from teamsight.agents.channel import TEAMMATES
from teamsight.agents.engine.engine import Engine
from teamsight.agents.engine.watching import Bound
from teamsight.agents.events.agent_left import AgentLeftError
from teamsight.agents.events.timeline import CONDITION
from teamsight.agents.events.waits import CONTACT, NOTHING, OBSERVED, OVER, Aim, Waits
from teamsight.agents.world_data import WorldData
from teamsight.core import checks
from teamsight.world.awaited import Kept
from teamsight.world.clock import Event


class Observation:
    """A target is observed, or no longer."""

    def __init__(self, engine: Engine, target: Body, *, wanted: bool) -> None:
        self._engine, self._target, self._wanted = engine, target, wanted

    def place(self, bound: Bound) -> tuple[int, int, int, int, int, int]:
        """Return the first six numbers of a row of `WaitArrays`."""
        target = self._target
        if target._row < 0:
            return (OVER, 0, 0, 0, 0, self._wanted)
        for relation, record in zip(bound.relations, bound.relation_records, strict=True):
            if relation.counts:
                # All relations that count share one array of who was met.
                body = bound.first_body[target.group.number] + target._row
                return (OBSERVED, record.address, body, 0, 0, self._wanted)
        return (NOTHING, 0, 0, 0, 0, self._wanted)

    def has_come(self) -> bool:
        """Whether it is so now."""
        return bool(self._observers()) == self._wanted

    def value(self) -> Any:
        """Return the observers, or the target that is no longer observed."""
        return self._observers() if self._wanted else self._target

    def lost(self) -> Exception | None:
        """Return the error if the target has left before it was observed."""
        if self._wanted and self._target._row < 0:
            return AgentLeftError(f"until.observed({self._target!r}): it has left the world and cannot be observed")
        return None

    def _observers(self) -> list[Any]:
        if self._target._row < 0:
            return []
        self._engine.prepare()
        found = [relation.observers_of(self._target) for relation in self._engine.relations if relation.counts]
        return list(dict.fromkeys(agent for agents in found for agent in agents))


class Contact:
    """A robot has a contact, or no longer."""

    def __init__(self, engine: Engine, robot: Body, other: Body | None, channel: str, *, wanted: bool) -> None:
        self._engine, self._robot, self._other, self._channel = engine, robot, other, channel
        self._wanted = wanted

    def place(self, bound: Bound) -> tuple[int, int, int, int, int, int]:
        """Return the first six numbers of a row of `WaitArrays`."""
        robot, other = self._robot, self._other
        if self._gone() is not None:
            return (OVER, 0, 0, 0, 0, self._wanted)
        record = bound.relation(robot.group, self._channel)
        first = robot.group.relations[self._channel].first if record is not None else {}
        if record is None or (other is not None and other.group.number not in first):
            return (NOTHING, 0, 0, 0, 0, self._wanted)
        index = -1 if other is None else first[other.group.number] + other._row
        return (CONTACT, record.address, robot._row, index, self._channel == TEAMMATES, self._wanted)

    def has_come(self) -> bool:
        """Whether it is so now."""
        return bool(self._present()) == self._wanted

    def value(self) -> Any:
        """Return the other agent; of several, the first. Of a contact that has ended with any, None."""
        present = self._present()
        return present[0] if self._wanted else self._other

    def lost(self) -> Exception | None:
        """Return the error if one of them has left before they met."""
        gone = self._gone()
        if gone is None or not self._wanted:
            return None
        given = ", ".join(repr(agent) for agent in (self._robot, self._other) if agent is not None)
        return AgentLeftError(f"until.contact({given}): {gone!r} has left the world")

    def _gone(self) -> Body | None:
        return next((one for one in (self._robot, self._other) if one is not None and one._row < 0), None)

    def _present(self) -> list[Any]:
        if self._gone() is not None:
            return []
        robot = self._robot
        found = robot.neighbours if self._channel == TEAMMATES else robot.sensed(self._channel)
        return [agent for agent in found if self._other is None or agent is self._other]


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
        return self._when(Observation(self._engine, self._observable("observed", target), wanted=True))

    def lost(self, target: Body) -> Event:
        """Return the event that an agent is not observed, also because it has left. Its value is the agent."""
        return self._when(Observation(self._engine, self._observable("lost", target), wanted=False))

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
        self._check_contact("contact", robot, other, channel)
        return self._when(Contact(self._engine, robot, other, channel, wanted=True))

    def contact_ended(self, robot: Body, other: Body | None = None, channel: str = TEAMMATES) -> Event:
        """Return the event that a robot does not have the other agent, or any, in a channel; see `contact`.

        It also happens when one of them leaves the world. Its value is `other`.
        """
        self._check_contact("contact_ended", robot, other, channel)
        return self._when(Contact(self._engine, robot, other, channel, wanted=False))

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

    def _when(self, aim: Aim) -> Event:
        event = self._data.timeline.clock.event()
        if aim.has_come():
            return event.succeed(aim.value())
        self._waits.add(aim, event)
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

    def _check_contact(self, name: str, robot: Body, other: Body | None, channel: str) -> None:
        given = [robot] if other is None else [robot, other]
        shown = f"until.{name}({', '.join(map(checks.shown, given))}, channel={checks.shown(channel)})"
        for agent in given:
            self._check_agent(shown, agent, may_have_left=name == "contact_ended")
        self._engine.prepare()
        channels = robot.group.channels
        if channel not in channels:
            have = ", ".join(map(repr, channels)) or "none"
            raise ValueError(f"{shown}: {robot.group.name} have no such channel, but {have}; declare it with senses()")
        if other is None:
            return
        if other is robot:
            raise ValueError(f"{shown}: no robot senses itself; give another agent, or none for any")
        seen = channels[channel].observed
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
