"""The world: a mesa model in which groups of agents perceive, decide and move."""

from __future__ import annotations

import math
import random
from collections.abc import Mapping
from functools import cached_property
from inspect import Parameter
from types import EllipsisType
from typing import TYPE_CHECKING, Any, TypeVar

from teamsight.agents import mesa_compat
from teamsight.agents.body import Body
from teamsight.agents.building import MOST_AGENTS, OWN_OF_WORLD, Places, Plan, check_class, divided, team_given
from teamsight.agents.condition_of_one import note_of_inactive
from teamsight.agents.decisions.cycle import EVERY_STEP, CycleLike, cycle_of
from teamsight.agents.engine.engine import Engine
from teamsight.agents.given import AwarenessLike, Numbers, PlacementName, Points, PolicyLike, RangeShape, SeedLike
from teamsight.agents.group import Group
from teamsight.agents.host import WorldHost, declare
from teamsight.agents.live_setting import SettingOfGroups
from teamsight.agents.recording.recording import Recording
from teamsight.agents.resolve import awareness_of, policy_or_none
from teamsight.agents.run_methods import RunMethods
from teamsight.agents.sensing.sensor import Sensor
from teamsight.agents.state import StateKeeper
from teamsight.agents.stepping import Stepper
from teamsight.agents.world_data import WorldData
from teamsight.core import checks
from teamsight.core.card import shown
from teamsight.world.arena import Arena
from teamsight.world.clock import Clock
from teamsight.world.interaction import Interaction
from teamsight.world.proximity.shapes import shape_given

A = TypeVar("A", bound=Body)
Rule = TypeVar("Rule", bound=Interaction)
_NONE: Any = Parameter.empty
if TYPE_CHECKING:
    from teamsight.agents.space import WorldSpace


