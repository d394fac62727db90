"""Exploration: run a world and return the robots' transitions as a lazy memory."""

from __future__ import annotations

import warnings
from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np
import numpy.typing as npt

from teamsight.agents.channel import TARGETS
from teamsight.agents.group import Group, team_of
from teamsight.agents.recording.transitions import Transitions, concatenated
from teamsight.agents.world import World
from teamsight.core import checks
from teamsight.policies.memory import LazyMemory
from teamsight.world.arena import Disc


def explore(world: World, steps: int, group: Group | None = None) -> LazyMemory:
    """Run a world and return the transitions of a group: one for each step and robot that is there when it begins.

    Parameters
    ----------
    world : World
        Any world. Its policies choose the actions, its degrees of awareness determine the situations.
    steps : int
        Number of steps, at least 1.
    group : Group, optional
        The group whose transitions are recorded; by default the first group on a team.

    Returns
    -------
    LazyMemory
        Its settings describe the world. What differs after the run has both values: numbers as [least, most].

    Raises
    ------
    TypeError, ValueError
        If `world` is not a `World` or has stopped, `steps` is not a whole number of at least 1, or the group is
        unknown, is empty, or changes its degree of awareness or the width of its situations on the way.

    Warns
    -----
    UserWarning
        If the group senses nothing in the channel "targets": its situations show no targets then, and all facts are 0.

    Notes
    -----
    Situations show targets and teammates. What is sensed in other channels is not in them.

    *Source:* §8.1: one exploration serves every objective. §8.2: 5 robots and 120 steps give 600 transitions.
    """
    if not isinstance(world, World):
        shown = f"{checks.shown(world)}: is not a world; give one"
        if isinstance(world, type):
            shown = f"{world.__name__}: is a class; give a world"
        raise TypeError(f"world={shown}, such as CMOMMT(robots=5)")
    steps = checks.count("steps", steps)
    robots = _explorers(world) if group is None else group
    if not world.running:
        shown = f"world={checks.shown(world)}"
        raise ValueError(f"{shown}: has stopped (running is False); explore another, or set running to True")
    if isinstance(robots, Group) and TARGETS not in robots.channels:
        warnings.warn(
            f"{robots!r} senses nothing in the channel {TARGETS!r}, so its situations show no targets and all facts "
            "are 0; declare it: world.senses(group, others)",
            stacklevel=2,
        )
    world.recording.record_transitions(robots)  # refuses a group of another world
    seed, first, before = world.seed_used, world.tick, settings_of(world, robots)
    recorded = record_run(world, robots, steps)
    met = _settings_met(before, settings_of(world, robots))
    return memory_of([recorded], robots, met | {"steps": world.tick - first, "runs": 1, "seed": seed})


def _settings_met(before: Mapping[str, Any], after: Mapping[str, Any]) -> dict[str, Any]:
    """Return the settings before a run, with both values where they differ after it."""
    met = dict(before)
    for name, value in after.items():
        if value in (None, "", before.get(name)):
            continue  # as before, or nobody is left
        if before.get(name) in (None, ""):
            met[name] = value
        elif isinstance(value, str | dict):
            met[name] = f"{before[name]}, then {value}"
        else:
            met[name] = _range(np.hstack([before[name], value]))
    return met


def record_run(world: World, group: Group, steps: int) -> Transitions:
    """Run a world from its present state and return the transitions of a group in these steps."""
    world.recording.record_transitions(group)
    before = len(world.recording.transitions(group).situation)
    world.run(steps)
    found = world.recording.transitions(group)
    facts = {name: fact[before:] for name, fact in found.facts.items()}
    return Transitions(found.situation[before:], found.action[before:], found.next_situation[before:], facts)


def memory_of(parts: Iterable[Transitions], group: Group, settings: Mapping[str, Any]) -> LazyMemory:
    """Return the lazy memory of transitions from several worlds, whose robots have the group's degree of awareness.

    Raises
    ------
    ValueError
        If the situations of the parts differ in width, or there is no transition.
    """
    kept = list(parts)
    widths = sorted({part.situation.shape[1] for part in kept})
    if len(widths) > 1:
        raise ValueError(
            f"situations of {' and '.join(map(str, widths))} inputs: a memory holds one width; explore with teams of "
            "one size, or with RingAwareness()"
        )
    return LazyMemory.of(*concatenated(kept), own=group.awareness.width(1).own, settings=settings)


def settings_of(world: World, group: Group) -> dict[str, Any]:
    """Return the settings of a world that matter for its transitions, JSON-serialisable."""
    group.host.find_neighbours()
    targets = group.relations["targets"].observed if "targets" in group.relations else []
    team_size = sum(map(len, team_of(world.groups, group) or [group]))
    # Situations come from what sensors show. Without sensors, and with discs, the settings are those of older memories.
    sensors = {name: repr(channel.sensor) for name, channel in group.channels.items() if channel.sensor is not None}
    return {
        "awareness": repr(group.awareness),
        "degree": group.awareness.name,
        "rings": list(group.awareness.rings(team_size)),
        "teammate_layout": group.awareness.teammate_layout,
        "policy": _described(group.policy),
        "robots": team_size,
        "targets": sum(map(len, targets)),
        "target_policy": ", ".join(_described(other.policy) for other in targets),
        "arena": repr(world.arena),
        "radius": world.arena.radius if isinstance(world.arena, Disc) else None,
        "robot_speed": _range(group.speed),
        "target_speed": _range(np.concatenate([np.zeros(0), *(other.speed for other in targets)])),
        "sensing_range": _range(group.sensing_range),
        "awareness_range": _range(group.awareness_range),
    } | ({"sensors": sensors} if sensors else {}) | ({"range_shape": "square"} if group.range_shape == "square" else {})


def _described(policy: Any) -> str:
    """Return the repr of a policy, or only its name if its repr contains an address."""
    text = repr(policy)
    return str(getattr(policy, "__name__", type(policy).__name__)) if " at 0x" in text else text


def _range(values: npt.NDArray[Any]) -> float | list[float] | None:
    """Return the common value, or the smallest and the largest."""
    if not len(values):
        return None
    low, high = values.min().item(), values.max().item()
    return low if low == high else [low, high]


def _explorers(world: World) -> Group:
    for group in world.groups:
        if group.team is not None and len(group):
            return group
    raise ValueError("explore(…): no robot is on a team; give the group whose transitions to record")
