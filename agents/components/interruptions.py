"""Interruptions: what befalls each agent of a group, independently of the others, and may pass."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, ClassVar

from teamsight.agents.components.durations import Duration, Times
from teamsight.agents.components.listed_members import check_members
from teamsight.agents.events.source import EventSource

if TYPE_CHECKING:
    from teamsight.agents.body import Body


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
        lasting: Duration | Times | None = getattr(self, self.parameters[1])
        if isinstance(lasting, Times):
            self._plan_in(lasting.lasting(number, member), "resume", member, number)
        elif lasting is not None:
            self._plan_in(lasting.draw(self.random(member, 2 * number + 1)), "resume", member, number)

    def resume(self, member: int, number: int) -> None:
        """End an interruption of an agent, and plan its next."""
        agent = self.agent(member)
        if agent is None:
            return
        self.end_one(agent, member)
        self.log(self.words[1], agent)
        self._plan_next(member, number + 1)

    def _plan_next(self, member: int, number: int) -> None:
        time_to: Duration | Times = getattr(self, self.parameters[0])
        if isinstance(time_to, Times):
            # At the start, the present moment is not over.
            time = time_to.after(math.nextafter(self.now, -1) if number == 0 else self.now, member)
            self._plan_in(time - self.now, "interrupt", member, number)
        else:
            self._plan_in(time_to.draw(self.random(member, 2 * number)), "interrupt", member, number)

    def _plan_in(self, delay: float, method: str, member: int, number: int) -> None:
        if delay < math.inf:
            self.plan(self.now + delay, method, member, number)

    def begin_one(self, agent: Body, member: int) -> None:
        """Do to an agent what an interruption does."""
        raise NotImplementedError

    def end_one(self, agent: Body, member: int) -> None:
        """Undo it."""
        raise NotImplementedError
