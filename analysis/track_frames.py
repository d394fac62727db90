"""Frames of a record: where all robots were at common times, although each reported at times of its own.

The frames lie on a regular grid of times. A robot's place at a grid time is interpolated linearly between its samples
before and after, if these are at most `max_gap` apart; in a longer gap, before its first sample and after its last, it
is absent, and nobody's neighbour. So degrees are lower bounds wherever robots are absent.
"""

from __future__ import annotations

from collections.abc import Iterator
from itertools import pairwise
from typing import NamedTuple

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from teamsight import checks

Floats = NDArray[np.float64]

# Robots times frames in a block: 2 million places take 32 MB.
_BLOCK = 2_000_000
_MOST_FRAMES = 10_000_000
# A gap of several samples is bridged: of samples at random times, one gap in 32 is longer than five medians.
_BRIDGED = 5.0
# A sample this close to a grid time, in steps, is at it: 0.1 + 0.2 is not 0.3.
_SAME = 1e-6


class Grid(NamedTuple):
    """The times of the frames: start + step · (0 .. frames − 1); gaps up to `max_gap` are bridged."""

    start: float
    step: float
    frames: int
    max_gap: float

    def time(self, first: int, last: int) -> Floats:
        """Return the times of frames `first` up to, not including, `last`."""
        return self.start + self.step * np.arange(first, last, dtype=np.float64)


class Track(NamedTuple):
    """The samples of one robot in the order of time: arrays of one length."""

    time: Floats
    x: Floats
    y: Floats


class Block(NamedTuple):
    """Successive frames: their times (f,), and all robots' places (f, robots, 2), NaN where absent."""

    first: int
    time: Floats
    position: Floats


def robot_starts(tracks: pd.DataFrame) -> NDArray[np.int64]:
    """Return the row where each robot's track starts, and the number of rows, shape (robots + 1,)."""
    code = np.asarray(tracks["robot"].cat.codes)
    change = np.flatnonzero(np.diff(code)) + 1
    return np.concatenate([[0], change, [len(code)]]).astype(np.int64)


def make_grid(tracks: pd.DataFrame, step: float | None = None, max_gap: float | None = None) -> Grid:
    """Return the grid of times for a record.

    Parameters
    ----------
    tracks : DataFrame
        As `read_tracks` returns.
    step : float, optional
        Time between frames; the median interval between a robot's successive samples when not given.
    max_gap : float, optional
        The longest gap that is bridged; five times the median interval when not given, but at least `step`.

    Raises
    ------
    ValueError
        If no robot has two samples, or the record would make more than ten million frames.
    """
    time = tracks["time"].to_numpy()
    own = np.ones(len(time) - 1, dtype=bool)
    own[robot_starts(tracks)[1:-1] - 1] = False  # from one robot's last sample to the next robot's first
    interval = np.diff(time)[own]
    if not len(interval):
        raise ValueError("tracks: every robot has a single sample; motion needs at least 2 of one robot")
    median = float(np.median(interval))
    step = median if step is None else checks.number("step", step, above=0.0)
    gap = max(_BRIDGED * median, step) if max_gap is None else checks.number("max_gap", max_gap, above=0.0)
    span = float(time.max() - time.min())
    if span / step >= _MOST_FRAMES:
        raise ValueError(
            f"step={step:g}: the record spans {span:g}, which makes more than {_MOST_FRAMES:,} frames; "
            "give a longer step, or look for wrong times"
        )
    return Grid(float(time.min()), step, int(span / step + _SAME) + 1, gap)


def blocks(tracks: pd.DataFrame, grid: Grid, period: tuple[float, float] = (0.0, 0.0)) -> Iterator[Block]:
    """Yield all frames in blocks that fit in memory.

    Parameters
    ----------
    tracks : DataFrame
        As `read_tracks` returns.
    grid : Grid
        When the frames are.
    period : (float, float)
        Distances after which the arena repeats along x and y, 0 where it does not: the line between two samples is the
        shortest way.
    """
    columns = [tracks[column].to_numpy() for column in ("time", "x", "y")]
    bounds = pairwise(robot_starts(tracks).tolist())
    robots = [Track(*(values[start:end] for values in columns)) for start, end in bounds]
    size = max(1, _BLOCK // len(robots))
    for first in range(0, grid.frames, size):
        time = grid.time(first, min(first + size, grid.frames))
        position = np.empty((len(time), len(robots), 2))
        for column, track in enumerate(robots):
            position[:, column] = _places(track, time, grid, period)
        yield Block(first, time, position)


def _places(track: Track, at: Floats, grid: Grid, period: tuple[float, float]) -> Floats:
    """Return one robot's places at the times `at`, NaN where it is absent; shape (len(at), 2)."""
    time = track.time
    same = _SAME * grid.step
    before = np.searchsorted(time, at + same, side="right") - 1
    after = np.minimum(before + 1, len(time) - 1)
    start = np.maximum(before, 0)
    gap = time[after] - time[start]
    passed = at - time[start]
    with np.errstate(divide="ignore", invalid="ignore"):
        share = np.clip(passed / gap, 0.0, 1.0)
    exact = np.abs(passed) <= same
    share[exact] = 0.0
    present = (before >= 0) & (exact | ((gap > 0) & (gap <= grid.max_gap * (1 + 1e-9))))
    place = np.empty((len(at), 2))
    for axis, values in enumerate((track.x, track.y)):
        way = values[after] - values[start]
        if period[axis] > 0:
            way -= period[axis] * np.rint(way / period[axis])
        place[:, axis] = np.where(present, values[start] + share * way, np.nan)
    return place
