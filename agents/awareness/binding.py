"""The record of a degree of awareness, and the entries that call its kernels on it."""

from __future__ import annotations

from collections.abc import Callable
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


_ENTRIES: dict[tuple[str, Callable[..., object]], Entry] = {}


def perceive_entry(awareness: Awareness) -> Entry | None:
    """Return the entry that writes the percept under this degree, or None if there is nothing to write."""
    rule = type(awareness).perceive
    if rule is None:
        return None
    if ("perceive", rule) not in _ENTRIES:
        _ENTRIES["perceive", rule] = specialise(perceive_at, awareness.name, perceive_kernel=rule)
    return _ENTRIES["perceive", rule]


def situate_entry(awareness: Awareness) -> Entry:
    """Return the entry that writes the situation vectors under this degree."""
    rule = type(awareness).situate
    if ("situate", rule) not in _ENTRIES:
        _ENTRIES["situate", rule] = specialise(situate_at, awareness.name, situate_kernel=rule)
    return _ENTRIES["situate", rule]
