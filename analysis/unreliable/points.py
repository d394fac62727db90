"""From runs to points: the gain from awareness and δ in each condition, with intervals."""

from __future__ import annotations

from typing import Any

import pandas as pd

from teamsight.analysis.stats import exceedance
from teamsight.analysis.stats.paired import interval_of

#: The risk for which δ is stated, and the confidence of each of its bounds.
RISK, CONFIDENCE = 0.05, 0.95

_CONDITION = ["sweep", "value", "policy", "robots", "radius"]


def points(table: pd.DataFrame) -> pd.DataFrame:
    """Return one row for each condition.

    Parameters
    ----------
    table : DataFrame
        From `plan.simulate`.

    Returns
    -------
    DataFrame
        sweep, value, policy, robots, radius; count (runs); the observed fraction with awareness and without, and gain,
        their paired difference, all in percent or percentage points with the ends of their 95 % intervals; delta, the
        point estimate for the risk `RISK` in the runs with awareness, delta_low and delta_safe, between which it lies
        (each with `CONFIDENCE`), supported (whether there are enough runs for delta_safe); neighbours and
        unaware_neighbours, the mean numbers over the active robots and the steps, with the ends of their intervals.
    """
    found = [
        dict(zip(_CONDITION, key, strict=True)) | _point(rows) for key, rows in table.groupby(_CONDITION, sort=False)
    ]
    return pd.DataFrame(found)


def _point(rows: pd.DataFrame) -> dict[str, Any]:
    aware, unaware = (rows[rows["aware"] == which].set_index("replicate").sort_index() for which in (True, False))
    assert aware.index.equals(unaware.index)
    aware_percent, unaware_percent = (100.0 * part["observed_fraction"].to_numpy() for part in (aware, unaware))
    point: dict[str, Any] = {"count": len(aware)}
    for name, values in (
        ("aware", aware_percent),
        ("unaware", unaware_percent),
        ("gain", aware_percent - unaware_percent),
        ("neighbours", aware["mean_neighbours"].to_numpy()),
        ("unaware_neighbours", unaware["mean_neighbours"].to_numpy()),
    ):
        found = interval_of(values)
        point |= {name: found.mean, f"{name}_low": found.low, f"{name}_high": found.high}
    curve = exceedance.curve(aware["max_neighbours"], int(rows["robots"].iloc[0]), confidence=CONFIDENCE)
    chosen = {
        name: exceedance.smallest_delta(curve, column, RISK)
        for name, column in (("delta", "probability"), ("delta_low", "low"), ("delta_safe", "high"))
    }
    return point | chosen | {"supported": exceedance.supports(len(aware), RISK, CONFIDENCE)}


def changes(table: pd.DataFrame, sweep: str) -> pd.DataFrame:
    """Return how the gain changes along a sweep: in each condition minus the first one, paired by seed.

    Parameters
    ----------
    table : DataFrame
        From `plan.simulate`.
    sweep : str
        "failures" or "periods".

    Returns
    -------
    DataFrame
        policy, robots, radius, value, change [percentage points], low, high (95 % interval).
    """
    of = table[table["sweep"] == sweep]
    first, found = of["value"].iloc[0], []
    for key, rows in of.groupby(["policy", "robots", "radius"], sort=False):
        wide = rows.pivot(index="replicate", columns=["value", "aware"], values="observed_fraction")
        gains = {value: 100.0 * (wide[value][True] - wide[value][False]) for value in rows["value"].unique()}
        for value, gain in gains.items():
            if value != first:
                change = interval_of((gain - gains[first]).to_numpy())
                found.append((*key, value, *change))
    return pd.DataFrame(found, columns=["policy", "robots", "radius", "value", "change", "low", "high"])
