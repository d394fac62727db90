"""Balch and Arkin (1994): what communication is worth in forage, consume and graze.

Robots with motor schemas communicate nothing, their states, or their goals; all three levels meet the same places. The
page has three percentages beside ours, and judges claims by sign and order. About the result: docs/tasks/foraging.md.

\b
Examples:
  teamsight reproduce balch_arkin1994 --out foraging
  teamsight reproduce balch_arkin1994 --quick --workers 1
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import partial
from itertools import product
from typing import TYPE_CHECKING, Annotated, Any

from teamsight.analysis.papers import reproduction
from teamsight.analysis.papers.reproduction import RECALLED, Paper, column, judged, rows_of, verdict_of
from teamsight.analysis.plot import markdown
from teamsight.analysis.plot.kinds import draw_means, mark_values, panels
from teamsight.analysis.plot.style import ROBOTS_LABEL, minus, shades
from teamsight.analysis.runs import limits
from teamsight.analysis.runs.seeds import root
from teamsight.analysis.stats.paired import Interval, interval_of
from teamsight.analysis.stats.verdicts import UNDECIDED, Verdict, above, interval_text, no_less, within
from teamsight.core.component import Allowed, Count, Seed

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.figure import Figure as Canvas

    from teamsight.agents.world import World
    from teamsight.analysis.runs.simulate import Planned
    from teamsight.tasks.task import Task

TASK_NAMES, LEVELS = ("forage", "consume", "graze"), ("none", "state", "goal")
#: The source of a claim, if not `RECALLED`.
READ, TOUZET = "abstract", "Touzet (2000)"
#: The difference that counts as none, as a share of the time; which share of the gain of goals states shall give.
MARGIN, SHARE = 0.03, 0.8
#: The percentages that Touzet (2000) quotes: in a task, what a level gains over another at most [%].
PERCENTAGES = (("forage", "goal", "none", 19.0), ("consume", "state", "none", 10.0), ("graze", "goal", "none", 1.0))

_no_less, _within = partial(no_less, margin=MARGIN), partial(within, margin=MARGIN)
#: The claims: text, source, rule, and the task, the level and the other level whose gain is judged.
CLAIMS = (
    ("B1 Forage: goals are better than no communication", TOUZET, above, "forage", "goal", "none"),
    ("B1 Forage: states are better than no communication", RECALLED, above, "forage", "state", "none"),
    ("B1 Forage: goals are at least as good as states", RECALLED, _no_less, "forage", "goal", "state"),
    ("B2 Consume: states are better than no communication", TOUZET, above, "consume", "state", "none"),
    ("B2 Consume: states are at least as good as goals", RECALLED, _no_less, "consume", "state", "goal"),
    ("B3 Graze: states make no difference", TOUZET, _within, "graze", "state", "none"),
    ("B3 Graze: goals make no difference", TOUZET, _within, "graze", "goal", "none"),
)

_PAGE = """
# Forage, consume, graze

{robots} robots; {attractors} attractors in forage and consume; {plan.runs} runs of each cell, paired: the levels of
communication meet the same places. Root seed {plan.seed}. A run that takes longer than {plan.steps} steps is censored
and counts as so many. Gains are shares of the mean time over all cells, with Student's 95 % interval of the paired
differences. “No difference” and “at least as good” mean up to {margin:g} %. “At most” is the largest of the noisy means
of all cells, which is above 0 by chance, too; no claim rests on it.

This is no reproduction of numbers: gains of the schemas, ranges and the law by which mass slows carriers down are not
known to us. Signs and order can hold or fail; claims that are recalled and not verified agree or differ.

## Completion times

| task | communication | steps to complete | censored | largest number of neighbours |
| :--- | :--- | ---: | ---: | ---: |
{times}

## Three percentages

| task | communication | theirs, at most | ours, over all cells (95 %) | ours, at most |
| :--- | :--- | ---: | ---: | ---: |
{percentages}

## By number of attractors

Teams of two or more robots. A mean over numbers of attractors hides effects of opposite sign, if there are any.

{by_attractors}

## Claims

