"""δ from recorded positions, without a model of the robots."""

from __future__ import annotations

import warnings
from typing import TYPE_CHECKING

import numpy as np
import pandas as pd

from teamsight.analysis.delta import closed_form
from teamsight.analysis.delta.report import DeltaReport
from teamsight.analysis.delta.resample import make_grid, neighbours_over_time
from teamsight.analysis.delta.trajectory_files import check_trajectories
from teamsight.analysis.delta.trajectory_notes import (
    Record,
    TrajectoryWarning,
    cautions,
    check_motion,
    motion_of,
    notes,
)
from teamsight.analysis.delta.trajectory_trials import independent_frames, recordings, trials, window_frames
from teamsight.analysis.runs.simulate import Progress
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
        as one team. Or if the record has a fault: fewer than 95 % of the robots are present at a time, one never is,
        their number differs between runs, two names differ only in capitals or in spaces around them, in most runs
        their first samples are more than two intervals apart, or a step is above ten medians and half a range. The
        report begins with the same sentences, `cautions`, and states no confidence.

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
    motion, frames = motion_of(trajectories, grid, arena), window_frames(grid, window)
    check_motion(motion, grid, awareness_range, frames)
    found = neighbours_over_time(
        trajectories, awareness_range, range_shape=range_shape, arena=arena, step=step, max_gap=max_gap,
        progress=progress,
    )  # fmt: skip
    tried = trials(found.over_time, grid, frames, independent_frames(found.over_time, grid))
    record = Record(trajectories, found, tried, motion, awareness_range)
    doubts = cautions(record)
    for doubt in doubts:
        warnings.warn(doubt, TrajectoryWarning, stacklevel=2)
    prediction = None
    if isinstance(arena, Disc) and range_shape == "disc":
        prediction = closed_form.predict(
            grid.robots, arena.radius, steps=tried.frames, awareness_range=awareness_range, speed=found.move
        )
    span = float(np.sum((grid.length - 1) * grid.step))
    kind, size = recordings(grid)
    parts = f", in {len(size):,} {kind}s" * (len(size) > 1)
    described = f"{grid.robots:,} recorded robots, {len(trajectories):,} positions over {span:g}{parts}"
    return DeltaReport(
        maxima=tried.maxima,
        bearings=found.bearings,
        robots=grid.robots,
        risk=risk,
        confidence=confidence,
        independent=tried.independent,
        largest=int(found.over_time["max_degree"].max()),
        prediction=prediction,
        source="trajectories",
        subject=subject or described,
        awareness_range=awareness_range,
        length=tried.frames * grid.step,
        unit="time units",
        trial=tried.kind,
        recorded=grid.frames * grid.step,
        over_time=found.over_time,
        frame=grid.step,
        cautions=doubts,
        notes=notes(record, window is not None),
    )
