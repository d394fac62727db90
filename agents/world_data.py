"""The data that the parts of a world share."""

from __future__ import annotations

from teamsight.agents.group import Group
from teamsight.agents.recording.history import History
from teamsight.agents.timeline import Timeline
from teamsight.world.arena import Arena
from teamsight.world.limits import Limits
from teamsight.world.noise import key_of


class WorldData:
    """The arena, agents, time and history of a world. Its parts share this object, and do not refer to the world.

    Parameters
    ----------
    arena : Arena
        The arena.
    seed : int
        The seed.

    Attributes
    ----------
    limits : Limits
        The limits of ranges and speeds in the arena.
    key : ndarray, shape (2,), uint64
        The key of the noise.
    groups : list of Group
        The groups, in the order in which they were added.
    timeline : Timeline
        The tick and the clock.
    history : History
        The completed steps.
    """

    def __init__(self, arena: Arena, seed: int) -> None:
        self.arena, self.seed = arena, seed
        self.limits = Limits(arena)
        self.key = key_of(seed)
        self.groups: list[Group] = []
        self.timeline = Timeline()
        self.history = History()

    def begin(self, seed: int, tick: int, history: History) -> None:
        """Continue from another state: set the seed, the tick and the history, and drop all pending events."""
        self.seed, self.history = seed, history
        # In place, because the kernels read it.
        self.key[:] = key_of(seed)
        self.timeline.jump(tick)
