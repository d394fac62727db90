"""Balch and Arkin (1994): what communication is worth in forage, consume and graze.

Robots with motor schemas communicate nothing, their states, or their goals; all three levels meet the same places. The
page puts the three percentages that Touzet (2000) quotes beside ours, and judges the claims by sign and order. About
the result: docs/tasks/foraging.md.

\b
Examples:
  teamsight reproduce balch_arkin1994 --out foraging
  teamsight reproduce balch_arkin1994 --quick --workers 1
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated, Any

from teamsight.analysis.papers.reproduction import (
    RECALLED,
    Floats,
    Paper,
    Plan,
    chosen,
    column,
    intervals,
    judged,
    no_less,
    run_until,
    saving,
    within,
)
from teamsight.analysis.plot import markdown
from teamsight.analysis.plot.kinds import draw_means, mark_values, panels
from teamsight.analysis.plot.style import DEGREE, ROBOTS_LABEL, minus
from teamsight.analysis.runs import limits
from teamsight.analysis.runs.seeds import root
from teamsight.analysis.stats.paired import Interval, interval_of
from teamsight.analysis.stats.verdicts import UNDECIDED, Verdict, above, percent_text
from teamsight.core.component import Allowed, Count, Seed

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.figure import Figure as Canvas

    from teamsight.agents.world import World
    from teamsight.analysis.runs.simulate import Planned
    from teamsight.tasks.task import Task

#: The tasks, and the levels of communication, by their names.
TASK_NAMES, LEVELS = ("forage", "consume", "graze"), ("none", "state", "goal")
#: How sure the source of a claim is: read, or said by Touzet (2000); else `RECALLED`.
READ, TOUZET = "abstract", "Touzet (2000)"
#: The difference that counts as none, as a share of the time; which share of the gain of goals states shall give.
MARGIN, SHARE = 0.03, 0.8
#: The percentages that Touzet (2000) quotes: in a task, what a level gains over another at most [%].
PERCENTAGES = (("forage", "goal", "none", 19.0), ("consume", "state", "none", 10.0), ("graze", "goal", "none", 1.0))
#: The claims: text, source, rule, and the task, the level and the other level whose gain is judged.
CLAIMS = (
    ("B1 Forage: goals are better than no communication", TOUZET, above, "forage", "goal", "none"),
    ("B1 Forage: states are better than no communication", RECALLED, above, "forage", "state", "none"),
    ("B1 Forage: goals are at least as good as states", RECALLED, no_less, "forage", "goal", "state"),
    ("B2 Consume: states are better than no communication", TOUZET, above, "consume", "state", "none"),
    ("B2 Consume: states are at least as good as goals", RECALLED, no_less, "consume", "state", "goal"),
    ("B3 Graze: states make no difference", TOUZET, within, "graze", "state", "none"),
    ("B3 Graze: goals make no difference", TOUZET, within, "graze", "goal", "none"),
)

# A run stops at the first multiple of these steps at which its task is done.
_PART = 250
_COLOURS = {"none": DEGREE["none"], "state": DEGREE["pairwise"], "goal": DEGREE["shared"]}
_PAGE = """
# Forage, consume, graze

{robots} robots; {attractors} attractors in forage and consume; {plan.runs} runs of each cell, paired: the levels of
communication meet the same places. Root seed {plan.seed}. A run that takes longer than {plan.steps} steps is censored
and counts as so many. Gains are shares of the mean time over all cells, with Student's 95 % interval of the paired
differences. “No difference” and “at least as good” mean up to {margin:g} %. “At most” is the largest of the noisy means
of all cells, which is above 0 by chance, too; no claim rests on it.

This is no reproduction of the numbers: gains of the schemas, ranges and the law by which mass slows carriers down are
not known to us, and ours were not fitted to them. Signs and order can hold or fail; claims that are recalled and not
verified agree or differ.

## Completion times

{times}

## Three percentages

{percentages}

## Claims

