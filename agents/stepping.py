"""Stepping: how a world advances, one step at a time or many in a compiled call."""

from __future__ import annotations

import warnings
from collections.abc import Callable
from typing import TYPE_CHECKING, Any, cast

import mesa

from teamsight.agents import building, mesa_compat
from teamsight.agents.engine.engine import Engine
from teamsight.agents.group import Group
from teamsight.agents.recording.collector import HistoryCollector, Rows
from teamsight.agents.recording.history import History
from teamsight.agents.timeline import Timeline
from teamsight.core import checks
from teamsight.core.interrupts import deferred

if TYPE_CHECKING:
    from teamsight.agents.model import World


class Stepping(Timeline):
    """What of a `World` advances it.

    Whatever interrupts a step, such as Ctrl-C or an exception in a user's policy, the world is afterwards where its
    last completed step has left it, and `step` and `run` go on from there.
    """

    groups: list[Group]
    recorders: list[Callable[[World], Any]]
    _collector: mesa.DataCollector
    _engine: Engine
    _history: History
    _warned: set[str]

    def step(self) -> None:
        """Make one step, unless an event stops the model before it."""
        self._check_outside("step()")
        tick = self.tick
        goes_on = self._let_events_happen()
        if self.tick != tick:
            # An event has reset or restored the world, and its counters with it.
            mesa_compat.count_steps(self._world, 1)
        if goes_on:
            self._make_step()
        else:
            mesa_compat.count_steps(self._world, -1)

    def run(self, steps: int) -> None:
        """Make `steps` steps, in one compiled call where nothing asks for Python.

        Parameters
        ----------
        steps : int
            How many, at least 0. A model that stops `running` makes fewer.

        Raises
        ------
        TypeError, ValueError
            If `steps` is no whole number of at least 0.
        """
        self._check_outside("run()")
        # An event may reset the world, and its tick with it: so many steps are still made.
        end = self.tick - self._jumps + checks.count("steps", steps, least=0)
        reason = self._needs_python()
        if reason and steps > 0 and self.running and reason not in self._warned:
            self._warned.add(reason)
            warnings.warn(f"run() makes its steps one by one, because {reason}", stacklevel=2)
        while (left := end + self._jumps - self.tick) > 0 and self.running:
            if reason or mesa_compat.has_events(self._world):
                # mesa has put its own wrapper, which counts, around the method.
                mesa_step: Callable[[], None] = self.step
                mesa_step()
            else:
                reason = self._run_to_next_event(left)

    def run_for(self, duration: int) -> None:
        """Make this many steps: mesa's other name for `run`."""
        self.run(duration)

    def run_until(self, end_time: int) -> None:
        """Make steps until this many have been made: mesa's name."""
        self.run(max(checks.count("end_time", end_time, least=0) - self.tick, 0))

    @property
    def _world(self) -> World:
        return cast("World", self)

    def _run_to_next_event(self, most: int) -> str:
        """Let the events happen that are due, make the steps up to the next one; return why the next need Python."""
        if self.clock.ticks_until_event(self.tick) > 0:
            # Nothing of the user's is called: the steps are made and counted as one.
            with deferred():
                tick = self.tick
                try:
                    self._run_quiet_stretch(most)
                finally:
                    mesa_compat.count_steps(self._world, self.tick - tick)
            return ""
        world = self._world
        offset = world.steps - self.tick
        try:
            # mesa counts a step before the events that precede it.
            mesa_compat.count_steps(world, 1)
            if not self._let_events_happen():
                return ""
            # An event may have brought in what needs Python.
            reason = self._needs_python()
            if reason or mesa_compat.has_events(world):
                self._make_step()
                mesa_compat.end_step(world)
            else:
                self._run_quiet_stretch(most)
            return reason
        finally:
            mesa_compat.set_counters(world, offset + self.tick)

    def _run_quiet_stretch(self, most: int) -> None:
        """Make steps up to the next event, at most so many and no more than one call takes."""
        quiet = max(self.clock.ticks_until_event(self.tick), 1)
        self._run_stretch(int(min(most, quiet, self._engine.longest_call)))

    def _make_step(self) -> None:
        for group in self.groups:
            if building.steps_by_itself(group):
                self._engine.prepare()
                with self._calling("an agent's own step"):
                    for agent in list(group.agents):
                        # Another may have removed it meanwhile.
                        if agent._row >= 0:
                            agent.step()
        if all(group.is_compiled for group in self.groups):
            self._run_stretch(1)
        else:
            self._begin_to_collect()
            before = self._before()
            try:
                self._engine.step()
            finally:
                self._collect(before)
        if self.recorders:
            with self._calling("a recorder"):
                for recorder in list(self.recorders):
                    recorder(self._world)
        if not isinstance(self._collector, HistoryCollector):
            self._collector.collect(self)

    def _run_stretch(self, steps: int) -> None:
        self._begin_to_collect()
        with deferred():
            before = self._before()
            try:
                self._engine.run(steps)
            finally:
                self._collect(before)

    def _begin_to_collect(self) -> None:
        """Make everything ready, and collect what is there before the first step."""
        self._engine.prepare()
        if isinstance(self._collector, HistoryCollector) and not self._collector.has_begun:
            self._collector.collect(self)

    def _before(self) -> Rows:
        """Return the rows of the present stretch that are still to come: none yet."""
        stretch = self._engine.stretch
        return Rows(
            stretch, stretch.rows, stretch.rows, self.tick, stretch.observed_sum, self._history.max_neighbours,
            self._history.earlier,
        )  # fmt: skip

    def _collect(self, before: Rows) -> None:
        before.last, before.tick = before.stretch.rows, self.tick
        if before.last > before.first and isinstance(self._collector, HistoryCollector):
            self._collector.collect_rows(before)

    def _needs_python(self) -> str:
        """Return why steps cannot be made in a compiled call; empty when they can."""
        if type(self).step is not Stepping.step:
            return f"{type(self).__name__} overrides step"
        if self.recorders:
            return "a recorder is a Python function"
        if not isinstance(self._collector, HistoryCollector):
            return "a DataCollector collects after every step"
        for group in self.groups:
            if building.steps_by_itself(group):
                return f"an agent class of {group.name} overrides step"
            if group.decides_alone:
                return f"the agent class of {group.name} overrides decide"
            if not group.is_compiled:
                return f"the policy of {group.name} is Python"
        return ""
