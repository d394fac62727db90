"""The logs of the groups whose transitions are recorded, one for each stretch in which the groups stay as they are."""

from __future__ import annotations

from teamsight.agents.group import Group, team_of
from teamsight.agents.recording.transitions import TransitionLog


class TransitionLogs:
    """The transitions of some groups of a world.

    Attributes
    ----------
    logs : list of TransitionLog
        All logs with transitions, and those in use.
    in_use : list of TransitionLog
        The logs to which the compiled loop writes.
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
        """Do not record a group that could not be added."""
        self._recorded = [other for other in self._recorded if other is not group]

    def forget(self) -> None:
        """Drop all that was recorded."""
        self.logs, self.in_use = [], []

    def begin(self, groups: list[Group]) -> None:
        """Begin new logs, because groups or teams may have changed."""
        self.in_use = [TransitionLog(group, sum(map(len, team_of(groups, group)))) for group in self._recorded]
        self.logs = [log for log in self.logs if log.rows] + self.in_use

    def make_room(self, steps: int) -> bool:
        """Make room for this many more steps; return whether arrays were replaced and must be bound."""
        moved = [log.make_room(steps) for log in self.in_use]
        return any(moved)
