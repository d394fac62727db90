"""Targets: the agents that robots observe."""

from __future__ import annotations

from teamsight.agents.body import Body


class Target(Body):
    """A target, on no team. To avoid robots it must sense them: ``world.senses(targets, robots)``."""
