"""Notes on the frames, gaps and trials of a record that limit the result."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from teamsight.analysis.delta.trajectory_faults import USUALLY_PRESENT
from teamsight.analysis.delta.trajectory_trials import Trials, recordings

if TYPE_CHECKING:
    from teamsight.analysis.delta.resample import Grid
    from teamsight.analysis.delta.trajectory_neighbours import Neighbours


def notes(
    found: Neighbours, tried: Trials, awareness_range: float, chosen: bool, present: float
) -> tuple[str, ...]:
    """Return the notes of a report, one sentence or two each.

    Parameters
    ----------
    found : Neighbours
        The frames.
    tried : Trials
        The trials.
    awareness_range : float
        Distance within which two robots are neighbours [length].
    chosen : bool
        Whether the window was given by the user.
    present : float
        Mean share of the robots that is present; a small one is a fault of the record.
    """
    grid = found.grid
    said = [f"Frames every {grid.step:g}; between samples of a robot up to {grid.max_gap:g} apart it moves in a line."]
    said += _of_recordings(grid)
    said += _of_trials(grid, tried, chosen)
    if USUALLY_PRESENT <= present < 0.995:
        said.append(
            f"On average {present:.0%} of the robots are present in a frame; absent robots are not counted as "
            "neighbours, so numbers of neighbours may be too low."
        )
    if found.move > 0.5 * awareness_range:
        said.append(
            f"Robots move {found.move:.3g} between frames, over half the awareness range: "
            "larger numbers of neighbours between frames are not found."
        )
    return tuple(said)


def _of_recordings(grid: Grid) -> list[str]:
    """Return the numbers of runs and pieces of a record, and the gaps between them."""
    if len(grid.length) == 1:
        return []
    kind, size = recordings(grid)
    said = []
    if kind == "run":
        said.append(f"The record holds {len(size):,} runs of {_between(size * grid.step)}.")
    if len(grid.gaps):
        several = len(grid.gaps) > 1
        said.append(
            f"{len(grid.gaps):,} gap{'s' * several} of {_between(grid.gaps)} in which no robot has a sample "
            f"divide{'s' * (not several)} the record into {len(grid.length):,} pieces of "
            f"{_between(grid.length * grid.step)}: there are no frames in gaps, and no window includes one."
        )
    return said


def _of_trials(grid: Grid, tried: Trials, chosen: bool) -> list[str]:
    """Return what a trial is if the user did not choose it, and which parts are no trials."""
    said = []
    length = f"{tried.frames * grid.step:g}"
    if tried.kind != "window":
        said.append(f"Each {tried.kind} is one trial; give a window to state the risk for a fixed length of time.")
    elif not chosen:
        part = "a twentieth of the record" if len(grid.length) == 1 else "at most a twentieth of the record"
        said.append(f"The window of {length} is {part}; give the window for which the risk is to be stated.")
    if tried.kind == "piece":
        said.append("Pieces are of one team, and may be correlated; mark independent runs by a column run.")
    short = int((grid.length < tried.frames).sum())
    if tried.kind == "window" and short:
        said.append(f"{short:,} of {len(grid.length):,} pieces are shorter than the window and contain no trial.")
    if tried.left_out:
        why = "with few robots present" + " or short" * (tried.kind == "piece")
        said.append(f"{tried.left_out} {tried.kind}s {why} are left out of the exceedance.")
    return said


def _between(values: Any) -> str:
    """Return the smallest and the largest value, or the value if all are equal."""
    low, middle, high = (f"{float(value):.4g}" for value in (np.min(values), np.median(values), np.max(values)))
    return low if low == high else f"{low} to {high} (median {middle})"
