"""Perception: the sightings that a degree of awareness writes for a group, and the scene that it reads."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from teamsight.agents.awareness import Awareness
from teamsight.agents.awareness.binding import SCENE, perceive_entry, situate_entry
from teamsight.core.neighbour_list import neighbour_room, no_neighbours
from teamsight.policies.interface import Policy

if TYPE_CHECKING:
    from teamsight.agents.group import Group


class Perception:
    """What n robots are shown.

    Parameters
    ----------
    size : int
        How many robots.

    Attributes
    ----------
    nothing : NeighbourList
        For what a group does not observe.
    shown, relayed : NeighbourList
        Buffers that the degree of awareness writes: teammates, and the targets that they sense.
    situation : ndarray, shape (n, width), float32
        The vectors for learners; of width 0 unless the policy reads them.
    room : int
        How many entries `shown` and `relayed` have room for.
    scene : ndarray
        The record that the kernels read.
    """

    def __init__(self, size: int) -> None:
        self.nothing = self.shown = self.relayed = no_neighbours(size)
        self.situation = np.zeros((size, 0), np.float32)
        self.room = 0
        self.is_situated = False
        self.scene = np.zeros(1, SCENE)
        self._situated_at: tuple[int, int] | None = None

    def grow(self, need: int) -> None:
        """Make room for this many entries and some more; bind again afterwards."""
        self.room = max(need + need // 4, 16)

    def perceive(self, awareness: Awareness) -> bool:
        """Bring what is shown up to the present sightings; return whether there was room."""
        entry = perceive_entry(awareness)
        need = entry(self.scene.ctypes.data) if entry else 0
        if need > self.room:
            self.grow(need)
            return False
        if self.is_situated:
            situate_entry(awareness)(self.scene.ctypes.data)
        return True

    def situate(self, awareness: Awareness, moment: tuple[int, int]) -> npt.NDArray[np.float32]:
        """Return the situation vectors of the present moment (`World.moment`), shape (n, width)."""
        if self._situated_at != moment:
            self._situations = np.zeros((len(self.situation), self._width), np.float32)
            scene = self.scene.copy()
            scene[0]["situation"], scene[0]["width"] = self._situations.ctypes.data, self._width
            situate_entry(awareness)(scene.ctypes.data)
            self._situated_at = moment
        return self._situations

    def bind(self, group: Group, team: list[Group]) -> None:
        """Make the buffers as wide as is needed now, and write where everything is into `scene`."""
        self._make_buffers(group, team)
        teammates = group.relations.get("teammates")
        self._parameters = np.ascontiguousarray(group.awareness.parameters, float)
        self._place = teammates.search.identity if teammates else np.zeros(0, np.int64)
        rows = [_teammates_row(other, teammates.first[other.number]) for other in team] if teammates else []
        self._team = np.array(rows, np.int64).reshape(-1, 8)
        self._seen = {
            "targets": group.buffers("targets"), "teammates": group.buffers("teammates"),
            "shown": self.shown, "relayed": self.relayed,
        }  # fmt: skip
        arrays: dict[str, npt.NDArray[Any]] = {
            "heading": group.bodies.heading, "sensing_range": group.ranges[0], "awareness_range": group.ranges[1],
            "place": self._place, "team": self._team, "parameters": self._parameters, "situation": self.situation,
        }  # fmt: skip
        for kind, seen in self._seen.items():
            arrays |= {f"{kind}_{name}": array for name, array in seen._asdict().items()}
        row = self.scene[0]
        for name, array in arrays.items():
            row[name] = array.ctypes.data
        row["size"], row["width"] = self.situation.shape
        row["first"] = teammates.first.get(group.number, 0) if teammates else 0
        row["team_groups"], row["parameter_count"] = len(self._team), len(self._parameters)
        row["shown_room"], row["relayed_room"] = len(self.shown.distance), len(self.relayed.distance)

    def _make_buffers(self, group: Group, team: list[Group]) -> None:
        size = len(group)
        awareness = group.awareness
        self.shown = self.relayed = self.nothing
        if type(awareness).perceive is not None and "teammates" in group.relations:
            self.room = max(self.room, len(group.relations["teammates"].identity))
            if not awareness.shows_teammates:
                self.shown = neighbour_room(size, self.room)
            self.relayed = neighbour_room(size, self.room)
        self._width = sum(awareness.width(max(sum(map(len, team)), 1)))
        self.is_situated = isinstance(group.policy, Policy) and group.policy.inputs > 0
        # In a large team the vectors of a degree that shows everybody are huge: they wait until somebody asks.
        self.situation = np.zeros((size, self._width if self.is_situated else 0), np.float32)
        self._situated_at = None


def _teammates_row(group: Group, first: int) -> list[int]:
    """Return a group's row of `Scene.team`."""
    arrays = (*group.buffers("targets"), group.bodies.heading, group.ranges[0])
    return [first, len(group), *(array.ctypes.data for array in arrays)]
