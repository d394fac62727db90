"""Observations of environments: which numbers show a robot what it perceives, and their limits."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from typing import TYPE_CHECKING, Annotated, Any, NamedTuple, TypeAlias

import numpy as np
import numpy.typing as npt

from teamsight.agents.awareness.degrees import next_nearest
from teamsight.agents.awareness.interface import Sensing, check_width, perceive_entry, sensing_at, situate_entry
from teamsight.agents.sensing.sensor import Sensor
from teamsight.core import checks
from teamsight.core.component import Allowed, Component
from teamsight.core.kernel import Entry, Packed, Record, call, kernel

if TYPE_CHECKING:
    import gymnasium

    from teamsight.agents.group import Group

_LAYOUTS = ("sectors", "nearest")
#: Numbers for each body that the layout "nearest" shows: whether there is one or how near, and where, ahead and left.
PER_BODY = 3
_Shown = Annotated[int, Allowed(least=0, most=10_000)]


@dataclass(frozen=True)
class Nearest(Component):
    """The layout that lists the nearest bodies, with three numbers each: how near, and where; all 0 if there is none.

    The first is 1 − the distance in ranges, or with ``encoding="distance"`` 1; the others are its place ahead and to
    the left in ranges.

    Parameters
    ----------
    targets : int, default 5
        How many targets are listed, the nearest first.
    teammates : int, default 5
        How many teammates, as the degree of awareness shows them.
    relayed : int, default 0
        How many targets that teammates report, under the degree "shared".

    Raises
    ------
    TypeError, ValueError
        If one is not a whole number of at least 0, or all are 0.
    """

    targets: _Shown = 5
    teammates: _Shown = 5
    relayed: _Shown = 0

    def __post_init__(self) -> None:
        super().__post_init__()
        if not self.width:
            raise ValueError("targets=0, teammates=0, relayed=0: one must be at least 1")

    @property
    def width(self) -> int:
        """The number of values of an observation."""
        return PER_BODY * (self.targets + self.teammates + self.relayed)


#: What users give as `layout`.
LayoutLike: TypeAlias = str | Nearest


def layout_of(value: LayoutLike) -> Nearest | None:
    """Return the layout that a user gives; None for "sectors", the situation vectors of the degrees of awareness.

    Raises
    ------
    ValueError
        If the name is unknown.
    """
    if isinstance(value, Nearest):
        return value
    return Nearest() if checks.choice("layout", value, _LAYOUTS) == "nearest" else None


@kernel
def _list_nearest(
    row: Any, first: int, most: int, heading: Any, seen: Any, edges: tuple[int, int], reach: float, near: bool
) -> None:
    """Write the nearest bodies of a neighbour list to ``row[first:]``; those as near come in the list's order."""
    for place in range(most):
        for part in range(PER_BODY):
            row[first + PER_BODY * place + part] = 0.0
    best = -1
    for place in range(min(most, edges[1] - edges[0])):
        best = next_nearest(seen, edges[0], edges[1], best)
        x = seen.offset[best, 0] / reach
        y = seen.offset[best, 1] / reach
        at = first + PER_BODY * place
        row[at] = 1.0 - seen.distance[best] / reach if near else 1.0
        row[at + 1] = x * heading[0] + y * heading[1]
        row[at + 2] = y * heading[0] - x * heading[1]


def _show_nearest(address: int) -> int:
    """Write the layout "nearest"; the parameters are its three numbers, if all teammates are shown, and nearness."""
    seen = sensing_at(address)
    scene, parameters, situation = seen.scene, seen.parameters, seen.situation
    targets = int(parameters[0])
    teammates = int(parameters[1])
    relayed = int(parameters[2])
    near = parameters[4] > 0.0
    for i in range(situation.shape[0]):
        row = situation[i]
        heading = scene.heading[i]
        edges = (scene.targets.start[i], scene.targets.start[i + 1])
        reach = scene.sensing_range[i] * scene.farthest
        _list_nearest(row, 0, targets, heading, scene.targets, edges, reach, near)
        at = PER_BODY * targets
        reach = scene.awareness_range[i] * scene.farthest
        if parameters[3] > 0.0:
            edges = (scene.teammates.start[i], scene.teammates.start[i + 1])
            _list_nearest(row, at, teammates, heading, scene.teammates, edges, reach, near)
        else:
            edges = (seen.teammates.start[i], seen.teammates.start[i + 1])
            _list_nearest(row, at, teammates, heading, seen.teammates, edges, reach, near)
        edges = (seen.relayed.start[i], seen.relayed.start[i + 1])
        at += PER_BODY * teammates
        _list_nearest(row, at, relayed, heading, seen.relayed, edges, reach, near)
    return 0


@cache
def _nearest_entry() -> Entry:
    return Entry(_show_nearest)


