"""The difference of two studies: runs under the same noise, subtracted in pairs."""

from __future__ import annotations

import json
from collections.abc import Collection, Sequence
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from teamsight.analysis.studies.definition.values import scalars
from teamsight.analysis.studies.figures.cells import is_same
from teamsight.core import checks

if TYPE_CHECKING:
    from teamsight.analysis.studies.results import Results

#: The name of the model among the parameters in which two studies may differ.
MODEL = "model"
# Values that an error lists.
_MOST_LISTED = 5
# Beside the axes, what identifies the world of a run.
_NOISE = ("replicate", "seed")


class Pairs(NamedTuple):
    """Runs of one study minus those of another.

    Attributes
    ----------
    values : ndarray of float64, shape (pairs,)
        The differences.
    row : ndarray of int64, shape (pairs,)
        The row of the first table that each comes from.
    """

    values: NDArray[np.float64]
    row: NDArray[np.int64]


def check_comparable(
    results: Results, minus: Results, across: Collection[str] = (), where: Collection[str] = ()
) -> None:
    """Raise an error if the runs of two studies have so little in common that a difference would mean nothing.

    Equal seeds show that two runs have the same noise, not that they are of the same task: the runs of a model of the
    user's own have seeds that do not depend on the parameters. So the steps must be equal, and the model. A parameter
    that one study varies must have only the value that it has in the other one.

    Parameters
    ----------
    results, minus : Results
        The study, and the one that is subtracted.
    across : collection of str
        Parameters, or "model", that may differ nevertheless.
    where : collection of str
        Axes of which one value was chosen, which may differ, too.

    Raises
    ------
    ValueError
        If steps, model or such a parameter differ, naming the values of both.
    """
    one, other = results.study, minus.study
    if one is None or other is None:
        raise ValueError("minus: needs two studies, whose runs are paired by their settings; give their folders")
    for name in across:
        names = (*one.fixed, *results.axes, *other.fixed, *minus.axes)
        checks.choice("across", name, [MODEL, *dict.fromkeys(names)])
    if one.steps != other.steps:
        raise ValueError(f"minus: has runs of {other.steps:,} steps, not {one.steps:,}; run both with the same steps")
    if one.model != other.model and MODEL not in across:
        raise ValueError(
            f"minus: is of the model {other.model}, not {one.model}, so equal seeds need not mean the same noise; "
            f"give across={MODEL} (--across {MODEL}) if they do"
        )
    for name in dict.fromkeys((*results.axes, *minus.axes)):
        if (name in results.axes and name in minus.axes) or name in across or name in where:
            continue
        varied, fixed = (results, other.fixed) if name in results.axes else (minus, one.fixed)
        values: list[object] = list(varied.settings[name].unique())
        wanted: object = "not given"
        if name in fixed:
            wanted = scalars([fixed[name]])[0]
            if all(is_same(value, wanted) for value in values):
                continue
        elif varied is minus:
            # Several runs to subtract from one are refused by `pair`.
            continue
        listed = ", ".join(map(str, values[:_MOST_LISTED])) + ", …" * (len(values) > _MOST_LISTED)
        shown = (listed, wanted) if varied is results else (wanted, listed)
        raise ValueError(
            f"{name}: is {shown[0]} in the study, {shown[1]} in that which is subtracted; choose a value by "
            f"where={name}=VALUE (--where), or give across={name} (--across) to subtract runs that differ in it"
        )


def pair(table: pd.DataFrame, base: pd.DataFrame, axes: Sequence[str], measure: str) -> Pairs:
    """Return the differences of all runs that both tables have under the same noise.

    Parameters
    ----------
    table, base : DataFrame
        One row for each run: the axes, replicate, seed and the measure.
    axes : sequence of str
        The axes that both studies have.
    measure : str
        What is subtracted.

    Raises
    ------
    ValueError
        If no run of one table has a counterpart in the other, or several in `base`.
    """
    keys = [*axes, *_NOISE]
    left, right = (_keyed(one, keys, measure) for one in (table, base))
    valued = right[right["value"].notna()]
    if valued.duplicated(keys).any():
        raise ValueError(
            f"{', '.join(axes) or 'axes'}: several runs to subtract have the same values, replicate and seed; give "
            "where= a value of the other study's further axes (--where NAME=VALUE)"
        )
    both = left.assign(row=np.arange(len(left))).merge(valued, on=keys, suffixes=("", "_base"))
    both = both[both["value"].notna()]
    if not len(both):
        raise ValueError(f"minus: {_unpaired(left, right, list(axes))}")
    return Pairs((both["value"] - both["value_base"]).to_numpy(float), both["row"].to_numpy(np.int64))


def _keyed(table: pd.DataFrame, keys: list[str], measure: str) -> pd.DataFrame:
    """Return a table by the values of its keys, of which those that are no numbers are texts."""

    def key(value: object) -> str:
        return value if isinstance(value, str) else json.dumps(value, sort_keys=True, default=str)

    are_numbers = {name: table[name].dtype.kind in "iuf" for name in keys}
    found = {name: table[name] if is_number else table[name].map(key) for name, is_number in are_numbers.items()}
    return pd.DataFrame(found).assign(value=table[measure].astype(float)).reset_index(drop=True)


def _unpaired(left: pd.DataFrame, right: pd.DataFrame, axes: list[str]) -> str:
    """Return why no runs are paired, and what to do."""
    counts = f"none of the {len(left):,} runs is paired with one of the {len(right):,} of the other study"
    for which, one in (("the study", left), ("that which is subtracted", right)):
        if len(one) and one["value"].isna().all():
            return f"{counts}: the measure has no value in any run of {which}; give another measure (--measure)"
    if axes and not len(left.merge(right[axes].drop_duplicates(), on=axes)):
        return f"{counts}: they have no values of {', '.join(axes)} in common; run both studies over the same values"
    return f'{counts}: their seeds differ; give both studies the same seed and pairing = "scenario"'
