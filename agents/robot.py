"""Robots: they sense targets, and teammates as their degree of awareness allows."""

from __future__ import annotations

from typing import ClassVar

from teamsight.agents.body import Body


class Robot(Body):
    """A robot of the team "robots", unless `World.add` names another team; see `Body`."""

    team: ClassVar[str | None] = "robots"
