"""The reproduction of each task: its figures and its ledger, by the name of the task."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from teamsight.core.registry import Registry

if TYPE_CHECKING:
    from teamsight.analysis.runs.simulate import Watch
    from teamsight.analysis.runs.workers import WorkerPool


@dataclass(frozen=True)
class Request:
    """What a reproduction is asked for.

    Attributes
    ----------
    folder : Path
        Where to write; it exists.
    seed, runs, steps : int or None
        The root seed, the replicates of each cell and the steps of each run; None for those of the reproduction.
    quick : bool
        Whether a coarse result is enough.
    formats : tuple of str
        Formats of the pictures: names in `teamsight.analysis.plot.style.FORMATS`.
    force : bool
        Whether files that teamsight did not write may be replaced.
    """

    folder: Path
    seed: int | None = None
    runs: int | None = None
    steps: int | None = None
    quick: bool = False
    formats: tuple[str, ...] = ("png",)
    force: bool = False


#: Draws the figures of a task and judges its claims; returns what there is to say, in lines.
Reproduce = Callable[[Request, "WorkerPool", "Watch"], Sequence[str]]

#: The reproductions by the name of the task, but for CMOMMT's, which is `teamsight.analysis.paper.reproduce`.
REPRODUCTIONS: Registry[Reproduce] = Registry(
    {
        "pursuit": "teamsight.analysis.pursuit.reproduce:reproduce",
        "surround": "teamsight.analysis.pursuit.reproduce:reproduce",
        # One study compares all three.
        "forage": "teamsight.analysis.foraging.reproduce:reproduce",
        "consume": "teamsight.analysis.foraging.reproduce:reproduce",
        "graze": "teamsight.analysis.foraging.reproduce:reproduce",
        "push": "teamsight.analysis.pushing.reproduce:reproduce",
        "collect": "teamsight.analysis.collecting.reproduce:reproduce",
    }
)
