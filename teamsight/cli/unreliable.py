"""``teamsight unreliable``: δ and the gain from awareness in teams whose robots fail or sense rarely."""

from __future__ import annotations

import time
from pathlib import Path
from typing import TYPE_CHECKING, Any

from teamsight.cli import limits, task_options, values
from teamsight.cli.errors import when_stopped
from teamsight.cli.options import Settings

if TYPE_CHECKING:
    from teamsight.analysis.unreliable.plan import Plan

_POLICIES = values.registry("teamsight.analysis.unreliable.subject", "TEAMS")
_CMOMMT = "cmommt"


class UnreliableSettings(Settings):
    """Settings of ``teamsight unreliable``."""

    task: str = values.choice("cmommt", "The task whose team is unreliable: {names}.", task_options.TASKS)
    set: dict[str, Any] = task_options.scenario(
        "A value of the scenario of a task other than cmommt. May be given several times."
    )
    out: Path = values.folder(Path("results"), "Folder for the results.")
    runs: int = values.count(60, "Number of runs of each condition.", most=limits.MOST_CELL_RUNS)
    steps: int | None = values.steps(None, "Number of steps of each run, at least 50.", shown="that of the task")
    repair: float = values.number(50.0, "Mean time to repair, in ticks.", least=1.0, most=1e9)
    policies: tuple[str, ...] = values.choices(
        ("a-cmommt", "evolved"), "Policies of cmommt, separated by commas: {names}.", _POLICIES, "policy"
    )
    seed: int = values.seed(2100, "Seed of all runs.")
    workers: int | None = values.workers()
    force: bool = values.force()

    def check(self) -> None:
        """Refuse runs in which robots would decide at most once, and policies and scenarios of other tasks."""
        from teamsight.analysis.unreliable.plan import PERIODS

        if self.task == _CMOMMT and self.set:
            raise ValueError(f"--set: is for another task than {_CMOMMT}, whose scenarios are fixed; leave it out")
        if self.task != _CMOMMT and "policies" in self.given:
            names = ",".join(self.policies)
            raise ValueError(f"--policies={names}: is for {_CMOMMT}; a task has one team with skill; leave it out")
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
    with when_stopped(lambda: _kept(folder)), working(settings.workers) as (watch, pool):
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

    kept = checkpoint_in(folder).count()
    return f"{kept} runs are kept in {folder}; the same command continues from there" if kept else "nothing was kept"
