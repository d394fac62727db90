"""The world: a mesa model in which groups of agents perceive, decide and move."""

from __future__ import annotations

import random
import warnings
from collections.abc import Callable
from typing import Any

import mesa
import numpy.typing as npt

from teamsight import checks
from teamsight.agents import compat, decisions, membership
from teamsight.agents.awareness import Awareness
from teamsight.agents.body import Body
from teamsight.agents.collector import HistoryCollector, Rows
from teamsight.agents.engine import Engine
from teamsight.agents.group import Group
from teamsight.agents.history import History
from teamsight.agents.readings import Readings
from teamsight.agents.state import Stateful
from teamsight.agents.timeline import Timeline
from teamsight.policies.interface import Action
from teamsight.world.arena import Arena
from teamsight.world.clock import Clock
from teamsight.world.noise import key_of


class World(Readings, Timeline, Stateful, mesa.Model):  # type: ignore[misc]
    """A mesa model of groups of agents in an arena.

    Parameters
    ----------
    arena : Arena
        Where everything happens: `Disc`, `Box` or `Torus`.
    rng : int, optional
        The seed; the model depends on it alone. By default a new one is drawn; see `seed_used`.
    seed : int, optional
        Another name for `rng`.

    Attributes
    ----------
    groups : list of Group
        The groups, in the order in which they were added.
    clock : Clock
        The SimPy environment that drives the model.
    tick : int
        How many steps have been made.
    seed_used : int
        The seed.

    Raises
    ------
    TypeError
        If `arena` is no arena, or a seed no whole number.
    ValueError
        If a seed is negative, or `rng` and `seed` differ.

    Notes
    -----
    One step is: events that are due → perceive → decide → advance → new sightings → record. `step` makes one; `run`
    makes many at once, with the same kernels in the same order and hence the same result to the last bit.
    """

    def __init__(self, arena: Arena, *, rng: int | None = None, seed: int | None = None) -> None:
        if not isinstance(arena, Arena):
            raise TypeError(f"arena={arena!r}: must be an arena, such as Disc(5.0), Box(10, 8) or Torus(10, 8)")
        self.seed_used = checks.seed(rng, seed)
        super().__init__(rng=self.seed_used)
        self.random = random.Random(self.seed_used)
        self.agents.random = self.random
        compat.take_over_step(self)
        self.arena = arena
        self.clock = Clock()
        self.key = key_of(self.seed_used)
        self.tick = 0
        self.groups: list[Group] = []
        self.recorders: list[Callable[[World], Any]] = []
        self._history = History()
        self._engine = Engine(self)
        self._collector: mesa.DataCollector | None = None
        self._warned: set[str] = set()

    def add(
        self,
        agent_class: type[Body],
        count: int,
        *,
        policy: Any,
        awareness: Awareness | str = "none",
        sensing_range: npt.ArrayLike = 1.0,
        awareness_range: npt.ArrayLike = 1.0,
        speed: npt.ArrayLike = 0.1,
        turn_limit: npt.ArrayLike | None = None,
        placement: str | npt.ArrayLike = "uniform",
        name: str | None = None,
    ) -> Group:
        """Add a group of agents.

        Parameters
        ----------
        agent_class : type
            `Robot`, `Target`, or a subclass.
        count : int
            How many, at least 1.
        policy : Policy, callable or str
            What decides for them: an object, a callable for one robot ``f(percept, rng) -> (turn, distance)``, or the
            name of a policy.
        awareness : Awareness or str
            What they perceive of teammates; an object or a name.
        sensing_range, awareness_range : float or array_like, shape (count,)
            How far they sense targets and teammates [length].
        speed : float or array_like, shape (count,)
            The farthest they can go a step [length].
        turn_limit : float or array_like, shape (count,), optional
            The farthest they can turn a step [rad]; by default any way.
        placement : {"uniform", "spread"} or array_like, shape (count, 2)
            Where they begin: uniform over the area, spread so that sensing discs do not overlap, or there.
        name : str, optional
            The group's name; by default the class's, in lower case and plural.

        Returns
        -------
        Group

        Raises
        ------
        TypeError, ValueError
            If a value is of the wrong type, shape or size, or the policy does not fit the degree of awareness.
        """
        group = membership.make_group(
            self, agent_class, count,
            membership.Plan(policy, awareness, sensing_range, awareness_range, speed, turn_limit, placement, name),
        )  # fmt: skip
        self.groups.append(group)
        membership.populate(self, group, agent_class)
        self.change()
        return group

    def senses(self, observers: Group, observed: Group) -> None:
        """Let one group sense another, within the observers' sensing range; policies see it in ``percept.targets``."""
        self._engine.senses(observers, observed)
        self.change()

    def adjust(
        self,
        group: Group,
        *,
        policy: Any = None,
        awareness: Awareness | str | None = None,
        sensing_range: npt.ArrayLike | None = None,
        awareness_range: npt.ArrayLike | None = None,
        speed: npt.ArrayLike | None = None,
        turn_limit: npt.ArrayLike | None = None,
    ) -> None:
        """Change what a group can do from the next step on; what is not given stays. A new policy remembers nothing.

        Parameters
        ----------
        group : Group
            Of this world.
        policy, awareness, sensing_range, awareness_range, speed, turn_limit
            As for `add`.

        Raises
        ------
        TypeError, ValueError
            As for `add`; then nothing is changed.
        """
        membership.adjust(
            self, group, policy=policy, awareness=awareness, sensing_range=sensing_range,
            awareness_range=awareness_range, speed=speed, turn_limit=turn_limit,
        )  # fmt: skip
        self.change()

    def step(self) -> None:
        """Make one step."""
        self._let_events_happen()
        self._make_step()

    def _make_step(self) -> None:
        self._engine.prepare()
        for group in self.groups:
            if membership.steps_by_itself(group):
                for agent in list(group.agents):
                    agent.step()
        self._engine.prepare()
        self._engine.step()
        self._after_step()

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
        end = self.tick + checks.count("steps", steps, least=0)
        reason = self._needs_python()
        if reason and end > self.tick and reason not in self._warned:
            self._warned.add(reason)
            warnings.warn(f"run() makes its steps one by one, because {reason}", stacklevel=2)
        while self.tick < end and self.running:
            if reason or compat.has_events(self):
                mesa_step: Callable[[], None] = self.step
                mesa_step()
                continue
            compat.count_steps(self, 1)
            self._let_events_happen()
            # An event may have brought in what needs Python, or said that this step is the last.
            reason = self._needs_python()
            if reason:
                self._make_step()
                continue
            quiet = max(self.clock.ticks_until_event(self.tick), 1) if self.running else 1
            self._run_stretch(int(min(end - self.tick, quiet, self._engine.longest_call)))

    def run_for(self, duration: int) -> None:
        """Make this many steps: mesa's other name for `run`."""
        self.run(duration)

    def run_until(self, end_time: int) -> None:
        """Make steps until this many have been made: mesa's name."""
        self.run(max(checks.count("end_time", end_time, least=0) - self.tick, 0))

    def _run_stretch(self, steps: int) -> None:
        self._engine.prepare()
        stretch = self._engine.stretch
        first, observed, largest = stretch.rows, stretch.observed_sum, self._history.max_neighbours
        try:
            self._engine.run(steps)
        except BaseException:
            self.running = False
            compat.count_steps(self, stretch.rows - first)
            raise
        # The first was counted before the events that preceded it.
        compat.count_steps(self, stretch.rows - first - 1)
        if isinstance(self._collector, HistoryCollector):
            earlier = self._history.earlier
            self._collector.collect_rows(Rows(stretch, first, stretch.rows, self.tick, observed, largest, *earlier))

    def _needs_python(self) -> str:
        """Say why steps cannot be made in a compiled call; empty when they can."""
        if type(self).step is not World.step:
            return f"{type(self).__name__} overrides step"
        if self.recorders:
            return "a recorder is a Python function"
        if self._collector is not None and type(self._collector) is not HistoryCollector:
            return "a DataCollector collects after every step"
        for group in self.groups:
            if membership.steps_by_itself(group):
                return f"an agent class of {group.name} overrides step"
            if group.decides_alone:
                return f"the agent class of {group.name} overrides decide"
            if not group.is_compiled:
                return f"the policy of {group.name} is Python"
        return ""

    def _after_step(self) -> None:
        for recorder in self.recorders:
            recorder(self)
        if self._collector is not None:
            self._collector.collect(self)

    def place(self, agent: Body, position: npt.ArrayLike) -> None:
        """Put an agent somewhere in the arena.

        Raises
        ------
        ValueError
            If `position` is not two finite numbers, or lies outside the arena.
        """
        group, row = agent.group, agent.row
        group.bodies.position[row] = membership.checked_positions(self.arena, position, (2,))
        self.refresh()

    def perceive(self, group: Group) -> None:
        """Bring ``group.percept`` up to date; steps do so by themselves."""
        self._engine.perceive(group)

    def refresh(self) -> None:
        """Say that something was moved by hand: sightings are found anew before they are read."""
        self._engine.is_seen = False

    def change(self) -> None:
        """Say that groups have changed: the world is put together anew before the next step."""
        self._engine.is_bound = False

    def policy_decision(self, group: Group) -> Action:
        """Return what a group's own policy decides at this tick."""
        return decisions.policy_decision(group, self.tick, self.key)

    @property
    def moment(self) -> tuple[int, int]:
        """What changes whenever anything may have moved."""
        return self.tick, self._engine.looks

    def observers_of(self, agent: Body) -> list[Any]:
        """Return the agents that have this one in sensing range."""
        self.look()
        return self._engine.observers_of(agent)

    def forget(self, group: Group, agent: Body) -> None:
        """Take an agent that has left mesa's sets out of its group's arrays."""
        membership.drop(group, agent)
        self.change()

    def close(self) -> None:
        """Let go of everything; mesa 3.3 would otherwise keep every model that was ever made."""
        self.running = False
        compat.release(self)
