"""From runs to points: the gain from awareness and δ in each condition, with intervals."""

from __future__ import annotations

from typing import Any

import numpy as np
import pandas as pd

from teamsight.analysis.stats import exceedance
from teamsight.analysis.stats.paired import interval_of
from teamsight.analysis.unreliable.plan import Plan

#: The risk for which δ is stated, and the confidence of each of its bounds.
RISK, CONFIDENCE = 0.05, 0.95


def points(table: pd.DataFrame, plan: Plan) -> pd.DataFrame:
    """Return one row for each condition.

    Parameters
    ----------
    table : DataFrame
        The runs of the plan.
    plan : Plan
        What was simulated.

    Returns
    -------
    DataFrame
        sweep, value, policy and the scenario (of CMOMMT, robots and radius); count (runs); the objective with awareness
        and without (of CMOMMT, the observed fraction in percent), and gain, their paired difference, positive where
        awareness is better, all with the ends of their 95 % intervals; delta, the
        point estimate for the risk `RISK` in the runs with awareness, delta_low and delta_safe, between which it lies
        (each with `CONFIDENCE`), supported (whether there are enough runs for delta_safe); neighbours and
        unaware_neighbours, the mean numbers over the active robots and the steps, with the ends of their intervals.
    """
    condition = ["sweep", "value", "policy", *plan.subject.columns]
    groups = table.groupby(condition, sort=False)
    return pd.DataFrame([dict(zip(condition, key, strict=True)) | _point(rows, plan) for key, rows in groups])


def _objective(rows: pd.DataFrame, plan: Plan) -> pd.Series[float]:
    """Return the objective of runs; a censored run counts as its length."""
    subject = plan.subject
    task = subject.task
    counted = rows[task.objective.metric].map(lambda value: task.objective.counted(value, plan.steps or task.steps))
    return subject.scale * counted


def _point(rows: pd.DataFrame, plan: Plan) -> dict[str, Any]:
    aware, unaware = (rows[rows["aware"] == which].set_index("replicate").sort_index() for which in (True, False))
    assert aware.index.equals(unaware.index)
    with_, without = (np.asarray(_objective(part, plan), np.float64) for part in (aware, unaware))
    task = plan.subject.task
    point: dict[str, Any] = {"count": len(aware)}
    for name, values in (
        ("aware", with_),
        ("unaware", without),
        ("gain", task.objective.sign * (with_ - without)),
        ("neighbours", aware["mean_neighbours"].to_numpy()),
        ("unaware_neighbours", unaware["mean_neighbours"].to_numpy()),
    ):
        found = interval_of(values)
        point |= {name: found.mean, f"{name}_low": found.low, f"{name}_high": found.high}
    curve = exceedance.curve(aware["max_neighbours"], int(rows[task.size].iloc[0]), confidence=CONFIDENCE)
    chosen = {
        name: exceedance.smallest_delta(curve, column, RISK)
        for name, column in (("delta", "probability"), ("delta_low", "low"), ("delta_safe", "high"))
    }
    return point | chosen | {"supported": exceedance.supports(len(aware), RISK, CONFIDENCE)}


def changes(table: pd.DataFrame, sweep: str, plan: Plan) -> pd.DataFrame:
    """Return how the gain changes along a sweep: in each condition minus the first one, paired by seed.

    Parameters
    ----------
    table : DataFrame
        The runs of the plan.
    sweep : str
        "failures" or "periods".
    plan : Plan
        What was simulated.

    Returns
    -------
    DataFrame
        policy, the scenario, value, change (of CMOMMT in percentage points), low, high (95 % interval).
    """
    of = table[table["sweep"] == sweep]
    first, found = of["value"].iloc[0], []
    by, sign = ["policy", *plan.subject.columns], plan.subject.task.objective.sign
    for key, rows in of.assign(counted=_objective(of, plan)).groupby(by, sort=False):
        wide = rows.pivot(index="replicate", columns=["value", "aware"], values="counted")
        gains = {value: sign * (wide[value][True] - wide[value][False]) for value in rows["value"].unique()}
        for value, gain in gains.items():
            if value != first:
                change = interval_of(np.asarray(gain - gains[first], np.float64))
                found.append((*key, value, *change))
    return pd.DataFrame(found, columns=[*by, "value", "change", "low", "high"])
