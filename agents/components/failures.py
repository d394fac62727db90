"""Failures: robots that stop taking part, and sensors that drop out, for a time or for good."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated, ClassVar

from teamsight.agents.channel import channel_of
from teamsight.agents.components.durations import Duration, Lasting, Times, TimeTo, length, next_time
from teamsight.agents.events.sources import EventSource
from teamsight.core.component import Allowed

if TYPE_CHECKING:
    from teamsight.agents.body import Body


class Holding(EventSource):
    """A source that makes agents inactive, or puts sensors of theirs out of order, for a time.

    What several sources hold, as an agent that has failed with an empty battery, is on again when the last of them lets
    it. What the user sets wins: what was off before, or was set to off meanwhile, stays off; what is set to on is on at
    once, and its later release changes nothing.
    """

    changing: ClassVar[tuple[str, ...]] = ("_held",)
    # Whether this source is switching something, which the user then is not.
    _switches = False

    def begin(self) -> None:
        """Begin without anything held."""
        # By member, and channel or None for the agent: whether it stays off when it is released.
        self._held: dict[tuple[int, str | None], bool] = {}

    def left(self, agent: Body, member: int) -> None:
        """Forget an agent that has left."""
        self._held = {held: stays for held, stays in self._held.items() if held[0] != member}

    def end(self) -> None:
        """Release all that it holds."""
        for member, channel in list(self._held):
            self.release(member, channel)

    def holds(self, member: int, channel: str | None = None) -> bool:
        """Whether this source keeps a member inactive, or its sensor of a channel out of order."""
        return (member, channel) in self._held

    def hold(self, member: int, channel: str | None = None) -> None:
        """Make an agent inactive, or put its sensor of a channel out of order; it must be present."""
        agent = self.agent(member)
        if not self.holds(member, channel):
            others = [source._held[member, channel] for source in self._others_that_hold(member, channel)]
            is_on = agent.active if channel is None else agent.sensor_works(channel)
            self._held[member, channel] = any(others) if others else not is_on
            self._switch(agent, channel, on=False)

    def release(self, member: int, channel: str | None = None) -> None:
        """Switch it on again, unless something else keeps it off."""
        agent, stays = self.agent(member), self._held.pop((member, channel), True)
        if agent is not None and not stays and not self._others_that_hold(member, channel):
            self._switch(agent, channel, on=True)

    def switched(self, agent: Body, member: int, channel: str | None, on: bool) -> None:
        """Let what the user has set win."""
        sources = [source for source in self.world.sources if isinstance(source, Holding)]
        if not self.holds(member, channel) or any(source._switches for source in sources):
            return
        if on:
            del self._held[member, channel]
        else:
            self._held[member, channel] = True

    def _switch(self, agent: Body, channel: str | None, *, on: bool) -> None:
        self._switches = True
        try:
            if channel is None:
                agent.active = on
            elif on:
                agent.repair_sensor(channel)
            else:
                agent.break_sensor(channel)
        finally:
            self._switches = False

    def _others_that_hold(self, member: int, channel: str | None) -> list[Holding]:
        return [one for one in self.beside(Holding) if one is not self and one.holds(member, channel)]


class Coming(EventSource):
    """A source that lets agents come to its group; so others may list times for members that are not there yet."""


def check_members(source: EventSource, *names: str) -> None:
    """Refuse a source whose parameters list times for members that its group neither has nor will have."""
    for name in names if not source.beside(Coming) else ():
        value = getattr(source, name)
        if isinstance(value, Times):
            value.check_members(name, source.members, source._its_group().name)


class Interruptions(EventSource):
    """A source of interruptions: for each agent a time until the first, its length, a time until the next, and so on.

    The times of an agent are a function of the seed, of the source and of the agent alone, so what others do, and who
    comes or leaves, does not change them.

    Attributes
    ----------
    words : tuple of two str
        What the log says when an interruption begins, and when it ends.
    parameters : tuple of two str
        The names of the attributes with the time to an interruption, and with how long it lasts: None for ever.
    """

    words: ClassVar[tuple[str, str]]
    parameters: ClassVar[tuple[str, str]]

    def check(self) -> None:
        """Refuse times that are listed for unknown members."""
        check_members(self, *self.parameters)

    def begin(self) -> None:
        """Plan the first interruption of each agent."""
        time_to: Duration | Times = getattr(self, self.parameters[0])
        if isinstance(time_to, Times):
            time_to.check_to_come(self.parameters[0], self.now)
        for member in self.members:
            self._plan_next(member, 0)

    def joined(self, agent: Body, member: int) -> None:
        """Plan the first interruption of an agent that has come."""
        self._plan_next(member, 0)

    def interrupt(self, member: int, number: int) -> None:
        """Begin an interruption of an agent, and plan its end."""
        agent = self.agent(member)
        if agent is None:
            return
        self.begin_one(agent, member)
        self.log(self.words[0], agent)
        time = self.now + length(self, getattr(self, self.parameters[1]), member, number, 2 * number + 1)
        if time < math.inf:
            self.plan(time, "resume", member, number)

    def resume(self, member: int, number: int) -> None:
        """End an interruption of an agent, and plan its next."""
        agent = self.agent(member)
        if agent is None:
            return
        self.end_one(agent, member)
        self.log(self.words[1], agent)
        self._plan_next(member, number + 1)

    def _plan_next(self, member: int, number: int) -> None:
        time = next_time(self, getattr(self, self.parameters[0]), member, number, 2 * number)
        if time < math.inf:
            self.plan(time, "interrupt", member, number)

    def begin_one(self, agent: Body, member: int) -> None:
        """Do to an agent what an interruption does."""
        raise NotImplementedError

    def end_one(self, agent: Body, member: int) -> None:
        """Undo it."""
        raise NotImplementedError


@dataclass(eq=False, repr=False)
class Failures(Holding, Interruptions):
    """Agents fail, each independently of the others, and may be repaired.

    An agent that has failed is inactive: it neither moves nor decides, senses nobody and is sensed by nobody. The log
    says "failed" and "repaired".

    Parameters
    ----------
    time_to_failure : float, Duration or Times
        The time from the start, or from the last repair, to a failure [ticks]: the mean of an exponential time, a
        duration such as `Weibull`, or the times of failures since the start of the run.
    time_to_repair : float, Duration or Times, optional
        The time from a failure to its repair [ticks]; by default agents that have failed stay so. `Times` are those of
        the first repair of an agent, of the second, and so on.

    Raises
    ------
    TypeError, ValueError
        If a time is neither a number nor a duration, or is not positive; when attached, if a listed time has passed.

    Notes
    -----
    An agent fails at its times whether or not it is active then. What the user sets wins: an agent that the user makes
    inactive stays so after its repair, and one that the user makes active in a failure has not failed any more. With
    exponential times, the share of the time in which an agent works tends to the availability, MTTF / (MTTF + MTTR).

    Examples
    --------
    ``failures = world.attach(Failures(500, 50), robots)``
    """

    time_to_failure: TimeTo
    time_to_repair: Lasting | None = None

    words = "failed", "repaired"
    parameters = "time_to_failure", "time_to_repair"

    def begin(self) -> None:
        """Plan the first failure of each agent."""
        Holding.begin(self)
        Interruptions.begin(self)

    @property
    def failed(self) -> list[Body]:
        """The agents that have failed and are neither repaired yet nor set active by the user."""
        return [self.agent(member) for member in sorted(member for member, _ in self._held)]

    def begin_one(self, agent: Body, member: int) -> None:
        """Let an agent fail."""
        self.hold(member)

    def end_one(self, agent: Body, member: int) -> None:
        """Repair an agent."""
        self.release(member)


@dataclass(eq=False, repr=False)
class SensorDropouts(Holding, Interruptions):
    """Sensors drop out and come back, those of each agent independently of the others.

    An agent whose sensor has dropped out senses nobody in that channel; others sense it as before. The log says
    "sensor dropped out" and "sensor came back". What the user sets wins: a sensor that the user breaks stays so,
    and one that the user repairs works.

    Parameters
    ----------
    time_to_dropout : float, Duration or Times
        The time from the start, or from the end of the last dropout, to a dropout [ticks]; as for `Failures`.
    time_to_recovery : float, Duration or Times, optional
        The time until the sensor comes back [ticks]; by default it does not.
    channel : str, optional
        The channel of the sensor; by default all channels of the group drop out together.

    Raises
    ------
    TypeError, ValueError
        If a time is neither a number nor a duration, or is not positive; when attached, if a listed time has passed or
        the group has no such channel.
    """

    time_to_dropout: TimeTo
    time_to_recovery: Lasting | None = None
    channel: Annotated[str, Allowed()] | None = None

    words = "sensor dropped out", "sensor came back"
    parameters = "time_to_dropout", "time_to_recovery"

    def begin(self) -> None:
        """Plan the first dropout of each agent."""
        if self.channel is not None:
            channel_of(self._its_group(), self.channel, f"channel={self.channel!r}")
        Holding.begin(self)
        Interruptions.begin(self)

    def begin_one(self, agent: Body, member: int) -> None:
        """Break the sensors of an agent."""
        for name in self._its_group().channels if self.channel is None else (self.channel,):
            self.hold(member, name)

    def end_one(self, agent: Body, member: int) -> None:
        """Repair those that nothing else keeps out of order."""
        for one, name in list(self._held):
            if one == member:
                self.release(member, name)
