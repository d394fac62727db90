"""The temporal graph: the neighbour graph in every frame of a record, and what follows from it."""

from __future__ import annotations

from functools import cached_property

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from teamsight.analysis.contacts import connectivity, intervals
from teamsight.analysis.contacts.frames import Edges
from teamsight.core import checks

Ints = NDArray[np.int64]
Floats = NDArray[np.float64]


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
        return intervals.contact_table(self._spans, self.time, self._known_presence, self.identity)

    @cached_property
    def gaps(self) -> pd.DataFrame:
        """One row an inter-contact time, between two contacts of the same two robots.

        Columns: one, other; begin, end, duration [time]; left_censored, right_censored: the time before their first
        contact, and after their last one; absence: one of them was not there for a part of the time, NA for a log,
        which does not say. Robots that never meet have no row.
        """
        return intervals.gap_table(self._spans, self.time, self._known_presence, self.identity)

    @cached_property
    def components(self) -> pd.DataFrame:
        """One row a frame: time, robots (that are there), components, largest, largest_share, isolated.

        Of directed edges the weakly connected components. Without robots the share is NaN.
        """
        return connectivity.component_table(self.component_labels, self.time)

    @cached_property
    def component_labels(self) -> Ints:
        """The component of each robot in each frame, int64 of shape (frames, n); −1 while it is not there."""
        return connectivity.labels(self.edges, self.present)

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

    @property
    def _known_presence(self) -> NDArray[np.bool_] | None:
        return self.present if self.knows_presence else None

    @cached_property
    def _spans(self) -> intervals.Spans:
        return intervals.spans(self.edges, self.robots, len(self.time))

    def __repr__(self) -> str:
        return f"<TemporalGraph of {self.robots} robots in {len(self.time)} frames, {len(self.edges.frame)} edges>"