class World(RunMethods):
    """A mesa model of groups of agents in an arena.

    Parameters
    ----------
    arena : Arena
        The arena: `Disc`, `Box`, `Torus`, or a class of your own.
    rng : int, array_like of int, SeedSequence, BitGenerator or Generator, optional
        The seed; see `seed_used`. By default a new one is drawn, and from anything but a whole number, as
        ``numpy.random.default_rng(rng).integers(2**53)``: a generator goes on by that, so the next world differs.
    seed : int or as `rng`, optional
        Another name for `rng`.

    Attributes
    ----------
    clock : Clock
        The SimPy environment of the world, in ticks: events and processes.
    recording : Recording
        The history, and the positions and transitions that were recorded.
    running : bool
        Set it to False to stop `run`.

    Raises
    ------
    TypeError, ValueError
        If `arena` is missing or not an arena, a seed is negative or of another type, or `rng` and `seed` differ.

    Notes
    -----
    One step is: process due events → perceive → decide → move → interact → find neighbours → record. `step` makes one
    step, `run` makes many, with the same kernels in the same order and the same result to the last bit.

    An operation that fails changes nothing.
    """

    clock: Clock

    # Without a default for the arena, Python's own error would come first, which names no cure. With this one the
    # signature says that it has none.
    def __init__(self, arena: Arena = _NONE, *, rng: SeedLike = None, seed: SeedLike = None) -> None:
        if arena is _NONE:
            made = "World" if type(self) is World else "super().__init__"
            raise TypeError(f"{type(self).__name__}: has no arena; give it one, as in {made}(Box(10, 10), rng=rng)")
        if not isinstance(arena, Arena):
            shown = checks.shown(arena)
            raise TypeError(f"arena={shown}: must be an arena, such as Disc(5.0), Box(10, 8) or Torus(10, 8)")
        self._data = data = WorldData(arena, checks.seed(rng, seed))
        super().__init__(rng=data.seed)
        self.random = random.Random(data.seed)
        self.agents.random = self.random
        mesa_compat.take_over_step(self)
        self.clock = data.timeline.clock
        self._engine = Engine(data)
        self.recording = Recording(data, self._engine)
        self._host = WorldHost(self, data, self._engine)
        self._stepper = Stepper(self, data, self._engine, self.recording, type(self).step is not World.step)
        self._states = StateKeeper(self, data, self._engine, self.recording)

    rng = mesa_compat.LazyGenerator()
    policy = SettingOfGroups()
    awareness = SettingOfGroups()
    speed = SettingOfGroups()
    turn_limit = SettingOfGroups()
    cycle = SettingOfGroups()
    sensing_range = SettingOfGroups()
    awareness_range = SettingOfGroups()

    def __init_subclass__(cls, **named: Any) -> None:
        super().__init_subclass__(**named)
        cls.__signature__ = mesa_compat.signature_for_batches(cls)  # type: ignore[attr-defined]

    @cached_property
    def space(self) -> WorldSpace:
        """The agents' places under the names of mesa's spaces; mesa's visualisation reads it. You may set your own."""
        return self._host.space

    def add(
        self,
        agent_class: type[A],
        count: int,
        *,
        policy: PolicyLike | None = None,
        policy_options: Mapping[str, Any] | None = None,
        awareness: AwarenessLike = "none",
        team: str | EllipsisType | None = ...,
        sensing_range: Numbers = 1.0,
        awareness_range: Numbers = 1.0,
        range_shape: RangeShape = "disc",
        speed: Numbers = 0.1,
        turn_limit: Numbers | None = None,
        placement: PlacementName | Points = "uniform",
        position: Points | None = None,
        heading: Points | None = None,
        cycle: CycleLike = EVERY_STEP,
        name: str | None = None,
        **arguments: Any,
    ) -> Group[A]:
        """Add a group of agents.

        Parameters
        ----------
        agent_class : type
            `Robot`, `Target`, `Body`, or a subclass.
        count : int
            The number of agents, at least 1. More can join later; see `Group.add`.
        policy : Policy, callable or str, optional
            The policy of all agents: an object, a callable for one robot ``f(percept, rng) -> (turn, distance)``, or
            the name of a policy. It may be left out if the class overrides `Body.decide`.
        policy_options : mapping of str to object, optional
            The options of a policy given by name: the parameters of its class.
        awareness : Awareness or str
            What they perceive of teammates: an object or a name.
        team : str or None, optional
            The name of their team; agents of groups of one team are teammates. None for no team. By default that of the
            class: "robots" for `Robot`, None for others.
        sensing_range, awareness_range : float or array_like, shape (count,)
            Distances within which they sense targets and teammates [length].
        range_shape : {"disc", "square"}
            The shape of all their ranges. In a square range is whatever is at most the range away along either axis of
            the arena; offsets and distances are Euclidean even so.
        speed : float or array_like, shape (count,)
            The largest distance they can move in a step [length].
        turn_limit : float or array_like, shape (count,), optional
            The largest angle they can turn in a step [rad], at most 2π; unlimited by default, and from π on.
        placement : {"uniform", "spread", "cells"}
            The rule for the initial positions: uniform over the area; spread so that sensing discs do not overlap; or
            at the centres of random cells of side 1.
        position : array_like, shape (count, 2) or (2,), optional
            The initial positions, or one for all [length].
        heading : array_like, shape (count, 2) or (2,), optional
            The initial directions, or one for all; they are normalised. By default they are drawn.
        cycle : Cycle or float
            When they sense and decide; a number is a period [ticks]. By default at every step.
        name : str, optional
            The group's name; by default the class's, in lower case and plural.
        **arguments
            Passed on to the ``__init__`` of the class. As with mesa's ``create_agents``, a list, tuple or array of
            `count` values gives one to each agent, and any other value is for all.

        Raises
        ------
        TypeError, ValueError
            If a value is of the wrong type, shape or size, the policy does not fit the degree of awareness, or the
            class does not take an argument. Nothing is changed then.
        """
        check_class(agent_class)
        size = checks.count("count", count, most=MOST_AGENTS)
        each = divided(agent_class, size, arguments, OWN_OF_WORLD).each
        decides_alone = agent_class.decide is not Body.decide
        plan = Plan(
            policy_or_none(policy, policy_options, agent_class.__name__, decides_alone), awareness_of(awareness),
            team_given(team, agent_class), name, Places(placement, position, heading),
            speed, math.pi if turn_limit is None else turn_limit, sensing_range, awareness_range, cycle_of(cycle),
            shape_given(range_shape),
        )  # fmt: skip
        return self._host.add(agent_class, size, plan, each)

    def senses(
        self,
        observers: Group,
        observed: Group,
        *,
        as_: str = "targets",
        sensor: Sensor | None = None,
        counts: bool | None = None,
    ) -> None:
        """Let one group sense another.

        Parameters
        ----------
        observers, observed : Group
            Groups of this world.
        as_ : str
            The channel, under which policies see them: ``percept.targets`` by default, and otherwise
            ``percept.channels.NAME``. Several groups can be sensed in one channel.
        sensor : Sensor, optional
            The sensor of the channel. By default all within the observers' sensing range are sensed, unless an obstacle
            or a wall blocks the line of sight. See also `Group.sensors`.
        counts : bool, optional
            Whether what is sensed counts in `observed_fraction`; by default that of the channel "targets" of groups on
            a team.

        Raises
        ------
        TypeError, ValueError
            If a group is of another world, the name cannot be an attribute, or the sensor or `counts` differ from those
            of the same channel.
        """
        declare(self._data, self._engine, (observers, observed), as_, sensor, counts)

    def interact(self, interaction: Rule, /, **groups: Group) -> Rule:
        """Let something happen between the bodies of some groups, in each step after all have moved.

        Parameters
        ----------
        interaction : Interaction
            What happens, such as a capture.
        **groups : Group
            The group of each role.

        Returns
        -------
        Interaction
            The same object, for `adjust`.

        Raises
        ------
        TypeError, ValueError
            If a role has no group, a group two roles, or a score the name of another. Nothing is changed then.
        """
        from teamsight.agents.interactions import interact

        interact(self._data, self._engine, interaction, groups)
        return interaction

    def __repr__(self) -> str:
        data = vars(self).get("_data")
        if data is None:
            return f"<{type(self).__name__}, not built>"
        groups = "".join(f", {len(one):,} {one.name}{note_of_inactive(one.bodies.active)}" for one in data.groups)
        return f"<{type(self).__name__}: tick {data.timeline.tick:,}, seed {data.seed}, {data.arena}{groups}>"

    def _repr_html_(self) -> str | None:
        from teamsight.agents.world_card import world_html

        return shown(lambda: world_html(type(self).__name__, self._data, self._engine))

    def __reduce_ex__(self, protocol: Any) -> Any:
        raise TypeError("a World holds a clock and compiled records, which cannot be copied; use state() and restore()")
