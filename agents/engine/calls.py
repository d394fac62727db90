"""Calls of the compiled loop: until it is done, with larger buffers where it needs them; and what follows failures."""

from __future__ import annotations

from typing import TYPE_CHECKING

from teamsight.agents.engine.binding import Binding
from teamsight.agents.engine.failures import (
    bad_interaction,
    bad_sensing,
    check_places,
    endless,
    failure,
    keep_actions,
)
from teamsight.agents.engine.loop import END_STEP, RUN, SEE
from teamsight.agents.engine.records import (
    BAD_ACTION,
    BAD_INTERACTION,
    BAD_SENSING,
    DONE,
    GROW_DETECTION,
    GROW_RELATION,
    OUTSIDE,
)
from teamsight.agents.engine.relation import Relation
from teamsight.agents.engine.watching import report
from teamsight.agents.recording.trajectory import Trail
from teamsight.agents.recording.transitions import TransitionLogs
from teamsight.agents.world_data import WorldData
from teamsight.core.interrupts import deferred

if TYPE_CHECKING:
    from teamsight.agents.recording.history import Stretch
    from teamsight.core.kernel import Entry

#: How often in one step a degree of awareness may ask for larger buffers; each time they grow by a quarter.
MOST_GROWTH = 8


class LoopCalls:
    """What `Engine` calls the loop with; see there for the attributes.

    Parameters
    ----------
    data : WorldData
        The world.
    """

    def __init__(self, data: WorldData) -> None:
        self._data = data
        self._every = self._phase = 0
        self.relations: list[Relation] = []
        self.is_bound = self._is_recorded = False
        self._binding: Binding
        self.trails: list[Trail] = []
        self.transitions = TransitionLogs()
        self.stretch: Stretch = data.history.begin([])

    def _make_room(self, steps: int) -> None:
        trail = self.trails[-1] if self._every else None
        self.stretch.make_room(steps)
        if trail:
            trail.buffer.make_room(steps // self._every + 1)
        self._binding.record_into(self.stretch, trail)
        if self.transitions.make_room(steps):
            self._binding.rebind_logs()

    def _call(self, entry: Entry) -> None:
        """Call the loop until it is done, enlarging the buffers that are full.

        Ctrl-C is raised afterwards, so that no step is left incomplete.
        """
        binding, grown = self._binding, ((0, 0, 0), 0)
        with deferred():
            try:
                while (status := entry(binding.world)) != DONE:
                    where, need, tick = (int(binding.progress[name][0]) for name in ("where", "need", "tick"))
                    if status in (BAD_ACTION, OUTSIDE, BAD_SENSING, BAD_INTERACTION):
                        raise self._fail(status, where, has_decided=entry is not SEE)
                    # What was computed so far in this step depends on the present state only; it is computed again.
                    self._grow(status, where, need)
                    place = status, where, tick
                    grown = place, grown[1] + 1 if grown[0] == place else 1
                    if grown[1] > MOST_GROWTH:
                        raise endless(self._data.groups, self.relations, status, where)
            finally:
                self._read_back()
            if entry is RUN or entry is END_STEP:
                if binding.watchers:
                    report(binding.watchers, binding.world.value)
                self._check_places()

    def _fail(self, status: int, where: int, *, has_decided: bool) -> ValueError:
        """Return the exception for a step that cannot be made; the decided actions are kept."""
        self.is_bound = False
        keep_actions(self._data.groups, status, where, has_decided=has_decided)
        if status == BAD_SENSING:
            return bad_sensing(self.relations[where], int(self._data.moment[0]))
        if status == BAD_INTERACTION:
            return bad_interaction(self._data, self._binding.world.value, where)
        return failure(self._data, status, where, int(self._binding.progress["tick"][0]))

    def _check_places(self) -> None:
        try:
            check_places(self._data)
        except ValueError:
            # The next `prepare` raises the same error, so no further step is made.
            self.is_bound = False
            raise

    def _grow(self, status: int, where: int, need: int) -> None:
        """Enlarge a buffer and bind it; the loop continues where it stopped."""
        if status in (GROW_RELATION, GROW_DETECTION):
            self.relations[where].grow(need, detection=status == GROW_DETECTION)
            self._binding.rebind(where)
        else:
            self._data.groups[where].perception.grow(need)
            self._binding.rebind()

    def _read_back(self) -> None:
        progress = self._binding.progress[0]
        self._data.timeline.set(int(progress["tick"]))
        self._data.time[0] = progress["tick"]
        # 1 only if there was no room for neighbours; the next call completes the step.
        self._phase = int(progress["phase"])
        buffer = self.stretch.buffer
        self._is_recorded = self._is_recorded or int(progress["row"]) > buffer.rows
        buffer.rows = self.stretch.scores.rows = int(progress["row"])
        if self._every:
            self.trails[-1].buffer.rows = int(progress["trail_row"])
