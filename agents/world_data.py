"""The data that the parts of a world share, and how a run begins in it."""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Iterator
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
import numpy.typing as npt

from teamsight.agents.events.sources import Sources
from teamsight.agents.group import Group
from teamsight.agents.recording.history import History
from teamsight.agents.resolve import columns_of_state, first_state_of_members
from teamsight.agents.sensing.sensor import Sensor
from teamsight.core import checks
from teamsight.core.contracts import is_own
from teamsight.world.clock import Clock
from teamsight.world.contact import BUMPS, Pass
from teamsight.world.interaction import InteractionState
from teamsight.world.interaction import first_state as start_of_interaction
from teamsight.world.limits import Limits
from teamsight.world.motion import is_watched
from teamsight.world.noise import key_of
from teamsight.world.placement import Founders, starts

if TYPE_CHECKING:
    from teamsight.agents.engine.interactions import PlacedInteraction
    from teamsight.agents.engine.records import Watcher
    from teamsight.world.arena import Arena
    from teamsight.world.contact import Contact
    from teamsight.world.placement import Starts


#: The cure for what cannot be done now.
LATER = "plan it with world.clock.at(world.clock.now, …)"
DECIDE, EVENT, CONDITION, OWN_STEP = "decide", "an event", "a condition", "an agent's own step"


class Timeline:
    """The time of a world.

    Attributes
    ----------
    clock : Clock
        The SimPy environment with the world's events.
    tick : int
        The number of completed steps.
    jumps : int
        The sum of the changes of `tick` by `reset` and `restore`.
    inside : str
        Which of the user's functions is being called; the world cannot be advanced meanwhile.
    events_end_steps : bool
        Whether the events of a tick happen at the end of the step that leads to it, as in mesa, and not before the
        next step.
    """

    def __init__(self) -> None:
        self.clock = Clock()
        self.tick = self.jumps = 0
        self.inside = ""
        self.events_end_steps = False

    @contextlib.contextmanager
    def calling(self, what: str) -> Iterator[None]:
        """Mark the time during which a function of the user's is called."""
        before, self.inside = self.inside, what
        try:
            yield
        finally:
            self.inside = before

    def check_outside(self, what: str) -> None:
        """Refuse to advance the world while a function of the user's is called."""
        if self.inside:
            cure = "call it between steps"
            if self.inside == EVENT:
                cure += "; a process lets the world go on by yield world.clock.timeout(1)"
            raise RuntimeError(f"{what}: called in {self.inside}, before a step is complete; {cure}")

    def check_undecided(self, what: str) -> None:
        """Refuse to change groups while they decide."""
        if self.inside == DECIDE:
            raise RuntimeError(f"{what}: called in {DECIDE}, before all agents have decided; {LATER}")

    def process_events(self) -> None:
        """Process all events that are due."""
        if self.clock.ticks_until_event(self.tick) <= 0:
            with self.calling(EVENT):
                self.clock.advance(self.tick)

    def set(self, tick: int) -> None:
        """Set the tick after completed steps."""
        self.tick = tick
        self.clock.set(tick)

    def jump(self, tick: int) -> None:
        """Set the tick and drop all pending events."""
        self.jumps += tick - self.tick
        self.tick = tick
        self.clock.begin(tick)


class AgentLeftError(RuntimeError):
    """Raised in a process that waits for something that cannot come, because an agent has left the world."""


