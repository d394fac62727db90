"""State: all that changes in a run as one value, apart from the clock's pending events."""

from __future__ import annotations

import copy
import random
from typing import TYPE_CHECKING, Any, NamedTuple, cast

import mesa
import numpy as np
import numpy.typing as npt

from teamsight.agents import mesa_compat
from teamsight.agents.engine.begin import first_states, restart_groups, start_of
from teamsight.agents.engine.engine import Engine
from teamsight.agents.engine.state_rows import layout
from teamsight.agents.group import Group
from teamsight.agents.recording.collector import HistoryCollector
from teamsight.agents.recording.history import History
from teamsight.core import checks
from teamsight.core.interrupts import deferred
from teamsight.world.arena import Arena
from teamsight.world.bodies import Bodies
from teamsight.world.clock import Clock
from teamsight.world.noise import key_of
from teamsight.world.starts import Starts

if TYPE_CHECKING:
    from teamsight.agents.model import World


class GroupState(NamedTuple):
    """What changes of a group in a run: its bodies, ranges, memory and the user's columns; and what tells it apart."""

    name: str
    policy: str
    awareness: str
    bodies: Bodies
    ranges: Any
    memory: Any
    columns: dict[str, npt.NDArray[Any]]


class State(NamedTuple):
    """A world at one moment; it can be pickled.

    Attributes
    ----------
    seed, tick : int
        The seed and how many steps have been made.
    arena : tuple
        What tells the arena apart.
    groups : tuple of GroupState
        One for each group.
    history : History
        The steps so far.
    collected : HistoryCollector or None
        What the world's own data collector holds; a user's collector is not part of the state.
    """

    seed: int
    tick: int
    arena: tuple[Any, ...]
    groups: tuple[GroupState, ...]
    history: History
    collected: HistoryCollector | None


class Stateful:
    """What of a `World` has to do with saving it, going back, and beginning anew."""

    clock: Clock
    groups: list[Group]
    key: npt.NDArray[np.uint64]
    random: random.Random
    running: bool
    _tick: int
    _jumps: int
    _seed_used: int
    _collector: mesa.DataCollector
    _engine: Engine
    _history: History

    def state(self) -> State:
        """Return a copy of all that changes in a run; `restore` goes back to it. Pending events are not part of it."""
        groups = tuple(
            GroupState(
                *_described_group(group), group.bodies, group.ranges, group.memory, group.columns.arrays()
            )
            for group in self.groups
        )  # fmt: skip
        collector = self._collector if isinstance(self._collector, HistoryCollector) else None
        arena = _described(cast("World", self).arena)
        return copy.deepcopy(State(self._seed_used, self._tick, arena, groups, self._history, collector))

    def restore(self, saved: State) -> None:
        """Go back to a saved state of this world, or of one that was made in the same way.

        Columns that were added since the state was saved stay as they are.

        Raises
        ------
        TypeError
            If it is no state.
        ValueError
            If the state belongs to a world with another arena, other groups or other policies. Nothing has changed
            then.
        """
        cast("World", self)._check_undecided("restore()", "plan it with world.at(world.now, …)")
        if not isinstance(saved, State):
            raise TypeError(f"restore({type(saved).__name__}): must be what state() returned")
        arena = cast("World", self).arena
        if saved.arena != _described(arena):
            raise ValueError(
                f"restore(…): the state is of a world in {_named(saved.arena)}, this one is {arena}; make one "
                "like that"
            )
        mine = [(*_described_group(group), len(group)) for group in self.groups]
        theirs = [(old.name, old.policy, old.awareness, len(old.bodies)) for old in saved.groups]
        if mine != theirs:
            differing = _difference(theirs, mine)
            raise ValueError(f"restore(…): the state is of a world with {differing}; make one like that")
        for group, old in zip(self.groups, saved.groups, strict=True):
            if group.is_compiled and layout(old.memory) != layout(group.memory):
                raise ValueError(
                    f"restore(…): {group.name} remembered {layout(old.memory)}, and here {layout(group.memory)}; make "
                    "a world whose policies have the same constants"
                )
        saved = copy.deepcopy(saved)
        with deferred():
            for group, old in zip(self.groups, saved.groups, strict=True):
                old.bodies.identity[:] = group.bodies.identity
                group.bodies, group.ranges = old.bodies, old.ranges
                group.columns.replace(old.columns)
                group.begin(old.memory)
            if saved.collected is not None and isinstance(self._collector, HistoryCollector):
                self._collector = saved.collected
            self._go_on(saved.seed, saved.tick, saved.history)

    def reset(self, rng: int | None = None) -> None:
        """Begin anew: everybody who is left is placed again, and the clock starts at 0 without events.

        Abilities are again those with which the groups were added; policies and degrees of awareness stay those of now,
        and so do the user's own columns.

        Parameters
        ----------
        rng : int, optional
            The seed; by default the one in use.
        """
        cast("World", self)._check_undecided("reset()", "plan it with world.at(world.now, world.reset)")
        seed = self._seed_used if rng is None else checks.seed(rng, None)
        collector = _emptied(self._collector)
        world = cast("World", self)
        # All that can fail comes first, before anything changes.
        start, states = start_of(world, key_of(seed)[np.newaxis]), first_states(world)
        with deferred():
            self._begin(seed, start, 0, states)
            self._collector = collector
        if not isinstance(collector, HistoryCollector):
            collector.collect(self)

    def _begin(self, seed: int, start: Starts, run: int, states: list[Any]) -> None:
        """Begin a run: place everybody again and set the clock to 0, without events."""
        is_kept = restart_groups(cast("World", self), start, run, states)
        self.random.seed(seed)
        self._go_on(seed, 0, History(), is_kept=is_kept)

    def _go_on(self, seed: int, tick: int, history: History, *, is_kept: bool = False) -> None:
        self._seed_used = seed
        # In place: the kernels read it.
        self.key[:] = key_of(seed)
        self._jumps += tick - self._tick
        self._tick = tick
        mesa_compat.set_counters(cast("World", self), tick)
        self.clock.begin(tick)
        self.running = True
        self._history = history
        self._engine.forget(is_kept=is_kept)

    def __reduce_ex__(self, protocol: Any) -> Any:
        raise TypeError("a World holds a clock and compiled records, which cannot be copied; use state() and restore()")


