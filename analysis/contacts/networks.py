"""Temporal graphs as graphs of networkx: one moment, and all contacts with their intervals."""

from __future__ import annotations

import networkx as nx
import numpy as np

from teamsight.analysis.contacts.temporal_graph import TemporalGraph
from teamsight.core import checks


def snapshot(graph: TemporalGraph, time: float) -> nx.Graph | nx.DiGraph:
    """Return the graph at a time, that of the last frame at or before it.

    Parameters
    ----------
    graph : TemporalGraph
        The graph.
    time : float
        At least the time of the first frame.

    Returns
    -------
    networkx.Graph or networkx.DiGraph
        The robots that are there, with the attribute ``position``; edges have ``distance`` [length].

    Raises
    ------
    ValueError
        If the time is before the first frame.
    """
    time = checks.number("time", time)
    frame = int(np.searchsorted(graph.time, time, side="right")) - 1
    if frame < 0:
        first = f"{graph.time[0]:g}" if len(graph.time) else "none"
        raise ValueError(f"time={time:g}: is before the first frame, {first}; give a later time")
    network = nx.DiGraph() if graph.directed else nx.Graph()
    names = graph.identity.tolist()
    for row in np.flatnonzero(graph.present[frame]).tolist():
        network.add_node(names[row], position=tuple(graph.position[frame, row].tolist()))
    for one, other, distance in zip(*(part.tolist() for part in graph.pairs_at(frame)), strict=True):
        network.add_edge(names[one], names[other], distance=distance)
    return network


def to_networkx(graph: TemporalGraph) -> nx.Graph | nx.DiGraph:
    """Return one graph of all contacts.

    Parameters
    ----------
    graph : TemporalGraph
        The graph.

    Returns
    -------
    networkx.Graph or networkx.DiGraph
        All robots, with the attribute ``present``, a list of (begin, end) [time]; edges have ``contacts``, a list of
        (begin, end), and ``total``, the sum of their durations.
    """
    network = nx.DiGraph() if graph.directed else nx.Graph()
    for name, there in zip(graph.identity.tolist(), graph.present.T, strict=True):
        network.add_node(name, present=_stretches(there, graph.time))
    for (one, other), rows in graph.contacts.groupby(["one", "other"], sort=False):
        met = list(zip(rows["begin"].tolist(), rows["end"].tolist(), strict=True))
        network.add_edge(one, other, contacts=met, total=float(rows["duration"].sum()))
    return network


def _stretches(there: np.ndarray, time: np.ndarray) -> list[tuple[float, float]]:
    """Return begin and end of each stretch of True; the last ends with the record."""
    change = np.flatnonzero(np.diff(there.astype(np.int8), prepend=0, append=0))
    ends = np.minimum(change[1::2], len(time) - 1)
    return list(zip(time[change[::2]].tolist(), time[ends].tolist(), strict=True))
