"""When communication is worth its cost in forage: heavier loads, and more of them; a study of our own.

The mean over all numbers of attractors hides gains and losses. New runs tell them apart by number and by mass. About
the result: docs/tasks/foraging-loads.md.

\b
Examples:
  teamsight reproduce foraging_loads --out loads
  teamsight reproduce foraging_loads --quick --workers 1
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import product
from typing import TYPE_CHECKING, Annotated, Any

from teamsight.analysis.papers import reproduction
from teamsight.analysis.papers.balch_arkin1994 import LEVELS, UntilDone, gain, gains_by
from teamsight.analysis.papers.reproduction import Paper, rows_of, verdict_of
from teamsight.analysis.plot.kinds import draw_means, mark_values, panels
from teamsight.analysis.plot.style import FAINT, minus, shades
from teamsight.analysis.runs import limits
from teamsight.analysis.runs.seeds import root
from teamsight.analysis.stats.paired import Interval
from teamsight.analysis.stats.verdicts import Verdict, above
from teamsight.core.component import Allowed, Count, Positive, Seed

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.figure import Figure as Canvas

    from teamsight.analysis.runs.simulate import Planned

_UNKNOWN = Interval(math.nan, -math.inf, math.inf)
_PAGE = """
# Loads and communication

Forage with {robots} robots, {attractors} attractors, each of a mass of {mass}; {plan.runs} runs of each cell, paired:
the levels of communication meet the same places. Root seed {plan.seed}. A run that takes longer than {plan.steps}
steps counts as so many; {censored} of {number_of_runs} did. Gains are shares of the mean time, with Student's 95 %
interval of the paired differences; none is corrected for the number of rows.

{gains}

{claims}
"""


@dataclass(frozen=True)
class Loads(reproduction.PaperPlan):
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
        Their numbers; all combinations with masses are cells.
    mass : tuple of float
        The masses of attractors; one of 5 halves the speed of a single carrier.
    """

    runs: limits.Runs = 200
    steps: limits.Steps = 8000
    seed: Seed = root("foraging: loads")
    robots: Annotated[tuple[Count, ...], Allowed()] = (2, 3, 4, 5)
    attractors: Annotated[tuple[Count, ...], Allowed()] = (1, 3, 5, 7)
    mass: Annotated[tuple[Positive, ...], Allowed()] = (5.0, 20.0, 50.0)

    def planned(self) -> Iterator[Planned]:
        """Yield each run with the columns that identify it: task, robots, attractors, mass and so on."""
        from teamsight.tasks.registry import TASKS

        task = TASKS["forage"]
        teams = {one: {"policy": "schemas", "communication": one, "awareness": "pairwise"} for one in LEVELS}
        for values in product(self.mass, self.attractors, self.robots):
            cell: dict[str, Any] = dict(zip(("mass", "attractors", "robots"), values, strict=True))
            how = task, self.seed, self.runs, cell, teams, self.steps, UntilDone(task)
            for level, replicate, seed, run in reproduction.paired_runs(*how):
                yield {"task": task.name, **cell, "replicate": replicate, "communication": level, "seed": seed}, run


def saved(table: pd.DataFrame) -> Interval:
    """Return what goals save over none in these runs; not known if there are none."""
    return gain(table, "forage", "goal", "none") if len(table) else _UNKNOWN


def _below(interval: Interval) -> str:
    """Return whether a quantity is below 0 by its interval."""
    return above(Interval(-interval.mean, -interval.high, -interval.low))


def less(interval: Interval, other: Interval) -> Interval:
    """Return the difference of two quantities from independent runs.

    The half-widths of their intervals are added as squares, which is exact for many runs.
    """
    mean = interval.mean - other.mean
    wide = math.hypot(interval.high - interval.mean, other.high - other.mean)
    return Interval(mean, mean - wide, mean + wide)


def verdicts(table: pd.DataFrame, plan: Loads) -> list[Verdict]:
    """Return the verdicts on our claims, which were written down before the runs were made.

    Two carriers of a mass m take it 2 · (5 + m) / (10 + m) times as fast as one, which is less than the two loads that
    they would carry apart, but nearly as much for a large mass. So helping should cost most where loads are light.
    """
    light, heavy = min(plan.mass), max(plan.mass)
    several = table[table["attractors"] > 1]
    small, large = (saved(rows_of(several, mass=mass)) for mass in (light, heavy))
    one = saved(rows_of(table, mass=light, attractors=1))
    of = (
        (f"L1 One attractor of mass {light:g}: goals save time", one, above),
        (f"L2 Several of mass {light:g}: goals cost time", small, _below),
        (f"L3 Several of mass {heavy:g}: goals save time", large, above),
        (f"L4 Several: goals save more with mass {heavy:g} than with {light:g}", less(large, small), above),
    )
    return [verdict_of(claim, "ours", interval, "%", rule) for claim, interval, rule in of]


def draw(table: pd.DataFrame, plan: Loads) -> Canvas:
    """Return what communication saves against the number of attractors, for each mass."""
    goals = (f"{100 * saved(rows_of(table, mass=mass)).mean:.0f} % (mass {mass:g})" for mass in plan.mass)
    figure, shown = panels(
        f"Time saved by communicating goals in forage: {minus(', '.join(goals))}",
        f"mean over {min(plan.robots)} to {max(plan.robots)} robots; {plan.runs} runs of each cell; 95 % confidence "
        f"intervals; seed {plan.seed}",
        [f"mass {one:g}" for one in plan.mass], x="number of attractors", y="time saved over none [%]", sharey=True,
    )  # fmt: skip
    for mass, axes in zip(plan.mass, shown, strict=True):
        for level, colour in zip(LEVELS[1:], shades(2), strict=True):
            cells = (rows_of(table, mass=mass, attractors=one) for one in plan.attractors)
            gains = [Interval(*(100 * end for end in gain(cell, "forage", level, "none"))) for cell in cells]
            draw_means(axes, plan.attractors, gains, colour, level, as_bars=True)
        axes.axhline(0.0, color=FAINT, linewidth=0.8, linestyle=":")
        mark_values(axes, plan.attractors, is_log=False)
    shown[0].legend(frameon=False)
    return figure


def page_values(table: pd.DataFrame, plan: Loads) -> dict[str, Any]:
    """Return the values of the page."""
    found = {name: ", ".join(f"{one:g}" for one in getattr(plan, name)) for name in ("robots", "attractors", "mass")}
    counts = {"censored": f"{int(table['censored'].sum()):,}", "number_of_runs": f"{len(table):,}"}
    return {name: minus(text) for name, text in (found | counts | {"gains": gains_by(table, "mass")}).items()}


PAPER = Paper(
    plan=Loads, name="foraging-loads", page="tasks/foraging-loads", template=_PAGE, values=page_values,
    figures={"foraging-loads": draw}, verdicts=verdicts, measured="time saved by goals (95 %)",
    quick={"runs": 8, "robots": (3, 5), "attractors": (1, 7)},
    small={"runs": 1, "steps": 20, "robots": (2,), "attractors": (1, 3), "mass": (5.0, 20.0)},
)  # fmt: skip
