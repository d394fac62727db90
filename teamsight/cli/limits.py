"""Limits on what one command simulates and writes; they are checked before any work."""

from __future__ import annotations

from collections.abc import Collection
from pathlib import Path
from typing import Any

#: Runs of each cell of `reproduce`, which has thousands of cells.
MOST_CELL_RUNS = 1_000
#: Agents of one kind: any two of them may be neighbours.
MOST_AGENTS = 1_000_000
#: Sectors of a ring, or teammates of a list: finer than a degree of arc is of no use, and each costs memory for every
#: transition.
MOST_SECTORS = 360
#: The smallest risk: a smaller one would need by far more runs than a command may make.
LEAST_RISK = 1e-9

# Events of one command: hours of work, and a log that fills the memory.
_MOST_EVENTS = 1e7
# Agents × steps of one command: months of work.
_MOST_AGENT_STEPS = 1e14
# Neighbours, sensed targets and relayed targets of all robots in one step, which are in memory together.
_MOST_NEIGHBOURS = 2e8
# Bytes of the recorded transitions; sorting them takes as much again.
_MOST_BYTES = 5e9
# Radius of the arena: beyond it the sensing range, which is 1, or the speeds would exceed the limits of a world.
_LEAST_RADIUS, _MOST_RADIUS = 1e-3, 1e8
# Agents × frames of a recording: a page of about 200 MB. Frames of a film: hours of drawing.
_MOST_RECORDED, _MOST_FILMED = 20_000_000, 20_000
_FACTS, _OWN = 9, 16


def check_worlds(
    robots: int, targets: int, radius: float, steps: int, runs: int = 1, *, awareness_range: float = 1.0,
    degrees: Collection[str] = (),
) -> None:  # fmt: skip
    """Refuse more agent steps than a command can simulate, and worlds whose neighbours do not fit in memory.

    Parameters
    ----------
    robots, targets : int
        The number of each in one world.
    radius : float
        Radius of the arena [sensing ranges].
    steps, runs : int
        The number of steps of each run, and of runs.
    awareness_range : float
        Distance within which two robots are neighbours [sensing ranges].
    degrees : collection of str
        The degrees of awareness; under some of them teammates report the targets that they sense.

    Raises
    ------
    ValueError
        If there are too many, or the radius is outside its limits.
    """
    from teamsight.agents.awareness.registry import degree_named

    made = float(robots + targets) * steps * runs
    if made > _MOST_AGENT_STEPS:
        counts = f"robots={robots}, targets={targets}, steps={steps}" + (f", runs={runs}" if runs > 1 else "")
        raise ValueError(f"{counts}: makes {made:.1e} agent steps, at most {_MOST_AGENT_STEPS:g}; reduce one of them")
    if not _LEAST_RADIUS <= radius <= _MOST_RADIUS:
        raise ValueError(
            f"radius={radius:g}: must be from {_LEAST_RADIUS:g} to {_MOST_RADIUS:g} sensing ranges, since otherwise "
            "rounding errors dominate; give another radius"
        )
    neighbours = float(robots) ** 2 * min(1.0, (awareness_range / radius) ** 2)
    sensed = targets * min(1.0, 1 / radius**2)
    relayed = any("relayed" in degree_named(degree).delivers for degree in degrees)
    made = neighbours * (1.0 + sensed if relayed else 1.0) + robots * sensed
    if made > _MOST_NEIGHBOURS:
        raise ValueError(
            f"robots={robots}, targets={targets}, radius={radius:g}: makes about {made:.1e} neighbours per step, at "
            f"most {_MOST_NEIGHBOURS:g} fit in memory; give fewer robots, or a larger radius"
        )


def check_transitions(robots: int, steps: int, runs: int, degrees: Collection[str], delta: int) -> None:
    """Refuse an exploration whose transitions do not fit in memory.

    Parameters
    ----------
    robots, steps, runs : int
        Their product is the number of transitions.
    degrees : collection of str
        The degrees of awareness, of which the one that adds most inputs to a situation counts.
    delta : int
        δ, for degrees that have it.

    Raises
    ------
    ValueError
        If the transitions need too much memory.
    """
    from teamsight.agents.awareness.registry import awareness_named

    added = max(awareness_named(degree, {"delta": delta}).width(robots).added for degree in degrees)
    transitions, numbers = robots * steps * runs, 2 * (_OWN + added + 1) + _FACTS
    if 4.0 * transitions * numbers > _MOST_BYTES:
        raise ValueError(
            f"robots={robots}, steps={steps}, runs={runs}: makes {transitions:.1e} transitions of {numbers} numbers, "
            f"{4 * transitions * numbers / 1e9:.3g} GB, at most {_MOST_BYTES / 1e9:g} GB; reduce one of them, or give "
            "a degree of awareness that adds fewer inputs"
        )


def check_failures(failures: float | None, repair: float | None, robot_steps: float) -> None:
    """Refuse repairs without failures, and more events than a command can process.

    Parameters
    ----------
    failures, repair : float or None
        The mean number of ticks until a robot fails, and until it is repaired.
    robot_steps : float
        Robots × steps.

    Raises
    ------
    ValueError
        If both do not fit, or there would be too many events.
    """
    if repair is None:
        return
    if failures is None:
        raise ValueError(f"repair={repair:g}: no robot fails; give --failures too, or leave --repair out")
    if 2 * robot_steps > _MOST_EVENTS * (failures + repair):
        raise ValueError(
            f"failures={failures:g}, repair={repair:g}: make more than {_MOST_EVENTS:g} events; give longer times, or "
            "fewer steps"
        )


def check_sectors(settings: Any) -> None:
    """Refuse ``--delta`` for a degree of awareness without δ; both are options of these settings.

    Raises
    ------
    ValueError
        If both do not fit.
    """
    from teamsight.agents.awareness.registry import with_option

    having = with_option("delta")
    if "delta" in settings.given and settings.awareness not in having:
        raise ValueError(
            f"delta={settings.delta}: awareness {settings.awareness!r} has no δ; leave --delta out, or give "
            f"--awareness {' or '.join(having)}"
        )


def check_recording(place: Path, agents: int, steps: int, every: int) -> None:
    """Refuse a recording that no browser could open, or a film that takes hours to draw.

    Parameters
    ----------
    place : path
        The file of the recording.
    agents, steps, every : int
        The number of agents and of steps, and the steps from one frame to the next.

    Raises
    ------
    ValueError
        If it is too large.
    """
    frames = steps // every
    most = _MOST_RECORDED // agents
    if place.suffix.lower() in (".gif", ".mp4"):
        most = min(most, _MOST_FILMED)
    if frames > most:
        raise ValueError(
            f"record={place}: would have {frames:,} frames of {agents:,} agents, at most {most:,}; give "
            f"--record-every {-(-steps // max(most, 1))}, or fewer steps"
        )
