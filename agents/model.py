"""The world: a mesa model in which groups of agents perceive, decide and move."""

from __future__ import annotations

import random
from collections.abc import Callable, Mapping
from typing import Any

import mesa
import numpy as np
import numpy.typing as npt

from teamsight.agents import building, mesa_compat
from teamsight.agents.awareness import Awareness
from teamsight.agents.body import Body
from teamsight.agents.engine import present, python_policies
from teamsight.agents.engine.engine import Engine
from teamsight.agents.group import Group
from teamsight.agents.live_setting import SettingOfGroups
from teamsight.agents.readings import Readings
from teamsight.agents.recording.collector import HistoryCollector
from teamsight.agents.recording.history import History
from teamsight.agents.resolve import policy_of
from teamsight.agents.state import Stateful
from teamsight.agents.stepping import Stepping
from teamsight.core import checks
from teamsight.core.interrupts import deferred
from teamsight.policies.interface import PerceptOfOne
from teamsight.world.arena import Arena
from teamsight.world.clock import Clock
from teamsight.world.limits import Limits
from teamsight.world.noise import key_of


class World(Readings, Stepping, Stateful, mesa.Model):  # type: ignore[misc]
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

    An operation that fails changes nothing.
    """

    def __init__(self, arena: Arena, *, rng: int | None = None, seed: int | None = None) -> None:
        if not isinstance(arena, Arena):
            shown = checks.shown(arena)
            raise TypeError(f"arena={shown}: must be an arena, such as Disc(5.0), Box(10, 8) or Torus(10, 8)")
        self._arena = arena
        if "limits" not in vars(self):
            self.limits = Limits(arena)
        self._seed_used = checks.seed(rng, seed)
        self._tick = 0
        super().__init__(rng=self._seed_used)
        self.random = random.Random(self._seed_used)
        self.agents.random = self.random
        mesa_compat.take_over_step(self)
        self.clock = Clock()
        self.key = key_of(self._seed_used)
        self.groups: list[Group] = []
        self.recorders: list[Callable[[World], Any]] = []
        self._history = History()
        self._engine = Engine(self)
        self._collector: mesa.DataCollector = HistoryCollector()
        self._warned: set[str] = set()

    policy = SettingOfGroups()
    awareness = SettingOfGroups()
    speed = SettingOfGroups()
    turn_limit = SettingOfGroups()
    sensing_range = SettingOfGroups()
    awareness_range = SettingOfGroups()

    def __init_subclass__(cls, **named: Any) -> None:
        super().__init_subclass__(**named)
        cls.__signature__ = mesa_compat.signature_for_batches(cls)  # type: ignore[attr-defined]

    @property
    def arena(self) -> Arena:
        """Where everything happens; it cannot be changed, for everybody was placed in it."""
        return self._arena

    @property
    def seed_used(self) -> int:
        """The seed; `reset` takes another."""
        return self._seed_used

    def add(
        self,
        agent_class: type[Body],
        count: int,
        *,
        policy: Any,
        policy_options: Mapping[str, Any] | None = None,
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
        policy_options : mapping of str to object, optional
            The options of a policy given by name: the parameters of its class.
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
        group = building.make_group(
            self, agent_class, count,
            building.Plan(
                policy_of(policy, policy_options), awareness, sensing_range, awareness_range, speed, turn_limit,
                placement, name,
            ),
        )  # fmt: skip
        building.populate(self, group, agent_class)
        return group

    def senses(self, observers: Group, observed: Group) -> None:
        """Let one group sense another, within the observers' sensing range; policies see it in ``percept.targets``.

        Parameters
        ----------
        observers, observed : Group
            Both of this world.

        Raises
        ------
        ValueError
            If a group is not of this world.
        """
        self._engine.senses(observers, observed)

    def adjust(
        self,
        group: Group,
        *,
        policy: Any = None,
        policy_options: Mapping[str, Any] | None = None,
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
        policy, policy_options, awareness, sensing_range, awareness_range, speed, turn_limit
            As for `add`.

        Raises
        ------
        TypeError, ValueError
            As for `add`; then nothing is changed.
        """
        self._check_undecided("adjust()", "plan it with world.at(world.now, …)")
        if group not in self.groups:
            raise ValueError(f"adjust({checks.shown(group)}): the group must have been added to this world")
        building.adjust(
            self, group, policy=policy, policy_options=policy_options, awareness=awareness, sensing_range=sensing_range,
            awareness_range=awareness_range, speed=speed, turn_limit=turn_limit,
        )  # fmt: skip

    def adjust_one(self, agent: Body, name: str, value: float) -> None:
        """Change what one agent can do; setting its attribute calls this.

        Parameters
        ----------
        agent : Body
            Who.
        name : {"speed", "turn_limit", "sensing_range", "awareness_range"}
            What.
        value : float
            As for `add`.

        Raises
        ------
        TypeError, ValueError
            As for `add`; then nothing is changed.
        """
        building.adjust_one(self, agent, name, value)

    def place(self, agent: Body, position: npt.ArrayLike) -> None:
        """Put an agent somewhere in the arena.

        Raises
        ------
        ValueError
            If `position` is not two finite numbers, or lies outside the arena.
        """
        group, row = agent.group, agent.row
        place = building.checked_positions(self.arena, position, (2,))
        with deferred():
            group.bodies.position[row] = place
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

    def policy_decision(
        self, agent: Body, percept: PerceptOfOne, rng: np.random.Generator
    ) -> tuple[float, float]:
        """Return (turn [rad], distance [length]) that the policy of an agent's group decides on a percept.

        Parameters
        ----------
        agent : Body
            Who asks.
        percept : PerceptOfOne
            What it knows; it may differ from what it perceives.
        rng : numpy.random.Generator
            Its random numbers, for policies that are callables.
        """
        return python_policies.policy_decision(agent, percept, rng, self.tick, self.key)

    @property
    def moment(self) -> tuple[int, int]:
        """What changes whenever anything may have moved."""
        return self.tick, self._engine.looks

    def observers_of(self, agent: Body) -> list[Any]:
        """Return the agents that have this one in sensing range."""
        self.look()
        return present.observers_of(self._engine.relations, agent)

    def forget(self, agent: Body, leave: Callable[[], None]) -> None:
        """Take an agent out of its group's arrays; `leave` takes it out of mesa's sets."""
        self._check_undecided("remove()", "plan it with world.at(world.now, robot.remove)")
        building.drop(agent.group, agent, leave)
        self.change()

    def leave_out(self, group: Group) -> None:
        """Forget what was said of a group that could not be added."""
        self._engine.leave_out(group)

    def close(self) -> None:
        """Let go of everything; mesa 3.3 would otherwise keep every model that was ever made."""
        self.running = False
        mesa_compat.release(self)
