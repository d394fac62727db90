"""Faults of a record that make δ too small, or its confidence wrong: absent robots, clocks that differ, jumps."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from teamsight.analysis.delta.trajectory_cautions import moves, rounded

if TYPE_CHECKING:
    from teamsight.analysis.delta.resample import Grid
    from teamsight.analysis.delta.trajectory_neighbours import Neighbours
    from teamsight.analysis.delta.trajectory_trials import Trials
    from teamsight.world.arena import Arena

Ints = NDArray[np.int64]

#: Smallest share of the robots that is present at a time in a record without faults.
USUALLY_PRESENT = 0.95
# Largest difference between the first samples of robots that start together [intervals].
_APART = 2.0
# Share of the intervals that are at most as long as the one that counts: samples at random times start apart.
_USUAL = 0.99
# Longest step [medians].
_LONG = 10.0
# Steps that are shorter hardly change who is a neighbour, however still the robots are [awareness ranges].
_FAR = 0.5


def faults(
    trajectories: pd.DataFrame,
    found: Neighbours,
    tried: Trials,
    awareness_range: float,
    present: float,
    arena: Arena | None = None,
) -> tuple[str, ...]:
    """Return which faults a record has, one sentence or two each.

    Parameters
    ----------
    trajectories : DataFrame
        From `check_trajectories`.
    found : Neighbours
        The frames.
    tried : Trials
        The trials.
    awareness_range : float
        Distance within which two robots are neighbours [length].
    present : float
        From `share_present`.
    arena : Arena, optional
        Steps are the shortest ways if it is periodic.
    """
    grid = found.grid
    said = [
        _absence(present),
        _sizes(_team_sizes(trajectories, grid, tried.kind), tried.kind),
        _offsets(trajectories, grid, tried.kind),
        _jumps(trajectories, grid, awareness_range, arena),
    ]
    return tuple(sentence for sentence in said if sentence)


def share_present(trajectories: pd.DataFrame, found: Neighbours, tried: Trials) -> float:
    """Return the mean share of the robots of a recording that is present in a frame of a trial.

    Parameters
    ----------
    trajectories, found, tried
        See `faults`.

    Notes
    -----
    The first and the last interval of a piece do not count, in which some robots have not sent their first sample yet.
    """
    grid = found.grid
    edge = int(np.ceil(grid.interval / grid.step))
    within = np.arange(grid.frames) - np.repeat(grid.split(False), grid.length)
    inner = tried.kept & (within >= edge) & (within < np.repeat(grid.length, grid.length) - edge)
    piece = np.repeat(np.arange(len(grid.length)), grid.length)
    size = _team_sizes(trajectories, grid, tried.kind)[piece if tried.kind == "piece" else grid.run[piece]]
    share = found.over_time["robots"].to_numpy() / size
    return float(share[inner if inner.any() else tried.kept].mean())


def _absence(share: float) -> str:
    if share >= USUALLY_PRESENT:
        return ""
    return (
        f"Check the tracking: {100 * share:.3g} % of the robots are present at a time, fewer than "
        f"{100 * USUALLY_PRESENT:g} %. Absent robots are no neighbours: if they were there, δ is too small."
    )


def _recording(trajectories: pd.DataFrame, grid: Grid, kind: str) -> Ints:
    """Return the number of the recording of each row: of its run, or of its piece if pieces are the trials."""
    if kind == "piece":
        return np.searchsorted(grid.start, trajectories["time"], side="right") - 1
    if "run" in trajectories:
        return np.asarray(trajectories["run"].cat.codes, np.int64)
    return np.zeros(len(trajectories), np.int64)


def _starts(trajectories: pd.DataFrame, recording: Ints) -> Ints:
    """Return the first row of each robot in each recording."""
    robot = np.asarray(trajectories["robot"].cat.codes)
    return np.flatnonzero((np.diff(robot, prepend=-1) != 0) | (np.diff(recording, prepend=-1) != 0))


def _team_sizes(trajectories: pd.DataFrame, grid: Grid, kind: str) -> Ints:
    """Return the number of robots that have a position in each recording."""
    recording = _recording(trajectories, grid, kind)
    first = _starts(trajectories, recording)
    seen = np.logical_or.reduceat(trajectories["x"].notna().to_numpy(), first)
    return np.bincount(recording[first[seen]], minlength=int(recording.max()) + 1)


def _sizes(size: Ints, kind: str) -> str:
    if size.min() == size.max():
        return ""
    few, most = int((size == size.min()).sum()), int((size == size.max()).sum())
    return (
        f"Check the robots: their number differs between {'piece' if kind == 'piece' else 'run'}s, from {size.min()} "
        f"(in {few:,}) to {size.max()} (in {most:,}). Fewer robots meet fewer: analyse records of one number."
    )


def _offsets(trajectories: pd.DataFrame, grid: Grid, kind: str) -> str:
    """Say which robot starts farthest from the others, if robots start apart in most recordings."""
    recording, time = _recording(trajectories, grid, kind), trajectories["time"].to_numpy()
    first = _starts(trajectories, recording)
    start = pd.Series(time[first]).groupby(recording[first])
    interval = np.diff(time)[np.setdiff1d(np.arange(len(time) - 1), first - 1)]
    usual = float(np.quantile(interval[interval <= grid.max_gap * (1 + 1e-9)], _USUAL))
    most = max(_APART * grid.interval, usual) * (1 + 1e-9)
    apart = int((start.max() - start.min() > most).sum())
    if apart <= 0.5 * start.ngroups:
        return ""
    offset = (time[first] - start.transform("median")).to_numpy()
    row = int(np.abs(offset).argmax())
    which = f" in {apart:,} of {start.ngroups:,} recordings" * (start.ngroups > 1)
    return (
        f"Check the clocks: the first samples of robots are more than {most:.3g} apart{which}; "
        f"{_name(trajectories, first[row])} starts {abs(offset[row]):.3g} {'after' if offset[row] > 0 else 'before'} "
        "the others (their median). If the clocks differ, so do the times at which robots seem to be near each other."
    )


def _jumps(trajectories: pd.DataFrame, grid: Grid, awareness_range: float, arena: Arena | None) -> str:
    row, wait, length = moves(trajectories, grid, arena)
    # Over several intervals a robot goes farther.
    length = length * np.minimum(1.0, grid.interval / wait)
    moving = length[length > 0]
    if not len(moving):
        return ""
    median = float(np.median(moving))
    long = np.flatnonzero((length > _LONG * median) & (length > _FAR * awareness_range))
    if not len(long):
        return ""
    longest = long[length[long].argmax()]
    return (
        f"Check the tracking: {len(long):,} step{'s' * (len(long) > 1)} of more than {_LONG:g} medians; the longest, "
        f"{rounded(float(length[longest]))} instead of {rounded(median)}, is that of "
        f"{_name(trajectories, row[longest])} before time {trajectories['time'].iat[row[longest]]:.12g}. It may be a "
        "false position, two robots under one name, or an arena that is periodic."
    )


def _name(trajectories: pd.DataFrame, row: Any) -> str:
    """Return the robot of a row, and its run if there are several."""
    of_run = f" of run {trajectories['run'].iat[row]}" if "run" in trajectories else ""
    return f"robot {trajectories['robot'].iat[row]}{of_run}"
