"""Stepping: advance a world, one step at a time or many in one compiled call."""

from __future__ import annotations

import math
import warnings
from collections.abc import Callable
from time import monotonic

import mesa

from teamsight.agents.body import Body
from teamsight.agents.channel import TARGETS, TEAMMATES
from teamsight.agents.engine.engine import Engine
from teamsight.agents.group import Group
from teamsight.agents.mesa import compat as mesa_compat
from teamsight.agents.recording.recording import HistoryCollector, Recording, Rows
from teamsight.agents.world_data import CONDITION, OWN_STEP, WorldData
from teamsight.core import checks, status_line
from teamsight.core.interrupts import deferred
from teamsight.core.status_line import StatusLine, has_reader, seconds
from teamsight.policies.interface import Policy
from teamsight.policies.registry import label
from teamsight.world.noise import PERIOD

# How often the line changes [s].
_EVERY = 0.25


class RunProgress:
    """The progress of one run. It costs a comparison per call of the loop, until it is shown.

    Parameters
    ----------
    steps : int
        The number of steps to make.
    is_wanted : bool
        Whether progress may be shown.

    Attributes
    ----------
    steps : int
        The number of steps to make.
    due : float
        The time on the clock `monotonic` at which `show` should be called next [s].
    """

    def __init__(self, steps: int, is_wanted: bool) -> None:
        self.steps, self._began, self.due = steps, 0.0, math.inf
        self._line: StatusLine | None = None
        if is_wanted and not status_line.shown_lines:
            self._began = monotonic()
            self.due = self._began + status_line.PATIENCE

    def show(self, done: int) -> None:
        """Show that `done` steps are made, if anybody can read it."""
        if self._line is None:
            if not has_reader():
                self.due = math.inf
                return
            self._line = StatusLine()
            status_line.shown_lines.append(self)
        now = monotonic()
        self.due = now + _EVERY
        taken = now - self._began
        left = f", {seconds(taken * (self.steps - done) / done)} left" if done else ""
        self._line.show(f"step {done:,} of {self.steps:,} ({done / self.steps:.0%}), {seconds(taken)}{left}")

    def close(self) -> None:
        """Remove what is shown."""
        if self._line is not None:
            status_line.shown_lines.remove(self)
            self._line.close()


WAITING = "a process waits for a condition in Python, world.until(…)"
#: Of the warnings for a group that does not decide, and for a step of an agent, which moves nobody.
IDLE, NOBODY = "idle", "moves nobody"


