"""δ from the recorded positions of real robots, without a model of them."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from teamsight.analysis.delta import closed_form, report, sector_occupancy
from teamsight.analysis.delta.closed_form import Prediction
from teamsight.analysis.delta.report import DeltaReport
from teamsight.analysis.delta.resample import Block, Grid, blocks, make_grid
from teamsight.analysis.delta.sector_occupancy import Bearings
from teamsight.analysis.delta.trajectory_files import check_trajectories, read_trajectories
from teamsight.analysis.delta.trajectory_notes import notes
from teamsight.analysis.delta.trajectory_trials import recordings, shorter_window, trials, window_frames
from teamsight.analysis.stats import exceedance
from teamsight.core import checks
from teamsight.world.arena import Disc
from teamsight.world.proximity.search import proximity_graph

if TYPE_CHECKING:
    from teamsight.world.arena import Arena

__all__ = ["DeltaReport", "delta_from_trajectories", "neighbours_over_time", "read_trajectories"]

#: Called with the frames done and the frames in all.
Progress = Callable[[int, int], None]

# About how many robots and times are asked for the bearings of their neighbours.
_LOOKED_AT = 200_000


class Neighbours(NamedTuple):
    """What a record shows of neighbours.

    ``over_time`` has one row a frame: run (its name; without a column of runs, the number of the piece between two
    gaps), time, robots (present), mean_degree, max_degree. ``robots`` is the most that were seen in one piece.
    ``move`` is the root of the mean squared distance that a robot covers between frames [length].
    """

    over_time: pd.DataFrame
    bearings: Bearings
    grid: Grid
    robots: int
    awareness_range: float
    move: float


def neighbours_over_time(
    trajectories: pd.DataFrame,
    awareness_range: float,
    *,
    arena: Arena | None = None,
    step: float | None = None,
    max_gap: float | None = None,
    progress: Progress | None = None,
) -> Neighbours:
    """Count neighbours in a record, frame by frame.

    Parameters
    ----------
    trajectories : DataFrame
        As `read_trajectories` returns.
    awareness_range : float
        Within which distance two robots are neighbours [length].
    arena : Disc, Box or Torus, optional
        Distances wrap on a torus; other arenas change no distance.
    step, max_gap : float, optional
        See `make_grid`.
    progress : callable, optional
        Called with the frames done and the frames in all, now and then.

    Raises
    ------
    ValueError
        If a number is outside its limits.

    Notes
    -----
    There are no frames in gaps in which no robot has a sample for longer than `max_gap`, nor between runs.

    A robot's heading is the direction in which it moves around the frame; one that stands still or is absent just
    before or after has none and is left out of the bearings, as an observer only.
    """
    awareness_range = checks.number("awareness_range", awareness_range, above=0.0)
    if arena is not None:
        arena.check_reach(awareness_range)
    grid = make_grid(trajectories, step, max_gap)
    every = max(1, grid.frames * grid.robots // _LOOKED_AT)
    if progress is not None:
        progress(0, grid.frames)
    counts, looks, square, moves = [], [], 0.0, 0
    for block in blocks(trajectories, grid, (0.0, 0.0) if arena is None else arena.period):
        block = block._replace(position=_wrapped(block.position, arena))
        for frame in range(len(block.time)):
            position = block.position[frame]
            present = ~np.isnan(position[:, 0])
            graph = proximity_graph(position[present], None, awareness_range, _wrapping(arena))
            degree = graph.degree
            counts.append((len(degree), np.mean(degree) if len(degree) else 0.0, np.max(degree, initial=0)))
            if (block.first + frame) % every == 0:
                looks.append(sector_occupancy.bearings(graph, _headings(block, frame, arena)[present]))
        length = np.sum(_steps(block.position[:-1], block.position[1:], arena) ** 2, axis=-1)
        square, moves = square + float(np.nansum(length)), moves + int(np.sum(np.isfinite(length)))
        if progress is not None:
            progress(block.first + len(block.time), grid.frames)
    table = pd.DataFrame(counts, columns=["robots", "mean_degree", "max_degree"])
    table.insert(0, "time", grid.time())
    piece = np.arange(len(grid.run))
    name = trajectories["run"].cat.categories.to_numpy()[grid.run] if "run" in trajectories else piece
    table.insert(0, "run", np.repeat(name, grid.length))
    move = float(np.sqrt(square / max(moves, 1)))
    return Neighbours(table, sector_occupancy.gather(looks), grid, grid.robots, awareness_range, move)


def delta_from_trajectories(
    trajectories: pd.DataFrame,
    awareness_range: float,
    *,
    risk: float = 0.01,
    window: float | None = None,
    arena: Arena | None = None,
    step: float | None = None,
    max_gap: float | None = None,
    confidence: float = 0.95,
    subject: str | None = None,
    progress: Progress | None = None,
) -> DeltaReport:
    """Choose δ for a stated risk from recorded positions.

    Parameters
    ----------
    trajectories : DataFrame
        As `read_trajectories` returns; any other is checked in the same way first.
    awareness_range : float
        Within which distance two robots are neighbours [length].
    risk : float
        Accepted probability that in a window any robot has more than δ neighbours; between 0 and 1.
    window : float, optional
        Length of the stretch of time that the risk is for [time]. When not given: the whole recording where the record
        holds at least ten alike, otherwise a twentieth of the record; see `trajectory_trials.window_frames`.
    arena : Disc, Box or Torus, optional
        Distances wrap on a torus; a disc allows the closed form; without one there is no prediction.
    step, max_gap : float, optional
        Time between frames, and the longest gap in a robot's samples that is bridged [time]; see `make_grid`.
    confidence : float
        Of each bound by itself.
    subject : str, optional
        One line that says what was recorded.
    progress : callable, optional
        Called with the frames done and the frames in all, now and then.

    Returns
    -------
    DeltaReport
        Its trials are the whole windows of the record, or its runs or pieces; its ``over_time`` the frames.

    Raises
    ------
    ValueError, TypeError
        If the record or a number is not as it must be.

    Notes
    -----
    Runs (a column of that name) are independent of each other. Windows of one run that follow each other resemble each
    other, so they count as fewer independent ones: see `exceedance.effective_number`, taken of their largest and of
    their mean degree, whichever gives less. What is left after the last whole window of a stretch counts for the
    largest degree only; so do windows in which fewer than half as many robots are present as in the median window, as
    while a team is being switched on.
    """
    risk = checks.number("risk", risk, above=0.0, most=1.0)
    confidence = checks.number("confidence", confidence, above=0.5, most=0.999999)
    trajectories = check_trajectories(trajectories)
    found = neighbours_over_time(
        trajectories, awareness_range, arena=arena, step=step, max_gap=max_gap, progress=progress
    )
    grid = found.grid
    tried = trials(found.over_time, grid, window_frames(grid, window))
    shorter = None
    if not exceedance.supports(tried.independent, risk, confidence):
        needed = exceedance.trials_needed(risk, confidence)
        shorter = shorter_window(found.over_time, grid, tried.frames, needed)
    return report.build(
        tried.maxima,
        found.bearings,
        robots=found.robots,
        risk=risk,
        confidence=confidence,
        independent=tried.independent,
        largest=int(found.over_time["max_degree"].max()),
        prediction=_predict(found, tried.frames, arena),
        source="trajectories",
        subject=subject or _describe(trajectories, found),
        awareness_range=found.awareness_range,
        length=tried.frames * grid.step,
        unit="time units",
        trial=tried.kind,
        recorded=grid.frames * grid.step,
        shorter=None if shorter is None else shorter * grid.step,
        over_time=found.over_time,
        notes=notes(found, tried, window is not None),
    )


def _predict(found: Neighbours, length: int, arena: Arena | None) -> Prediction | None:
    if not isinstance(arena, Disc):
        return None
    reach = found.awareness_range
    return closed_form.predict(found.robots, arena.radius, steps=length, awareness_range=reach, speed=found.move)


def _describe(trajectories: pd.DataFrame, found: Neighbours) -> str:
    span = float(np.sum((found.grid.length - 1) * found.grid.step))
    kind, size = recordings(found.grid)
    parts = f", in {len(size):,} {kind}s" * (len(size) > 1)
    return f"{found.robots:,} recorded robots, {len(trajectories):,} positions over {span:g}{parts}"


def _wrapping(arena: Arena | None) -> Arena | None:
    """Return the arena if its distances are not those of the plane."""
    return arena if arena is not None and max(arena.period) > 0 else None


def _wrapped(position: NDArray[np.float64], arena: Arena | None) -> NDArray[np.float64]:
    if _wrapping(arena) is None or arena is None:
        return position
    return arena.displacement(np.zeros(2), position)


def _steps(start: Any, end: Any, arena: Arena | None) -> NDArray[np.float64]:
    return np.asarray(end - start if arena is None else arena.displacement(start, end))


def _headings(block: Block, frame: int, arena: Arena | None) -> NDArray[np.float64]:
    """Return the way from the frame before to the frame after, as far as they are in the block; shape (robots, 2)."""
    before, after = max(frame - 1, 0), min(frame + 1, len(block.time) - 1)
    return _steps(block.position[before], block.position[after], arena)
