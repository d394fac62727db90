"""The points of both sweeps as tables of Markdown."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from functools import partial
from typing import Any

import numpy as np
import pandas as pd

from teamsight.analysis.plot import markdown
from teamsight.analysis.unreliable.plan import Plan
from teamsight.analysis.unreliable.points import RISK, changes
from teamsight.analysis.unreliable.subject import CmommtSubject, Subject

_HEADINGS = {
    "failures": ("Failures", "availability"),
    "periods": ("Sensing periods", "period"),
}


def page(table: pd.DataFrame, points: pd.DataFrame, plan: Plan) -> str:
    """Return the page.

    Parameters
    ----------
    table : DataFrame
        The runs of the plan.
    points : DataFrame
        From `points.points`.
    plan : Plan
        What was simulated.
    """
    parts = ["# Unreliable teams", _conditions(plan)]
    for sweep, (title, _) in _HEADINGS.items():
        said = "\n".join(f"- {line}" for line in sentences(table, points, sweep, plan))
        parts += [f"## {title}", said, sweep_table(points, sweep, plan)]
    return markdown.page(*parts)


def sweep_table(points: pd.DataFrame, sweep: str, plan: Plan) -> str:
    """Return a table with a row for each quantity and scenario, and a column for each value of the sweep.

    Parameters
    ----------
    points : DataFrame
        From `points.points`.
    sweep : str
        "failures" or "periods".
    plan : Plan
        What was simulated.
    """
    columns = plan.subject.columns
    of = points[points["sweep"] == sweep]
    values = of["value"].unique().tolist()
    rows = []
    for name, policy, write in _quantities(of["policy"].unique().tolist(), plan.subject):
        for scenario, part in of[of["policy"] == policy].groupby([*columns], sort=False):
            found = {point["value"]: write(point) for point in part.to_dict("records")}
            rows.append([name, *map(_number, scenario), *(found[value] for value in values)])
    names = [{"robots": "N", "radius": "R"}.get(name, name) for name in columns]
    titles = [f"quantity, against the {_HEADINGS[sweep][1]}", *names, *(f"{value:g}" for value in values)]
    return markdown.table(titles, rows, align="l" + "r" * (len(titles) - 1))


def _number(value: object) -> str:
    return f"{value:g}" if isinstance(value, float) else f"{value}"


def _quantities(
    policies: Sequence[str], subject: Subject
) -> Iterator[tuple[str, str, Callable[[dict[Any, Any]], str]]]:
    """Yield the name of each quantity, a policy whose points have it, and how it is written."""
    teams = {policy: subject.name(policy, True) for policy in policies}
    missing = {subject.name(policy, False): policy for policy in reversed(policies)}
    for policy in policies:
        yield f"{subject.gained}, {teams[policy]}", policy, partial(_plus_minus, "gain", signed=True)
    for policy in policies:
        yield f"{subject.observed}, {teams[policy]}", policy, partial(_plus_minus, "aware")
    for team, policy in missing.items():
        yield f"{subject.observed}, {team}", policy, partial(_plus_minus, "unaware")
    for policy in policies:
        yield f"δ (its bounds), {teams[policy]}", policy, _range
    for policy in policies:
        yield f"neighbours, {teams[policy]}", policy, lambda point: f"{point['neighbours']:.2f}"
    for team, policy in missing.items():
        yield f"neighbours, {team}", policy, lambda point: f"{point['unaware_neighbours']:.2f}"


def _conditions(plan: Plan) -> str:
    return (
        f"{plan.runs} runs of {plan.steps} steps in each condition, {plan.subject.about}, root "
        f"seed {plan.seed}. Failures and repairs take exponential times; the mean time to repair is {plan.repair:g} "
        f"ticks. Robots that sense rarely have random phases. δ is for a risk of {RISK:g}, from the runs with "
        "awareness; its bounds have 95 % confidence each. Intervals are those of Student's t, 95 %; all differences "
        f"are paired. A gain is over {_without(plan)}. Neighbours are means over active robots and steps."
    )


def _without(plan: Plan) -> str:
    """Return the team over which others gain, in words."""
    if isinstance(plan.subject, CmommtSubject):
        return "A-CMOMMT without awareness"
    return "the same team without awareness, positive where awareness is better"


def sentences(table: pd.DataFrame, points: pd.DataFrame, sweep: str, plan: Plan) -> list[str]:
    """Return what the sweep shows, a sentence for each policy and scenario."""
    by = ["policy", *plan.subject.columns]
    change = dict(list(changes(table, sweep, plan).groupby(by, sort=False)))
    said = []
    for key, rows in points[points["sweep"] == sweep].groupby(by, sort=False):
        first, last = rows.iloc[0], rows.iloc[-1]
        who = f"{first['policy']}, {plan.subject.title(first.to_dict())}"
        text = f"{who}: gain {_interval(first, 'gain')} at {first['value']:g}"
        if len(rows) > 1:
            end = change[key].iloc[-1]
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


def summary(table: pd.DataFrame, points: pd.DataFrame, plan: Plan) -> Sequence[str]:
    """Return the sentences of both sweeps, each with the name of its sweep."""
    return [f"{sweep}: {line}" for sweep in _HEADINGS for line in sentences(table, points, sweep, plan)]
