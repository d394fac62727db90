"""The record of a degree of awareness, and the entries that call its kernels on it."""

from __future__ import annotations

from functools import cache
from typing import Annotated, NamedTuple

import numpy as np
import numpy.typing as npt

from teamsight.agents.awareness.interface import Awareness, Scene
from teamsight.core.kernel import Entry, Record, specialise
from teamsight.core.neighbour_list import NeighbourList


class Sensing(NamedTuple):
    """The record of a degree of awareness: the arguments of its two kernels; see `Awareness`."""

    scene: Scene
    parameters: Annotated[npt.NDArray[np.float64], "p"]
    teammates: NeighbourList
    relayed: NeighbourList
    situation: Annotated[npt.NDArray[np.float32], "n", "width"]


SENSING = Record(Sensing)
sensing_at = SENSING.at


def perceive_at(address: int) -> int:
    """Call `perceive` of a degree of awareness on the arrays of a record."""
    s = sensing_at(address)
    return perceive_kernel(s.scene, s.parameters, s.teammates, s.relayed)  # type: ignore[name-defined,no-any-return]  # noqa: F821


def situate_at(address: int) -> int:
    """Call `situate` of a degree of awareness on the arrays of a record."""
    s = sensing_at(address)
    situate_kernel(s.scene, s.parameters, s.situation)  # type: ignore[name-defined]  # noqa: F821
    return 0


_specialised = cache(specialise)


def perceive_entry(awareness: Awareness) -> Entry | None:
    """Return the entry that writes the percept under this degree, or None if there is nothing to write."""
    rule = type(awareness).perceive
    return None if rule is None else _specialised(perceive_at, awareness.name, perceive_kernel=rule)


def situate_entry(awareness: Awareness) -> Entry:
    """Return the entry that writes the situation vectors under this degree."""
    return _specialised(situate_at, awareness.name, situate_kernel=type(awareness).situate)
