"""Columns of settings that are listed one by one: points and samples."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from teamsight.analysis.studies.definition.axes import MOST_SETTINGS
from teamsight.analysis.studies.definition.values import Table, frozen
from teamsight.core import checks


def columns_of(where: str, given: object) -> Table:
    """Return columns of equal lengths, as tuples by name.

    Parameters
    ----------
    where : str
        The name used in errors.
    given : object
        A mapping of names to lists, or a DataFrame of pandas or polars.

    Raises
    ------
    TypeError, ValueError
        If it is not, has no rows, columns of different lengths, or a value that no study can hold, such as NaN.
    """
    table = _mapping(where, given)
    for name, values in table.items():
        if not isinstance(name, str):
            raise TypeError(f"{where}: the name {checks.shown(name)} must be a text, such as 'robots'")
        is_scalar = isinstance(values, np.ndarray) and values.ndim == 0
        if is_scalar or not isinstance(values, (list, tuple, range, np.ndarray)):
            raise TypeError(f"{where}.{name}={checks.shown(values)}: must be a list, with one value for each setting")
    lengths = {name: len(values) for name, values in table.items()}
    if len(set(lengths.values())) > 1:
        text = checks.shown(lengths)
        raise ValueError(f"{where}: columns have different lengths, {text}; give as many values in each")
    rows = max(lengths.values(), default=0)
    if not rows:
        raise ValueError(f"{where}: has no rows; give at least one, or remove it")
    if rows > MOST_SETTINGS:
        raise ValueError(f"{where}: has {rows:,} rows, at most {MOST_SETTINGS:,}; give fewer")
    return Table({str(name): frozen(f"{where}.{name}", values) for name, values in table.items()})


def _mapping(where: str, given: Any) -> Mapping[Any, Any]:
    if isinstance(given, str):
        raise TypeError(f"{where}={checks.shown(given)}: is read in study files only; give pandas.read_csv(…) here")
    if hasattr(given, "columns"):
        names = list(given.columns)
        if len(set(names)) < len(names):
            raise ValueError(f"{where}: the table has a column twice; keep one")
        return {name: np.asarray(given[name]).tolist() for name in names}
    if not isinstance(given, Mapping):
        raise TypeError(f"{where}={checks.shown(given)}: must be a mapping of parameters to lists, or a DataFrame")
    return given
