"""Sources that make agents inactive: an agent is active again when none of them keeps it inactive any more."""

from __future__ import annotations

from typing import TYPE_CHECKING

from teamsight.agents.events.source import EventSource

if TYPE_CHECKING:
    from teamsight.agents.body import Body


class Disabling(EventSource):
    """A source that makes agents inactive for a time.

    An agent that several sources make inactive, as one that has failed with an empty battery, becomes active when the
    last of them lets it. One that was inactive for another reason, as when a user has set it, stays so.
    """

    def begin(self) -> None:
        """Begin without inactive agents."""
        # By member: whether it was inactive for another reason.
        self._disabled: dict[int, bool] = {}

    def left(self, agent: Body, member: int) -> None:
        """Forget an agent that has left."""
        self._disabled.pop(member, None)

    def end(self) -> None:
        """Let all agents that it has made inactive take part again."""
        for member in list(self._disabled):
            self.enable(member)

    def is_disabled(self, member: int) -> bool:
        """Whether this source keeps a member of its group inactive."""
        return member in self._disabled

    def disable(self, member: int) -> None:
        """Make an agent inactive; it must be present."""
        agent = self.agent(member)
        if member not in self._disabled:
            self._disabled[member] = not agent.active and not self._others_disable(member)
            agent.active = False

    def enable(self, member: int) -> None:
        """Let an agent take part again, unless something else keeps it inactive."""
        agent, stays = self.agent(member), self._disabled.pop(member, True)
        if agent is not None and not stays and not self._others_disable(member):
            agent.active = True

    def _others_disable(self, member: int) -> bool:
        return any(
            source is not self and source.group is self.group and source.is_disabled(member)
            for source in self.world.sources
            if isinstance(source, Disabling)
        )