{claims}
"""


@dataclass(frozen=True)
class Communication(reproduction.PaperPlan):
    """What to simulate.

    Parameters
    ----------
    runs : int
        Runs of each cell, paired by their seeds.
    steps : int
        Steps after which a run is censored.
    seed : int
        Seed of all runs.
    robots, attractors : tuple of int
        The numbers of robots, and of attractors where there are any: all combinations are cells.
    """

    runs: limits.Runs = 30
    steps: limits.Steps = 8000
    seed: Seed = root("foraging")
    robots: Annotated[tuple[Count, ...], Allowed()] = (1, 2, 3, 4, 5)
    attractors: Annotated[tuple[Count, ...], Allowed()] = (1, 3, 5, 7)

    def planned(self) -> Iterator[Planned]:
        """Yield each run with the columns that identify it: task, robots, attractors (0 for graze) and so on."""
        from teamsight.tasks.registry import TASKS

        teams = {one: {"policy": "schemas", "communication": one, "awareness": "pairwise"} for one in LEVELS}
        for task in map(TASKS.__getitem__, TASK_NAMES):
            for robots in self.robots:
                for attractors in self.attractors if "attractors" in task.scenario else (0,):
                    cell = {"robots": robots} | ({"attractors": attractors} if attractors else {})
                    how = task, self.seed, self.runs, cell, teams, self.steps, UntilDone(task)
                    for level, replicate, seed, run in reproduction.paired_runs(*how):
                        named = {"task": task.name, "robots": robots, "attractors": attractors, "replicate": replicate}
                        yield named | {"communication": level, "seed": seed}, run


@dataclass(frozen=True)
class UntilDone:
    """Runs a world until its task is done, and returns its objective and the largest number of neighbours."""

    task: Task

    def __call__(self, world: World, steps: int) -> dict[str, Any]:
        """Run the world for at most so many steps."""
        metric, objective = self.task.metrics[self.task.objective.metric], self.task.objective
        reproduction.run_until(lambda world: not objective.is_censored(metric(world)), world, steps, part=250)
        time = float(metric(world))
        found = {"time": objective.counted(time, steps), "censored": objective.is_censored(time)}
        return found | {"max_neighbours": int(world.recording.max_neighbours(self.task.team))}


def gain(table: pd.DataFrame, task: str, level: str, over: str) -> Interval:
    """Return by which share the mean time with one level of communication is shorter than with another."""
    return reproduction.saving(*(column(table, "time", task=task, communication=one) for one in (level, over)))


def gains_by(table: pd.DataFrame, by: str = "task") -> str:
    """Return a table of what levels save over none, for teams of two or more: by a column and number of attractors."""
    rows, several = [], table[(table["robots"] > 1) & (table["attractors"] > 0)]
    for value in several[by].unique():
        cells = rows_of(several, **{by: value})
        for attractors, cell in [*cells.groupby("attractors"), ("all", cells)]:
            of = (gain(cell, str(cell["task"].iloc[0]), level, "none") for level in LEVELS[1:])
            shown = value if isinstance(value, str) else f"{value:g}"
            rows.append([shown, str(attractors), *(interval_text(one, "%", scale=100) for one in of)])
    return markdown.table([by, "attractors", *(f"{one} over none (95 %)" for one in LEVELS[1:])], rows, align="lrrr")


def verdicts(table: pd.DataFrame, plan: Communication | None = None) -> list[Verdict]:
    """Return the verdicts on all claims; `table` has a row for each run."""
    found = [verdict_of(claim, source, gain(table, *of), "%", rule) for claim, source, rule, *of in CLAIMS]
    # States give most of what goals give; undecided if goals give nothing.
    none, state, goal = (column(table, "time", task="forage", communication=level) for level in LEVELS)
    share = interval_of(((none - state) - SHARE * (none - goal)) / none.mean())
    has_gain = gain(table, "forage", "goal", "none").low > 0.0
    note = "" if has_gain else "; goals gain nothing of which this could be a share"
    claim = f"B4 Forage: states give at least {SHARE:g} of the gain of goals"
    verdict = no_less(share, 0.0) if has_gain else UNDECIDED
    return [*found, judged(claim, READ, interval_text(share, "%", scale=100) + note, verdict)]


def draw(table: pd.DataFrame, plan: Communication) -> Canvas:
    """Return completion times against the number of robots, for each level of communication."""
    saved = (f"{task} {100 * gain(table, task, 'goal', 'none').mean:.0f} %" for task in TASK_NAMES)
    figure, shown = panels(
        f"Time saved by communicating goals: {minus(', '.join(saved))}",
        f"mean over numbers of attractors; {plan.runs} runs of each cell; 95 % confidence intervals; seed {plan.seed}",
        TASK_NAMES, x=ROBOTS_LABEL, y="steps to complete",
    )  # fmt: skip
    for task, axes in zip(TASK_NAMES, shown, strict=True):
        for level, colour in zip(LEVELS, shades(3), strict=True):
            found = (column(table, "time", task=task, communication=level, robots=robots) for robots in plan.robots)
            draw_means(axes, plan.robots, reproduction.intervals(found), colour, level, as_bars=True)
        axes.set_ylim(bottom=0)
        mark_values(axes, plan.robots, is_log=False)
    shown[0].legend(frameon=False)
    return figure


def page_values(table: pd.DataFrame, plan: Communication) -> dict[str, Any]:
    """Return the values of the page: completion times, and the percentages of Touzet (2000) beside ours."""
    times, percentages = [], []
    for task, level in product(TASK_NAMES, LEVELS):
        of = rows_of(table, task=task, communication=level)
        shares = f"{100 * of['censored'].mean():.1f} % | {of['max_neighbours'].max()}"
        times.append(f"| {task} | {level} | {of['time'].mean():.0f} | {shares} |")
    for task, level, over, percent in PERCENTAGES:
        most, where = max(
            (gain(cell, task, level, over).mean, f"N = {robots}" + (f", {attractors} attractors" if attractors else ""))
            for (robots, attractors), cell in rows_of(table, task=task).groupby(["robots", "attractors"])
        )
        mean = interval_text(gain(table, task, level, over), "%", scale=100)
        ours = minus(f"{mean} | {100 * most:+.1f} % at {where}")
        percentages.append(f"| {task} | {level} over {over} | {percent:g} % | {ours} |")
    found = {"times": "\n".join(times), "percentages": "\n".join(percentages), "margin": 100 * MARGIN}
    found["by_attractors"] = gains_by(table)
    return found | {name: ", ".join(map(str, getattr(plan, name))) for name in ("robots", "attractors")}


PAPER = Paper(
    plan=Communication, name="foraging", page="tasks/foraging", template=_PAGE, values=page_values,
    figures={"foraging": draw}, verdicts=verdicts, measured="time saved (95 %)",
    quick={"runs": 4, "robots": (1, 3, 5), "attractors": (1, 7)},
    small={"runs": 1, "steps": 20, "robots": (1, 3), "attractors": (1,)},
)  # fmt: skip