class Encoded(NamedTuple):
    """The record of observations that are made of others: with the readings of a lidar, as nearness, or both.

    Attributes
    ----------
    show, seen : Entry, Packed of Sensing
        The kernel that writes the rest, and its record.
    rest : ndarray, shape (n, rest), float32
        The rest.
    readings : ndarray, shape (n, rays), float64
        Distances of the lidar [length].
    range : float
        The range of the lidar [length].
    near : int
        The first of the values that are shown as 1 − themselves; all after it are.
    situation : ndarray, shape (n, width), float32
        The observations: the rest, and distances in ranges.
    """

    show: Entry
    seen: Packed[Sensing]
    rest: Annotated[npt.NDArray[np.float32], "n", "rest"]
    readings: Annotated[npt.NDArray[np.float64], "n", "rays"]
    range: float
    near: int
    situation: Annotated[npt.NDArray[np.float32], "n", "width"]


_ENCODED = Record(Encoded)
_encoded_at = _ENCODED.at


def _encode(address: int) -> int:
    here = _encoded_at(address)
    call(here.show, here.seen)
    rest, rays = here.rest.shape[1], here.readings.shape[1]
    one = np.float32(1.0)
    for i in range(here.situation.shape[0]):
        row = here.situation[i]
        # From 0 on, so that the compiler knows that no index is negative, and makes SIMD code.
        if here.near == 0:
            for k in range(rest):
                row[k] = one - here.rest[i, k]
        else:
            for k in range(rest):
                row[k] = here.rest[i, k]
        for j in range(rays):
            # Rounded first, so that nearness is 1 − the other encoding to the last bit.
            reading = np.float32(here.readings[i, j] / here.range)
            row[rest + j] = reading if rest + j < here.near else one - reading
    return 0


@cache
def _encoded_entry() -> Entry:
    return Entry(_encode)


class Observation:
    """How the robots of a group are shown what they perceive.

    Parameters
    ----------
    group : Group
        The robots.
    team_size : int
        The number of robots of their team.
    layout : Nearest or None
        The layout; None for situation vectors.
    encoding : {"nearness", "distance"}
        What is said of distances.

    Attributes
    ----------
    width : int
        The number of values of an observation.
    teammates : int
        The number of teammates of a robot.
    perceive : Entry or None
        The kernel that must run before `show`, on the group's own record; None if there is none.
    show : Entry
        The kernel that writes the observations, on the record of `seen`.
    """

    def __init__(self, group: Group, team_size: int, layout: Nearest | None, encoding: str) -> None:
        self._layout, self._degree, self._group = layout, group.awareness, group
        self._is_near = encoding == "nearness"
        self.teammates = max(team_size - 1, 0)
        self._rest = check_width(group.awareness, max(team_size, 1)) if layout is None else layout.width
        self.width = self._rest + (group.lidar.rays if group.lidar else 0)
        needs_lists = layout is not None and (layout.teammates or layout.relayed)
        self.perceive = perceive_entry(group.awareness) if needs_lists else None
        self._show_rest = situate_entry(group.awareness) if layout is None else _nearest_entry()
        # A list is written in its encoding.
        self._near = (0 if layout is None else self._rest) if self._is_near else self.width
        self._is_plain = group.lidar is None and self._near == self.width
        self.show = self._show_rest if self._is_plain else _encoded_entry()
        # Readings of sensors of this package are at most the range, with noise too.
        self._is_limited = type(group.awareness).__module__.startswith("teamsight.agents.awareness.") and all(
            channel.sensor is None or type(channel.sensor) is Sensor for channel in group.channels.values()
        )

    def seen(self, sensing: Packed[Sensing], situation: Any) -> Packed[Any]:
        """Return the record of a group with which `show` writes into `situation`, shape (robots, width), float32."""
        lidar, value = self._group.lidar, sensing.value
        rest = situation if self._is_plain else np.zeros((len(situation), self._rest), np.float32)
        value = value._replace(situation=rest)
        if (layout := self._layout) is not None:
            numbers = layout.targets, layout.teammates, layout.relayed, self._degree.shows_teammates, self._is_near
            value = value._replace(parameters=np.array(numbers, float))
        seen = type(sensing)(sensing.record, value)
        if self._is_plain:
            return seen
        readings = self._group.bodies.lidar if lidar else np.zeros((len(situation), 0))
        reach = float(lidar.range) if lidar else 1.0
        return _ENCODED.pack(Encoded(self._show_rest, seen, rest, readings, reach, self._near, situation))

    def space(self) -> gymnasium.spaces.Box:
        """Return a new space of the observations of one robot."""
        from gymnasium import spaces

        if not self._is_limited:
            return spaces.Box(-np.inf, np.inf, (self.width,), np.float32)
        if self._layout is None:
            return spaces.Box(0.0, 1.0, (self.width,), np.float32)
        # Relayed targets are seen from the teammate that senses them, and teammates over hops from another teammate.
        most = np.ones((self._layout.width // PER_BODY, PER_BODY), np.float32)
        first = self._layout.targets if self._degree.spreads else len(most) - self._layout.relayed
        most[first:, 1:] = np.inf
        least = -most
        # How near what is farther than a range is has no limit, either.
        least[:, 0] = 0.0
        if self._is_near:
            least[first:, 0] = -np.inf
        rays = np.zeros(self.width - self._rest, np.float32)
        return spaces.Box(np.append(least, rays), np.append(most, rays + 1), dtype=np.float32)
