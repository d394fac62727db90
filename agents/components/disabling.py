"""Sources that make agents inactive: an agent is active again when none of them keeps it inactive any more."""

from __future__ import annotations

from teamsight.agents.components.holding import Holding


class Disabling(Holding):
    """A source that makes agents inactive for a time; see `Holding` for several of them, and for what the user sets."""

    def is_disabled(self, member: int) -> bool:
        """Whether this source keeps a member of its group inactive."""
        return self.holds(member)

    def disable(self, member: int) -> None:
        """Make an agent inactive; it must be present."""
        self.hold(member)

    def enable(self, member: int) -> None:
        """Let an agent take part again, unless something else keeps it inactive."""
        self.release(member)
