"""The kernels of a degree of awareness on guarded arrays."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import numpy.typing as npt

from teamsight.agents.awareness.binding import SCENE, perceive_entry, situate_entry
from teamsight.agents.awareness.interface import Awareness, Scene
from teamsight.agents.awareness.sample_scene import Sample
from teamsight.core.kernel import Entry, array_at, inlined, specialise
from teamsight.core.kernel.fences import Fences
from teamsight.core.kernel.guard import READ_ONLY, guarded_at
from teamsight.core.kernel.guarded_arrays import Axis, Named, machine_code, run_guarded
from teamsight.core.kernel.guarded_copy import guarded
from teamsight.core.neighbour_list import NeighbourList

_ROBOT = Axis("robots", "robots are 0 to n − 1, and n is scene.heading.shape[0]")
_XY = Axis("components", "they are 0, x, and 1, y")
_SIGHTING = Axis("sightings", "robot i sees those from start[i] up to, not including, start[i + 1]")
_START = Axis("elements", "there is one more than robots; robot i's are start[i] and start[i + 1]")
_ENTRY = Axis("entries", "write no more than there is room for, and return how many are needed")


def _seen(name: str, entry: Axis) -> list[Named]:
    return [
        Named(f"{name}.start", (_START,)),
        Named(f"{name}.identity", (entry,)),
        Named(f"{name}.offset", (entry, _XY)),
        Named(f"{name}.distance", (entry,)),
    ]


# In the order of the numbers below, from 1 on.
_ARRAYS = [
    Named("", ()),
    *_seen("scene.targets", _SIGHTING), *_seen("scene.teammates", _SIGHTING),
    *_seen("teammates", _ENTRY), *_seen("relayed", _ENTRY),
    Named("scene.heading", (_ROBOT, _XY)),
    Named("scene.sensing_range", (_ROBOT,)),
    Named("scene.awareness_range", (_ROBOT,)),
    Named("scene.place", (_SIGHTING,)),
    Named("scene.team", (Axis("groups", "find a robot's group by its place"), Axis("columns", "see Scene.team"))),
    Named("parameters", (Axis("parameters", "add what it needs to `parameters`"),)),
    Named("situation", (_ROBOT, Axis("inputs", "width(team_size) says how many there are"))),
]  # fmt: skip


@inlined
def _neighbour_list(
    size: int, room: int, start: int, identity: int, offset: int, distance: int, number: int
) -> NeighbourList:
    return NeighbourList(
        guarded_at(start, size + 1, np.int64, number),
        guarded_at(identity, room, np.int64, number + 1),
        guarded_at(offset, (room, 2), np.float64, number + 2),
        guarded_at(distance, room, np.float64, number + 3),
    )


@inlined
def _scene_at(s: Any) -> Scene:
    n = s.size
    targets = array_at(s.targets_start, n + 1, np.int64)[n]
    teammates = array_at(s.teammates_start, n + 1, np.int64)[n]
    return Scene(
        guarded_at(s.heading, (n, 2), np.float64, 17 + READ_ONLY),
        guarded_at(s.sensing_range, n, np.float64, 18 + READ_ONLY),
        guarded_at(s.awareness_range, n, np.float64, 19 + READ_ONLY),
        _neighbour_list(
            n, targets, s.targets_start, s.targets_identity, s.targets_offset, s.targets_distance, 1 + READ_ONLY
        ),
        _neighbour_list(
            n,
            teammates,
            s.teammates_start,
            s.teammates_identity,
            s.teammates_offset,
            s.teammates_distance,
            5 + READ_ONLY,
        ),
        guarded_at(s.place, teammates, np.int64, 20 + READ_ONLY),
        s.first,
        guarded_at(s.team, (s.team_groups, 8), np.int64, 21 + READ_ONLY),
    )


def _perceive(address: int) -> int:
    s = array_at(address, 1, SCENE)[0]
    n = s.size
    # A degree that shows all teammates has no room for others: there, also `start` may only be read.
    hidden = READ_ONLY if s.shown_room < 0 else 0
    room = max(s.shown_room, 0)
    shown = _neighbour_list(n, room, s.shown_start, s.shown_identity, s.shown_offset, s.shown_distance, 9 + hidden)
    relayed = _neighbour_list(
        n, s.relayed_room, s.relayed_start, s.relayed_identity, s.relayed_offset, s.relayed_distance, 13
    )
    parameters = guarded_at(s.parameters, s.parameter_count, np.float64, 22 + READ_ONLY)
    return perceive_kernel(_scene_at(s), parameters, shown, relayed)  # type: ignore[name-defined,no-any-return]  # noqa: F821


def _situate(address: int) -> int:
    s = array_at(address, 1, SCENE)[0]
    parameters = guarded_at(s.parameters, s.parameter_count, np.float64, 22 + READ_ONLY)
    situate_kernel(_scene_at(s), parameters, guarded_at(s.situation, (s.size, s.width), np.float32, 23))  # type: ignore[name-defined]  # noqa: F821
    return 0


_ENTRIES: dict[Callable[..., Any], Entry] = {}


def _entry(template: Callable[[int], int], awareness: Awareness, name: str, plain: Entry | None) -> Entry | None:
    """Return the guarded form of an entry, or the entry as it is where that cannot be compiled."""
    if plain is None:
        return None
    rule = getattr(type(awareness), name)
    if rule not in _ENTRIES:
        made = specialise(template, f"{awareness.name}-guarded", **{f"{name}_kernel": guarded(rule)})
        _ENTRIES[rule] = machine_code(type(awareness).__name__, name, made, plain) or plain
    return _ENTRIES[rule]


class GuardedScene:
    """A made-up scene in guarded arrays, on which the kernels of a degree of awareness run.

    Parameters
    ----------
    awareness : Awareness
        The degree.
    sample : Sample
        The scene.
    """

    def __init__(self, awareness: Awareness, sample: Sample) -> None:
        self._awareness, self._sample, self._fences = awareness, sample, Fences()
        self._record = np.zeros(1, SCENE)
        row = self._record[0]
        for name in ("heading", "sensing_range", "awareness_range", "place"):
            row[name] = self._put(f"scene.{name}", getattr(sample, name))
        for kind in ("targets", "teammates"):
            for name, array in getattr(sample, kind)._asdict().items():
                row[f"{kind}_{name}"] = self._put(f"scene.{kind}.{name}", array)
        rows = [
            [first, len(reach), *(self._put("a teammate's targets", array) for array in seen),
             self._put("a teammate's heading", heading), self._put("a teammate's sensing range", reach)]
            for first, heading, reach, seen in sample.groups
        ]  # fmt: skip
        parameters = np.ascontiguousarray(awareness.parameters, float)
        row["team"] = self._put("scene.team", np.array(rows, np.int64).reshape(-1, 8))
        row["parameters"] = self._put("parameters", parameters)
        row["size"], row["first"] = len(sample.heading), sample.first
        row["team_groups"], row["parameter_count"] = len(rows), len(parameters)

    def _put(self, name: str, array: npt.NDArray[Any], *, read_only: bool = True) -> int:
        return int(self._fences.put(name, array, read_only=read_only).ctypes.data)

    def perceive(self, shown: NeighbourList, relayed: NeighbourList) -> tuple[int, NeighbourList, NeighbourList]:
        """Run `perceive` on copies of these buffers; return its answer and what it wrote."""
        entry = _entry(_perceive, self._awareness, "perceive", perceive_entry(self._awareness))
        if entry is None:
            return 0, shown, relayed
        written = []
        for kind, buffers in (("shown", shown), ("relayed", relayed)):
            label = "teammates" if kind == "shown" else kind
            parts = {n: self._fences.put(f"{label}.{n}", array) for n, array in buffers._asdict().items()}
            written.append(NeighbourList(**parts))
            for name, array in parts.items():
                self._record[0][f"{kind}_{name}"] = array.ctypes.data
            self._record[0][f"{kind}_room"] = len(buffers.distance)
        if self._awareness.shows_teammates:
            self._record[0]["shown_room"] = -1
        need = self._run("perceive", entry)
        return need, written[0], written[1]

    def situate(self, situation: npt.NDArray[np.float32]) -> npt.NDArray[np.float32]:
        """Run `situate` on a copy of this array; return what it wrote."""
        written = self._fences.put("situation", situation)
        self._record[0]["situation"], self._record[0]["width"] = written.ctypes.data, situation.shape[1]
        entry = _entry(_situate, self._awareness, "situate", situate_entry(self._awareness))
        assert entry is not None
        self._run("situate", entry)
        return written

    def _run(self, kernel: str, entry: Entry) -> int:
        name = type(self._awareness).__name__
        answer = run_guarded(name, kernel, entry, self._record.ctypes.data, _ARRAYS)
        if broken := self._fences.broken():
            raise ValueError(
                f"{name}: {kernel} writes next to {broken}, or into it where it may only read; index arrays within "
                "their shape"
            )
        return answer
