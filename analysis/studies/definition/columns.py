"""Columns of settings that are listed one by one: points and samples."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from teamsight.analysis.studies.definition.axes import MOST_SETTINGS, Values
from teamsight.analysis.studies.definition.values import Table, frozen
from teamsight.core import checks


def columns_of(where: str, given: object) -> Table:
    """Return columns of equal lengths, as tuples by name.

    Parameters
    ----------
    where : str
        The name used in errors.
    given : object
        A mapping of names to lists, or a table of pandas.

    Raises
    ------
    TypeError, ValueError
        If it is not, has no rows, columns of different lengths, or a value that is missing.
    """
    table: Any = given
    if type(given).__module__.startswith("pandas.") and hasattr(given, "columns"):
        table = {name: table[name].tolist() for name in table.columns}
    if not isinstance(table, Mapping) or not all(isinstance(one, (list, tuple, range, np.ndarray)) for one in table.values()):
        raise TypeError(f"{where}={checks.shown(given)}: must be a mapping of parameters to lists, or a DataFrame")
    lengths = {name: len(values) for name, values in table.items()}
    if len(set(lengths.values())) > 1:
        raise ValueError(f"{where}: columns have different lengths, {checks.shown(lengths)}; give as many values in each")
    if not lengths or 0 in lengths.values():
        raise ValueError(f"{where}: has no rows; give at least one, or remove it")
    rows = max(lengths.values())
    if rows > MOST_SETTINGS:
        raise ValueError(f"{where}: has {rows} rows, at most {MOST_SETTINGS}; give fewer")
    return Table({_named(where, name): _column(f"{where}.{name}", values) for name, values in table.items()})


def _named(where: str, name: object) -> str:
    if not isinstance(name, str):
        raise TypeError(f"{where}: the name {checks.shown(name)} must be a text, such as 'robots'")
    return str(name)


def _column(where: str, values: Any) -> Values:
    found: Values = frozen(where, values)
    return found
