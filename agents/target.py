"""Targets: the agents that robots observe."""

from __future__ import annotations

from typing import Any

from teamsight.agents.body import Body


class Target(Body):
    """A target, on no team. To avoid robots it must sense them: ``world.senses(targets, robots)``."""

    @property
    def observers(self) -> list[Any]:
        """The agents that sense this one, except teammates."""
        return self.group.host.observers_of(self)

    @property
    def is_observed(self) -> bool:
        """Whether it is sensed in a channel that counts in the observed fraction."""
        return self.group.host.is_observed(self)