def _emptied(collector: mesa.DataCollector) -> mesa.DataCollector:
    """Return a collector that reports the same and has collected nothing."""
    if isinstance(collector, HistoryCollector):
        return HistoryCollector()
    names = ("model_reporters", "agent_reporters", "agenttype_reporters")
    return type(collector)(**{name: getattr(collector, name) for name in names})


def _described_group(group: Group) -> tuple[str, str, str]:
    """Return what tells a group from others: its name, policy and degree of awareness, with their constants."""
    policy = repr(group.policy)
    # What says only where it lies in memory would differ from itself once it was saved.
    return group.name, type(group.policy).__name__ if " at 0x" in policy else policy, repr(group.awareness)


def _difference(theirs: list[Any], mine: list[Any]) -> str:
    """Return the first difference between the groups of two worlds."""
    if len(theirs) != len(mine):
        return f"{len(theirs)} groups, and here are {len(mine)}"
    one, other = next((one, other) for one, other in zip(theirs, mine, strict=True) if one != other)
    # Of two policies of one kind, the constants that differ.
    parts = [", ".join(map(str, group)).replace("(", ", ").replace(")", "").split(", ") for group in (one, other)]
    first, second = (", ".join(part for part in a if part and part not in b)[:120] for a, b in (parts, parts[::-1]))
    return f"{one[0]} that have {first}, and {other[0]} have {second} here"


def _described(arena: Arena) -> tuple[Any, ...]:
    """Return what tells an arena from others: equal for equal ones, also when one of them was saved in a file."""
    box = tuple(np.ravel(arena.bounds).tolist())
    return (type(arena).__qualname__, tuple(arena.size), tuple(arena.period), box)


def _named(arena: tuple[Any, ...]) -> str:
    name, size, *_ = arena
    return f"{name} of size {', '.join(f'{side:g}' for side in size)}"
