"""The page: times, stagnation and neighbours of each team size, and the claims."""

from __future__ import annotations

from collections.abc import Sequence

import pandas as pd

from teamsight.analysis.plot import markdown
from teamsight.analysis.plot.verdict_table import verdict_table
from teamsight.analysis.pushing.claims import MARGIN, runs_of, same_runs, stagnation, verdicts
from teamsight.analysis.pushing.plan import Plan, agreement_of

_STRESS_TEST = (
    "This is a stress test and no reproduction: Kube and Zhang's ranges, speeds, box and results in numbers are not "
    "known to us, and the law of the box is ours. No claim has a number. Claims that are recalled and not verified "
    "agree or differ; only what was read can hold or fail."
)


def page(table: pd.DataFrame, plan: Plan) -> str:
    """Return the page.

    Parameters
    ----------
    table : DataFrame
        The table of the runs of the plan.
    plan : Plan
        What was simulated.
    """
    return markdown.page(
        "# Box pushing",
        _conditions(plan), _STRESS_TEST,
        "## Team sizes", sizes_table(table),
        "## Claims", verdict_table(verdicts(table)),
        "## Arbiters and awareness", _arbiters(plan), _awareness(table),
    )  # fmt: skip


def sizes_table(table: pd.DataFrame) -> str:
    """Return a table with a row for each number of robots."""
    rows = []
    for size in sorted(table["robots"].unique()):
        one = [f"{size}"]
        for team in ("fixed priority", "no recovery"):
            runs = runs_of(table, team, size)
            shares = stagnation(runs)
            one += [
                f"{runs['time'].mean():.0f}", f"{100 * runs['censored'].mean():.0f} %",
                f"{100 * shares.mean():.0f} %" if len(shares) else "–",
            ]  # fmt: skip
        one += [f"{runs_of(table, team, size)['max_neighbours'].mean():.1f}" for team in ("explore", "fixed priority")]
        rows.append(one)
    columns = [
        "robots", "steps", "censored", "stagnation", "steps without recovery", "censored", "stagnation",
        "neighbours when exploring", "with fixed priority",
    ]  # fmt: skip
    return markdown.table(columns, rows, align="r" * len(columns))


def summary(table: pd.DataFrame, plan: Plan) -> Sequence[str]:
    """Return the result in sentences."""
    return [
        *(f"{one.claim}: {one.verdict}, {one.measured}." for one in verdicts(table)),
        _arbiters(plan), _awareness(table),
    ]  # fmt: skip


def _arbiters(plan: Plan) -> str:
    learned, tested = agreement_of(plan.seed)
    return (
        f"The network selects the behaviour of the fixed priority in {100 * learned:.2f} % of the decisions from which "
        f"it learned, and in {100 * tested:.2f} % of those of other runs."
    )


def _awareness(table: pd.DataFrame) -> str:
    same, runs = same_runs(table, "fixed priority", "δ = 1")
    return (
        f"With the nearest teammate alone (δ = 1) instead of all teammates, {same} of {runs} runs with at least two "
        "robots are the same."
    )


def _conditions(plan: Plan) -> str:
    return (
        f"{plan.runs} runs of each team of each size, paired: all teams of a size meet the same places. Root seed "
        f"{plan.seed}. A run ends when the box has been moved by 10 units; one that takes longer than {plan.steps} "
        "steps is censored and counts as so many. *Stagnation* is the share of the steps with at least two robots that "
        "push in which the box does not move. Intervals have 95 %, each by itself: they are not corrected for the "
        f"number of claims. “The same time” means up to {100 * MARGIN:g} %. Neighbours are those within awareness "
        "range, up to the end of the run."
    )
