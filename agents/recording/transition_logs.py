"""The logs of the groups whose transitions are recorded, one for each stretch in which the groups stay as they are."""

from __future__ import annotations

from teamsight.agents.group import Group, team_of
from teamsight.agents.recording.transitions import TransitionLog


class TransitionLogs:
    """The transitions of some groups of a world.

    Attributes
    ----------
    logs : list of TransitionLog
        Those that hold anything, and those in use.
    in_use : list of TransitionLog
        Those that the compiled loop writes to.
    """

    def __init__(self) -> None:
        self._recorded: list[Group] = []
        self.logs: list[TransitionLog] = []
        self.in_use: list[TransitionLog] = []

    @property
    def is_on(self) -> bool:
        """Whether any group is recorded."""
        return bool(self._recorded)

    def record(self, group: Group) -> bool:
        """Record the transitions of a group from now on; return False if they are recorded already."""
        if group in self._recorded:
            return False
        self._recorded.append(group)
        return True

    def leave_out(self, group: Group) -> None:
        """Do not record a group, which could not be added."""
        self._recorded = [other for other in self._recorded if other is not group]

    def forget(self) -> None:
        """Drop all that was recorded."""
        self.logs, self.in_use = [], []

    def begin(self, groups: list[Group]) -> None:
        """Begin new logs: who is in a group, or on its team, may have changed."""
        self.in_use = [TransitionLog(group, sum(map(len, team_of(groups, group)))) for group in self._recorded]
        self.logs = [log for log in self.logs if log.rows] + self.in_use

    def make_room(self, steps: int) -> bool:
        """Make room for this many more steps; return whether arrays are others now, so that they must be bound."""
        moved = [log.make_room(steps) for log in self.in_use]
        return any(moved)
