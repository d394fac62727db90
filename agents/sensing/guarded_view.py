"""The kernel of a sensor on guarded arrays."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from teamsight.agents.sensing.binding import DETECTING, Detecting, sense_at, sense_entry
from teamsight.agents.sensing.interface import Detector, View
from teamsight.core.kernel import Entry, specialise
from teamsight.core.kernel.fences import Fences
from teamsight.core.kernel.guarded_arrays import Axis, machine_code, run_guarded
from teamsight.core.kernel.guarded_copy import guarded
from teamsight.core.kernel.guarded_record import GuardedRecord
from teamsight.core.neighbour_list import NeighbourList

_IN_RANGE = Axis("entries", "those of observer i are start[i] up to, not including, start[i + 1]")
_ENTRY = Axis("entries", "write no more than there is room for, and return how many are needed")
_COUNTED = Axis("elements", "that is all that there are")
_GUARDED = GuardedRecord(
    DETECTING,
    ("sensed",),
    {
        "n": Axis("observers", "observers are 0 to n − 1, and n is view.heading.shape[0]"),
        "m": Axis("agents", "the observed are 0 to m − 1, and m is view.everyone.shape[0]"),
        "n + 1": Axis("elements", "there is one more than observers; observer i's are start[i] and start[i + 1]"),
        "k": _IN_RANGE,
        **{f"sensed.{name} k": _ENTRY for name in ("identity", "offset", "distance")},
        "p": Axis("parameters", "add what it needs to `parameters`"),
        "segments": Axis("segments", "there are view.sight.segments.shape[0]"),
        "discs": Axis("discs", "there are view.sight.discs.shape[0]"),
        **{str(length): _COUNTED for length in range(1, 5)},
    },
)

_ENTRIES: dict[Callable[..., Any], Entry] = {}


def _entry(sensor: Detector) -> Entry:
    """Return the guarded form of an entry, or the entry as it is where that cannot be compiled."""
    rule, name = type(sensor).sense, type(sensor).__name__
    if rule not in _ENTRIES:
        plain = sense_entry(sensor)
        made = specialise(sense_at, f"{name}-guarded", sense_kernel=guarded(rule), detecting_at=_GUARDED.at)
        _ENTRIES[rule] = machine_code(name, "sense", made, plain) or plain
    return _ENTRIES[rule]


def sense_guarded(sensor: Detector, view: View, sensed: NeighbourList) -> tuple[int, NeighbourList]:
    """Run `sense` on copies of these arrays, with bounds checks; return its answer and what it wrote.

    Raises
    ------
    TypeError, ValueError
        If the kernel cannot be compiled, or uses elements outside its arrays; see `run_guarded`.
    """
    fences = Fences()
    seen: View = fences.put("view", view, read_only=True)
    parameters = fences.put("parameters", np.ascontiguousarray(sensor.parameters, float), read_only=True)
    written: NeighbourList = fences.put("sensed", sensed)
    record = DETECTING.pack(Detecting(seen, parameters, written))
    need = run_guarded(type(sensor).__name__, "sense", _entry(sensor), record, _GUARDED.arrays, fences)
    return need, written
