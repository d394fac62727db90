"""Binding of the interactions of a world: who takes part, the calls, and what a step that fails puts back."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from teamsight.agents.engine.interaction_records import PARTAKER, InteractionArrays, PartakerArrays
from teamsight.agents.group import Group
from teamsight.agents.world_data import WorldData
from teamsight.core.kernel import Packed

Integers = npt.NDArray[np.int64]


class BoundInteractions:
    """The records of all interactions of a world.

    Parameters
    ----------
    data : WorldData
        The world.
    group_records : list of Packed of GroupArrays
        The records of its groups, in their order.

    Attributes
    ----------
    records : list of Packed of InteractionArrays
        The interactions; their scores follow each other.
    partakers : list of Packed of PartakerArrays
        The groups that take part in one.
    copies : ndarray, shape (arrays, 3), int64
        See `WorldArrays.copies`.
    """

    def __init__(self, data: WorldData, group_records: list[Packed[Any]]) -> None:
        self.records: list[Packed[InteractionArrays]] = []
        groups = {group.number: group for one in data.interactions for group in one.groups}
        known = {number: _partaker(group, group_records[number]) for number, group in groups.items()}
        self.partakers = list(known.values())
        first = 0
        if data.interactions:
            # Only worlds with an interaction need it.
            from teamsight.world.region_of import region_of

            region = region_of(data.arena)
            for one in data.interactions:
                self.records.append(one.bind(known, region, first))
                first += len(one.scores)
        written = [array for one in data.interactions for array in one.arrays]
        for group in groups.values():
            written += [group.bodies.speed, group.bodies.reward, group.bodies.ended, group.last_rewards]
        self._written = [array for array in written if array.nbytes]
        self._copies = [array.copy() for array in self._written]

    @property
    def copies(self) -> Integers:
        pairs = zip(self._written, self._copies, strict=True)
        rows = [(array.ctypes.data, copy.ctypes.data, array.nbytes) for array, copy in pairs]
        return np.array(rows, np.int64).reshape(-1, 3)


def _partaker(group: Group, record: Packed[Any]) -> Packed[PartakerArrays]:
    bodies, table = group.bodies, group.timetable
    decided_at = np.zeros(0, np.int64) if table is None else table.decided_at
    before = bodies.position.copy()
    return PARTAKER.pack(PartakerArrays(
        record, group.number, before, bodies.reward, bodies.ended, group.last_rewards, decided_at
    ))  # fmt: skip
