"""How many replicates each setting needs until its interval is narrow enough."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

from teamsight.analysis.studies.definition.recording import Until

#: Replicates at the first look, at least: a spread that few runs show may be far too small.
FIRST_LOOK = 30
#: Growth from one look to the next.
GROWTH = 1.25
#: Successive looks at which the interval must be narrow enough.
NARROW_LOOKS = 2


def looks(until: Until, start: int) -> Iterator[int]:
    """Yield the numbers of replicates at which the interval is looked at; the last is the limit.

    Parameters
    ----------
    until : Until
        The limit.
    start : int
        The replicates of the study: the first ones.
    """
    count = min(max(start, FIRST_LOOK), until.limit)
    yield count
    while count < until.limit:
        count = min(math.ceil(count * GROWTH), until.limit)
        yield count


def replicates_needed(until: Until, start: int, values: Sequence[float]) -> int:
    """Return how many replicates a setting needs, as far as its present ones show.

    The interval is looked at when the setting has certain numbers of replicates, and must be narrow enough at two
    looks in succession. So the answer depends on the setting's own replicates 0, 1, … alone, and not on the order or
    the pieces in which they were made.

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
        The number of replicates. No more are needed if it is at most ``len(values)``.

    Notes
    -----
    To stop as soon as one interval is narrow favours samples whose spread is too small by chance; a 95 % interval then
    covers the mean in about 93 % of studies. With at least 30 replicates and two looks it is 94 to 95 %:
    ``benchmarks/adaptive_coverage.py`` simulates it.
    """
    given = np.asarray(values, np.float64)
    settings = np.zeros(len(given), np.int64)
    return int(all_needed(until, start, settings, np.arange(len(given)), given, 1)[0])


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
        The number of the setting in the plan, and that of the replicate, of each run that was made; in any order.
    value : array of float
        The measure of each; NaN for failed runs.
    settings : int
        The number of settings.

    Returns
    -------
    array of int
        Replicates of each setting, (settings,).
    """
    order = np.lexsort((replicate, setting))
    setting, replicate, value = setting[order], replicate[order], value[order]
    needed = np.full(settings, -1, np.int64)
    narrow = np.zeros(settings, np.int64)
    for count in looks(until, start):
        within = replicate < count
        made = np.bincount(setting[within], minlength=settings)
        needed[(needed < 0) & (made < count)] = count
        width = _widths(setting[within], value[within], settings)
        # Where no run of a setting succeeds, more would be of no use.
        hopeless = np.bincount(setting[within & np.isfinite(value)], minlength=settings) == 0
        narrow = np.where(width <= until.interval, narrow + 1, 0)
        needed[(needed < 0) & ((narrow >= NARROW_LOOKS) | hopeless | (count == until.limit))] = count
        open_ = needed < 0
        if not open_.any():
            break
        kept = open_[setting]
        setting, replicate, value = setting[kept], replicate[kept], value[kept]
    return needed


def _widths(setting: NDArray[np.int64], value: NDArray[np.float64], settings: int) -> NDArray[np.float64]:
    """Return the width of the 95 % interval of the mean of each setting; infinite for fewer than two values."""
    # Slow to import.
    from teamsight.analysis.stats.paired import half_width

    finite = np.isfinite(value)
    setting, value = setting[finite], value[finite]
    count = np.bincount(setting, minlength=settings)
    mean = np.bincount(setting, value, settings) / np.maximum(count, 1)
    squares = np.bincount(setting, (value - mean[setting]) ** 2, settings)
    error = np.sqrt(squares / np.maximum(count - 1, 1) / np.maximum(count, 1))
    return 2.0 * half_width(error, count)
