"""The kernels of a degree of awareness on guarded arrays."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np
import numpy.typing as npt

from teamsight.agents.awareness.binding import SENSING, Sensing, perceive_at, perceive_entry, situate_at, situate_entry
from teamsight.agents.awareness.interface import TEAM_GROUP, Awareness
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


def _entry(template: Callable[[int], int], awareness: Awareness, name: str, plain: Entry) -> Entry:
    """Return the guarded form of an entry, or the entry as it is where that cannot be compiled."""
    rule, hides = getattr(type(awareness), name), not awareness.shows_teammates
    if (rule, hides) not in _ENTRIES:
        guards = {f"{name}_kernel": guarded(rule), "sensing_at": _GUARDED[hides].at}
        made = specialise(template, f"{awareness.name}-guarded", **guards)
        _ENTRIES[rule, hides] = machine_code(type(awareness).__name__, name, made, plain) or plain
    return _ENTRIES[rule, hides]


class GuardedScene:
    """A random scene in guarded arrays, on which the kernels of a degree of awareness run."""

    def __init__(self, awareness: Awareness, sample: Sample) -> None:
        self._awareness, self._fences = awareness, Fences()
        put = partial(self._fences.put, read_only=True)
        team = [TEAM_GROUP.pack(put("a teammate", group)) for group in sample.groups]
        scene = put("scene", sample.scene)._replace(team=team)
        parameters = put("parameters", np.ascontiguousarray(awareness.parameters, float))
        nothing = no_neighbours(len(scene.heading))
        blank = np.zeros((len(scene.heading), 0), np.float32)
        self._record = SENSING.pack(Sensing(scene, parameters, nothing, nothing, blank))

    def perceive(self, shown: NeighbourList, relayed: NeighbourList) -> tuple[int, NeighbourList, NeighbourList]:
        """Run `perceive` on copies of these buffers; return its answer and what it wrote."""
        plain = perceive_entry(self._awareness)
        if plain is None:
            return 0, shown, relayed
        entry = _entry(perceive_at, self._awareness, "perceive", plain)
        shown, relayed = self._fences.put("teammates", shown), self._fences.put("relayed", relayed)
        self._record.update(teammates=shown, relayed=relayed)
        return self._run("perceive", entry), shown, relayed

    def situate(self, situation: npt.NDArray[np.float32]) -> npt.NDArray[np.float32]:
        """Run `situate` on a copy of this array; return what it wrote."""
        written: npt.NDArray[np.float32] = self._fences.put("situation", situation)
        self._record.update(situation=written)
        entry = _entry(situate_at, self._awareness, "situate", situate_entry(self._awareness))
        self._run("situate", entry)
        return written

    def _run(self, kernel: str, entry: Entry) -> int:
        name = type(self._awareness).__name__
        guarded_record = _GUARDED[not self._awareness.shows_teammates]
        return run_guarded(name, kernel, entry, self._record, guarded_record.arrays, self._fences)
