"""The trials of a record: windows of one length, or whole recordings; no trial includes a gap."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from teamsight.analysis.delta.resample import Grid
from teamsight.analysis.stats import exceedance
from teamsight.core import checks

Ints = NDArray[np.int64]

# Default number of windows in a record.
_WINDOWS = 20
# With so many recordings each is one trial: a window would be half a recording or more.
_RECORDINGS = 10
# Windows with a smaller share of the median number of robots are left out, and so are pieces with a smaller share of
# the median length.
_USUAL = 0.5
# Standard errors of an autocorrelation that may be chance, for trials with gaps between them.
_ERRORS = 1.645
# Smallest autocorrelation of frames that counts.
_LEAST = 0.05


class Trials(NamedTuple):
    """The trials of a record.

    Attributes
    ----------
    kind : {"window", "run", "piece"}
        A trial is a window, a whole run, or a whole piece between two gaps.
    maxima : DataFrame
        One row a trial: window, run, start, end, robots (mean), max_neighbours, mean_neighbours.
    frames : int
        Length of a trial; of whole recordings the median.
    left_out : int
        Number of trials left out because too few robots were present or the piece was too short.
    independent : float
        Effective number of independent trials.
    kept : ndarray of bool, shape (frames,)
        Whether each frame is in a trial.
    """

    kind: str
    maxima: pd.DataFrame
    frames: int
    left_out: int
    independent: float
    kept: NDArray[np.bool_]


def recordings(grid: Grid) -> tuple[str, Ints]:
    """Return the recordings of a record: its runs if there are several, otherwise its pieces.

    Returns
    -------
    kind : {"run", "piece"}
    frames : ndarray of int64
        Length of each.
    """
    kind = "run" if grid.run[0] != grid.run[-1] else "piece"
    return kind, np.diff(grid.split(kind == "run"), append=grid.frames)


def window_frames(grid: Grid, window: float | None) -> int | None:
    """Return the number of frames in a window, or None if each recording is one trial.

    Parameters
    ----------
    grid : Grid
        The frames.
    window : float, optional
        Length given by the user [time].

    Raises
    ------
    ValueError
        If it is longer than every piece, or shorter than the time between frames.

    Notes
    -----
    Without a window, each recording is a trial if there are at least ten; pieces between gaps only if they are similar
    in length, half of them at least half as long as the longest. Otherwise the window is a twentieth of the record, or
    shorter, so that half of the record is in pieces at least as long.
    """
    longest = int(grid.length.max())
    if window is None:
        kind, size = recordings(grid)
        if len(size) >= _RECORDINGS and (kind == "run" or np.median(size) >= _USUAL * size.max()):
            return None
        ordered = np.sort(grid.length)
        common = int(ordered[np.searchsorted(np.cumsum(ordered), 0.5 * grid.frames)])
        return max(1, min(grid.frames // _WINDOWS, common))
    window = checks.number("window", window, above=0.0)
    span = longest * grid.step
    if window > span * (1 + 1e-9):
        where = "the record, which spans" if len(grid.length) == 1 else f"the longest of {len(grid.length):,} pieces,"
        raise ValueError(f"window={window:g}: longer than {where} {span:g}; give a window of at most {span:g}, or none")
    if window < grid.step * (1 - 1e-9):
        raise ValueError(
            f"window={window:g}: shorter than the time between frames, {grid.step:g}; give a longer window"
        )
    return min(max(1, round(window / grid.step)), longest)


def independent_frames(over_time: pd.DataFrame, grid: Grid) -> float:
    """Return the effective number of independent frames, T/τ; a record has no more independent windows.

    Parameters
    ----------
    over_time : DataFrame
        All frames: run, time, robots, mean_degree, max_degree.
    grid : Grid
        Times of the frames.

    Notes
    -----
    τ = 1 + 2 Σ ρ_t over the autocorrelations of the largest and of the mean degree of frames, before the first below
    0.05; the larger τ counts. Few windows of slow robots show little of their correlation, the frames in them more.
    """
    several = recordings(grid)[0] == "run"
    return exceedance.effective_number(
        over_time["max_degree"], over_time["mean_degree"], run=over_time["run"] if several else None, least=_LEAST
    )


def trials(over_time: pd.DataFrame, grid: Grid, window: int | None, most: float = np.inf) -> Trials:
    """Return the trials of a record, with the largest degree of each.

    Parameters
    ----------
    over_time : DataFrame
        All frames: run, time, robots, mean_degree, max_degree.
    grid : Grid
        Times of the frames.
    window : int, optional
        Length of a window [frames]; by default each recording is one trial.
    most : float
        Upper limit of the number of independent windows, from `independent_frames`. Trials with gaps between them may
        exceed it, because their frames say nothing about the time in gaps.

    Notes
    -----
    Runs are assumed to be independent of each other. Pieces are of one team, whose state persists
    through gaps, so windows of several pieces count as if the pieces followed each other without gaps. If no piece
    contains two windows, all have gaps between them, and an autocorrelation counts only if it is not due to chance.
    """
    kind, size = recordings(grid)
    several = kind == "run"
    robots, largest, mean = (over_time[name].to_numpy() for name in ("robots", "max_degree", "mean_degree"))
    if window is None:
        first, last = grid.split(several), grid.split(several) + size - 1
        robots, largest = np.add.reduceat(robots, first) / size, np.maximum.reduceat(largest, first)
        mean, enough = np.add.reduceat(mean, first) / size, several | (size >= _USUAL * np.median(size))
    else:
        count = grid.length // window
        within = np.arange(count.sum()) - np.repeat(np.cumsum(count) - count, count)
        first = np.repeat(grid.split(False), count) + window * within
        frames, last = first[:, np.newaxis] + np.arange(window), first + window - 1
        robots, largest, mean = robots[frames].mean(axis=1), largest[frames].max(axis=1), mean[frames].mean(axis=1)
        kind, enough = "window", np.ones(len(first), bool)
    enough = enough & (robots >= _USUAL * np.median(robots))
    time, first, last = over_time["time"].to_numpy(), first[enough], last[enough]
    table = pd.DataFrame(
        {
            "window": np.flatnonzero(enough), "run": over_time["run"].to_numpy()[first], "start": time[first],
            "end": time[last], "robots": robots[enough], "max_neighbours": largest[enough],
            "mean_neighbours": mean[enough],
        }
    )  # fmt: skip
    change = np.zeros(grid.frames + 1, np.int64)
    change[first] += 1
    change[last + 1] -= 1
    apart = len(grid.length) > 1 and (window is None or grid.length.max() < 2 * window)
    independent = exceedance.effective_number(
        table["max_neighbours"],
        table["mean_neighbours"],
        run=table["run"] if several else None,
        errors=_ERRORS if apart else 0.0,
    )
    if kind == "window" and not apart:
        independent = min(independent, most)
    length = int(np.median(size)) if window is None else window
    return Trials(kind, table, length, int((~enough).sum()), independent, np.cumsum(change)[:-1] > 0)
