"""The temporal graph: the neighbour graph in every frame of a record, and what follows from it."""

from __future__ import annotations

from functools import cached_property
from typing import NamedTuple

import networkx as nx
import numpy as np
import pandas as pd
from numpy.typing import NDArray
from scipy.sparse import coo_array, csgraph

from teamsight.analysis.contacts.frames import Edges
from teamsight.core import checks

Ints = NDArray[np.int64]
Floats = NDArray[np.float64]

# Why a contact begins or ends.
_CAUSES = ["range", "presence", "record", "unknown"]


class _Spans(NamedTuple):
    """Contacts by frame, ordered by pair and time: rows of two robots, and the first and last frame of each, (k,)."""

    one: Ints
    other: Ints
    first: Ints
    last: Ints


class TemporalGraph:
    """The neighbour graph over time; made by `of_positions`, `of_trajectory`, `of_world` and `of_log`.

    Attributes
    ----------
    time : ndarray of float64, shape (frames,)
        Times of the frames, ascending. What is seen in a frame is taken to last until the next one.
    identity : ndarray, shape (n,)
        Names of the robots.
    position : ndarray of float64, shape (frames, n, 2)
        Positions [length]; NaN while a robot is not there, or where they are unknown.
    present : ndarray of bool, shape (frames, n)
        Which robots are there.
    edges : Edges
        The edges of all frames, by row.
    directed : bool
        Whether edges lead from the robot that senses to the one that is sensed; otherwise they are the mutual ones.
    knows_presence : bool
        Whether the record shows who is there; a log of contacts does not, and all count as present.
    unit : str
        The unit of time on axes: "ticks" for worlds and logs, "" if nobody has said.
    awareness_range : float or None
        The range of all robots [length]; None if they differ or it is unknown.
    """

    def __init__(
        self,
        time: Floats,
        identity: NDArray[np.generic],
        position: Floats,
        edges: Edges,
        *,
        directed: bool,
        knows_presence: bool = True,
        unit: str = "",
        awareness_range: float | None = None,
    ) -> None:
        self.unit, self.awareness_range = unit, awareness_range
        self.time, self.identity, self.position = time, identity, position
        self.knows_presence = knows_presence
        self.present = ~np.isnan(position[..., 0]) if knows_presence else np.ones(position.shape[:2], bool)
        self.edges, self.directed = edges, directed
        self._first = np.searchsorted(edges.frame, np.arange(len(time) + 1))

    @property
    def robots(self) -> int:
        """The number of robots that are there at any time."""
        return len(self.identity)

    def pairs_at(self, frame: int) -> tuple[Ints, Ints, Floats]:
        """Return rows and distance of the two robots of each edge of a frame."""
        within = slice(self._first[frame], self._first[frame + 1])
        return self.edges.one[within], self.edges.other[within], self.edges.distance[within]

    @cached_property
    def degree(self) -> Floats:
        """The number of neighbours of each robot, float64 of shape (frames, n); NaN while it is not there."""
        places = len(self.time) * self.robots
        counts = np.bincount(self.edges.frame * self.robots + self.edges.one, minlength=places)
        if not self.directed:
            counts += np.bincount(self.edges.frame * self.robots + self.edges.other, minlength=places)
        return np.where(self.present, counts.reshape(self.present.shape), np.nan)

    @cached_property
    def contacts(self) -> pd.DataFrame:
        """One row a contact, the time from when two robots become neighbours until they are no longer.

        Columns: one, other (names; of directed edges the one that senses first); begin, end, duration [time];
        began_by, ended_by: "range" for robots that come into or out of range, "presence" for one that arrives, is
        repaired, fails or leaves, "record" for contacts that are older than the record or outlast it, "unknown" for
        range or presence in a log, which does not say. Durations with "record" are censored: the true ones are longer.
        """
        one, other, first, last = self._spans
        time, end = self.time, len(self.time) - 1
        after = np.minimum(last + 1, end)

        def cause(frame: Ints, at_edge: NDArray[np.bool_]) -> pd.Categorical[str]:
            why: NDArray[np.str_] = np.full(len(frame), "unknown")
            if self.knows_presence:
                why = np.where(self.present[frame, one] & self.present[frame, other], "range", "presence")
            return pd.Categorical(np.where(at_edge, "record", why), _CAUSES)

        return pd.DataFrame(
            {
                "one": self.identity[one],
                "other": self.identity[other],
                "begin": time[first],
                "end": time[after],
                "duration": time[after] - time[first],
                "began_by": cause(np.maximum(first - 1, 0), first == 0),
                "ended_by": cause(after, last == end),
            }
        )

    @cached_property
    def gaps(self) -> pd.DataFrame:
        """One row an inter-contact time, between two contacts of the same two robots.

        Columns: one, other; begin, end, duration [time]; left_censored, right_censored: the time before their first
        contact, and after their last one; absence: one of them was not there for a part of the time, NA for a log,
        which does not say. Robots that never meet have no row.
        """
        found, time, end = self._spans, self.time, len(self.time) - 1
        new = (np.diff(found.one, prepend=-1) != 0) | (np.diff(found.other, prepend=-1) != 0)
        last = np.append(new[1:], True)[: len(new)]
        # Before the first contact of a pair, between two, and after the last one.
        lead, tail = new & (found.first > 0), last & (found.last < end)
        between = np.flatnonzero(~new)
        counts = [lead.sum(), len(between), tail.sum()]
        row = np.concatenate([np.flatnonzero(lead), between, np.flatnonzero(tail)])
        begin = np.concatenate([np.zeros(counts[0], np.int64), found.last[between - 1] + 1, found.last[tail] + 1])
        until = np.concatenate([found.first[lead], found.first[between], np.full(counts[2], end)])
        one, other = found.one[row], found.other[row]
        absence: object = pd.array([pd.NA] * len(row), "boolean")
        if self.knows_presence:
            absent = np.zeros((len(self.present) + 1, self.robots), np.int64)
            np.cumsum(~self.present, axis=0, out=absent[1:])
            absence = np.asarray(sum(absent[until, side] - absent[begin, side] for side in (one, other))) > 0
        table = pd.DataFrame(
            {
                "one": self.identity[one],
                "other": self.identity[other],
                "begin": time[begin],
                "end": time[until],
                "duration": time[until] - time[begin],
                "left_censored": np.repeat([True, False, False], counts),
                "right_censored": np.repeat([False, False, True], counts),
                "absence": absence,
            }
        )
        return table.iloc[np.lexsort((begin, other, one))].reset_index(drop=True)

    @cached_property
    def components(self) -> pd.DataFrame:
        """One row a frame: time, robots (that are there), components, largest, largest_share, isolated.

        Of directed edges the weakly connected components. Without robots the share is NaN.
        """
        label, frames = self.component_labels, len(self.time)
        there = label >= 0
        robots = there.sum(axis=1)
        sizes = np.bincount(label[there])
        # The frame of a component is that of any of its robots.
        frame = np.zeros(len(sizes), np.int64)
        frame[label[there]] = np.broadcast_to(np.arange(frames)[:, np.newaxis], label.shape)[there]
        largest = np.zeros(frames, np.int64)
        np.maximum.at(largest, frame, sizes)
        return pd.DataFrame(
            {
                "time": self.time,
                "robots": robots,
                "components": np.bincount(frame, minlength=frames),
                "largest": largest,
                "largest_share": np.divide(largest, robots, out=np.full(frames, np.nan), where=robots > 0),
                "isolated": np.bincount(frame[sizes == 1], minlength=frames),
            }
        )

    @cached_property
    def component_labels(self) -> Ints:
        """The component of each robot in each frame, int64 of shape (frames, n); −1 while it is not there.

        Components are numbered throughout, those of a frame one after the other.
        """
        # One graph, whose nodes are robots in frames.
        nodes, there = self.present.size, self.present.ravel()
        one, other = (self.edges.frame * self.robots + side for side in (self.edges.one, self.edges.other))
        matrix = coo_array((np.ones(len(one), np.int8), (one, other)), shape=(nodes, nodes))
        found = csgraph.connected_components(matrix, directed=False)[1] if nodes else np.zeros(0)
        label = np.full(nodes, -1, np.int64)
        label[there] = np.unique(found[there], return_inverse=True)[1]
        return label.reshape(self.present.shape)

    def time_since_contact(self, robot: object = None) -> Floats:
        """Return the time since the last contact, float64 of shape (frames, n) [time].

        It is 0 in contact, and NaN before the first one or while the robot is not there.

        Parameters
        ----------
        robot : optional
            The name of a robot, with which the others are in contact or not; by default any neighbour counts.

        Raises
        ------
        ValueError
            If no robot has this name.
        """
        meets = np.zeros(self.present.shape, bool)
        frame, one, other = self.edges.frame, self.edges.one, self.edges.other
        if robot is None:
            meets[frame, one] = True
            if not self.directed:
                meets[frame, other] = True
        else:
            row = self.row(robot)
            meets[frame[other == row], one[other == row]] = True
            if not self.directed:
                meets[frame[one == row], other[one == row]] = True
        last = np.maximum.accumulate(np.where(meets, np.arange(len(self.time))[:, np.newaxis], -1), axis=0)
        since = self.time[:, np.newaxis] - self.time[np.maximum(last, 0)]
        return np.where((last >= 0) & self.present, since, np.nan)

    def row(self, robot: object) -> int:
        """Return the row of a robot by name."""
        found = np.flatnonzero(self.identity == robot)
        if not len(found):
            known = ", ".join(map(str, self.identity[:8].tolist())) + ", …" * (self.robots > 8)
            raise ValueError(f"robot={checks.shown(robot)}: not in the record; known are {known}")
        return int(found[0])

    @cached_property
    def _spans(self) -> _Spans:
        """The longest stretches of successive frames in which the same two robots are neighbours."""
        edges, size, frames = self.edges, max(self.robots, 1), max(len(self.time), 1)
        key = np.sort((edges.one * size + edges.other) * frames + edges.frame)
        # Frame 0 of a pair may follow the last frame of the pair before.
        new = (np.diff(key, prepend=-2) != 1) | (key % frames == 0)
        begin, end = key[new], key[np.append(new[1:], True)[: len(key)]]
        pair, first = np.divmod(begin, frames)
        return _Spans(*np.divmod(pair, size), first, end % frames)

    def __repr__(self) -> str:
        return f"<TemporalGraph of {self.robots} robots in {len(self.time)} frames, {len(self.edges.frame)} edges>"


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
        # Of each stretch of True begin and end; the last ends with the record.
        change = np.flatnonzero(np.diff(there.astype(np.int8), prepend=0, append=0))
        ends = np.minimum(change[1::2], len(graph.time) - 1)
        begun, ended = (graph.time[frames].tolist() for frames in (change[::2], ends))
        network.add_node(name, present=list(zip(begun, ended, strict=True)))
    for (one, other), rows in graph.contacts.groupby(["one", "other"], sort=False):
        met = list(zip(rows["begin"].tolist(), rows["end"].tolist(), strict=True))
        network.add_edge(one, other, contacts=met, total=float(rows["duration"].sum()))
    return network
