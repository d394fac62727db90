"""``teamsight ceilings``: what could a team observe at most, and how far do policies go?"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import partial
from typing import Annotated

from teamsight.analysis.runs.limits import Runs, Steps
from teamsight.cli.options import Agents, Works
from teamsight.core.component import Allowed, Seed
from teamsight.world.limits import Length


@dataclass(frozen=True, kw_only=True)
class CeilingSettings(Works):
    """Options of ``teamsight ceilings``.

    Parameters
    ----------
    policies : tuple of str
        Policies to compare; the first is the reference.
    robots : int
        Number of robots.
    targets : int
        Number of targets.
    radius : float
        Radius of the arena, in sensing ranges.
    runs : int
        Number of runs of each team.
    steps : int
        Number of steps of each run.
    seed : int
        Seed of all runs.
    """

    policies: Annotated[
        tuple[str, ...], Allowed(metavar="[POLICY]...", is_argument=True, is_repeated=True, shown="a-cmommt, …")
    ] = ("a-cmommt", "random-walk", "evolved")
    robots: Agents = 10
    targets: Agents = 15
    radius: Length = 5.0
    runs: Runs = 5
    steps: Steps = 600
    seed: Seed = 0


def ceilings(settings: CeilingSettings) -> None:
    """Compare policies with what is possible.

    On the same worlds as the policies run teams that know more than robots can: "sharing", a central planner that knows
    what some robot senses; "informed", where all targets are; "clairvoyant", where they will be. "teleport" is the
    share of the targets that the robots could cover if they were anywhere at once: no team passes it.

    \b
    Examples:
      teamsight ceilings
      teamsight ceilings a-cmommt evolved --robots 5 --radius 3 --runs 20
    """
    from teamsight.analysis.ceilings import PLANNERS, compare, standings
    from teamsight.cli.show import interval, show_table, working

    teams = [*settings.policies, *PLANNERS]
    cell = settings.robots, settings.targets, settings.radius
    with working(settings) as (watch, pool):
        table = compare(
            [cell], teams, runs=settings.runs, steps=settings.steps, seed=settings.seed, pool=pool,
            progress=partial(watch, "running"),
        )  # fmt: skip
    first = teams[0]
    rows = [
        (
            one.team, interval(one.observed._asdict(), ".1f"),
            "" if one.team == first else interval(one.more._asdict(), "+.1f"),
            f"{100 * one.share:.0f} %" if math.isfinite(one.share) else "",
        )
        for one in standings(table)
    ]  # fmt: skip
    show_table(rows, ("team", "observed [%]", f"more than {first}", "of the way"))
