"""Sources that switch something of agents off: it is on again when none of them holds it any more."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from teamsight.agents.events.source import EventSource

if TYPE_CHECKING:
    from teamsight.agents.body import Body


class Holding(EventSource):
    """A source that makes agents inactive, or puts sensors of theirs out of order, for a time.

    What several sources hold, as an agent that has failed with an empty battery, is on again when the last of them lets
    it. What the user sets wins: what was off before, or was set to off meanwhile, stays off; what is set to on is on at
    once, and its later release changes nothing.
    """

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
            self._held[member, channel] = any(others) if others else not _is_on(agent, channel)
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

    def save(self) -> Any:
        """Return what it holds."""
        return dict(self._held)

    def load(self, data: Any) -> None:
        """Go back to what `save` returned."""
        self._held = dict(data)

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
        sources = [one for one in self.world.sources if isinstance(one, Holding) and one is not self]
        return [one for one in sources if one.group is self.group and one.holds(member, channel)]


def _is_on(agent: Body, channel: str | None) -> bool:
    return agent.active if channel is None else agent.sensor_works(channel)