class WorldData:
    """The arena, agents, time and history of a world. Its parts share this object, and do not refer to the world.

    Attributes
    ----------
    first_arena : Arena
        The arena in which runs begin; `arena` may have other obstacles meanwhile.
    arena_size : ndarray, shape (sizes,), float64
        The size of the arena, which kernels read.
    limits : Limits
        The limits of ranges and speeds in the arena.
    key : ndarray, shape (2,), uint64
        The key of the noise.
    moment : ndarray, shape (1,), int64
        The tick of the positions to which sensors are applied.
    time : ndarray, shape (1,), float64
        The same tick, for percepts.
    groups : list of Group
        The groups, in the order in which they were added.
    contact : Contact
        What happens when bodies that have a radius meet.
    timeline : Timeline
        The tick and the clock.
    sources : Sources
        The event sources and the event log.
    history : History
        The completed steps.
    is_open : bool
        Whether agents have come or left, so that the sizes of groups are recorded step by step.
    watchers : list of Watcher
        What the loop calls after each step; `Engine.watch` and `Engine.unwatch` change it.
    interactions : list of PlacedInteraction
        What happens between bodies after they have moved; `World.interact` adds to it.
    conditions : list of callable
        What is called before and after each step made one by one, and returns whether it has planned an event; see
        `Until.__call__`.
    """

    def __init__(self, arena: Arena, seed: int, contact: Contact) -> None:
        self.seed, self.contact, self.first_arena = seed, contact, arena
        self.put_arena(arena)
        self.key = key_of(seed)
        self.moment = np.zeros(1, np.int64)
        self.time = np.zeros(1)
        self.groups: list[Group] = []
        self.timeline = Timeline()
        self.sources = Sources(self.timeline)
        self.history = History()
        self.is_open = False
        self.watchers: list[Watcher] = []
        self.interactions: list[PlacedInteraction] = []
        self.conditions: list[Callable[[], bool]] = []
        # An `Until`, once it is used.
        self.until: Any = None

    def put_arena(self, arena: Arena) -> None:
        """Put this arena in place of the present one; bind again."""
        self.arena, self.limits = arena, Limits(arena)
        self.arena_size = np.array(arena.size, float)

    def begin(self, seed: int, tick: int, history: History) -> None:
        """Continue from another state: set the seed, the tick and the history, and drop all pending events."""
        self.seed, self.history = seed, history
        # In place, because the kernels read it.
        self.key[:] = key_of(seed)
        self.timeline.jump(tick)
        self.conditions.clear()
        for watcher in self.watchers:
            watcher.forget()
        for one in self.interactions:
            one.begin(self.key)
        self.time[0] = tick

    def check_group(self, group: Any, what: str) -> None:
        """Refuse what is no group of this world; `what`, with {} for the group, says in the error where it was given.

        Raises
        ------
        TypeError, ValueError
            If it is no group, or not of this world.
        """
        if not isinstance(group, Group):
            what = what.format(checks.shown(group))
            raise TypeError(f"{what}: give a group, not a list or an agent; world.add returns it")
        if group not in self.groups:
            what = what.format(checks.shown(group))
            raise ValueError(f"{what}: must be a group that was added to this world, as world.add returns it")

    @property
    def score_names(self) -> tuple[str, ...]:
        """The columns of the history that interactions and contacts write."""
        found = tuple(name for one in self.interactions for name in one.interaction.scores)
        # Points do not bump, so that worlds of all radii have the column.
        return found if isinstance(self.contact, Pass) else (*found, BUMPS)

    @property
    def solid(self) -> list[Group]:
        """The groups with bodies that meet others: those that have a radius, unless bodies pass through each other."""
        if isinstance(self.contact, Pass):
            return []
        return [group for group in self.groups if group.members.radius.any()]

    def start_of(self, keys: npt.NDArray[np.uint64]) -> Starts:
        """Return the initial positions and headings of all groups for each noise key; see `starts`.

        Of bodies that must not overlap, those who have left, or will leave at a reset, take no room.
        """
        solid, founders = self.solid, list[Founders]()
        if not solid:
            return starts(self.first_arena, [one for group in self.groups for one in group.founders], keys)
        for group in self.groups:
            gone = np.ones(len(group.members), np.bool_)
            gone[group.bodies.member] = False
            for source in self.sources.attached:
                gone[list(source.guests) if source.group is group else []] = True
            founders += [one.without(gone) for one in group.founders] if group in solid else group.founders
        return starts(self.first_arena, founders, keys)

    def first_states(self) -> FirstStates:
        """Return the states of all policies before their first decision, and of all interactions; see `first_state`."""
        return FirstStates(
            [
                first_state_of_members(group.rules[0], group.bodies.member, len(group.members))
                for group in self.groups
            ],
            [start_of_interaction(one.declared, one.sizes) for one in self.interactions],
        )

    @property
    def is_rewritable(self) -> bool:
        """Whether a new run can use the arrays, and the kernels' records of their addresses, as they are.

        The parameters of user-defined policies, degrees and arenas may have changed: a world with any is bound again.
        """
        if is_watched(self.arena) or is_own(self.contact) or not all(map(_is_shipped, self.groups)):
            return False
        return all(type(one.interaction).__module__.startswith("teamsight.") for one in self.interactions)

    def restart(self, start: Starts, run: int, states: FirstStates, *, is_kept: bool) -> None:
        """Put all groups back to the start of a run: one of `start`, with the `states` of `first_states`.

        If the arrays are kept, which needs a world that `is_rewritable`, they are written instead of replaced.
        """
        first = 0
        for group, state in zip(self.groups, states.policies, strict=True):
            last = first + len(group.members)
            group.restart(start.position[run, first:last], start.heading[run, first:last])
            first = last
            if is_kept:
                for name, values in zip(columns_of_state(0), state, strict=True):
                    group.bodies[name][:] = values
            else:
                group.set_state(0, state)
                group.begin()
        for one, begun in zip(self.interactions, states.interactions, strict=True):
            one.restart(begun, is_kept=is_kept)


class FirstStates(NamedTuple):
    """The states with which a run begins: of each group's policy, and of each interaction."""

    policies: list[Any]
    interactions: list[InteractionState]


def _is_shipped(group: Group) -> bool:
    awareness = group.rules[1]
    return (
        group.is_compiled
        and group.is_in_table(0)
        and all(type(policy).__module__.startswith("teamsight.policies.") for policy in group.policies)
        and type(awareness).__module__.startswith("teamsight.agents.awareness.")
        and not is_own(group.drive)
        and all(channel.sensor is None or type(channel.sensor) is Sensor for channel in group.channels.values())
    )
