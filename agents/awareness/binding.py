"""Compiled degrees of awareness: the record through which the loop hands a degree the scene."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from teamsight.agents.awareness.interface import Awareness, Scene
from teamsight.core.kernel import Entry, array_at, kernel, specialise
from teamsight.core.neighbour_list import NeighbourList
from teamsight.policies.compiled import neighbour_list_at

_SEEN = ("start", "identity", "offset", "distance")

SCENE = np.dtype(
    [(name, np.int64) for name in ("size", "heading", "sensing_range", "awareness_range")]
    + [(f"{kind}_{name}", np.int64) for kind in ("targets", "teammates") for name in _SEEN]
    + [(name, np.int64) for name in ("place", "first", "team", "team_groups", "parameters", "parameter_count")]
    + [(f"{kind}_{name}", np.int64) for kind in ("shown", "relayed") for name in (*_SEEN, "room")]
    + [(name, np.int64) for name in ("situation", "width")]
)


@kernel
def scene_at(s: Any) -> Scene:
    """Return the scene that a record describes."""
    n = s.size
    teammates = neighbour_list_at(n, s.teammates_start, s.teammates_identity, s.teammates_offset, s.teammates_distance)
    return Scene(
        array_at(s.heading, (n, 2), np.float64),
        array_at(s.sensing_range, n, np.float64),
        array_at(s.awareness_range, n, np.float64),
        neighbour_list_at(n, s.targets_start, s.targets_identity, s.targets_offset, s.targets_distance),
        teammates,
        array_at(s.place, teammates.start[n], np.int64),
        s.first,
        array_at(s.team, (s.team_groups, 8), np.int64),
    )


def _perceive(address: int) -> int:
    s = array_at(address, 1, SCENE)[0]
    shown = NeighbourList(
        array_at(s.shown_start, s.size + 1, np.int64),
        array_at(s.shown_identity, s.shown_room, np.int64),
        array_at(s.shown_offset, (s.shown_room, 2), np.float64),
        array_at(s.shown_distance, s.shown_room, np.float64),
    )
    relayed = NeighbourList(
        array_at(s.relayed_start, s.size + 1, np.int64),
        array_at(s.relayed_identity, s.relayed_room, np.int64),
        array_at(s.relayed_offset, (s.relayed_room, 2), np.float64),
        array_at(s.relayed_distance, s.relayed_room, np.float64),
    )
    parameters = array_at(s.parameters, s.parameter_count, np.float64)
    return perceive_kernel(scene_at(s), parameters, shown, relayed)  # type: ignore[name-defined,no-any-return]  # noqa: F821


def _situate(address: int) -> int:
    s = array_at(address, 1, SCENE)[0]
    parameters = array_at(s.parameters, s.parameter_count, np.float64)
    situate_kernel(scene_at(s), parameters, array_at(s.situation, (s.size, s.width), np.float32))  # type: ignore[name-defined]  # noqa: F821
    return 0


_ENTRIES: dict[tuple[str, Callable[..., Any]], Entry] = {}


def perceive_entry(awareness: Awareness) -> Entry | None:
    """Return what writes the percept under this degree, or None where nothing is to be written."""
    rule = type(awareness).perceive
    if rule is None:
        return None
    if ("perceive", rule) not in _ENTRIES:
        _ENTRIES["perceive", rule] = specialise(_perceive, awareness.name, perceive_kernel=rule)
    return _ENTRIES["perceive", rule]


def situate_entry(awareness: Awareness) -> Entry:
    """Return what writes the situation vectors under this degree."""
    rule = type(awareness).situate
    if ("situate", rule) not in _ENTRIES:
        _ENTRIES["situate", rule] = specialise(_situate, awareness.name, situate_kernel=rule)
    return _ENTRIES["situate", rule]
