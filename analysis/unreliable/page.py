"""The points of both sweeps as tables of Markdown."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from functools import partial
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
    for sweep, (title, _) in _HEADINGS.items():
        said = "\n".join(f"- {line}" for line in sentences(table, points, sweep))
        parts += [f"## {title}", said, sweep_table(points, sweep)]
    return markdown.page(*parts)


def sweep_table(points: pd.DataFrame, sweep: str) -> str:
    """Return a table with a row for each quantity and scenario, and a column for each value of the sweep.

    Parameters
    ----------
    points : DataFrame
        From `points.points`.
    sweep : str
        "failures" or "periods".
    """
    of = points[points["sweep"] == sweep]
    values = of["value"].unique().tolist()
    rows = []
    for name, policy, write in _quantities(of["policy"].unique().tolist()):
        for (robots, radius), scenario in of[of["policy"] == policy].groupby(["robots", "radius"], sort=False):
            found = {point["value"]: write(point) for point in scenario.to_dict("records")}
            rows.append([name, f"{robots}", f"{radius:g}", *(found[value] for value in values)])
    columns = [f"quantity, against the {_HEADINGS[sweep][1]}", "N", "R", *(f"{value:g}" for value in values)]
    return markdown.table(columns, rows, align="l" + "r" * (len(columns) - 1))


def _quantities(policies: Sequence[str]) -> Iterator[tuple[str, str, Callable[[dict[Any, Any]], str]]]:
    """Yield the name of each quantity, a policy whose points have it, and how it is written."""
    missing = {TEAMS[policy][1]: policy for policy in reversed(policies)}
    for policy in policies:
        yield f"gain [points], {TEAMS[policy][0]}", policy, partial(_plus_minus, "gain", signed=True)
    for policy in policies:
        yield f"observed [%], {TEAMS[policy][0]}", policy, partial(_plus_minus, "aware")
    for team, policy in missing.items():
        yield f"observed [%], {team}", policy, partial(_plus_minus, "unaware")
    for policy in policies:
        yield f"δ (its bounds), {TEAMS[policy][0]}", policy, _range
    for policy in policies:
        yield f"neighbours, {TEAMS[policy][0]}", policy, lambda point: f"{point['neighbours']:.2f}"
    for team, policy in missing.items():
        yield f"neighbours, {team}", policy, lambda point: f"{point['unaware_neighbours']:.2f}"


def _conditions(plan: Plan) -> str:
    return (
        f"{plan.runs} runs of {plan.steps} steps in each condition, {TARGETS} targets, ranges 1, default speeds, root "
        f"seed {plan.seed}. Failures and repairs take exponential times; the mean time to repair is {plan.repair:g} "
        f"ticks. Robots that sense rarely have random phases. δ is for a risk of {RISK:g}, from the runs with "
        "awareness; its bounds have 95 % confidence each. Intervals are those of Student's t, 95 %; all differences "
        "are paired. A gain is over A-CMOMMT without awareness. Neighbours are means over active robots and steps."
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


def _plus_minus(name: str, point: dict[Any, Any], *, signed: bool = False) -> str:
    wide = point[f"{name}_high"] - point[name]
    mean = _signed(point[name]) if signed else f"{point[name]:.1f}"
    return f"{mean} ± {wide:.1f}" if np.isfinite(wide) else mean


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
