"""Cautions on a record: a unit that cannot be that of the awareness range, and groups that are not one team."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np
import pandas as pd
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from teamsight.analysis.delta.resample import Floats, Grid, blocks, trajectory_starts

if TYPE_CHECKING:
    from teamsight.analysis.delta.trajectory_neighbours import Neighbours
    from teamsight.world.arena import Arena

Ints = NDArray[np.int64]

# Robots that move more ranges than this between samples cannot be followed from one to the next.
_MOST_MOVE = 10.0
# More ranges than this between samples are suspicious.
_USUAL_MOVE = 1.0
# Ranges between samples that lose little of what happens between them.
_FINE = 0.5


class TrajectoryWarning(UserWarning):
    """Recorded positions that have faults, are not of one team, or have another unit than the awareness range."""


class Scale(NamedTuple):
    """Lengths of a record [length].

    Attributes
    ----------
    move : float
        Median distance that a robot moves between two samples, or between two frames if these are farther apart;
        moves of length 0 do not count.
    width, height : float
        Ranges of all x and of all y.
    """

    move: float
    width: float
    height: float


def scale_of(trajectories: pd.DataFrame, grid: Grid, arena: Arena | None = None) -> Scale:
    """Return the lengths of a record.

    Parameters
    ----------
    trajectories : DataFrame
        From `read_trajectories`.
    grid : Grid
        Times of the frames.
    arena : Arena, optional
        Moves are the shortest ways if it is periodic.
    """
    _, wait, length = moves(trajectories, grid, arena)
    move = length * np.maximum(1.0, grid.step / wait)
    move = move[move > 0]
    spans = (_span(trajectories[axis].to_numpy()) for axis in ("x", "y"))
    return Scale(float(np.median(move)) if len(move) else 0.0, *spans)


def moves(trajectories: pd.DataFrame, grid: Grid, arena: Arena | None = None) -> tuple[Ints, Floats, Floats]:
    """Return the moves of robots from sample to sample, without those over gaps.

    Parameters
    ----------
    trajectories, grid, arena
        See `scale_of`.

    Returns
    -------
    row : ndarray of int64
        Row of the later sample of each.
    wait, length : ndarray of float64
        Time between the samples [time], and their distance [length]; NaN if the robot is away at one of them.
    """
    time, x, y = (trajectories[name].to_numpy() for name in ("time", "x", "y"))
    own = np.ones(len(time) - 1, bool)
    own[trajectory_starts(trajectories)[1:-1] - 1] = False
    wait = np.diff(time)
    own &= (wait > 0) & (wait <= grid.max_gap * (1 + 1e-9))
    way = np.column_stack([np.diff(x), np.diff(y)])[own]
    if arena is not None and max(arena.period) > 0:
        way = arena.displacement(np.zeros(2), way)
    return np.flatnonzero(own) + 1, wait[own], np.hypot(*way.T)


def _span(values: Floats) -> float:
    """Return the length that coordinates span; NaN stands for robots that are not there."""
    return float(np.nanmax(values) - np.nanmin(values))


def check_motion(scale: Scale, grid: Grid, awareness_range: float, frames: int | None) -> None:
    """Raise an error if robots move so many ranges between samples that trials say nothing about what happens in them.

    Parameters
    ----------
    scale : Scale
        Lengths of the record.
    grid : Grid
        Times of the frames.
    awareness_range : float
        Distance within which two robots are neighbours [length].
    frames : int or None
        Length of a trial; None for whole recordings. In a single frame nothing happens between samples.

    Raises
    ------
    ValueError
        If they do.
    """
    ranges, span = scale.move / awareness_range, f"{rounded(scale.width)} × {rounded(scale.height)}"
    if frames != 1 and ranges > _MOST_MOVE:
        raise ValueError(
            f"awareness_range={awareness_range:g}: robots move {rounded(ranges)} ranges between samples (median "
            f"{rounded(scale.move)}), at most {_MOST_MOVE:g}, so their neighbours in between are unknown; give the "
            f"range in the unit of the positions, which span {span}, or record at least every "
            f"{grid.step * _FINE / ranges:.2g}"
        )


def cautions(
    found: Neighbours, trajectories: pd.DataFrame, scale: Scale, awareness_range: float, arena: Arena | None = None
) -> tuple[str, ...]:
    """Return why the unit may be wrong, or that several groups count as one team, one sentence each.

    Parameters
    ----------
    found : Neighbours
        The frames.
    trajectories : DataFrame
        From `read_trajectories`.
    scale : Scale
        Lengths of the record.
    awareness_range : float
        Distance within which two robots are neighbours [length].
    arena : Arena, optional
        Distances are periodic if it is.
    """
    said = []
    span = f"the positions span {rounded(scale.width)} × {rounded(scale.height)}"
    if (ranges := scale.move / awareness_range) > _USUAL_MOVE:
        said.append(
            f"robots move {rounded(ranges)} awareness ranges between samples (median {rounded(scale.move)}; {span}). "
            "If the unit is right, record more often: neighbours between samples are not found."
        )
    if not found.over_time["max_degree"].any():
        near = nearest(trajectories, found.grid, arena, found.range_shape)
        said.append(
            f"no two robots were ever within the awareness range of {awareness_range:g}; the nearest two were "
            f"{rounded(near)} apart, {rounded(near / awareness_range)} ranges ({span})."
        )
    if are_all_near(found):
        said.append(
            f"every robot always has all others within the awareness range of {awareness_range:g}; they are at most "
            f"{rounded(found.farthest)} apart, {rounded(found.farthest / awareness_range)} ranges ({span})."
        )
    doubts = [f"Check the unit: {sentence}" for sentence in said]
    if groups := trajectories.attrs.get("groups"):
        listed = ", ".join(groups)
        doubts.append(f"Check the groups: all agents of {listed} count as one team; leave out the rows of others.")
    return tuple(doubts)


def scale_note(scale: Scale, awareness_range: float) -> str:
    """Return the lengths of a record in awareness ranges.

    Parameters
    ----------
    scale : Scale
        Lengths of the record.
    awareness_range : float
        Distance within which two robots are neighbours [length].
    """
    move, width, height = (f"{rounded(length / awareness_range)}" for length in scale)
    return (
        f"In awareness ranges of {awareness_range:g}: positions span {width} × {height}, and a robot that moves covers "
        f"{move} from one sample to the next (median)."
    )


def are_all_near(found: Neighbours) -> bool:
    """Return whether every robot has all others as neighbours in every frame."""
    robots = found.over_time["robots"]
    return bool((found.over_time["mean_degree"] == robots - 1)[robots > 1].all() and (robots > 1).any())


def nearest(
    trajectories: pd.DataFrame, grid: Grid, arena: Arena | None = None, range_shape: str = "disc"
) -> float:
    """Return the smallest distance between two robots in any frame; infinite if no two are present in one.

    Parameters
    ----------
    trajectories, grid, arena
        See `scale_of`.
    range_shape : {"disc", "square"}
        The shape of ranges; with squares the Chebyshev distance counts.
    """
    period = (0.0, 0.0) if arena is None else arena.period
    least, norm = np.inf, 2.0 if range_shape == "disc" else np.inf
    for block in blocks(trajectories, grid, period):
        for axis, length in enumerate(period):
            if length > 0:
                values = np.mod(block.position[..., axis], length)
                # The remainder of a tiny negative number is rounded to the period.
                block.position[..., axis] = np.where(values >= length, 0.0, values)
        for position in block.position:
            present = position[~np.isnan(position[:, 0])]
            if len(present) > 1:
                # As in an arena, a period of 0 is none.
                distance, _ = cKDTree(present, boxsize=period).query(present, k=2, p=norm)
                least = min(least, float(distance[:, 1].min()))
    return least


def rounded(number: float) -> str:
    """Return a number in three digits, without an exponent unless it is very large or small."""
    return f"{number:,.0f}" if 1000 <= number < 1e9 else f"{number:.3g}"
