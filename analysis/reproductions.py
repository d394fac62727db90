"""The reproduction of each task: its figures and its ledger, by the name of the task."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING

from teamsight.core.registry import Registry

if TYPE_CHECKING:
    from teamsight.analysis.reproduction import Request
    from teamsight.analysis.runs.simulate import Watch
    from teamsight.analysis.runs.workers import WorkerPool


#: Draws the figures of a task and judges its claims; returns what there is to say, in lines.
Reproduce = Callable[["Request", "WorkerPool", "Watch"], Sequence[str]]

#: The reproductions by the name of the task, but for CMOMMT's, which is `teamsight.analysis.papers.touzet2000`.
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
