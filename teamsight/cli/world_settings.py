"""The options of commands that simulate one world: `run` and `watch`."""

from __future__ import annotations

from typing import TYPE_CHECKING

from teamsight.cli import values
from teamsight.cli.options import Settings

if TYPE_CHECKING:
    from teamsight.agents.components.failures import Failures


class WorldSettings(Settings):
    """Which world is simulated, and with which seed."""

    robots: int = values.agents(10, "Number of robots.")
    targets: int = values.agents(15, "Number of targets.")
    radius: float = values.length(5.0, "Radius of the arena, in sensing ranges.")
    policy: str = values.choice("a-cmommt", "Policy of the robots: {names}.", values.POLICIES)
    awareness: str = values.choice("pairwise", "Degree of awareness: {names}.", values.DEGREES)
    delta: int = values.sectors(16)
    awareness_range: float = values.length(1.0, "Distance within which two robots are neighbours, in sensing ranges.")
    preset: str | None = values.preset()
    failures: float | None = values.duration("Mean number of ticks until a robot fails.", "no failures")
    repair: float | None = values.duration("Mean number of ticks until a failed robot is repaired.", "no repair")
    seed: int = values.seed(0, "Seed of the world.")


def source_of_failures(settings: WorldSettings) -> Failures | None:
    """Return the source of failures, if there are any."""
    if settings.failures is None:
        return None
    from teamsight.agents.components.failures import Failures

    return Failures(settings.failures, settings.repair)
