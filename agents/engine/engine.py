"""The engine: binds the arrays of a world for the compiled loop, and makes its steps by calls of the loop."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from teamsight.agents.channel import leave
from teamsight.agents.decisions.new_timetable import give_timetables, is_every_step
from teamsight.agents.engine.binding import Binding
from teamsight.agents.engine.calls import MOST_GROWTH, LoopCalls
from teamsight.agents.engine.changes import Changes
from teamsight.agents.engine.failures import endless_growth
from teamsight.agents.engine.loop import BEGIN_STEP, END_STEP, LOOK, RUN, SEE
from teamsight.agents.engine.needed import kernels_needed
from teamsight.agents.engine.neighbours import connect
from teamsight.agents.engine.python_policies import Deliberation, carry, due_rows
from teamsight.agents.engine.watching import Watcher, report
from teamsight.agents.events.timeline import DECIDE
from teamsight.agents.group import Group
from teamsight.agents.recording.trajectory import Trail
from teamsight.agents.world_data import WorldData
from teamsight.core import checks
from teamsight.core.interrupts import deferred
from teamsight.core.kernel.report import REPORT

if TYPE_CHECKING:
    from teamsight.policies.interface import Action

# Work for about a quarter of a second.
_BODY_STEPS_A_CALL = 4_000_000


class Engine(LoopCalls):
    """Runs a world in compiled code, step by step or many steps in one call.

    Attributes
    ----------
    is_bound : bool
        Whether the records describe the groups as they are.
    is_seen : bool
        Whether the neighbour lists are those of the present positions.
    searches : int
        The number of neighbour searches between steps, and of changes of their lists.
    stretch : Stretch
        The history of the steps since groups last changed.
    trails : list of Trail
        The recorded positions.
    transitions : TransitionLogs
        The recorded transitions.
    deliberations : dict of Group to Deliberation
        During a step: the decisions of the groups with Python policies.
    """

    def __init__(self, data: WorldData) -> None:
        super().__init__(data)
        self.is_seen = False
        # Whether the watchers have seen the present positions, and whether the records hold those that there are.
        self._is_watched, self._has_watchers = False, True
        self._changes = Changes()
        self.searches = 0
        self.deliberations: dict[Group, Deliberation] = {}

    def leave_out(self, group: Group) -> None:
        """Forget a group that could not be added."""
        for other in self._data.groups:
            leave(other.channels, group)
        self.transitions.groups = [other for other in self.transitions.groups if other is not group]
        self.is_bound = False

    def prepare(self) -> None:
        """Prepare a step: bind the records and search for neighbours, where either is out of date."""
        if not self.is_bound:
            with deferred():
                self.relations = connect(self._data)
                give_timetables(self._data)
                self.stretch = self._data.history.begin(self.relations, self._data.score_names)
                trail = None
                if self._every:
                    trail = Trail(self._data.groups, self._every, self._data.timeline.tick)
                    self.trails.append(trail)
                partakers = [group for one in self._data.interactions for group in one.groups]
                self.transitions.begin(self._data.groups, partakers)
                REPORT.plan(kernels_needed(self._data))
                self._binding = Binding(self._data, self.relations, self.stretch, trail, self.transitions.in_use)
                self._binding.progress["phase"] = self._phase
                self.is_bound, self.is_seen, self._has_watchers = True, False, True
        if not self._has_watchers:
            REPORT.plan(kernels_needed(self._data))
            self._binding.rebind_watchers()
            self._has_watchers = True
        if self.is_seen and not self._changes:
            return
        can_change = self.is_seen and not self._phase
        if not (can_change and self._changes.apply(self._binding, self.relations)):
            self._call(SEE)
        self._changes.clear()
        self.is_seen, self._is_recorded, self._is_watched = True, False, False
        self.searches += 1

    def change(self, group: Group, row: int) -> None:
        """Note that the condition of one agent has changed: whether it is active, or whether a sensor of it works."""
        if not group.has_conditions:
            group.has_conditions, self.is_bound = True, False
        self._changes.note(group.number, row)

    def watch(self, watcher: Watcher) -> None:
        """Call a watcher after each step, from now on."""
        self._data.watchers.append(watcher)
        self._is_watched = False
        self.rewatch()

    def unwatch(self, watcher: Watcher) -> None:
        """Call a watcher no longer."""
        self._data.watchers[:] = [other for other in self._data.watchers if other is not watcher]
        self.rewatch()

    def rewatch(self) -> None:
        """Bind the watchers again before the next step."""
        self._has_watchers = False

    def look(self) -> bool:
        """Let the watchers see what has changed between steps; return whether one of them has something to report."""
        if not self._data.watchers:
            return False
        for watcher in list(self._data.watchers):
            watcher.tidy()
        if not any(watcher.sees_changes for watcher in self._data.watchers):
            return False
        self.prepare()
        if self._is_watched:
            return False
        with deferred():
            self._is_watched = True
            self._call(LOOK)
            return report(self._binding.watchers, self._binding.world.value)

    def perceive(self, group: Group) -> None:
        """Update the percept of a group to the present positions."""
        self.prepare()
        if group.timetable is not None:
            group.timetable.travel(group.bodies.moved, self._data.timeline.tick)
        self._binding.show_columns()
        for _ in range(MOST_GROWTH):
            if group.perception.perceive(group.awareness):
                return
            self._binding.rebind()
        raise endless_growth(group)

    def run(self, steps: int) -> None:
        """Make at most `steps` steps in one compiled call; all policies have kernels.

        If the last step failed, only that step is made again, with the actions already decided.
        """
        resumed = any(group.has_decided for group in self._data.groups)
        if resumed:
            steps = 1
        self._make_room(steps)
        # A step whose neighbour search ran out of room after the move is completed first.
        self._binding.progress["steps"] = steps - self._phase
        self._call(RUN)
        if resumed:
            self._decide_again()

    def step(self) -> None:
        """Make one step in which a policy is Python."""
        data = self._data
        self._make_room(1)
        if self._phase:
            self._call(END_STEP)
            return
        self._call(BEGIN_STEP)
        deciding = [group for group in data.groups if not group.is_compiled]
        try:
            actions = self._decide(deciding)
            with deferred():
                carried = [carry(self.deliberations[group], one) for group, one in zip(deciding, actions, strict=True)]
                tick = data.timeline.tick
                try:
                    self._call(END_STEP)
                finally:
                    is_made = data.timeline.tick > tick or bool(self._phase)
                    for one in carried:
                        one.end(is_made=is_made)
        finally:
            self.deliberations = {}
        self._decide_again()

    def _decide(self, groups: list[Group]) -> list[Action]:
        """Return the actions of the groups with Python policies."""
        tick, key = self._data.timeline.tick, self._data.key
        self.deliberations = {
            group: Deliberation(group, tick, key, group.noise(tick), due_rows(group)) for group in groups
        }
        with self._data.timeline.calling(DECIDE):
            return [deliberation.decide() for deliberation in self.deliberations.values()]

    def _decide_again(self) -> None:
        """Let all kernels decide again in the next step, once the actions of a failed step were carried out."""
        for group in self._data.groups:
            if group.has_decided:
                group.has_decided = False
                self.is_bound = False
                if group.timetable is not None:
                    group.timetable.go_on(self._data.key, group.bodies.member, self._data.timeline.tick - 1)

    @property
    def longest_call(self) -> int:
        """The number of steps per call: enough to make calls cheap, few enough to respond to Ctrl-C."""
        return max(_BODY_STEPS_A_CALL // max(sum(map(len, self._data.groups)), 1), 1)

    def record_positions(self, every: int) -> None:
        """Record positions each `every` steps, from now on."""
        self._every = every
        self.is_bound = False

    def record_transitions(self, group: Group) -> None:
        """Record the transitions of a group, from now on."""
        if group not in self._data.groups:
            raise ValueError(f"record_transitions({checks.shown(group)}): the group must have been added to this world")
        if not is_every_step(group):
            raise ValueError(
                f"record_transitions({group.name}): takes a decision of each robot at every step, and their cycle is "
                f"{checks.shown(group.cycle)}; set {group.name}.cycle = Cycle()"
            )
        if group not in self.transitions.groups:
            self.transitions.groups.append(group)
            self.is_bound = False

    def forget(self, *, is_kept: bool = False) -> None:
        """Start all recording anew; if the arrays are kept, the records are still valid."""
        # Binding begins trails and logs, so with either it is done again.
        self.is_bound = self.is_bound and is_kept and not (self._every or self.transitions.groups)
        self.is_seen = self._is_recorded = False
        self._changes.clear()
        self._phase = 0
        if self.is_bound:
            self._binding.rewind()
            self._has_watchers = not self._data.watchers
            self.stretch = self._data.history.begin_like(self.stretch)
            return
        self.trails = []
        self.transitions.forget()
        self.stretch = self._data.history.begin([])

    @property
    def extras(self) -> tuple[Any, int, bool]:
        """The channels of all groups, and what is recorded; `ReusedWorlds` compares them."""
        channels = [channel for group in self._data.groups for channel in group.channels.values()]
        declared = tuple((channel.name, len(channel.observed), channel.sensor) for channel in channels)
        return declared, self._every, bool(self.transitions.groups)

    def adapt(self) -> None:
        """Adapt to a new arena size and new ranges, which have been written into the arrays."""
        # The width of cells is the range.
        if any(relation.search.has_cells for relation in self.relations):
            self.is_bound = False

    def present(self, name: str) -> float:
        """Return `observed` or `mean_degree` for the present positions."""
        self.prepare()
        return self.stretch.reading(name, self._is_recorded)
