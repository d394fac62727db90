"""The page: rows, pucks and claims."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pandas as pd

from teamsight.analysis.collecting.claims import RECALLED, values, verdicts
from teamsight.analysis.collecting.plan import SCHEMES, Plan
from teamsight.analysis.plot import markdown
from teamsight.analysis.stats.paired import interval_of
from teamsight.policies.basis import BEHAVIOURS, CLEAR_ROWS, CORRECT

_NOT_A_REPRODUCTION = (
    "This is no reproduction of numbers: Mataric's arena, ranges, night, weights and the sizes of her reinforcement "
    "are not known to us, and ours were not fitted to her results. Claims that are recalled and not verified agree or "
    "differ."
)
_CONDITIONS = {8: "puck", 4: "at home", 2: "night", 1: "intruder"}


def page(table: pd.DataFrame, plan: Plan) -> str:
    """Return the page.

    Parameters
    ----------
    table : DataFrame
        That of the runs of `plan`.
    plan : Plan
        What was simulated.
    """
    return markdown.page(
        "# Learning to collect pucks",
        _plan_text(plan), _NOT_A_REPRODUCTION,
        "## Rows and pucks", conditions_table(table, plan),
        "## Each row", rows_table(table, plan),
        "## Claims", claims_table(table, plan),
    )  # fmt: skip


def conditions_table(table: pd.DataFrame, plan: Plan) -> str:
    """Return a table with a row for each condition: rows learned right, and pucks delivered."""
    rows = []
    for size in plan.sizes:
        for condition in plan.policies(size):
            shares = [_text(100.0 * values(table, condition, name, size)) for name in ("correct", "correct_intruder")]
            pucks = [_text(values(table, condition, name, size)) for name in ("delivered_early", "delivered")]
            slept = f"{100.0 * values(table, condition, 'slept_at_home', size).mean():.0f} %"
            rows.append([str(size), condition, *shares, *pucks, slept])
    columns = [
        "N", "condition", f"clear rows right after {plan.judged:,} steps [%]", "of those with an intruder [%]",
        "pucks delivered then", f"after {plan.times[-1]:,} steps", "woken at home",
    ]  # fmt: skip
    return markdown.table(columns, rows, align="rlrrrrr")


def rows_table(table: pd.DataFrame, plan: Plan) -> str:
    """Return a table with a row for each row of the conditions, and the share of robots that have learned it."""
    part = table[table["robots"] == plan.sizes[0]]
    shares = {name: np.mean(part[part["condition"] == name]["rows"].tolist(), axis=0) for name in SCHEMES}
    rows = []
    for row, answer in enumerate(CORRECT):
        if row & 8 and row & 4:
            continue
        named = ", ".join(name for bit, name in _CONDITIONS.items() if row & bit) or "none"
        learned = [f"{100.0 * shares[name][row]:.0f} %" for name in SCHEMES]
        rows.append([named, BEHAVIOURS[answer], "yes" if row in CLEAR_ROWS else "no", *learned])
    return markdown.table(["conditions", "behaviour", "clear", *SCHEMES], rows, align="lll" + "r" * len(SCHEMES))


def claims_table(table: pd.DataFrame, plan: Plan) -> str:
    """Return a table with a row for each claim."""
    rows = [list(one) for one in verdicts(table, plan)]
    return markdown.table(["claim", "source", "measured (95 %)", "verdict"], rows)


def summary(table: pd.DataFrame, plan: Plan) -> Sequence[str]:
    """Return the result in sentences."""
    found = verdicts(table, plan)
    recalled = [one.verdict for one in found if one.source == RECALLED]
    return [
        f"Of {len(recalled)} claims that are recalled of Mataric, {recalled.count('agrees')} agree and "
        f"{recalled.count('differs')} differ.",
        *(f"{one.claim}: {one.measured}, {one.verdict}." for one in found),
    ]


def _text(numbers: np.ndarray) -> str:
    """Return a mean with half its 95 % interval."""
    found = interval_of(numbers)
    wide = found.high - found.mean
    return f"{found.mean:.1f} ± {wide:.1f}" if np.isfinite(wide) else f"{found.mean:.1f}"


def _plan_text(plan: Plan) -> str:
    return (
        f"{plan.runs} learning runs of each condition, paired by their seed; root seed {plan.seed}. Rows are scored "
        f"for each robot after {plan.judged:,} steps, the same for all schemes. Pucks are those that a team delivers "
        f"in {plan.steps} steps when it learns no more, mean of {plan.tests} worlds for each run. Intervals are "
        "Student's, 95 %, over the runs, each by itself."
    )
