"""Limits of what is simulated at once: beyond them nobody could wait for it."""

from __future__ import annotations

from typing import Any

from teamsight.core import checks

#: Steps of a run: each leaves a row in the history.
MOST_STEPS = 10_000_000
#: Runs, worlds and memories: each leaves a row in a table.
MOST_RUNS = 1_000_000
#: Pairs of a memory, of some 30 numbers each.
MOST_PAIRS = 100_000_000


def steps(value: Any) -> int:
    """Return a number of steps that a run can have; raise TypeError or ValueError for others."""
    return checks.count("steps", value, most=MOST_STEPS, cure="make more runs instead")


def runs(value: Any) -> int:
    """Return a number of runs that can be made at once; raise TypeError or ValueError for others."""
    return checks.count("runs", value, most=MOST_RUNS, cure="give fewer, of more steps each")
