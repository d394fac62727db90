"""The percept of one robot, for policies that are functions of a single robot, and that of some robots."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from teamsight.core import checks
from teamsight.core.card import shown
from teamsight.core.elementary import atan2
from teamsight.core.kernel import plain
from teamsight.core.neighbour_list import NeighbourList
from teamsight.policies.channels import NO_CHANNELS, NO_COLUMNS, Channels, PerceivedColumns, channels_of
from teamsight.policies.interface import Floats, Integers, Percept


class NeighboursOfOne(NamedTuple):
    """The neighbours of one robot: `identity` (k,), `offset` (k, 2) along the arena's axes, `distance` (k,)."""

    identity: Integers
    offset: Floats
    distance: Floats


class PerceptOfOne(NamedTuple):
    """What one robot perceives; the fields of `Percept` without the axis of robots."""

    heading: Floats
    moved: Floats
    speed: float
    sensing_range: float
    awareness_range: float
    targets: NeighboursOfOne
    teammates: NeighboursOfOne
    relayed: NeighboursOfOne
    situation: npt.NDArray[np.float32]
    channels: Channels[NeighboursOfOne] = NO_CHANNELS
    time: float = 0.0
    reward: float = 0.0
    ended: bool = False
    identity: int = -1
    columns: PerceivedColumns = NO_COLUMNS
    lidar: Floats = np.zeros(0)

    def _repr_html_(self) -> str | None:
        from teamsight.policies.percept_card import percept_html

        return shown(lambda: percept_html(self))


#: A policy for one robot: returns (turn [rad], distance [length]).
Rule = Callable[[PerceptOfOne, np.random.Generator], tuple[float, float]]


def percept_of_one(percept: Percept, i: int) -> PerceptOfOne:
    """Return the percept of robot `i` of a group."""
    return PerceptOfOne(
        percept.heading[i],
        percept.moved[i],
        float(percept.speed[i]),
        float(percept.sensing_range[i]),
        float(percept.awareness_range[i]),
        _neighbours_of_one(percept.targets, i),
        _neighbours_of_one(percept.teammates, i),
        _neighbours_of_one(percept.relayed, i),
        percept.situation[i],
        _each_channel(percept.channels, lambda name, seen: _neighbours_of_one(seen, i)),
        float(percept.time[0]),
        *(float(percept.reward[i]), bool(percept.ended[i])) if len(percept.reward) else (0.0, False),
        int(percept.identity[i]) if len(percept.identity) else -1,
        percept.columns,
        percept.lidar[i] if len(percept.lidar) else np.zeros(0),
    )


def turn_to(heading: npt.ArrayLike, way: npt.ArrayLike) -> float:
    """Return the angle from a heading to a direction, as functions for one robot return it.

    Parameters
    ----------
    heading, way : array_like, shape (2,)
        Two directions, of any length; `way` is often an offset of the percept.

    Returns
    -------
    float
        Anticlockwise [rad], from −π to π; 0 if `way` is (0, 0).
    """
    (ahead, left), (x, y) = np.asarray(heading, float), np.asarray(way, float)
    return plain(atan2)(y * ahead - x * left, x * ahead + y * left)


def _each_channel(channels: Any, change: Callable[[str, Any], Any]) -> Any:
    names = getattr(channels, "_fields", None)
    if not isinstance(channels, tuple) or names is None:
        raise TypeError("percept.channels: must be a NamedTuple; change one with percept.channels._replace(name=…)")
    return channels_of(names, map(change, names, channels))


def _neighbours_of_one(seen: NeighbourList, i: int) -> NeighboursOfOne:
    mine = slice(seen.start[i], seen.start[i + 1])
    return NeighboursOfOne(seen.identity[mine], seen.offset[mine], seen.distance[mine])