{claims}
"""


@dataclass(frozen=True)
class Communication(Plan):
    """What to simulate.

    Parameters
    ----------
    runs : int
        Runs of each cell. Run r of all teams in a cell has the same seed.
    steps : int
        Steps after which a run is censored.
    seed : int
        Seed of all runs.
    robots, attractors : tuple of int
        The numbers of robots, and of attractors where there are any; each of one with each of the other is a cell.
    """

    runs: limits.Runs = 30
    steps: limits.Steps = 8000
    seed: Seed = root("foraging")
    robots: Annotated[tuple[Count, ...], Allowed()] = (1, 2, 3, 4, 5)
    attractors: Annotated[tuple[Count, ...], Allowed()] = (1, 3, 5, 7)

    def planned(self) -> Iterator[Planned]:
        """Yield each run with the columns that identify it: task, robots, attractors (0 for graze) and so on."""
        from teamsight.analysis.runs.run import task_run, task_seed
        from teamsight.tasks.registry import TASKS

        for name in TASK_NAMES:
            task = TASKS[name]
            for robots in self.robots:
                for attractors in self.attractors if "attractors" in task.scenario else (0,):
                    cell = {"robots": robots} | ({"attractors": attractors} if attractors else {})
                    for replicate in range(self.runs):
                        seed = task_seed(task, self.seed, replicate, cell)
                        for level in LEVELS:
                            team = {"policy": "schemas", "communication": level, "awareness": "pairwise"}
                            named = {"task": name, "robots": robots, "attractors": attractors, "replicate": replicate}
                            run = task_run(task, task.parameters(team, cell), seed, self.steps, UntilDone(task))
                            yield named | {"communication": level, "seed": seed}, run


@dataclass(frozen=True)
class UntilDone:
    """Runs a world until its task is done, and returns its objective and the largest number of neighbours.

    Parameters
    ----------
    task : Task
        The task.
    """

    task: Task

    def __call__(self, world: World, steps: int) -> dict[str, Any]:
        """Run the world for at most so many steps."""
        metric, objective = self.task.metrics[self.task.objective.metric], self.task.objective
        run_until(lambda world: not objective.is_censored(metric(world)), world, steps, _PART)
        time = float(metric(world))
        return {
            "time": objective.counted(time, steps), "censored": objective.is_censored(time),
            "max_neighbours": int(world.recording.max_neighbours(self.task.team)),
        }  # fmt: skip


def times(table: pd.DataFrame, task: str, level: str) -> Floats:
    """Return the completion times of a task with one level of communication, in the order of cells and replicates."""
    return column(table, "time", task=task, communication=level)


def gain(table: pd.DataFrame, task: str, level: str, over: str) -> Interval:
    """Return by which share the mean time with one level of communication is shorter than with another."""
    return saving(times(table, task, level), times(table, task, over))


def verdicts(table: pd.DataFrame) -> list[Verdict]:
    """Return the verdicts on all claims; `table` has a row for each run."""
    found = []
    for claim, source, rule, *of in CLAIMS:
        measured = gain(table, *of)
        decided = rule(measured) if rule is above else rule(measured, MARGIN)
        found.append(judged(claim, source, percent_text(measured), decided))
    # States give most of what goals give; undecided if goals give nothing.
    none, state, goal = (times(table, "forage", level) for level in LEVELS)
    share = interval_of(((none - state) - SHARE * (none - goal)) / none.mean())
    has_gain = gain(table, "forage", "goal", "none").low > 0.0
    verdict = no_less(share, 0.0) if has_gain else UNDECIDED
    note = "" if has_gain else "; goals gain nothing of which this could be a share"
    claim = f"B4 Forage: states give at least {SHARE:g} of the gain of goals"
    return [*found, judged(claim, READ, percent_text(share) + note, verdict)]


def draw(table: pd.DataFrame, plan: Communication) -> Canvas:
    """Return completion times against the number of robots, for each level of communication."""
    saved = (f"{task} {100 * gain(table, task, 'goal', 'none').mean:.0f} %" for task in TASK_NAMES)
    figure, shown = panels(
        f"Time saved by communicating goals: {minus(', '.join(saved))}",
        f"mean over numbers of attractors; {plan.runs} runs of each cell; 95 % confidence intervals; seed {plan.seed}",
        TASK_NAMES, x=ROBOTS_LABEL, y="steps to complete",
    )  # fmt: skip
    for task, axes in zip(TASK_NAMES, shown, strict=True):
        for level in LEVELS:
            samples = (column(table, "time", task=task, communication=level, robots=robots) for robots in plan.robots)
            draw_means(axes, plan.robots, intervals(samples), _COLOURS[level], level, as_bars=True)
        axes.set_ylim(bottom=0)
        mark_values(axes, plan.robots, is_log=False)
    shown[0].legend(frameon=False)
    return figure


def times_table(table: pd.DataFrame) -> str:
    """Return a table of mean completion times, and of censored runs."""
    cells = {(task, level): chosen(table, task=task, communication=level) for task in TASK_NAMES for level in LEVELS}
    rows = [
        [*of, f"{part['time'].mean():.0f}", f"{100 * part['censored'].mean():.1f} %", f"{part['max_neighbours'].max()}"]
        for of, part in cells.items()
    ]
    columns = ["task", "communication", "steps to complete", "censored", "largest number of neighbours"]
    return markdown.table(columns, rows, align="llrrr")


def percentages_table(table: pd.DataFrame) -> str:
    """Return a table of the percentages that Touzet (2000) quotes, beside ours."""
    rows = []
    for task, level, over, percent in PERCENTAGES:
        most, where = max(
            (gain(cell, task, level, over).mean, f"N = {robots}" + (f", {attractors} attractors" if attractors else ""))
            for (robots, attractors), cell in chosen(table, task=task).groupby(["robots", "attractors"])
        )
        rows.append([
            task, f"{level} over {over}", f"{percent:g} %", percent_text(gain(table, task, level, over)),
            f"{100 * most:+.1f} % at {where}".replace("-", "−"),
        ])  # fmt: skip
    columns = ["task", "communication", "theirs, at most", "ours, over all cells (95 %)", "ours, at most"]
    return markdown.table(columns, rows, align="llrrr")


PAPER = Paper(
    Communication, "foraging", _PAGE,
    lambda table, plan: {
        "robots": ", ".join(map(str, plan.robots)), "attractors": ", ".join(map(str, plan.attractors)),
        "margin": 100 * MARGIN, "times": times_table(table), "percentages": percentages_table(table),
    },
    {"foraging": draw}, lambda table, plan: verdicts(table), "time saved (95 %)",
    quick={"runs": 4, "robots": (1, 3, 5), "attractors": (1, 7)},
)  # fmt: skip
