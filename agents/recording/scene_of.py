"""The scene of a world: its arena, groups and bodies, as a page draws them."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import fields, is_dataclass

import numpy as np
import numpy.typing as npt

from teamsight.agents.awareness.interface import Awareness
from teamsight.agents.channel import TARGETS
from teamsight.agents.group import Group
from teamsight.agents.outline import COLOURS, obstacles, walls
from teamsight.core.checks import shown
from teamsight.core.version import __version__
from teamsight.policies.registry import label
from teamsight.view.scene import Fact, Line, LinkList, Point, Scene, SceneGroup, Slot
from teamsight.world.arena import Arena

Floats = npt.NDArray[np.float64]

_FULL_TURN = 2 * math.pi


class Backdrop:
    """The part of a scene that never changes: the arena, the box around it, and its lines.

    Parameters
    ----------
    arena : Arena
        The arena.
    """

    def __init__(self, arena: Arena) -> None:
        low, high = arena.bounds
        self.bounds = (float(low[0]), float(low[1]), float(high[0]), float(high[1]))
        x, y = arena.period
        self.wraps: Point | None = (float(x), float(y)) if x or y else None
        self.walls, self.obstacles = _lines(walls(arena)), _lines(obstacles(arena))


def scene_of(
    backdrop: Backdrop,
    groups: Iterable[Group],
    slots: Iterable[Slot],
    *,
    title: str | None,
    model: str,
    seed: int,
    every: int,
    series: tuple[str, ...],
    links: tuple[LinkList, ...],
) -> Scene:
    """Return the scene of a world.

    Parameters
    ----------
    backdrop : Backdrop
        Its arena.
    groups : iterable of Group
        Its groups, in order.
    slots : iterable of Slot
        The bodies of the frames.
    title : str, optional
        By default the class of the world, the policy of the first team, and the seed.
    model : str
        The class of the world.
    seed, every, series, links
        As in `Scene`.
    """
    listed = tuple(groups)
    counting = [channel for group in listed for channel in group.channels.values() if channel.counts]
    counted = {one.number for channel in counting for one in channel.observed}
    described = tuple(_group(group, is_counted=group.number in counted) for group in listed)
    policy = next((group.policy for group in described if group.role == "robot"), None)
    parts = [model, policy, f"seed {seed}"]
    return Scene(
        ", ".join(part for part in parts if part) if title is None else title,
        model, __version__, seed, every, backdrop.bounds, backdrop.walls, backdrop.obstacles, backdrop.wraps, described,
        tuple(slots), series, links,
    )  # fmt: skip


def slots_of(group: Group) -> list[Slot]:
    """Return the agents of a group as slots, in the order of its rows."""
    channel = group.channels.get(TARGETS)
    angle = float(getattr(channel and channel.sensor, "field_of_view", _FULL_TURN))
    sensing, awareness = (array.tolist() for array in group.ranges)
    return [
        Slot(group.number, identity, sensing[row], awareness[row], angle)
        for row, identity in enumerate(group.bodies.identity.tolist())
    ]


def _group(group: Group, *, is_counted: bool) -> SceneGroup:
    policy, awareness = group.rules
    role = "robot" if group.team is not None else "target" if is_counted else "other"
    return SceneGroup(
        group.name, role, COLOURS[group.number % len(COLOURS)], group.team,
        None if group.decides_alone else label(policy).strip("'"), _degree(awareness), _facts(group),
        group.range_shape,
    )  # fmt: skip


def _degree(awareness: Awareness) -> Mapping[str, Fact] | None:
    """Return a degree of awareness by name, with its options; None for none."""
    if awareness.name == "none":
        return None
    options: dict[str, object] = {}
    if is_dataclass(awareness):
        options = {one.name: getattr(awareness, one.name) for one in fields(awareness)}
    return {"name": awareness.name, **{name: _fact(value) for name, value in options.items()}}


def _facts(group: Group) -> dict[str, Fact]:
    """Return further facts: the class of the agents, their speed, and what they sense by which sensor."""
    speed = group.bodies.speed
    facts: dict[str, Fact] = {"class": group.agent_class.__name__}
    if len(speed) and (speed == speed[0]).all():
        facts["speed"] = float(speed[0])
    for name, channel in group.channels.items():
        if channel.observed:
            groups = " + ".join(one.name for one in channel.observed)
            by = f" by {shown(channel.sensor)}" if channel.sensor is not None else ""
            facts[f"senses {name}"] = f"{groups}{by}"
    return facts


def _fact(value: object) -> Fact:
    """Return a value that JSON has."""
    if isinstance(value, bool | str) or value is None:
        return value
    if isinstance(value, int | float | np.number) and math.isfinite(value):
        return value.item() if isinstance(value, np.number) else value
    return shown(value)


def _lines(lines: Iterable[Floats]) -> tuple[Line, ...]:
    return tuple(tuple((x, y) for x, y in line.tolist()) for line in lines)
