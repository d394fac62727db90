"""Limits on the work of one command."""

from __future__ import annotations

from typing import Annotated, Any

from teamsight.core import checks
from teamsight.core.component import Allowed

#: Steps of a run: each leaves a row in the history.
MOST_STEPS = 10_000_000
#: Runs, worlds and memories: each leaves a row in a table.
MOST_RUNS = 1_000_000
#: Transitions of a memory, of about 70 numbers each.
MOST_TRANSITIONS = 100_000_000

#: The steps of a run, and a number of runs, as components declare them.
Steps = Annotated[int, Allowed(least=1, most=MOST_STEPS, cure=("", "make more runs instead"))]
Runs = Annotated[int, Allowed(least=1, most=MOST_RUNS, cure=("", "give fewer, of more steps each"))]
#: Runs of each cell of commands that have thousands of cells.
CellRuns = Annotated[int, Allowed(least=1, most=1_000)]


def steps(value: Any) -> int:
    """Return a valid number of steps of a run; raise TypeError or ValueError for others."""
    return checks.count("steps", checks.count("steps", value), most=MOST_STEPS, cure="make more runs instead")


def runs(value: Any, name: str = "runs") -> int:
    """Return a valid number of runs; raise TypeError or ValueError for others."""
    return checks.count(name, checks.count(name, value), most=MOST_RUNS, cure="give fewer, of more steps each")
