"""``teamsight unreliable``: δ and the gain from awareness in teams whose robots fail or sense rarely."""

from __future__ import annotations

import time
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from teamsight.analysis.runs.limits import Steps
from teamsight.cli.options import CellRuns, Folder, TaskName, Works, Writes, names_in
from teamsight.core.component import Allowed, Seed

if TYPE_CHECKING:
    from teamsight.analysis.unreliable.plan import Plan

_Policy = Annotated[str, names_in("teamsight.analysis.unreliable.subject:TEAMS")]
_CMOMMT = "cmommt"


@dataclass(frozen=True, kw_only=True)
class UnreliableSettings(Works, Writes):
    """Options of ``teamsight unreliable``.

    Parameters
    ----------
    task : str
        The task whose team is unreliable.
    set : mapping of str to object
        A value of the scenario of a task other than cmommt. May be given several times.
    out : Path
        Folder for the results.
    runs : int
        Number of runs of each condition.
    steps : int, optional
        Number of steps of each run, at least 50.
    repair : float
        Mean time to repair.
    policies : sequence of str
        Policies of cmommt, separated by commas.
    seed : int
        Seed of all runs.
    """

    task: TaskName = "cmommt"
    set: Mapping[str, Any] = field(default_factory=dict)
    out: Folder = Path("results")
    runs: CellRuns = 60
    steps: Annotated[Steps | None, Allowed(shown="that of the task")] = None
    repair: Annotated[float, Allowed(least=1, most=1e9, unit="ticks")] = 50.0
    policies: Annotated[tuple[_Policy, ...], Allowed()] = ("a-cmommt", "evolved")
    seed: Seed = 2100

    def check(self) -> None:
        """Refuse runs in which robots would decide at most once, and policies and scenarios of other tasks."""
        from teamsight.analysis.unreliable.plan import PERIODS

        if self.task == _CMOMMT:
            self.refuse(("set",), f"is for another task than {_CMOMMT}, whose scenarios are fixed")
        else:
            self.refuse(("policies",), f"is for {_CMOMMT}; a task has one team with skill")
        if self.steps is not None and self.steps < max(PERIODS):
            raise ValueError(
                f"steps={self.steps}: must be at least {max(PERIODS)}, the longest sensing period; give more steps"
            )


def unreliable(settings: UnreliableSettings) -> None:
    """Measure δ and the gain from awareness in unreliable teams.

    Two sweeps over three scenarios of CMOMMT, or over that of another task and its team with skill: robots that fail
    and are repaired, with availabilities from 1 to 0.5; and robots that sense and decide every 1 to 50 ticks. In each
    condition the same worlds are run with awareness and without, so the gain is paired. Writes a figure for each sweep,
    a table of all runs with their seeds, a table of all conditions, and a page. docs/unreliable.md is about the result.
    After an interruption the same command continues from there.

    \b
    Examples:
      teamsight unreliable --out unreliable
      teamsight unreliable --runs 10 --policies a-cmommt
      teamsight unreliable --runs 400 --repair 20 --seed 7
      teamsight unreliable --task graze --set robots=8 --out unreliable-graze
    """
    from teamsight.analysis.runs.files import prepare_folder
    from teamsight.analysis.unreliable.page import summary
    from teamsight.analysis.unreliable.results import check_results, make_results
    from teamsight.cli.show import say, working

    plan = plan_of(settings)
    folder = prepare_folder(settings.out)
    check_results(plan, folder, force=settings.force)
    began = time.perf_counter()
    with working(settings.workers, lambda: _kept(folder)) as (watch, pool):
        table, points = make_results(plan, folder, pool, watch, force=settings.force)
    for line in summary(table, points, plan):
        say(line)
    say(f"unreliable teams in {folder} after {time.perf_counter() - began:.0f} s")


def plan_of(settings: UnreliableSettings) -> Plan:
    """Return the plan that the settings describe."""
    from teamsight.analysis.unreliable.plan import Plan

    given = settings.values(("runs", "steps", "seed", "repair", "task"))
    if settings.task == _CMOMMT:
        given["policies"] = settings.policies
    return Plan(**given, setting=settings.set)


def _kept(folder: Path) -> str:
    from teamsight.analysis.unreliable.results import checkpoint_in
    from teamsight.cli.show import kept_in

    return kept_in(folder, checkpoint_in(folder).count())
