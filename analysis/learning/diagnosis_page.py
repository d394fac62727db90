"""The tables of a diagnosis in Markdown."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import pandas as pd

from teamsight.analysis.learning.diagnosis_measures import BINS
from teamsight.analysis.plot import markdown

# Intervals of distances in the tables: a few of those where little changes, and all near the sensing range.
_SHOWN = (2, 6, 10, 14, 16, 17, 18, 19)


def page(points: pd.DataFrame, conditions: str) -> str:
    """Return the tables; means with half of their 95 % intervals over the explorations.

    Parameters
    ----------
    points : DataFrame
        From `diagnosis_points`.
    conditions : str
        The settings in a line.
    """
    return markdown.page(
        "# Diagnosis",
        f"{conditions[0].upper()}{conditions[1:]}. Distances are in sensing ranges.",
        "## Mean reward of a move",
        _table(points, ("toward", "away", "effect", "rewarded by chance"), ("quantity",)),
        "## Share of the matches that show a target there",
        _table(points, ("matches", "matches by chance"), ("quantity", "inputs", "transitions")),
        "## Approach to the target, in steps",
        _table(points, ("approach",), ("learner", "inputs", "transitions")),
        "## Share of the chosen transitions that were rewarded",
        _table(points, ("rewarded",), ("learner", "inputs", "transitions")),
    )


def _table(points: pd.DataFrame, quantities: Sequence[str], by: Sequence[str]) -> str:
    """Return a table with a row for each combination of `by`, and a column for each interval that is shown."""
    columns = [f"{place / BINS:.2f}–{(place + 1) / BINS:.2f}" for place in _SHOWN]
    rows = []
    for quantity in quantities:
        of = points[points["quantity"] == quantity]
        for names, part in of.groupby(list(by), sort=True):
            cells = {round(point["distance"] * BINS - 0.5): _cell(point) for point in part.to_dict("records")}
            rows.append([*map(str, names), *(cells.get(place, "–") for place in _SHOWN)])
    return markdown.table([*by, *columns], rows)


def _cell(point: dict[Any, Any]) -> str:
    wide = point["high"] - point["mean"]
    return f"{point['mean']:.2f}" + (f" ± {wide:.2f}" if wide < float("inf") else "")
