"""The kernels of a degree of awareness on guarded arrays."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import numpy.typing as npt

from teamsight.agents.awareness.binding import SENSING, Sensing, perceive_at, perceive_entry, situate_at, situate_entry
from teamsight.agents.awareness.interface import TEAM_GROUP, Awareness, Scene, TeamGroup
from teamsight.agents.awareness.sample_scene import Sample
from teamsight.core.kernel import Entry, specialise
from teamsight.core.kernel.fences import Fences
from teamsight.core.kernel.guarded_arrays import Axis, machine_code, run_guarded
from teamsight.core.kernel.guarded_copy import guarded
from teamsight.core.kernel.guarded_record import GuardedRecord
from teamsight.core.neighbour_list import NeighbourList, no_neighbours
from teamsight.policies.guarded_decision import PERCEPT_AXES

_ENTRY = Axis("entries", "write no more than there is room for, and return how many are needed")
_AXES = PERCEPT_AXES | {
    "n": Axis("robots", "robots are 0 to n − 1, and n is scene.heading.shape[0]"),
    "records": Axis("groups", "find a robot's group by its place"),
    "width": Axis("inputs", "width(team_size) says how many there are"),
    **{f"{kind}.{name} k": _ENTRY for kind in ("teammates", "relayed") for name in ("identity", "offset", "distance")},
}
# The teammates of a degree that shows all of them, including `start`, may only be read.
_GUARDED = {
    hides: GuardedRecord(SENSING, ("relayed", "situation") + ("teammates",) * hides, _AXES) for hides in (False, True)
}


_ENTRIES: dict[tuple[Callable[..., Any], bool], Entry] = {}


def _entry(template: Callable[[int], int], awareness: Awareness, name: str, plain: Entry | None) -> Entry | None:
    """Return the guarded form of an entry, or the entry as it is where that cannot be compiled."""
    if plain is None:
        return None
    rule, hides = getattr(type(awareness), name), not awareness.shows_teammates
    if (rule, hides) not in _ENTRIES:
        guards = {f"{name}_kernel": guarded(rule), "sensing_at": _GUARDED[hides].at}
        made = specialise(template, f"{awareness.name}-guarded", **guards)
        _ENTRIES[rule, hides] = machine_code(type(awareness).__name__, name, made, plain) or plain
    return _ENTRIES[rule, hides]


class GuardedScene:
    """A random scene in guarded arrays, on which the kernels of a degree of awareness run.

    Parameters
    ----------
    awareness : Awareness
        The degree.
    sample : Sample
        The scene.
    """

    def __init__(self, awareness: Awareness, sample: Sample) -> None:
        self._awareness, self._fences = awareness, Fences()
        put, size = self._put, len(sample.heading)
        team = [
            TEAM_GROUP.pack(TeamGroup(
                first, put("a teammate's heading", heading), put("a teammate's sensing range", reach),
                put("a teammate's targets", seen),
            ))
            for first, heading, reach, seen in sample.groups
        ]  # fmt: skip
        ranges = put("scene.sensing_range", sample.sensing_range), put("scene.awareness_range", sample.awareness_range)
        scene = Scene(
            put("scene.heading", sample.heading), *ranges, put("scene.targets", sample.targets),
            put("scene.teammates", sample.teammates), put("scene.place", sample.place), sample.first, team,
        )  # fmt: skip
        parameters = put("parameters", np.ascontiguousarray(awareness.parameters, float))
        nothing = no_neighbours(size)
        self._record = SENSING.pack(Sensing(scene, parameters, nothing, nothing, np.zeros((size, 0), np.float32)))

    def _put(self, name: str, value: Any, *, read_only: bool = True) -> Any:
        if isinstance(value, NeighbourList):
            parts = value._asdict().items()
            return NeighbourList(*(self._put(f"{name}.{n}", part, read_only=read_only) for n, part in parts))
        return self._fences.put(name, value, read_only=read_only)

    def perceive(self, shown: NeighbourList, relayed: NeighbourList) -> tuple[int, NeighbourList, NeighbourList]:
        """Run `perceive` on copies of these buffers; return its answer and what it wrote."""
        entry = _entry(perceive_at, self._awareness, "perceive", perceive_entry(self._awareness))
        if entry is None:
            return 0, shown, relayed
        shown, relayed = (
            self._put(name, room, read_only=False) for name, room in (("teammates", shown), ("relayed", relayed))
        )
        self._record.update(teammates=shown, relayed=relayed)
        return self._run("perceive", entry), shown, relayed

    def situate(self, situation: npt.NDArray[np.float32]) -> npt.NDArray[np.float32]:
        """Run `situate` on a copy of this array; return what it wrote."""
        written: npt.NDArray[np.float32] = self._put("situation", situation, read_only=False)
        self._record.update(situation=written)
        entry = _entry(situate_at, self._awareness, "situate", situate_entry(self._awareness))
        assert entry is not None
        self._run("situate", entry)
        return written

    def _run(self, kernel: str, entry: Entry) -> int:
        name = type(self._awareness).__name__
        guarded_record = _GUARDED[not self._awareness.shows_teammates]
        return run_guarded(name, kernel, entry, self._record, guarded_record.arrays, self._fences)
