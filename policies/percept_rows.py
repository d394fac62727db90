"""The percept of some robots of a group."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from teamsight.core.neighbour_list import NeighbourList
from teamsight.policies.channels import channels_of
from teamsight.policies.interface import Percept

Integers = npt.NDArray[np.int64]


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
        percept.columns,
    )  # fmt: skip


def neighbours_of_rows(seen: NeighbourList, rows: Integers) -> NeighbourList:
    """Return the neighbours of some observers, given by their rows, as copies."""
    degree = seen.start[rows + 1] - seen.start[rows]
    start = np.append(0, np.cumsum(degree))
    entries = np.repeat(seen.start[rows] - start[:-1], degree) + np.arange(start[-1])
    return NeighbourList(start, seen.identity[entries], seen.offset[entries], seen.distance[entries])
