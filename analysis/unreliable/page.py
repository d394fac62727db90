"""The points of both sweeps as tables of Markdown."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import pandas as pd

from teamsight.analysis.plot import markdown
from teamsight.analysis.unreliable.plan import TARGETS, TEAMS, Plan
from teamsight.analysis.unreliable.points import RISK, changes

_HEADINGS = {
    "failures": ("Failures", "availability"),
    "periods": ("Sensing periods", "period"),
}
_COLUMNS = ("observed with [%]", "without [%]", "gain [points]", "δ", "bounds of δ", "neighbours with", "without")


def page(table: pd.DataFrame, points: pd.DataFrame, plan: Plan) -> str:
    """Return the page.

    Parameters
    ----------
    table : DataFrame
        From `plan.simulate`.
    points : DataFrame
        From `points.points`.
    plan : Plan
        What was simulated.
    """
    parts = ["# Unreliable teams", _conditions(plan)]
    for sweep, (title, value) in _HEADINGS.items():
        parts += [f"## {title}", "\n".join(f"- {line}" for line in sentences(table, points, sweep))]
        of = points[points["sweep"] == sweep]
        for policy in plan.policies:
            given, missing = TEAMS[policy]
            parts.append(f"### {title}: {given} minus {missing}")
            rows = [_row(point) for point in of[of["policy"] == policy].to_dict("records")]
            columns = ["N", "R", value, *_COLUMNS]
            parts.append(markdown.table(columns, rows, align="r" * len(columns)))
    return markdown.page(*parts)


def _conditions(plan: Plan) -> str:
    return (
        f"{plan.runs} runs of {plan.steps} steps in each condition, {TARGETS} targets, ranges 1, default speeds, root "
        f"seed {plan.seed}. Failures and repairs take exponential times; the mean time to repair is {plan.repair:g} "
        f"ticks. Robots that sense rarely have random phases. δ is for a risk of {RISK:g}, from the runs with "
        "awareness; its bounds have 95 % confidence each. Intervals are those of Student's t, 95 %; all differences "
        "are paired."
    )


def sentences(table: pd.DataFrame, points: pd.DataFrame, sweep: str) -> list[str]:
    """Return what the sweep shows, a sentence for each policy and scenario."""
    change = changes(table, sweep)
    said = []
    for (policy, robots, radius), rows in points[points["sweep"] == sweep].groupby(
        ["policy", "robots", "radius"], sort=False
    ):
        first, last = rows.iloc[0], rows.iloc[-1]
        of = change[(change["policy"] == policy) & (change["robots"] == robots) & (change["radius"] == radius)]
        text = f"{policy}, N = {robots}, R = {radius:g}: gain {_interval(first, 'gain')} at {first['value']:g}"
        if len(rows) > 1:
            end = of.iloc[-1]
            text += (
                f", {_interval(last, 'gain')} at {last['value']:g}; change {_signed(end['change'])}"
                f"{_ends(end['low'], end['high'])}. δ {_range(first)} and {_range(last)}"
            )
        said.append(f"{text}.")
    return said


def _row(point: dict[Any, Any]) -> list[str]:
    named = [f"{point['robots']}", f"{point['radius']:g}", f"{point['value']:g}"]
    observed = [f"{point[name]:.1f} ± {point[f'{name}_high'] - point[name]:.1f}" for name in ("aware", "unaware")]
    gain = _interval(point, "gain")
    high = f"{point['delta_safe']}" if point["supported"] else "too few runs"
    bounds = f"{point['delta_low']} to {high}"
    neighbours = [f"{point[name]:.2f}" for name in ("neighbours", "unaware_neighbours")]
    return [*named, *observed, gain, f"{point['delta']}", bounds, *neighbours]


def _range(point: Any) -> str:
    high = f" to {point['delta_safe']}" if point["supported"] else ""
    return f"{point['delta']} ({point['delta_low']}{high})"


def _interval(point: Any, name: str) -> str:
    return f"{_signed(point[name])}{_ends(point[f'{name}_low'], point[f'{name}_high'])}"


def _ends(low: float, high: float) -> str:
    return f" ({_signed(low)} to {_signed(high)})" if np.isfinite(low) else ""


def _signed(value: float) -> str:
    # 0 is added, since a number that rounds to 0 is not negative.
    return f"{round(value, 1) + 0.0:+.1f}".replace("-", "−")


def summary(table: pd.DataFrame, points: pd.DataFrame) -> Sequence[str]:
    """Return the sentences of both sweeps, each with the name of its sweep."""
    return [f"{sweep}: {line}" for sweep in _HEADINGS for line in sentences(table, points, sweep)]