class Stepper:
    """Advances a world.

    If a step is interrupted, by Ctrl-C or by an exception in a user's policy, the world stays as after the last
    completed step, and `step` and `run` continue from there.
    """

    def __init__(
        self, model: mesa.Model, data: WorldData, engine: Engine, recording: Recording, overrides_step: bool
    ) -> None:
        self._model, self._data, self._engine, self._recording = model, data, engine, recording
        self._timeline = data.timeline
        self._overrides_step = overrides_step
        # Why steps were made one by one; the user was warned of each reason.
        self.warned: set[str | tuple[str, str]] = set()
        self.is_closed = False
        # How often `step` was called, and whether the model's own is being called, which must call it.
        self.calls, self.in_own_step = 0, False

    def step(self) -> None:
        """Make one step, unless an event before it stops the model."""
        timeline = self._timeline
        self.calls += 1
        timeline.check_outside("step()")
        tick = timeline.tick
        goes_on = self._process_events()
        if timeline.tick != tick:
            # An event has reset or restored the world, and its counters with it.
            mesa_compat.count_steps(self._model, 1)
        if goes_on:
            self._make_step()
        else:
            mesa_compat.count_steps(self._model, -1)

    def run(self, steps: int, *, progress: bool = True) -> None:
        """Make `steps` steps, in one compiled call unless something needs Python in between; see `World.run`."""
        timeline, model = self._timeline, self._model
        timeline.check_outside("run()")
        steps = checks.count("steps", steps, least=0)
        cure = f"noise repeats after {PERIOD:,} ticks; to end a run earlier, an event can set world.running = False"
        checks.count("steps", steps, least=0, most=PERIOD - timeline.tick, cure=cure)
        shown = RunProgress(steps, checks.flag("progress", progress))
        # An event may reset the tick; the number of steps to make stays the same.
        end = timeline.tick - timeline.jumps + shown.steps
        reason = self.needs_python()
        if steps > 0 and not model.running:
            self._warn_of_stop()
        if reason and steps > 0 and model.running and reason not in self.warned:
            self.warned.add(reason)
            warnings.warn(f"run() makes its steps one by one, because {reason}", stacklevel=3)
        if steps > 0:
            self._warn_of_idle(end + timeline.jumps)
        try:
            if timeline.events_end_steps:
                self.finish_tick()
                # The events of this tick may have added something that needs Python, here as in the loop.
                reason = self.needs_python()
            while (left := end + timeline.jumps - timeline.tick) > 0 and model.running:
                if monotonic() > shown.due:
                    shown.show(steps - left)
                if reason or mesa_compat.has_events(model):
                    # The wrapper of `mesa_compat.take_over_step`, which counts the step.
                    mesa_step: Callable[[], None] = model.step
                    mesa_step()
                    if not reason or reason == WAITING:
                        reason = self.needs_python()
                else:
                    reason = self._run_to_next_event(left)
                    self.finish_tick()
                    reason = reason or self.needs_python()
        finally:
            shown.close()

    def finish_tick(self) -> None:
        """Process the events that are due, between two steps, where they happen at the end of a step."""
        if self._timeline.events_end_steps and not self._timeline.inside:
            self._timeline.process_events()

    def _process_events(self) -> bool:
        """Process the events that are due; return False if one has stopped the model."""
        model, data, was_running = self._model, self._data, self._model.running
        self._timeline.process_events()
        # What the events have changed may be what a watcher waits for; then there are new events.
        while (data.watchers or data.conditions) and (model.running or not was_running):
            if not (self._engine.look() or self._test_conditions()):
                break
            self._timeline.process_events()
        return bool(model.running or not was_running)

    def _test_conditions(self) -> bool:
        """Test what processes wait for in Python; return whether that has planned an event."""
        if not self._data.conditions:
            return False
        with self._timeline.calling(CONDITION):
            planned = [test() for test in list(self._data.conditions)]
        return any(planned)

    def _run_to_next_event(self, most: int) -> str:
        """Process due events and make the steps up to the next event; return why the steps after it need Python."""
        timeline, model = self._timeline, self._model
        if timeline.clock.ticks_until_event(timeline.tick) > 0 and not self._engine.look():
            # No function of the user's is called, so Ctrl-C can wait until the steps are made and counted.
            with deferred():
                tick = timeline.tick
                try:
                    self._run_quiet_stretch(most)
                finally:
                    mesa_compat.count_steps(model, timeline.tick - tick)
            return ""
        offset = model.steps - timeline.tick
        try:
            # mesa counts a step before the events that precede it.
            mesa_compat.count_steps(model, 1)
            if not self._process_events():
                return ""
            # An event may have added something that needs Python.
            reason = self.needs_python()
            if reason or mesa_compat.has_events(model):
                self._make_step()
                mesa_compat.end_step(model)
            else:
                self._run_quiet_stretch(most)
            return reason
        finally:
            mesa_compat.set_counters(model, offset + timeline.tick)

    def _run_quiet_stretch(self, most: int) -> None:
        """Make steps up to the next event, at most `most` and no more than one call takes."""
        quiet = max(self._timeline.clock.ticks_until_event(self._timeline.tick), 1)
        self._run_stretch(int(min(most, quiet, self._engine.longest_call)))

    def _make_step(self) -> None:
        for group in self._data.groups:
            if _overrides_step(group):
                self._engine.prepare()
                with self._timeline.calling(OWN_STEP):
                    for agent in list(group._agents):
                        # The step of another agent may have removed this one.
                        if agent._row >= 0:
                            agent.step()
        if all(group.is_compiled for group in self._data.groups):
            self._run_stretch(1)
        else:
            self._prepare_steps()
            self._collect(self._engine.step)
        if self._recording.callbacks:
            with self._timeline.calling("a recorder"):
                for callback in list(self._recording.callbacks):
                    callback(self._model)
        if not isinstance(self._recording.collector, HistoryCollector):
            self._recording.collector.collect(self._model)
        self._test_conditions()

    def _run_stretch(self, steps: int) -> None:
        self._prepare_steps()
        with deferred():
            self._collect(self._engine.run, steps)

    def _prepare_steps(self) -> None:
        self.begin_to_collect()
        if self._recording.before_steps:
            with self._timeline.calling("a recorder"):
                for callback in list(self._recording.before_steps):
                    callback(self._model)

    def begin_to_collect(self) -> None:
        """Prepare a step, and collect the present values before the first."""
        self._engine.prepare()
        collector = self._recording.collector
        if isinstance(collector, HistoryCollector) and not collector.has_begun:
            self._warn_if_blind()
            collector.collect(self._model)

    def _warn_if_blind(self) -> None:
        """Warn at the start of a run of a declaration that seems to be forgotten."""
        groups = self._data.groups
        if not any(name != TEAMMATES for group in groups for name in group.channels):
            targets = [group.name for group in groups if group.team is None]
            robots = [group.name for group in groups if group.team is not None]
            if targets and robots:
                self._warn(
                    f"no group senses another, so observed_fraction is NaN; if {robots[0]} are to sense {targets[0]}, "
                    f"declare it: world.senses({robots[0]}, {targets[0]})"
                )
        for group in groups:
            policy = group.rules[0]
            if isinstance(policy, Policy) and TARGETS in policy.needs and TARGETS not in group.channels:
                self._warn(
                    f"the policy of {group.name}, {label(policy)}, reads targets, and the group senses none; "
                    f"declare what it senses: world.senses({group.name}, others)"
                )

    def _warn_of_idle(self, end: int) -> None:
        """Warn of a group none of whose robots has decided yet, or will before a tick."""
        for group in self._data.groups:
            table = group.timetable
            if table is not None and len(group) and (table.decided_at < 0).all() and (table.next_at >= end).all():
                if (group.name, IDLE) in self.warned:
                    continue
                self.warned.add((group.name, IDLE))
                self._warn(
                    f"none of {group.name} decides before tick {end:,}, so all stay; the first does at tick "
                    f"{int(table.next_at.min()):,}: give them an earlier phase, as in {group.name}.cycle = Cycle(5), "
                    "or make more steps"
                )

    def _warn_of_stop(self) -> None:
        state = "was closed" if self.is_closed else "is stopped (running is False)"
        self._warn(f"run() makes no step: the model {state}; set model.running = True, or use reset()")

    def note_step_of(self, agent: Body) -> None:
        """Warn once of a call of an agent's ``step`` that is not the world's, as by ``agents.do("step")``."""
        name = type(agent).__name__
        if self._timeline.inside == OWN_STEP:
            return
        if type(agent).step is not Body.step:
            self._warn(
                f"{name}.step was called, and each step of the world calls it too, so it is called twice; leave out "
                'agents.do("step") or shuffle_do("step")'
            )
        # In a model's own step it may be meant for other agents of the user's.
        elif not self.in_own_step:
            self._warn(f"{name}.step() moves nobody: robots and targets move together, by world.step()", NOBODY)

    def check_step_made(self) -> None:
        """Refuse a model whose own ``step`` has made none, which would never end, unless it has stopped the model."""
        if self._model.running:
            what = f"{type(self._model).__name__}.step made no step"
            raise TypeError(f"{what}: call super().step() in it, which moves all agents together")

    def _warn(self, message: str, topic: str = "") -> None:
        """Warn once of a topic, by default of what the message says."""
        if (topic or message) not in self.warned:
            self.warned.add(topic or message)
            warnings.warn(message, stacklevel=5)

    def _collect(self, make_steps: Callable[..., None], *number: int) -> None:
        """Make steps and collect those that were completed, also if the last one fails."""
        stretch, history = self._engine.stretch, self._data.history
        first, earlier = stretch.rows, history.earlier
        try:
            make_steps(*number)
        finally:
            collector = self._recording.collector
            if stretch.rows > first and isinstance(collector, HistoryCollector):
                tick = self._timeline.tick
                collector.collect_rows(Rows(stretch, first, stretch.rows, tick, earlier))

    def needs_python(self) -> str:
        """Return why steps cannot be made in a compiled call; empty if they can."""
        if self._overrides_step:
            return f"{type(self._model).__name__} overrides step"
        if self._recording.callbacks:
            return "a recorder is a Python function"
        if not isinstance(self._recording.collector, HistoryCollector):
            return "a DataCollector collects after every step"
        if self._data.conditions:
            return WAITING
        for group in self._data.groups:
            if _overrides_step(group):
                return f"an agent class of {group.name} overrides step"
            if group.decides_alone:
                return f"the agent class of {group.name} overrides decide"
            if not group.is_compiled:
                return f"the policy of {group.name} is Python"
        return ""


def _overrides_step(group: Group) -> bool:
    return bool(group._agents) and type(group._agents[0]).step is not Body.step
