"""What a reader must know of a record's frames, gaps and trials to trust the degrees."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from teamsight.analysis.delta.trajectory_trials import Trials, recordings

if TYPE_CHECKING:
    from teamsight.analysis.delta.trajectory_neighbours import Neighbours


def notes(found: Neighbours, tried: Trials, chosen: bool) -> tuple[str, ...]:
    """Return the notes of a report, one sentence or two each.

    Parameters
    ----------
    found : Neighbours
        The frames.
    tried : Trials
        The trials.
    chosen : bool
        Whether the user gave the window.
    """
    grid = found.grid
    said = [
        f"Frames every {grid.step:g}; gaps of up to {grid.max_gap:g} between a robot's samples are bridged by a line."
    ]
    said += _of_recordings(found)
    said += _of_trials(found, tried, chosen)
    present = float(found.over_time["robots"].mean()) / found.robots
    if present < 0.995:
        said.append(
            f"On average {present:.0%} of the robots are present in a frame; absent ones are nobody's neighbour, "
            "so degrees may be too low."
        )
    if found.move > 0.5 * found.awareness_range:
        said.append(
            f"Robots move {found.move:.3g} between frames, over half the awareness range: "
            "larger degrees in between go unseen."
        )
    return tuple(said)


def _of_recordings(found: Neighbours) -> list[str]:
    """Say into how many runs and pieces the record is divided, and by what gaps."""
    grid = found.grid
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
            f"{_between(grid.length * grid.step)}: gaps hold no frames, and no window reaches over one."
        )
    return said


def _of_trials(found: Neighbours, tried: Trials, chosen: bool) -> list[str]:
    """Say what a trial is if nobody chose it, and what is no trial."""
    grid, said = found.grid, []
    length = f"{tried.frames * grid.step:g}"
    if tried.kind != "window":
        said.append(f"Each {tried.kind} is one trial; give a window to state the risk for a stretch of one length.")
    elif not chosen:
        part = "a twentieth of the record" if len(grid.length) == 1 else "at most a twentieth of the record"
        said.append(f"The window of {length} is {part}; state your own for a risk that means something.")
    if tried.kind == "piece":
        said.append("Pieces are one team's, and may resemble each other; tell independent runs apart by a column run.")
    short = int((grid.length < tried.frames).sum())
    if tried.kind == "window" and short:
        said.append(f"{short:,} of {len(grid.length):,} pieces are shorter than the window and hold no trial.")
    if tried.left_out:
        why = "with few robots present" + " or short" * (tried.kind == "piece")
        said.append(f"{tried.left_out} {tried.kind}s {why} are left out of the exceedance.")
    return said


def _between(values: Any) -> str:
    """Return the smallest and the largest value, or the one that all are."""
    low, middle, high = (f"{float(value):.4g}" for value in (np.min(values), np.median(values), np.max(values)))
    return low if low == high else f"{low} to {high} (median {middle})"
