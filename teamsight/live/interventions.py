"""Interventions: what a visitor does to bodies and obstacles of a running world, noted so that it can be repeated.

Each is carried out through the world's public interface, between two steps. It is in the world's event log and in the
journal, as the Python that does the same again.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from teamsight.agents.body import Body, checked_positions
from teamsight.agents.group import Group
from teamsight.agents.world import World
from teamsight.world.shapes import Circle, Polygon

#: Interventions of one run, at most: its journal is in memory, and in the Python of a page.
MOST_INTERVENTIONS = 2000
#: Corners of an obstacle that is drawn.
MOST_CORNERS = 64
# It stands for the world in lines of Python.
MODEL = "\0"
_ABILITIES = ("sensing_range", "awareness_range", "speed", "radius")


class Place(NamedTuple):
    """A body as all worlds of a page know it: the number of its group, and its member there."""

    group: int
    member: int


class Act(NamedTuple):
    """What was done: the name of a function of this module and its values by name, or "set" with a name and a value."""

    kind: str
    fields: dict[str, Any]


class Entry(NamedTuple):
    """What was done after so many steps, as lines of Python; for a parameter, which one was set to what."""

    made: int
    act: Act
    lines: tuple[str, ...] = ()
    setting: str | None = None
    value: Any = None


@dataclass
class Journal:
    """What was done to a world since it was built.

    Attributes
    ----------
    parameters : dict of str to object
        The arguments with which it was built.
    entries : list of Entry
        In order.
    """

    parameters: dict[str, Any]
    entries: list[Entry] = field(default_factory=list)

    def check_room(self) -> None:
        """Refuse more than can be kept.

        Raises
        ------
        ValueError
            If there is no room.
        """
        if len(self.entries) >= MOST_INTERVENTIONS:
            raise ValueError(
                f"{len(self.entries):,} interventions: a run has at most {MOST_INTERVENTIONS:,}; Reset starts again"
            )

    def note(self, entry: Entry) -> None:
        """Note what was done; a number that a slider sets again before the next step replaces the one before."""
        before, fields = self.entries[-1] if self.entries else None, entry.act.fields
        is_number = entry.act.kind == "set" and isinstance(fields["value"], (int, float))
        if is_number and before is not None and before.made == entry.made:
            is_again = before.act.kind == "set" and before.act.fields["name"] == fields["name"]
            self.entries[len(self.entries) - is_again :] = []
        self.entries.append(entry)


def place_of(world: World, body: int) -> Place:
    """Return the body with a `unique_id`.

    Raises
    ------
    ValueError
        If it is not in the world.
    """
    for number, group in enumerate(world.groups):
        rows = np.flatnonzero(group.identity == body)
        if len(rows):
            return Place(number, int(group.bodies.member[rows[0]]))
    raise ValueError(f"body={body}: is not in the world any more; choose another")


def check_there(world: World, place: Place) -> None:
    """Refuse a body that is not in the world.

    Raises
    ------
    ValueError
        If it is not.
    """
    _agent(world, place)


def move(world: World, place: Place, x: float, y: float) -> list[str]:
    """Move a body."""
    agent, its_name = _agent(world, place)
    x, y = _in_cell(world, x, y)
    agent.position = (x, y)
    world.log("moved", agent, x=x, y=y)
    return [f"{its_name}.position = ({x!r}, {y!r})", f'{MODEL}.log("moved", {its_name}, x={x!r}, y={y!r})']


def switch(world: World, place: Place, on: bool) -> list[str]:
    """Let a body fail, or repair it."""
    agent, its_name = _agent(world, place)
    if agent.active == on:
        state = "works" if on else "is out of order"
        raise ValueError(f"body {agent.unique_id}: {state} already; nothing has changed")
    logged = len(world._data.sources.events)
    agent.active = on
    lines = [f"{its_name}.active = {on}"]
    return lines + _logged(world, logged, "active" if on else "inactive", agent, its_name)


def remove(world: World, place: Place) -> list[str]:
    """Take a body out of the world."""
    agent, its_name = _agent(world, place)
    logged = len(world._data.sources.events)
    agent.remove()
    lines = [f"agent = {its_name}", "agent.remove()"]
    return lines + _logged(world, logged, "left", agent, "agent")


def add(world: World, number: int, x: float, y: float) -> list[str]:
    """Add a body to a group; what the bodies of the group do not share, such as a speed, is that of the first."""
    group, its_name = _group(world, number)
    x, y = _in_cell(world, x, y)
    logged = len(world._data.sources.events)
    given = {name: float(group.bodies[name][0]) for name in _ABILITIES if len(np.unique(group.bodies[name])) > 1}
    (agent,) = group.add(1, position=(x, y), **given)  # type: ignore[arg-type]
    more = "".join(f", {name}={value!r}" for name, value in given.items())
    lines = [f"[agent] = {its_name}.add(1, position=({x!r}, {y!r}){more})"]
    return lines + _logged(world, logged, "joined", agent, "agent")


def obstruct(world: World, shape: str, points: Sequence[tuple[float, float]]) -> list[str]:
    """Put an obstacle into the arena: a circle around the first point through the second, or a polygon."""
    if shape == "circle":
        if len(points) != 2:
            raise ValueError(f"points: {len(points)} for a circle; give its centre and a point on it")
        (x, y), (on_x, on_y) = points
        radius = float(np.hypot(on_x - x, on_y - y))
        obstacle: Any = Circle((x, y), radius)
        text = f"Circle(({x!r}, {y!r}), {radius!r})"
    else:
        obstacle, text = Polygon(points), f"Polygon({list(points)!r})"
    arena = world.arena.with_obstacles(obstacle)
    if not any(arena.period) and not world._data.first_arena.contains(_along(obstacle.boundary)).any():
        raise ValueError("the obstacle is outside of the arena; draw it inside")
    world.arena = arena
    world.log("obstacle added", shape=shape)
    return [
        f"{MODEL}.arena = {MODEL}.arena.with_obstacles({text})", f'{MODEL}.log("obstacle added", shape={shape!r})',
    ]  # fmt: skip


def _along(corners: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
    """Return points on the edges of a polygon, 64 on each."""
    share = np.arange(64)[:, None, None] / 64
    return np.asarray(corners * (1 - share) + np.roll(corners, -1, axis=0) * share)


def clear(world: World) -> list[str]:
    """Take out the obstacles that were drawn."""
    first = world._data.first_arena
    if world.arena is first:
        raise ValueError("clear: there are no drawn obstacles; nothing has changed")
    world.arena = first
    world.log("obstacles removed")
    return [f"{MODEL}.arena = first_arena", f'{MODEL}.log("obstacles removed")']


def _in_cell(world: World, x: float, y: float) -> tuple[float, float]:
    """Return the centre of the cell of a place in a world whose bodies began in cells; in any other the place."""
    placements = [one.placement for group in world.groups for one in group.founders]
    if not any(isinstance(one, str) and one == "cells" for one in placements):
        return x, y
    low, high = (np.asarray(corner, float) for corner in world.arena.bounds)
    # The upper walls belong to the last cells.
    cell = np.clip(np.floor(checked_positions(world.arena, (x, y), (2,)) - low), 0, np.floor(high - low) - 1)
    return float(low[0] + cell[0] + 0.5), float(low[1] + cell[1] + 0.5)


def _logged(world: World, before: int, what: str, agent: Body, its_name: str) -> list[str]:
    """Log what the world has not logged itself: it does not at tick 0, where changes are part of the set-up."""
    if len(world._data.sources.events) > before:
        return []
    world.log(what, agent)
    return [f'{MODEL}.log("{what}", {its_name})']


def _group(world: World, number: int) -> tuple[Group[Any], str]:
    if number >= len(world.groups):
        raise ValueError(f"group={number}: there are {len(world.groups)} groups, numbered from 0; choose one of them")
    group = world.groups[number]
    is_attribute = group.name.isidentifier() and getattr(world, group.name, None) is group
    return group, f"{MODEL}.{group.name}" if is_attribute else f"{MODEL}.groups[{number}]"


def _agent(world: World, place: Place) -> tuple[Body, str]:
    group, its_name = _group(world, place.group)
    rows = np.flatnonzero(group.bodies.member == place.member)
    if not len(rows):
        raise ValueError(f"body {place.member} of {group.name}: is not in both worlds; choose another, or one world")
    return group[int(rows[0])], f"{its_name}[{rows[0]}]"
