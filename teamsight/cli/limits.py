"""Limits of what one command makes: each is refused with the count that it would make, before any work."""

from __future__ import annotations

import math

from teamsight.analysis.runs.limits import MOST_RUNS, MOST_STEPS

__all__ = [
    "LEAST_RISK", "MOST_AGENTS", "MOST_CELL_RUNS", "MOST_RUNS", "MOST_STEPS", "STEPS_CURE", "added_inputs",
    "check_pairs", "check_rows", "check_sightings", "check_work", "runs_within",
]  # fmt: skip

#: What to do instead of a run of more steps.
STEPS_CURE = "give fewer steps, or another seed for more of them"
#: Runs of each cell of `reproduce`, which has thousands of cells.
MOST_CELL_RUNS = 1_000
#: Agents of a kind: each pair of them may be neighbours.
MOST_AGENTS = 1_000_000
#: The least risk: what would need more runs than anybody can make.
LEAST_RISK = 1e-9

# Steps of single robots and targets that a command makes: months of work.
_MOST_AGENT_STEPS = 1e14
# Neighbours, sensed targets and relayed targets of all robots in one step, which lie in memory together.
_MOST_SIGHTINGS = 2e8
# Bytes of the pairs that are explored; to put them in order takes as much again, and more.
_MOST_BYTES = 5e9
# Of the arena, so that its sensing range, which is 1, and its speeds are within the limits of a world.
_LEAST_RADIUS, _MOST_RADIUS = 1e-3, 1e8
# Rows that a command writes.
_MOST_ROWS = 2e6
_FACTS, _OWN = 9, 16


def check_work(robots: int, targets: int, steps: int, runs: int = 1) -> None:
    """Refuse more agent steps than a command can make.

    Raises
    ------
    ValueError
        Naming their number.
    """
    made = float(robots + targets) * steps * runs
    if made > _MOST_AGENT_STEPS:
        counts = f"robots={robots}, targets={targets}, steps={steps}" + (f", runs={runs}" if runs > 1 else "")
        raise ValueError(f"{counts}: makes {made:.1e} agent steps, at most {_MOST_AGENT_STEPS:g}; give less of one")


def check_sightings(robots: int, targets: int, radius: float, awareness_range: float, shared: bool = False) -> None:
    """Refuse a world in which the robots have more neighbours than fit in memory.

    Parameters
    ----------
    robots, targets : int
        How many there are.
    radius : float
        Of the arena [sensing ranges].
    awareness_range : float
        Within which distance two robots are neighbours [sensing ranges].
    shared : bool
        Whether teammates report the targets that they sense.

    Raises
    ------
    ValueError
        Naming their number, or the radius.
    """
    if not _LEAST_RADIUS <= radius <= _MOST_RADIUS:
        raise ValueError(
            f"radius={radius:g}: must be {_LEAST_RADIUS:g} to {_MOST_RADIUS:g} sensing ranges, or its ranges and "
            "speeds drown in rounding; give another radius"
        )
    edges = float(robots) ** 2 * min(1.0, (awareness_range / radius) ** 2)
    sensed = targets * min(1.0, 1 / radius**2)
    made = edges * (1.0 + sensed if shared else 1.0) + robots * sensed
    if made > _MOST_SIGHTINGS:
        raise ValueError(
            f"robots={robots}, targets={targets}, radius={radius:g}: makes about {made:.1e} sightings a step, at most "
            f"{_MOST_SIGHTINGS:g} fit in memory; give fewer robots, or a larger radius"
        )


def check_pairs(robots: int, steps: int, runs: int, added: int) -> None:
    """Refuse an exploration whose pairs would not fit in memory.

    Parameters
    ----------
    robots, steps, runs : int
        What is explored; there are as many pairs as their product.
    added : int
        Inputs of a situation that the degree of awareness adds.

    Raises
    ------
    ValueError
        Naming the number of pairs and their size.
    """
    pairs, numbers = robots * steps * runs, 2 * (_OWN + added + 1) + _FACTS
    if 4.0 * pairs * numbers > _MOST_BYTES:
        raise ValueError(
            f"robots={robots}, steps={steps}, runs={runs}: makes {pairs:.1e} pairs of {numbers} numbers, "
            f"{4 * pairs * numbers / 1e9:.3g} GB, at most {_MOST_BYTES / 1e9:g} GB; give less of one, or a degree of "
            "awareness that adds fewer inputs"
        )


def check_rows(rows: float, what: str) -> None:
    """Refuse a table of more rows than a command writes.

    Raises
    ------
    ValueError
        Naming `what` makes them, and their number.
    """
    if rows > _MOST_ROWS:
        raise ValueError(f"{what}: makes {rows:.1e} rows, at most {_MOST_ROWS:g}; give less of one")


def runs_within(risk: float, runs: int | None) -> int:
    """Return the runs that a risk asks for, or those given.

    Raises
    ------
    ValueError
        If they are too many.
    """
    asked = math.ceil(10 / risk) if runs is None else runs
    if asked > MOST_RUNS:
        raise ValueError(
            f"risk={risk:g}: asks for 10 / risk = {asked:.1e} runs, at most {MOST_RUNS}; give a risk of at least "
            f"{10 / MOST_RUNS:g}, or --runs"
        )
    return asked


def added_inputs(awareness: str, delta: int | None, robots: int) -> int:
    """Return how many inputs a degree of awareness adds to a situation, by its name."""
    per_teammate = {"pairwise": 2, "shared": _OWN}.get(awareness, 0)
    return (delta or _OWN) if awareness == "ring" else per_teammate * (robots - 1)
