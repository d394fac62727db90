"""Frames of a record: the positions of all robots at common times, from samples at different times; their neighbours.

A record is divided into pieces: into runs, and at gaps longer than `max_gap` in which no robot has a sample. The frames
of a piece are on a regular grid of times that starts at its first sample. A robot's position is interpolated linearly
between its samples before and after, if these are at most `max_gap` apart. In a longer gap, before its first sample and
after its last, it is absent and not counted as a neighbour. So degrees are lower bounds wherever robots are absent.
"""

from __future__ import annotations

from collections.abc import Iterator
from itertools import pairwise
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from teamsight.analysis.delta import sector_occupancy
from teamsight.analysis.delta.sector_occupancy import Bearings
from teamsight.analysis.runs.simulate import Progress
from teamsight.core import checks
from teamsight.world.search import proximity_graph

if TYPE_CHECKING:
    from teamsight.world.arena import Arena

Floats = NDArray[np.float64]

# Robots times frames in a block: 2 million positions take 32 MB.
_BLOCK = 2_000_000
_MOST_FRAMES = 10_000_000
# Medians of the longest gap that is interpolated: of samples at random times, one gap in 32 is longer.
_BRIDGED = 5.0
# Tolerance, in steps, within which a sample is at a grid time: 0.1 + 0.2 is not 0.3.
_SAME = 1e-6
# Robots and times, at about which the bearings are sampled.
_SAMPLES = 200_000
# Bearings that are kept, at most: of some more, every second frame is dropped.
_BEARINGS = 10_000_000


class Grid(NamedTuple):
    """The times of the frames of each piece: start + step · (0 .. length − 1).

    Attributes
    ----------
    start : ndarray of float64, shape (pieces,)
        Time of the first frame.
    length : ndarray of int64, shape (pieces,)
        Number of frames.
    run : ndarray of int64, shape (pieces,)
        Number of the run of each piece; ascending, and times ascend within a run.
    gaps : ndarray of float64, shape (pieces − runs,)
        Durations without any sample between the pieces of a run.
    step : float
        Time between frames.
    max_gap : float
        Longest gap between two samples of a robot that is interpolated.
    robots : int
        Largest number of robots in one piece.
    interval : float
        Median time between successive samples of a robot.
    """

    start: Floats
    length: NDArray[np.int64]
    run: NDArray[np.int64]
    gaps: Floats
    step: float
    max_gap: float
    robots: int
    interval: float

    @property
    def frames(self) -> int:
        """The number of frames in all."""
        return int(self.length.sum())

    def time(self) -> Floats:
        """Return the times of all frames."""
        within = np.arange(self.frames) - np.repeat(np.cumsum(self.length) - self.length, self.length)
        return np.repeat(self.start, self.length) + self.step * within

    def split(self, run: bool) -> NDArray[np.int64]:
        """Return the first frame of each run, or of each piece."""
        first = np.cumsum(self.length) - self.length
        return first[np.flatnonzero(np.diff(self.run, prepend=-1))] if run else first


class Block(NamedTuple):
    """Successive frames of a piece: number of the first, times (f,), and positions (f, robots, 2), NaN if absent."""

    first: int
    time: Floats
    position: Floats


