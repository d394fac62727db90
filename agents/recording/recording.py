"""The recording of a world: its history, positions and transitions on demand, and the user's recorders."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import mesa
import pandas as pd

from teamsight.agents.engine.engine import Engine
from teamsight.agents.group import Group
from teamsight.agents.mesa.collector import HistoryCollector
from teamsight.agents.recording.history import trajectory_frame
from teamsight.agents.recording.transitions import Transitions, joined
from teamsight.agents.world_data import WorldData
from teamsight.core import checks


class Recording:
    """What is recorded of a world's run: ``world.recording``.

    Attributes
    ----------
    callbacks : list of callable
        Functions that are called with the world after each step. Steps are then made one by one.
    before_steps : list of callable
        Functions that are called with the world before steps are made, after all events that precede them: before each
        step of ``run(1)``, and once for all steps that one compiled call makes. They must change nothing.
    collector : mesa.DataCollector
        The data collector of the world; see `World.datacollector`.
    """

    def __init__(self, data: WorldData, engine: Engine) -> None:
        self._data, self._engine = data, engine
        self.callbacks: list[Callable[[Any], Any]] = []
        self.before_steps: list[Callable[[Any], Any]] = []
        self.collector: mesa.DataCollector = HistoryCollector()

    @property
    def history(self) -> pd.DataFrame:
        """One row for each completed step, indexed 1..n: observed, mean_neighbours, max_neighbours.

        The scores of interactions follow, under their names.
        """
        return self._data.history.frame(self._data.score_names)

    @property
    def mean_neighbours(self) -> float:
        """The mean over robots and completed steps of the number of robots within a robot's awareness range."""
        return self._data.history.mean_neighbours

    def max_neighbours(self, team: str | None = None, first: int = 0) -> int:
        """Return the largest number of neighbours of any robot in the completed steps.

        Parameters
        ----------
        team : str, optional
            The name of a team; by default all teams count.
        first : int
            The number of steps to leave out at the start.
        """
        if team is None and not first:
            return self._data.history.max_neighbours
        largest = self.max_neighbours_by_group(first)
        return max((degree for (_, name), degree in largest.items() if team in (None, name)), default=0)

    def max_neighbours_by_group(self, first: int = 0) -> dict[tuple[str, str], int]:
        """Return the largest number of neighbours of any robot in each group, by the names of group and team.

        Parameters
        ----------
        first : int
            The number of steps to leave out at the start.
        """
        return self._data.history.largest_by_group(first)

    def record_positions(self, every: int = 1) -> None:
        """Record the positions of all agents from now on, at each tick that `every` divides; see `trajectory`.

        Raises
        ------
        TypeError, ValueError
            If `every` is not a whole number of at least 1.
        """
        self._engine.record_positions(checks.count("every", every))

    @property
    def trajectory(self) -> pd.DataFrame:
        """The recorded positions: time [ticks], group, identity, x, y [length]."""
        return trajectory_frame(self._engine.trails)

    def record_transitions(self, group: Group) -> None:
        """Record the transitions of a group's robots from now on; see `transitions`.

        `World.reset` and `World.restore` discard those recorded so far.

        Raises
        ------
        ValueError
            If the group is not in this world.
        """
        self._engine.record_transitions(group)

    def transitions(self, group: Group) -> Transitions:
        """Return the recorded transitions of a group: one for each robot and step.

        Raises
        ------
        ValueError
            If none were recorded, or the width of the situation has changed meanwhile.
        """
        self._engine.prepare()
        return joined(group, [log for log in self._engine.transitions.logs if log.group is group])
