"""The readings of a world: what was observed, now and so far, for scripts, data collectors and viewers."""

from __future__ import annotations

import mesa
import networkx as nx
import pandas as pd

from teamsight.agents.engine.engine import Engine
from teamsight.agents.group import Group
from teamsight.agents.recording.history import History
from teamsight.agents.recording.trajectory import neighbour_graph, trajectory_frame
from teamsight.agents.recording.transitions import Experience, joined
from teamsight.agents.teammates import Teammates, proximity, teammates
from teamsight.core import checks
from teamsight.core.neighbour_list import NeighbourList


class Readings:
    """What of a `World` is read and not changed."""

    groups: list[Group]
    _collector: mesa.DataCollector
    _engine: Engine
    _history: History

    def look(self) -> None:
        """Bring all sightings up to date, if anything was moved by hand."""
        self._engine.prepare()

    @property
    def datacollector(self) -> mesa.DataCollector:
        """mesa's data collector; what is set collects at once, and then after every step.

        A world begins with one that holds the history, from its first step on; see `HistoryCollector`.
        """
        return self._collector

    @datacollector.setter
    def datacollector(self, collector: mesa.DataCollector) -> None:
        if not callable(getattr(collector, "collect", None)):
            raise TypeError(f"datacollector={checks.shown(collector)}: must be a mesa.DataCollector")
        self.look()
        collector.collect(self)
        self._collector = collector

    @property
    def observed_fraction(self) -> float:
        """The mean over the completed steps of the share of targets that at least one robot sees, 0..1."""
        return self._history.observed_fraction

    @property
    def max_neighbours(self) -> int:
        """The largest number of robots within any robot's awareness range in the completed steps."""
        return self._history.max_neighbours

    @property
    def observed(self) -> float:
        """The share of targets that at least one robot sees now, 0..1."""
        return self._engine.present("observed")

    @property
    def mean_neighbours(self) -> float:
        """The mean number of robots within a robot's awareness range now."""
        return self._engine.present("mean_neighbours")

    @property
    def history(self) -> pd.DataFrame:
        """One row for each completed step, indexed 1..n: observed, mean_neighbours, max_neighbours."""
        return self._history.frame()

    @property
    def proximity(self) -> NeighbourList:
        """Who of `teammates` is within whose awareness range now, as flat arrays; edges join agents of one team."""
        self.look()
        return proximity(self.groups)

    @property
    def teammates(self) -> Teammates:
        """All agents that are on a team now, in the order of groups; `proximity` counts through them."""
        return teammates(self.groups)

    def neighbour_graph(self) -> nx.Graph:
        """Return the present graph of who is within whose awareness range; directed when ranges differ."""
        self.look()
        return neighbour_graph(self.groups)

    def record_positions(self, every: int = 1) -> None:
        """From now on keep the positions of all agents, each `every` steps; read them from `trajectory`."""
        self._engine.record_positions(checks.count("every", every))

    @property
    def trajectory(self) -> pd.DataFrame:
        """The positions kept: time [ticks], group, identity, x, y [length]."""
        return trajectory_frame(self._engine.trails)

    def record_experience(self, group: Group) -> None:
        """From now on keep what the robots of a group meet at each step; read it from `experience`.

        `reset` and `restore` begin the record anew.

        Raises
        ------
        ValueError
            If the group is not of this world.
        """
        self._engine.record_experience(group)

    def experience(self, group: Group) -> Experience:
        """Return what the robots of a group met since `record_experience`: a pair for each robot and step.

        Raises
        ------
        ValueError
            If it was not recorded, or the width of the situation has changed on the way.
        """
        self.look()
        return joined(group, [log for log in self._engine.experience.logs if log.group is group])
