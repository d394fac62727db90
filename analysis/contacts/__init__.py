"""The neighbour graph over time: contacts, components and percolation of recorded positions."""

from __future__ import annotations

from typing import TYPE_CHECKING

from teamsight.core.lazy_names import lazy_names

if TYPE_CHECKING:
    from teamsight.analysis.contacts.figure import draw
    from teamsight.analysis.contacts.percolation import Percolation, percolation
    from teamsight.analysis.contacts.sources import of_log, of_positions, of_trajectory, of_world
    from teamsight.analysis.contacts.temporal_graph import TemporalGraph, snapshot, to_networkx

_HOMES = {
    "Percolation": "teamsight.analysis.contacts.percolation",
    "TemporalGraph": "teamsight.analysis.contacts.temporal_graph",
    "draw": "teamsight.analysis.contacts.figure",
    "of_log": "teamsight.analysis.contacts.sources",
    "of_positions": "teamsight.analysis.contacts.sources",
    "of_trajectory": "teamsight.analysis.contacts.sources",
    "of_world": "teamsight.analysis.contacts.sources",
    "percolation": "teamsight.analysis.contacts.percolation",
    "snapshot": "teamsight.analysis.contacts.temporal_graph",
    "to_networkx": "teamsight.analysis.contacts.temporal_graph",
}

__all__ = [
    "Percolation", "TemporalGraph", "draw", "of_log", "of_positions", "of_trajectory", "of_world", "percolation",
    "snapshot", "to_networkx",
]  # fmt: skip

__getattr__ = lazy_names(__name__, _HOMES, globals())
