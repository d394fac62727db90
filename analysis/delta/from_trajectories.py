"""δ from recorded positions, without a model of the robots."""

from __future__ import annotations

import warnings
from typing import TYPE_CHECKING

import numpy as np
import pandas as pd

from teamsight.analysis.delta import closed_form
from teamsight.analysis.delta.closed_form import Prediction
from teamsight.analysis.delta.report import DeltaReport
from teamsight.analysis.delta.resample import Grid, make_grid
from teamsight.analysis.delta.team_conditions import SQUARE_RANGES
from teamsight.analysis.delta.trajectory_cautions import TrajectoryWarning, cautions, check_motion, scale_note, scale_of
from teamsight.analysis.delta.trajectory_faults import faults, share_present
from teamsight.analysis.delta.trajectory_files import check_trajectories
from teamsight.analysis.delta.trajectory_neighbours import Neighbours, neighbours_over_time
from teamsight.analysis.delta.trajectory_notes import notes
from teamsight.analysis.delta.trajectory_trials import (
    Trials,
    independent_frames,
    recordings,
    shorter_window,
    trials,
    window_frames,
)
from teamsight.analysis.runs.simulate import Progress
from teamsight.analysis.stats import exceedance
from teamsight.core import checks
from teamsight.world.arena import Disc
from teamsight.world.limits import shape_given

if TYPE_CHECKING:
    from teamsight.world.arena import Arena


def delta_from_trajectories(
    trajectories: pd.DataFrame,
    awareness_range: float,
    *,
    range_shape: str = "disc",
    risk: float = 0.01,
    window: float | None = None,
    arena: Arena | None = None,
    step: float | None = None,
    max_gap: float | None = None,
    confidence: float = 0.95,
    subject: str | None = None,
    progress: Progress = lambda done, total: None,
) -> DeltaReport:
    """Choose δ for a stated risk from recorded positions.

    Parameters
    ----------
    trajectories : DataFrame
        From `read_trajectories`, or a table of the same columns, which is checked in the same way.
    awareness_range : float
        Distance within which two robots are neighbours [length].
    range_shape : {"disc", "square"}
        The shape of ranges. In a square are robots at most the range away along either axis.
    risk : float
        Maximum probability that any robot has more than δ neighbours during a window; between 0 and 1.
    window : float, optional
        Duration for which the risk is stated [time]. By default the whole recording if the record has at least ten
        similar ones, otherwise a twentieth of the record; see `trajectory_trials.window_frames`.
    arena : Disc, Box or Torus, optional
        Distances are periodic in a torus. Only a disc has the closed form, for ranges that
        are discs.
    step, max_gap : float, optional
        Time between frames, and longest gap between samples of a robot that is interpolated [time]; see `make_grid`.
    confidence : float
        Confidence of each bound by itself.
    subject : str, optional
        Description of the record, in one line.
    progress : callable
        Called with the frames done and the frames in all.

    Returns
    -------
    DeltaReport
        Its trials are the complete windows of the record, or its runs or pieces; ``over_time`` has the frames.

    Raises
    ------
    ValueError, TypeError
        If the record or a number is invalid, or robots move more than ten ranges between samples (the median), so that
        windows of several frames say nothing about what happens in them.

    Warns
    -----
    TrajectoryWarning
        If the unit of the range is probably not that of the positions: robots move more than a range between samples,
        never meet, or always fit into a tenth of a range. Or if a column group has several values in one run: all count
        as one team. Or if the record has a fault: fewer than 95 % of the robots are present at a time, their number
        differs between runs, in most runs their first samples are more than two intervals apart, or a step is above ten
        medians and half a range. The report begins with the same sentences, `cautions`, and states no confidence.

    Notes
    -----
    Runs (a column of that name) are independent of each other. Successive windows of a run are correlated, so they
    count as fewer independent ones: see `exceedance.effective_number`, applied to their largest and to their mean
    degree; the smaller result counts, but at most that of all frames, `independent_frames`. The frames after the last
    complete window of a piece count for the largest degree only, and so do windows with less than half as many robots
    as the median window.
    """
    risk = checks.number("risk", risk, above=0.0, most=1.0)
    confidence = checks.number("confidence", confidence, above=0.5, most=0.999999)
    awareness_range = checks.number("awareness_range", awareness_range, above=0.0)
    shape_given(range_shape)
    trajectories = check_trajectories(trajectories)
    grid = make_grid(trajectories, step, max_gap)
    scale, frames = scale_of(trajectories, grid, arena), window_frames(grid, window)
    check_motion(scale, grid, awareness_range, frames)
    found = neighbours_over_time(
        trajectories, awareness_range, range_shape=range_shape, arena=arena, step=step, max_gap=max_gap,
        progress=progress,
    )  # fmt: skip
    most = independent_frames(found.over_time, grid)
    tried = trials(found.over_time, grid, frames, most)
    doubts = cautions(found, trajectories, scale, awareness_range, arena)
    present = share_present(trajectories, found, tried)
    doubts += faults(trajectories, found, tried, awareness_range, present, arena)
    for doubt in doubts:
        warnings.warn(doubt, TrajectoryWarning, stacklevel=2)
    return DeltaReport(
        maxima=tried.maxima,
        bearings=found.bearings,
        robots=grid.robots,
        risk=risk,
        confidence=confidence,
        independent=tried.independent,
        largest=int(found.over_time["max_degree"].max()),
        prediction=_predicted(found, arena, awareness_range, tried.frames),
        source="trajectories",
        subject=subject or _describe(trajectories, grid),
        awareness_range=awareness_range,
        length=tried.frames * grid.step,
        unit="time units",
        trial=tried.kind,
        recorded=grid.frames * grid.step,
        shorter=_shorter(found, tried, risk, confidence, most),
        over_time=found.over_time,
        frame=grid.step,
        is_moving=found.move > 0,
        cautions=doubts,
        notes=(
            *notes(found, tried, awareness_range, window is not None, present), scale_note(scale, awareness_range),
            *[SQUARE_RANGES] * (range_shape == "square"),
        ),
    )


def _shorter(found: Neighbours, tried: Trials, risk: float, confidence: float, most: float) -> float | None:
    """Return the longest window that supports the risk [time], or None if there is none or the trials support it."""
    if exceedance.supports(tried.independent, risk, confidence):
        return None
    needed = exceedance.trials_needed(risk, confidence)
    window = shorter_window(found.over_time, found.grid, tried.frames, needed, most)
    return None if window is None else window * found.grid.step


def _predicted(found: Neighbours, arena: Arena | None, awareness_range: float, frames: int) -> Prediction | None:
    if not isinstance(arena, Disc) or found.range_shape != "disc":
        return None
    return closed_form.predict(
        found.grid.robots, arena.radius, steps=frames, awareness_range=awareness_range, speed=found.move
    )


def _describe(trajectories: pd.DataFrame, grid: Grid) -> str:
    span = float(np.sum((grid.length - 1) * grid.step))
    kind, size = recordings(grid)
    parts = f", in {len(size):,} {kind}s" * (len(size) > 1)
    return f"{grid.robots:,} recorded robots, {len(trajectories):,} positions over {span:g}{parts}"
