"""Limits on what one command simulates and writes; they are checked before any work."""

from __future__ import annotations

import math
from typing import Any

from teamsight.analysis.runs.limits import MOST_RUNS, MOST_STEPS

__all__ = [
    "LEAST_RISK", "MOST_AGENTS", "MOST_CELL_RUNS", "MOST_RUNS", "MOST_SECTORS", "MOST_STEPS", "added_inputs",
    "check_neighbours", "check_rows", "check_sectors", "check_transitions", "check_work", "relays", "runs_within",
    "workers_for",
]  # fmt: skip

#: Runs of each cell of `reproduce`, which has thousands of cells.
MOST_CELL_RUNS = 1_000
#: Agents of one kind: any two of them may be neighbours.
MOST_AGENTS = 1_000_000
#: Sectors of a ring: finer than a degree of arc is of no use, and each sector costs memory for every transition.
MOST_SECTORS = 360
#: The smallest risk: a smaller one would need more runs than `MOST_RUNS` by far.
LEAST_RISK = 1e-9

# Agents × steps of one command: months of work.
_MOST_AGENT_STEPS = 1e14
# Agents × steps of less work than workers save: they import everything anew, which takes each more than a second.
_SHORT = 1e8
# Neighbours, sensed targets and relayed targets of all robots in one step, which are in memory together.
_MOST_NEIGHBOURS = 2e8
# Bytes of the recorded transitions; sorting them takes as much again.
_MOST_BYTES = 5e9
# Radius of the arena: beyond it the sensing range, which is 1, or the speeds would exceed the limits of a world.
_LEAST_RADIUS, _MOST_RADIUS = 1e-3, 1e8
# Rows of a table.
_MOST_ROWS = 2e6
_FACTS, _OWN = 9, 16


def check_work(robots: int, targets: int, steps: int, runs: int = 1) -> None:
    """Refuse more agent steps than a command can simulate.

    Parameters
    ----------
    robots, targets, steps, runs : int
        The number of each; of robots, targets and steps in one run.

    Raises
    ------
    ValueError
        If their product is too large.
    """
    made = float(robots + targets) * steps * runs
    if made > _MOST_AGENT_STEPS:
        counts = f"robots={robots}, targets={targets}, steps={steps}" + (f", runs={runs}" if runs > 1 else "")
        raise ValueError(f"{counts}: makes {made:.1e} agent steps, at most {_MOST_AGENT_STEPS:g}; reduce one of them")


def check_neighbours(robots: int, targets: int, radius: float, awareness_range: float, relayed: bool = False) -> None:
    """Refuse a world whose neighbours and sensed targets do not fit in memory.

    Parameters
    ----------
    robots, targets : int
        The number of each.
    radius : float
        Radius of the arena [sensing ranges].
    awareness_range : float
        Distance within which two robots are neighbours [sensing ranges].
    relayed : bool
        Whether teammates report the targets that they sense.

    Raises
    ------
    ValueError
        If there are too many, or the radius is outside its limits.
    """
    if not _LEAST_RADIUS <= radius <= _MOST_RADIUS:
        raise ValueError(
            f"radius={radius:g}: must be from {_LEAST_RADIUS:g} to {_MOST_RADIUS:g} sensing ranges, since otherwise "
            "rounding errors dominate; give another radius"
        )
    neighbours = float(robots) ** 2 * min(1.0, (awareness_range / radius) ** 2)
    sensed = targets * min(1.0, 1 / radius**2)
    made = neighbours * (1.0 + sensed if relayed else 1.0) + robots * sensed
    if made > _MOST_NEIGHBOURS:
        raise ValueError(
            f"robots={robots}, targets={targets}, radius={radius:g}: makes about {made:.1e} neighbours per step, at "
            f"most {_MOST_NEIGHBOURS:g} fit in memory; give fewer robots, or a larger radius"
        )


def check_transitions(robots: int, steps: int, runs: int, added: int) -> None:
    """Refuse an exploration whose transitions do not fit in memory.

    Parameters
    ----------
    robots, steps, runs : int
        Their product is the number of transitions.
    added : int
        Inputs of a situation that the degree of awareness adds.

    Raises
    ------
    ValueError
        If the transitions need too much memory.
    """
    transitions, numbers = robots * steps * runs, 2 * (_OWN + added + 1) + _FACTS
    if 4.0 * transitions * numbers > _MOST_BYTES:
        raise ValueError(
            f"robots={robots}, steps={steps}, runs={runs}: makes {transitions:.1e} transitions of {numbers} numbers, "
            f"{4 * transitions * numbers / 1e9:.3g} GB, at most {_MOST_BYTES / 1e9:g} GB; reduce one of them, or give "
            "a degree of awareness that adds fewer inputs"
        )


def check_rows(rows: float, what: str) -> None:
    """Refuse a table with too many rows.

    Parameters
    ----------
    rows : float
        The number of rows.
    what : str
        The options that determine it.

    Raises
    ------
    ValueError
        If there are too many.
    """
    if rows > _MOST_ROWS:
        raise ValueError(f"{what}: makes {rows:.1e} rows, at most {_MOST_ROWS:g}; reduce one of them")


def runs_within(risk: float, runs: int | None) -> int:
    """Return the number of runs: the given one, or the 10 / risk that a risk needs.

    Parameters
    ----------
    risk : float
        The risk.
    runs : int or None
        The number of runs that was given.

    Raises
    ------
    ValueError
        If the risk needs too many runs.
    """
    needed = math.ceil(10 / risk) if runs is None else runs
    if needed > MOST_RUNS:
        raise ValueError(
            f"risk={risk:g}: needs 10 / risk = {needed:.1e} runs, at most {MOST_RUNS}; give a risk of at least "
            f"{10 / MOST_RUNS:g}, or --runs"
        )
    return needed


def check_sectors(settings: Any) -> None:
    """Refuse ``--delta`` for a degree of awareness without sectors.

    Parameters
    ----------
    settings : Settings
        With the options ``awareness`` and ``delta``.

    Raises
    ------
    ValueError
        If both do not fit.
    """
    from teamsight.agents.awareness.registry import with_option

    having = with_option("delta")
    if "delta" in settings.given and settings.awareness not in having:
        raise ValueError(
            f"delta={settings.delta}: awareness {settings.awareness!r} has no sectors; leave --delta out, or give "
            f"--awareness {' or '.join(having)}"
        )


def workers_for(given: int | None, agent_steps: float) -> int:
    """Return the number of worker processes: the given one, or the number of cores, or 1 for short work.

    Parameters
    ----------
    given : int or None
        The option ``--workers``.
    agent_steps : float
        Agents × steps × runs of the command.
    """
    from teamsight.analysis.runs.workers import cores

    if given is not None:
        return given
    return cores() if agent_steps > _SHORT else 1


def added_inputs(awareness: str, delta: int, robots: int) -> int:
    """Return how many inputs a degree of awareness adds to a situation.

    Parameters
    ----------
    awareness : str
        The name of the degree.
    delta : int
        Number of sectors, for degrees that have them.
    robots : int
        The team size.
    """
    from teamsight.agents.awareness.registry import awareness_named

    return awareness_named(awareness, {"delta": delta}).width(robots).added


def relays(awareness: str) -> bool:
    """Return whether teammates report the targets that they sense, under a degree of awareness."""
    from teamsight.agents.awareness import AWARENESS

    return "relayed" in AWARENESS[awareness].delivers
