"""The page of the ledger: Tan's values beside ours, and the claims."""

from __future__ import annotations

import math
from collections.abc import Sequence

import pandas as pd

from teamsight.analysis.plot import markdown
from teamsight.analysis.plot.verdict_table import counts, verdict_table
from teamsight.analysis.pursuit.claims import verdicts
from teamsight.analysis.pursuit.ledger import AGREES, DIFFERS, UNDECIDED, WIDEST, Row, rows
from teamsight.analysis.pursuit.plan import Plan
from teamsight.analysis.pursuit.trials import SETTLED

_INFERRED = (
    "Tan does not say in which order agents move, what “next to” means, what a move against the wall does, or how the "
    "last step of a trial is valued. These are our inferences. Hunters move first where one captures, all move at once "
    "where two must; diagonals are next to a cell; a move against the wall is lost: so random hunters need as many "
    "steps as his. The value of what is perceived at a capture counts like any other, as his formula reads."
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
    ledger, found = rows(table), verdicts(table)
    return markdown.page(
        "# Tan's pursuit",
        _conditions(plan), _INFERRED,
        f"## {len(ledger)} values", _counts(ledger), ledger_table(ledger),
        f"## {len(found)} claims", by_chance(len(found)), verdict_table(found),
    )  # fmt: skip


def ledger_table(ledger: Sequence[Row]) -> str:
    """Return a table with a row for each value of Tan."""
    columns = ["where", "prey/hunters", "phase", "Tan", "ours", "95 %", "difference", "verdict"]
    return markdown.table(columns, [_cells(row) for row in ledger], align="lllrrrrl")


def _cells(row: Row) -> list[str]:
    value = row.value
    return [
        value.where, value.condition, value.phase, _plus_minus(value.steps, value.half),
        _plus_minus(row.mean, row.half90), f"± {row.half95:.1f}" if math.isfinite(row.half95) else "",
        f"{row.difference:+.1f} ({row.low:+.1f} to {row.high:+.1f})".replace("-", "−"), row.verdict,
    ]  # fmt: skip


def summary(table: pd.DataFrame) -> list[str]:
    """Return the result in three sentences."""
    found = verdicts(table)
    return [_counts(rows(table)), counts(found), by_chance(len(found))]


def by_chance(claims: int) -> str:
    """Return how many claims would hold by chance."""
    return (
        "Each claim is judged by its own 95 % interval: if nothing made a difference, at most one in 40 would hold by "
        f"chance, {claims / 40:.1f} of {claims}."
    )


def _counts(ledger: Sequence[Row]) -> str:
    agree, differ, open_ = (sum(row.verdict == name for row in ledger) for name in (AGREES, DIFFERS, UNDECIDED))
    return f"Of {len(ledger)} values of Tan {agree} agree, {differ} differ, {open_} are undecided."


def _conditions(plan: Plan) -> str:
    return (
        f"{plan.runs} runs of each condition, root seed {plan.seed}. Values are mean steps of a trial: for training "
        f"over its last {SETTLED} trials, for tests over {plan.tests} trials of the greedy policy. Intervals of values "
        "are Student's, 90 % as Tan gives them, and 95 %. A difference has Welch's 95 % interval: a value agrees if "
        f"that contains 0 and reaches at most {WIDEST:.0%} of the value to either side, is undecided if it contains 0 "
        "and is wider, and differs otherwise. Tan's random hunters are a mean over 200 trials. Values of his figures, "
        "and of learners in his Table 1, have no interval: there only ours counts."
    )


def _plus_minus(mean: float, half: float | None) -> str:
    return f"{mean:.2f}" if half is None or not math.isfinite(half) else f"{mean:.2f} ± {half:.2f}"
