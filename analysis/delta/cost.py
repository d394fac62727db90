"""Cost of each degree of awareness at one team size."""

from __future__ import annotations

from typing import Any

import pandas as pd

from teamsight.agents.awareness.registry import AWARENESS, awareness_named
from teamsight.analysis import search_space


def cost_table(team_size: int, deltas: list[int]) -> pd.DataFrame:
    """Return what each degree costs at this team size, those that have a δ once for each.

    Returns
    -------
    DataFrame
        degree, growth, formula (str); delta (Int64, missing where there is none), own, added, inputs (by the paper's
        formulas), log10_size (of p^d with p = 2 readings, the fewest that a sensor can have); added_here, what the
        arrays of a situation really add with N − 1 teammates.
    """
    rows = []
    for name, degree in AWARENESS.items():
        for delta in sorted(set(deltas)) if "delta" in degree.options() else [None]:
            table = search_space.dimensions_table([team_size], delta=delta or search_space.DELTA)
            row = dict[Any, Any](table[table["degree"] == name].iloc[0])
            here = awareness_named(name, {"delta": delta}).width(team_size).added
            rows.append(row | {"delta": delta, "added_here": here})
    columns = ["degree", "growth", "formula", "delta", "own", "added", "inputs", "log10_size", "added_here"]
    return pd.DataFrame(rows)[columns].astype({"delta": "Int64"})
