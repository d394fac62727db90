"""The page on modular learners: sizes of tables, steps to a capture, random hunters, and the claims."""

from __future__ import annotations

from collections.abc import Sequence

import pandas as pd

from teamsight.analysis.plot import markdown
from teamsight.analysis.plot.verdict_table import counts, verdict_table
from teamsight.analysis.pursuit.ono.claims import shown, verdicts
from teamsight.analysis.pursuit.ono.conditions import CONDITIONS, HUNTERS, SIDE, SMALLER
from teamsight.analysis.pursuit.ono.plan import Plan
from teamsight.analysis.pursuit.ono.rates import expected_steps, late_steps, random_steps
from teamsight.policies.online.modular_q import ModularQ

_OURS = (
    "Ono and Fukumoto's rates, their choice of actions and their prey's moves are not known to us. Ours: α = 0.1, γ = "
    "0.9, Boltzmann choice by the sum of the modules with T = 0.001, first values 0; reward 1 to every hunter at a "
    "capture and −0.1 at any other step; a prey that moves at random or stays; prey that would enter a hunter's cell "
    "stays, then hunters that would enter the prey's. They were chosen on other seeds."
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
    found = verdicts(table)
    return markdown.page(
        "# Modules against one table over all",
        f"{plan.runs} runs of each condition, root seed {plan.seed}. Four hunters on a torus must stand on all four "
        f"sides of one prey. {_OURS}",
        "## Tables of a hunter", sizes_table(),
        "## Steps to a capture", learners_table(table),
        "## Random hunters", random_table(table),
        f"## {len(found)} claims", verdict_table(found),
    )  # fmt: skip


def sizes_table(depths: Sequence[int] = (2, 3, 4)) -> str:
    """Return p^d, the rows of modules and of one table over all, and their values, for some depths of view."""
    rows = []
    for depth in depths:
        modular = ModularQ(depth)
        places = (2 * depth + 1) ** 2 + 1
        whole = places**HUNTERS
        rows.append([
            f"{depth}", f"{places}", f"{modular.tables * modular.rows:,}", f"{whole:,}", f"{modular.entries:,}",
            f"{whole * modular.moves:,}",
        ])  # fmt: skip
    titles = ["depth", "p", "rows of 3 modules, 3·p²", "rows of one table, p⁴", "values, modules", "values, one table"]
    return markdown.table(titles, rows, align="rrrrrr")


def learners_table(table: pd.DataFrame) -> str:
    """Return the steps to a capture at the end of learning, for each condition with learners."""
    rows = []
    for name in CONDITIONS:
        runs = table[table["condition"] == name]
        if runs.empty or name.startswith("random"):
            continue
        found = late_steps(table, name)
        bits, chance = runs["information"].mean(), runs["chance"].mean()
        rows.append([
            name, f"{int(runs['steps'].iloc[0]):,}", f"{runs['captures'].mean():,.0f}",
            f"{(runs['late'] > 0).sum()} of {len(runs)}", shown(found),
            f"{bits:.2f} ({chance:.2f})" if bits == bits else "",
        ])  # fmt: skip
    titles = [
        "hunters", "steps", "captures", "runs with a capture at the end", "steps to a capture at the end (95 %)",
        "mutual information, by chance [bit]",
    ]  # fmt: skip
    return markdown.table(titles, rows, align="lrrrrr")


def random_table(table: pd.DataFrame) -> str:
    """Return the steps to a capture of random hunters on tori of several sizes, beside the formula."""
    rows = []
    for side in (*SMALLER, SIDE):
        runs = table[table["condition"] == f"random, side {side}"]
        if runs.empty:
            continue
        found, formula = random_steps(table, f"random, side {side}"), expected_steps(side)
        ratio = f"{found.mean / formula:.2f}" if found.mean < float("inf") else ""
        rows.append([
            f"{side} × {side}", f"{int(runs['steps'].sum()):,}", f"{runs['captures'].sum():,}", shown(found),
            f"{formula:,.0f}", ratio,
        ])  # fmt: skip
    titles = ["torus", "steps", "captures", "steps to a capture (95 %)", "(side² − 1)⁴ / 4!", "ratio"]
    return markdown.table(titles, rows, align="lrrrrr")


def summary(table: pd.DataFrame) -> list[str]:
    """Return the result in a sentence."""
    return [f"Modules: {counts(verdicts(table))}"]
