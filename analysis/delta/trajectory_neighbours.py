"""Neighbours in a record: the degrees in each frame, and samples of the bearings of neighbours."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np
import pandas as pd

from teamsight.analysis.delta import sector_occupancy
from teamsight.analysis.delta.resample import Block, Floats, Grid, blocks, make_grid
from teamsight.analysis.delta.sector_occupancy import Bearings
from teamsight.analysis.runs.simulate import Progress
from teamsight.world.search import proximity_graph

if TYPE_CHECKING:
    from teamsight.world.arena import Arena

# Robots and times, at about which the bearings are sampled.
_SAMPLES = 200_000


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
    counts, samples, square, moves, farthest = [], [], 0.0, 0, 0.0
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
        length = np.sum(_steps(block.position[:-1], block.position[1:], periodic) ** 2, axis=-1)
        square, moves = square + float(np.nansum(length)), moves + int(np.sum(np.isfinite(length)))
        progress(block.first + len(block.time), grid.frames)
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