def percept_of_group_of_one(percept: PerceptOfOne) -> Percept:
    """Return the percept of one robot as that of a group of one; refuse fields of a wrong type or shape."""
    if not isinstance(percept, PerceptOfOne):
        kind = type(percept).__name__
        raise TypeError(f"percept={kind}: must be a PerceptOfOne; change fields with percept._replace(…)")
    situation = np.asarray(percept.situation, np.float32)
    if situation.ndim != 1:
        raise ValueError(f"percept.situation: has the shape {situation.shape}; it must be (width,)")
    lidar = np.asarray(percept.lidar, float)
    if lidar.ndim != 1:
        raise ValueError(f"percept.lidar: has the shape {lidar.shape}; it must be (rays,)")
    return Percept(
        _row("heading", percept.heading),
        _row("moved", percept.moved),
        _number("speed", percept.speed),
        _number("sensing_range", percept.sensing_range),
        _number("awareness_range", percept.awareness_range),
        _neighbour_list_of_one("targets", percept.targets),
        _neighbour_list_of_one("teammates", percept.teammates),
        _neighbour_list_of_one("relayed", percept.relayed),
        np.ascontiguousarray(situation[None]),
        _each_channel(percept.channels, lambda name, seen: _neighbour_list_of_one(f"channels.{name}", seen)),
        np.array([checks.number("percept.time", percept.time)]),
        np.array([checks.number("percept.reward", percept.reward)]),
        np.array([checks.flag("percept.ended", percept.ended)]),
        np.array([int(percept.identity)]),
        percept.columns,
        np.ascontiguousarray(lidar[None]),
    )


def _number(name: str, value: Any) -> Floats:
    return np.array([checks.number(f"percept.{name}", value, least=0)])


def _row(name: str, value: npt.ArrayLike) -> Floats:
    array = np.asarray(value, float)
    if array.shape != (2,):
        raise ValueError(f"percept.{name}: has the shape {array.shape}; it must be (2,)")
    if not np.isfinite(array).all():
        raise ValueError(f"percept.{name}={tuple(array.tolist())}: must be two finite numbers")
    return np.ascontiguousarray(array[None])


def _neighbour_list_of_one(name: str, seen: NeighboursOfOne) -> NeighbourList:
    if not isinstance(seen, tuple) or len(seen) != len(NeighboursOfOne._fields):
        raise TypeError(f"percept.{name}: must be NeighboursOfOne(identity, offset, distance)")
    identity, offset, distance = (
        np.ascontiguousarray(part, kind) for part, kind in zip(seen, (np.int64, float, float), strict=True)
    )
    k = len(distance) if distance.ndim == 1 else -1
    if identity.shape != (k,) or offset.shape != (k, 2):
        shapes = f"{identity.shape}, {offset.shape} and {distance.shape}"
        raise ValueError(f"percept.{name}: identity, offset and distance are {shapes}; they must be (k,), (k, 2), (k,)")
    return NeighbourList(np.array([0, k]), identity, offset, distance)


def percept_of_rows(percept: Percept, rows: Integers) -> Percept:
    """Return the percept of some robots, given by their rows, as copies."""
    channels: Any = percept.channels
    percept = percept.completed()
    return Percept(
        percept.heading[rows], percept.moved[rows], percept.speed[rows], percept.sensing_range[rows],
        percept.awareness_range[rows], neighbours_of_rows(percept.targets, rows),
        neighbours_of_rows(percept.teammates, rows), neighbours_of_rows(percept.relayed, rows),
        percept.situation[rows],
        channels_of(channels._fields, (neighbours_of_rows(seen, rows) for seen in channels)),
        percept.time, percept.reward[rows], percept.ended[rows], percept.identity[rows],
        percept.columns, percept.lidar[rows],
    )  # fmt: skip


def neighbours_of_rows(seen: NeighbourList, rows: Integers) -> NeighbourList:
    """Return the neighbours of some observers, given by their rows, as copies."""
    degree = seen.start[rows + 1] - seen.start[rows]
    start = np.append(0, np.cumsum(degree))
    entries = np.repeat(seen.start[rows] - start[:-1], degree) + np.arange(start[-1])
    return NeighbourList(start, seen.identity[entries], seen.offset[entries], seen.distance[entries])