def _codes(trajectories: pd.DataFrame) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Return the numbers of the run and of the robot of each row."""
    robot = np.asarray(trajectories["robot"].cat.codes, np.int64)
    run = np.asarray(trajectories["run"].cat.codes, np.int64) if "run" in trajectories else np.zeros_like(robot)
    return run, robot


def trajectory_starts(trajectories: pd.DataFrame) -> NDArray[np.int64]:
    """Return the row where each trajectory starts, one for each robot of each run, and the number of rows."""
    run, robot = _codes(trajectories)
    change = np.flatnonzero((np.diff(robot) != 0) | (np.diff(run) != 0)) + 1
    return np.concatenate([[0], change, [len(robot)]]).astype(np.int64)


def make_grid(trajectories: pd.DataFrame, step: float | None = None, max_gap: float | None = None) -> Grid:
    """Return the grid of times for a record.

    Parameters
    ----------
    trajectories : DataFrame
        From `read_trajectories`.
    step : float, optional
        Time between frames; by default the median interval between successive samples of a robot.
    max_gap : float, optional
        Longest gap that is interpolated; by default five times the median interval, but at least `step`. A longer gap
        of all robots divides the record.

    Raises
    ------
    ValueError
        If no robot has two samples in a run, no two robots have samples in one piece, or the record would make more
        than ten million frames.
    """
    time, name = trajectories["time"].to_numpy(), trajectories.attrs.get("name", "trajectories")
    own = np.ones(len(time) - 1, dtype=bool)
    own[trajectory_starts(trajectories)[1:-1] - 1] = False  # from one trajectory's last sample to the next one's first
    interval = np.diff(time)[own]
    if not len(interval):
        raise ValueError(f"{name}: every robot has a single sample; motion needs at least 2 of one robot in a run")
    median = float(np.median(interval))
    step = median if step is None else checks.number("step", step, above=0.0)
    gap = max(_BRIDGED * median, step) if max_gap is None else checks.number("max_gap", max_gap, above=0.0)
    start, end, run, gaps, robots = _pieces(trajectories, gap)
    if robots < 2:
        raise ValueError(
            f"{name}: a single robot in each piece between gaps of more than {gap:g}; a neighbour graph needs "
            "2 robots at one time; give a longer max_gap, or check whether the column run separates robots of one run"
        )
    with np.errstate(over="ignore"):
        steps, span = (end - start) / step, float(np.sum(end - start))
    if float(np.sum(steps)) >= _MOST_FRAMES:
        raise ValueError(
            f"step={step:g}: the record spans {span:g}, which makes more than {_MOST_FRAMES:,} frames; "
            "give a longer step, or check the times"
        )
    return Grid(start, (steps + _SAME).astype(np.int64) + 1, run, gaps, step, gap, robots, median)


def _pieces(trajectories: pd.DataFrame, max_gap: float) -> tuple[Floats, Floats, NDArray[np.int64], Floats, int]:
    """Return start, end and run of each piece, the gaps within runs, and the largest number of robots in a piece."""
    run, robot = _codes(trajectories)
    order = np.lexsort((trajectories["time"], run))
    time, run, robot = trajectories["time"].to_numpy()[order], run[order], robot[order]
    wait = np.diff(time)
    # Times in seconds since 1970 are rounded.
    waits = wait > max_gap * (1 + 1e-9) + 16 * np.spacing(np.abs(time[1:]))
    runs = np.diff(run) != 0
    new = np.concatenate([[True], runs | waits])
    first = np.flatnonzero(new)
    # A robot counts once in each piece in which it has samples.
    names = int(robot.max()) + 1
    met = np.unique((np.cumsum(new) - 1) * names + robot) // names
    last = np.append(first[1:], len(time)) - 1
    return time[first], time[last], run[first], wait[waits & ~runs], int(np.bincount(met).max())


def blocks(trajectories: pd.DataFrame, grid: Grid, period: tuple[float, float] = (0.0, 0.0)) -> Iterator[Block]:
    """Yield all frames in blocks that fit in memory; no block includes a gap.

    Parameters
    ----------
    trajectories : DataFrame
        From `read_trajectories`.
    grid : Grid
        Times of the frames.
    period : (float, float)
        Periods of the arena along x and y, 0 if it is not periodic. Robots move the shortest way between two samples.
    """
    columns = [trajectories[column].to_numpy() for column in ("time", "x", "y")]
    starts = trajectory_starts(trajectories)
    runs = _codes(trajectories)[0][starts[:-1]]
    number = 0
    for run in np.unique(runs):
        bounds = pairwise(starts[np.searchsorted(runs, run) : np.searchsorted(runs, run, side="right") + 1].tolist())
        robots = [[values[start:end] for values in columns] for start, end in bounds]
        size = max(1, _BLOCK // len(robots))
        for piece in range(*np.searchsorted(grid.run, [run, run + 1]).tolist()):
            for first in range(0, int(grid.length[piece]), size):
                frames = np.arange(first, min(first + size, int(grid.length[piece])), dtype=np.float64)
                time = grid.start[piece] + grid.step * frames
                position = np.empty((len(time), len(robots), 2))
                for column, samples in enumerate(robots):
                    position[:, column] = _places(samples, time, grid, period)
                yield Block(number, time, position)
                number += len(time)


def _places(samples: list[Floats], at: Floats, grid: Grid, period: tuple[float, float]) -> Floats:
    """Return the positions of a robot, with samples (time, x, y), at the times `at`; NaN if it is absent."""
    time, *coordinates = samples
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
    for axis, values in enumerate(coordinates):
        way = values[after] - values[start]
        if period[axis] > 0:
            way -= period[axis] * np.rint(way / period[axis])
        # Between a sample and one without a position the robot is absent; at the time of the sample it is there.
        place[:, axis] = np.where(present, values[start] + np.where(share == 0.0, 0.0, share * way), np.nan)
    return place


class Neighbours(NamedTuple):
    """The neighbours in a record.

    ``over_time`` has one row a frame: run (its name, or without a column of runs the number of the piece between two
    gaps), time, robots (present), mean_degree, max_degree. ``move`` is the root mean square of the distance that a
    robot moves between frames, ``farthest`` the largest distance between two neighbours [length], along one axis if
    ranges are squares.
    """

    over_time: pd.DataFrame
    bearings: Bearings
    grid: Grid
    move: float
    farthest: float
    range_shape: str = "disc"


def neighbours_over_time(
    trajectories: pd.DataFrame,
    awareness_range: float,
    *,
    range_shape: str = "disc",
    arena: Arena | None = None,
    step: float | None = None,
    max_gap: float | None = None,
    progress: Progress = lambda done, total: None,
) -> Neighbours:
    """Count neighbours in a record, frame by frame.

    Parameters
    ----------
    trajectories : DataFrame
        From `read_trajectories`.
    awareness_range : float
        Distance within which two robots are neighbours [length].
    range_shape : {"disc", "square"}
        The shape of ranges. In a square are robots at most the range away along either axis.
    arena : Disc, Box or Torus, optional
        Changes distances only if it is periodic, as a torus is.
    step, max_gap : float, optional
        See `make_grid`.
    progress : callable
        Called with the frames done and the frames in all.

    Raises
    ------
    ValueError
        If a number is outside its limits.

    Notes
    -----
    There are no frames between runs, or in gaps longer than `max_gap` in which no robot has a sample.

    The heading of a robot is the direction of its motion from the frame before to the frame after. A robot that does
    not move, or is absent in one of them, has no heading, and its bearings are not sampled.
    """
    if arena is not None:
        arena.check_reach(awareness_range)
    grid = make_grid(trajectories, step, max_gap)
    every = max(1, grid.frames * grid.robots // _SAMPLES)
    progress(0, grid.frames)
    periodic = arena if arena is not None and max(arena.period) > 0 else None
    counts, samples, square, moves, farthest, held = [], [], 0.0, 0, 0.0, 0
    for block in blocks(trajectories, grid, (0.0, 0.0) if periodic is None else periodic.period):
        if periodic is not None:
            block = block._replace(position=periodic.displacement(np.zeros(2), block.position))
        for frame in range(len(block.time)):
            position = block.position[frame]
            present = ~np.isnan(position[:, 0])
            graph = proximity_graph(position[present], None, awareness_range, periodic, range_shape=range_shape)
            degree = graph.degree
            apart = graph.distance if range_shape == "disc" else np.abs(graph.offset)
            farthest = max(farthest, float(apart.max(initial=0.0)))
            counts.append((len(degree), np.mean(degree) if len(degree) else 0.0, np.max(degree, initial=0)))
            if (block.first + frame) % every == 0:
                samples.append(sector_occupancy.bearings(graph, _headings(block, frame, periodic)[present]))
                held += len(samples[-1].turn)
                while held > _BEARINGS and len(samples) > 1:
                    # Where all are neighbours of all, so many robots would fill the memory.
                    samples, every = samples[::2], 2 * every
                    held = sum(len(one.turn) for one in samples)
            progress(block.first + frame + 1, grid.frames)
        length = np.sum(_steps(block.position[:-1], block.position[1:], periodic) ** 2, axis=-1)
        square, moves = square + float(np.nansum(length)), moves + int(np.sum(np.isfinite(length)))
    table = pd.DataFrame(counts, columns=["robots", "mean_degree", "max_degree"])
    table.insert(0, "time", grid.time())
    piece = np.arange(len(grid.run))
    name = trajectories["run"].cat.categories.to_numpy()[grid.run] if "run" in trajectories else piece
    table.insert(0, "run", np.repeat(name, grid.length))
    move = float(np.sqrt(square / max(moves, 1)))
    return Neighbours(table, sector_occupancy.gather(samples), grid, move, farthest, range_shape)


def _steps(start: Floats, end: Floats, periodic: Arena | None) -> Floats:
    return end - start if periodic is None else periodic.displacement(start, end)


def _headings(block: Block, frame: int, periodic: Arena | None) -> Floats:
    """Return the motion from the frame before to the frame after, within the block; shape (robots, 2)."""
    before, after = max(frame - 1, 0), min(frame + 1, len(block.time) - 1)
    return _steps(block.position[before], block.position[after], periodic)
