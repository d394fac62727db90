"""The page: the three percentages beside ours, and the claims."""

from __future__ import annotations

from collections.abc import Sequence

import pandas as pd

from teamsight.analysis.foraging.claims import MARGIN, PERCENTAGES, gain, largest, verdicts
from teamsight.analysis.foraging.plan import NAMES, Plan
from teamsight.analysis.plot import markdown
from teamsight.analysis.plot.verdict_table import verdict_table
from teamsight.analysis.stats.verdicts import FAILS, HOLDS, percent_text
from teamsight.policies.schemas import COMMUNICATION

_NOT_A_REPRODUCTION = (
    "This is no reproduction of the numbers: gains of the schemas, ranges and the law by which mass slows carriers "
    "down are not known to us, and ours were not fitted to them. Signs and order can hold or fail; claims that are "
    "recalled and not verified agree or differ."
)


def page(table: pd.DataFrame, plan: Plan) -> str:
    """Return the page.

    Parameters
    ----------
    table : DataFrame
        One row for each run of the plan.
    plan : Plan
        What was simulated.
    """
    return markdown.page(
        "# Forage, consume, graze",
        _conditions(plan), _NOT_A_REPRODUCTION,
        "## Completion times", times_table(table),
        "## Three percentages", percentages_table(table),
        "## Claims", verdict_table(verdicts(table), "time saved (95 %)"),
    )  # fmt: skip


def times_table(table: pd.DataFrame) -> str:
    """Return a table of mean completion times, and of censored runs."""
    rows = []
    for task in NAMES:
        for communication in COMMUNICATION:
            part = table[(table["task"] == task) & (table["communication"] == communication)]
            rows.append([
                task, communication, f"{part['time'].mean():.0f}", f"{100 * part['censored'].mean():.1f} %",
                f"{part['max_neighbours'].max()}",
            ])  # fmt: skip
    columns = ["task", "communication", "steps to complete", "censored", "largest number of neighbours"]
    return markdown.table(columns, rows, align="llrrr")


def percentages_table(table: pd.DataFrame) -> str:
    """Return a table of the percentages that Touzet (2000) quotes, beside ours."""
    rows = []
    for one in PERCENTAGES:
        most, where = largest(table, one.task, one.level, one.over)
        over_all = percent_text(gain(table, one.task, one.level, one.over))
        rows.append([
            one.task, f"{one.level} over {one.over}", f"{one.percent:g} %",
            over_all, f"{100 * most:+.1f} % at {where}".replace("-", "−"),
        ])  # fmt: skip
    columns = ["task", "communication", "theirs, at most", "ours, over all cells (95 %)", "ours, at most"]
    return markdown.table(columns, rows, align="llrrr")


def summary(table: pd.DataFrame) -> Sequence[str]:
    """Return the result in sentences."""
    found = [one.verdict for one in verdicts(table)]
    held, failed = found.count(HOLDS), found.count(FAILS)
    sure = sum(one in (HOLDS, FAILS) for one in found)
    return [
        f"Of {len(found)} claims, {sure} are certain enough and decided: {held} hold and {failed} do not.",
        *(
            f"{one.task}, {one.level} over {one.over}: {percent_text(gain(table, one.task, one.level, one.over))}; "
            f"Balch and Arkin {one.percent:g} % at most."
            for one in PERCENTAGES
        ),
    ]


def _conditions(plan: Plan) -> str:
    robots, attractors = (", ".join(map(str, one)) for one in (plan.robots, plan.attractors))
    return (
        f"{robots} robots; {attractors} attractors in forage and consume; {plan.runs} runs of each cell, paired: the "
        f"levels of communication meet the same places. Root seed {plan.seed}. A run that takes longer than "
        f"{plan.steps} steps is censored and counts as so many. Gains are shares of the mean time over all cells, with "
        f"Student's 95 % interval of the paired differences. “No difference” and “at least as good” mean up to "
        f"{100 * MARGIN:g} %. “At most” is the largest of the noisy means of all cells, which is above 0 by chance, "
        "too; no claim rests on it."
    )
