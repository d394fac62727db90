"""The difference of two studies: runs under the same noise, subtracted in pairs."""

from __future__ import annotations

import json
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import pandas as pd
from numpy.typing import NDArray

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
    right = right[right["value"].notna()]
    if right.duplicated(keys).any():
        raise ValueError(
            f"{', '.join(axes) or 'axes'}: several runs to subtract have the same values, replicate and seed; give "
            "where= a value of the other study's further axes (--where NAME=VALUE)"
        )
    both = left.assign(row=np.arange(len(left))).merge(right, on=keys, suffixes=("", "_base"))
    both = both[both["value"].notna()]
    if not len(both):
        raise ValueError(f"minus: {_unpaired(left, right, list(axes))}")
    return Pairs((both["value"] - both["value_base"]).to_numpy(float), both["row"].to_numpy(np.int64))


def _keyed(table: pd.DataFrame, keys: list[str], measure: str) -> pd.DataFrame:
    found = pd.DataFrame({name: table[name].map(_key) if _is_text(table[name]) else table[name] for name in keys})
    return found.assign(value=table[measure].astype(float)).reset_index(drop=True)


def _is_text(column: pd.Series) -> bool:  # type: ignore[type-arg]
    return not pd.api.types.is_numeric_dtype(column) or pd.api.types.is_bool_dtype(column)


def _key(value: object) -> str:
    return value if isinstance(value, str) else json.dumps(value, sort_keys=True, default=str)


def _unpaired(left: pd.DataFrame, right: pd.DataFrame, axes: list[str]) -> str:
    """Return why no runs are paired, and what to do."""
    counts = f"none of the {len(left):,} runs is paired with one of the {len(right):,} of the other study"
    if axes and not len(left.merge(right[axes].drop_duplicates(), on=axes)):
        return f"{counts}: they have no values of {', '.join(axes)} in common; run both studies over the same values"
    return f'{counts}: their seeds differ; give both studies the same seed and pairing = "scenario"'
