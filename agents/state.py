"""State: all that changes in a run as one value, apart from the clock's pending events."""

from __future__ import annotations

import copy
import random
from typing import TYPE_CHECKING, Any, NamedTuple, cast

import mesa
import numpy as np
import numpy.typing as npt

from teamsight import checks
from teamsight.agents import compat
from teamsight.agents.collector import HistoryCollector
from teamsight.agents.engine import Engine
from teamsight.agents.group import Group
from teamsight.agents.history import History
from teamsight.agents.membership import make_bodies
from teamsight.world.arena import Arena
from teamsight.world.bodies import Bodies
from teamsight.world.clock import Clock
from teamsight.world.noise import key_of

if TYPE_CHECKING:
    from teamsight.agents.model import World


class State(NamedTuple):
    """A world at one moment; it can be pickled.

    Attributes
    ----------
    seed, tick : int
        The seed and how many steps have been made.
    groups : tuple
        For each group its name, kind of policy, bodies, ranges, memory and the user's columns.
    history : History
        The steps so far.
    collected : HistoryCollector or None
        What the world's own data collector holds; a user's collector is not part of the state.
    """

    seed: int
    tick: int
    groups: tuple[tuple[str, str, Bodies, Any, Any, dict[str, Any]], ...]
    history: History
    collected: HistoryCollector | None


class Stateful:
    """What of a `World` has to do with saving it, going back, and beginning anew."""

    arena: Arena
    clock: Clock
    groups: list[Group]
    key: npt.NDArray[np.uint64]
    random: random.Random
    running: bool
    seed_used: int
    tick: int
    _collector: mesa.DataCollector | None
    _engine: Engine
    _history: History

    def state(self) -> State:
        """Return a copy of all that changes in a run; `restore` goes back to it. Pending events are not part of it."""
        groups = tuple(
            (group.name, type(group.policy).__name__, group.bodies, group.ranges, group.memory, group.columns)
            for group in self.groups
        )
        collector = self._collector if isinstance(self._collector, HistoryCollector) else None
        return copy.deepcopy(State(self.seed_used, self.tick, groups, self._history, collector))

    def restore(self, saved: State) -> None:
        """Go back to a saved state of this world, or of one that was made in the same way.

        Raises
        ------
        ValueError
            If the state belongs to a world with other groups or policies.
        """
        mine = [(group.name, type(group.policy).__name__, len(group)) for group in self.groups]
        theirs = [(name, policy, len(bodies)) for name, policy, bodies, *_ in saved.groups]
        if mine != theirs:
            raise ValueError(
                f"restore(…): the state is of a world with {theirs}, this one has {mine}; make one like that"
            )
        saved = copy.deepcopy(saved)
        for group, (_, _, bodies, ranges, memory, columns) in zip(self.groups, saved.groups, strict=True):
            bodies.identity[:] = group.bodies.identity
            group.bodies, group.ranges, group.columns = bodies, ranges, columns
            group.begin()
            group.memory = memory
        if saved.collected is not None and isinstance(self._collector, HistoryCollector):
            self._collector = saved.collected
        self._go_on(saved.seed, saved.tick, saved.history)

    def reset(self, rng: int | None = None) -> None:
        """Begin anew: everybody who is left is placed again, and the clock starts at 0 without events.

        The user's own columns stay as they are.

        Parameters
        ----------
        rng : int, optional
            The seed; by default the one in use.
        """
        seed = self.seed_used if rng is None else checks.seed(rng, None)
        self.key = key_of(seed)
        for group in self.groups:
            group.place_again(*make_bodies(cast("World", self), group.number, group.founders, group.plan))
        self.random.seed(seed)
        self._go_on(seed, 0, History())

    def _go_on(self, seed: int, tick: int, history: History) -> None:
        self.seed_used, self.key = seed, key_of(seed)
        self.tick = tick
        compat.set_counters(cast("World", self), tick)
        self.clock = Clock()
        self.clock.catch_up(tick)
        self.running = True
        self._history = history
        self._engine.forget()

    def __reduce_ex__(self, protocol: Any) -> Any:
        raise TypeError("a World holds a clock and compiled records, which cannot be copied; use state() and restore()")
