"""The logs of the groups whose experience is recorded, one for each stretch in which the groups stay as they are."""

from __future__ import annotations

from typing import Any

import numpy as np

from teamsight.agents.engine.neighbours import Relation
from teamsight.agents.engine.records import EXPERIENCE
from teamsight.agents.group import Group, team_of
from teamsight.agents.recording.transitions import ExperienceLog


class ExperienceLogs:
    """The experience of some groups of a world.

    Attributes
    ----------
    logs : list of ExperienceLog
        Those that hold anything, and those in use.
    records : ndarray of `EXPERIENCE`
        What the compiled loop writes through, one for each log in use.
    """

    def __init__(self) -> None:
        self._recorded: list[Group] = []
        self.logs: list[ExperienceLog] = []
        self.records = np.zeros(0, EXPERIENCE)

    @property
    def is_on(self) -> bool:
        """Whether any group is recorded."""
        return bool(self._recorded)

    def record(self, group: Group) -> bool:
        """Keep the experience of a group from now on; return False if it is kept already."""
        if group in self._recorded:
            return False
        self._recorded.append(group)
        return True

    def leave_out(self, group: Group) -> None:
        """Do not record a group, which could not be added."""
        self._recorded = [other for other in self._recorded if other is not group]

    def forget(self) -> None:
        """Begin to record anew."""
        self.logs = []
        self.records = np.zeros(0, EXPERIENCE)

    def begin(self, groups: list[Group]) -> None:
        """Begin new logs: who is in a group, or on its team, may have changed."""
        teams = [team_of(groups, group) for group in self._recorded]
        begun = [
            ExperienceLog(group, sum(map(len, team))) for group, team in zip(self._recorded, teams, strict=True)
        ]
        self.logs = [log for log in self.logs if log.rows] + begun
        self.records = np.zeros(len(begun), EXPERIENCE)

    def _in_use(self) -> list[tuple[ExperienceLog, Any]]:
        first = len(self.logs) - len(self.records)
        return list(zip(self.logs[first:], self.records, strict=True))

    def bind(self, groups: list[Group], relations: list[Relation]) -> None:
        """Write where everything is into the records."""
        bodies = sum(map(len, groups))
        for log, record in self._in_use():
            log.bind(record, groups, relations, bodies)

    def make_room(self, steps: int) -> bool:
        """Make room for this many more steps; return whether arrays have moved, so that they must be bound again."""
        moved = [log.make_room(steps) for log, _ in self._in_use()]
        return any(moved)

    def read_back(self) -> None:
        """Take over how many rows the loop has written."""
        for log, record in self._in_use():
            log.rows = int(record["row"])
