"""State: all that changes in a run as one value, apart from the clock's pending events."""

from __future__ import annotations

import copy
from typing import TYPE_CHECKING, Any, NamedTuple

from teamsight.agents.collector import HistoryCollector
from teamsight.agents.history import History
from teamsight.agents.membership import make_bodies
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
        For each group its name, bodies, ranges, memory and the user's columns.
    history : History
        The steps so far.
    collected : HistoryCollector or None
        What the world's own data collector holds; a user's collector is not part of the state.
    """

    seed: int
    tick: int
    groups: tuple[tuple[str, Bodies, Any, Any, dict[str, Any]], ...]
    history: History
    collected: HistoryCollector | None


def take(world: World) -> State:
    """Return a copy of a world's state."""
    groups = tuple(
        (group.name, group.bodies, group.ranges, group.memory, group.columns) for group in world.groups
    )
    collector = world._collector if isinstance(world._collector, HistoryCollector) else None
    return copy.deepcopy(State(world.seed_used, world.tick, groups, world._history, collector))


def put(world: World, saved: State) -> None:
    """Bring a world to a saved state."""
    mine = [(group.name, len(group)) for group in world.groups]
    theirs = [(name, len(bodies)) for name, bodies, *_ in saved.groups]
    if mine != theirs:
        raise ValueError(f"restore(…): the state is of a world with {theirs}, this one has {mine}; make an equal one")
    saved = copy.deepcopy(saved)
    for group, (_, bodies, ranges, memory, columns) in zip(world.groups, saved.groups, strict=True):
        bodies.identity[:] = group.bodies.identity
        group.bodies, group.ranges, group.columns = bodies, ranges, columns
        group.begin()
        group.memory = memory
    if saved.collected is not None and isinstance(world._collector, HistoryCollector):
        world._collector = saved.collected
    _go_on(world, saved.seed, saved.tick, saved.history)


def begin_again(world: World, seed: int) -> None:
    """Place everybody again under this seed, at tick 0."""
    world.key = key_of(seed)
    for group in world.groups:
        identity = group.bodies.identity
        group.bodies, group.ranges = make_bodies(world, group.number, len(group), group.plan)
        group.bodies.identity[:] = identity
        group.begin()
    _go_on(world, seed, 0, History())


def _go_on(world: World, seed: int, tick: int, history: History) -> None:
    world.seed_used, world.key = seed, key_of(seed)
    world.tick = world.steps = tick
    if hasattr(world, "_advance_time"):
        world.time = float(tick)
    world.clock = Clock()
    world.clock.catch_up(tick)
    world.running = True
    world._history = history
    world._engine.forget()
