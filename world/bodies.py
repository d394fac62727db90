"""Bodies: the state and the abilities of a group of agents, one array for each property."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

Column = npt.NDArray[np.float64]


class Abilities(NamedTuple):
    """What each of n agents can do; see `Bodies` for the first three.

    Attributes
    ----------
    speed, turn_cosine, turn_sine : ndarray, shape (n,), float64
        The largest distance [length] and the turning limit of a step.
    sensing_range, awareness_range : ndarray, shape (n,), float64
        Distances within which each senses targets and teammates [length].
    """

    speed: Column
    turn_cosine: Column
    turn_sine: Column
    sensing_range: Column
    awareness_range: Column

    def cut(self, size: int) -> Abilities:
        """Return those of the first agents."""
        return Abilities(*(array[:size].copy() for array in self))

    def followed_by(self, other: Abilities) -> Abilities:
        """Return those of these agents, then those of others."""
        return Abilities(*(np.concatenate(pair) for pair in zip(self, other, strict=True)))


@dataclass
class Bodies:
    """The bodies of n agents.

    Attributes
    ----------
    identity : ndarray, shape (n,), int64
        Unique in the world, never reused.
    member : ndarray, shape (n,), int64
        The agent's number within its group, never reused. It selects the agent's noise.
    position : ndarray, shape (n, 2), float64
        Positions [length].
    heading : ndarray, shape (n, 2), float64
        Unit vectors.
    moved : ndarray, shape (n, 2), float64
        The displacement of the last step [length].
    speed : ndarray, shape (n,), float64
        The largest distance of a step [length].
    turn_cosine, turn_sine : ndarray, shape (n,), float64
        The turning limit; see `motion.turn_limit`.
    arena_size : ndarray, shape (sizes,), float64
        The arena's `size`, for `confine`.
    active : ndarray, shape (n,), bool
        Whether it takes part: else it neither moves nor decides, senses nobody and is sensed by nobody.
    reward : ndarray, shape (n,), float64
        The sum of what interactions have given it since its last decision.
    ended : ndarray, shape (n,), bool
        Whether one has ended a trial for it since then.
    """

    identity: npt.NDArray[np.int64]
    member: npt.NDArray[np.int64]
    position: Column
    heading: Column
    moved: Column
    speed: Column
    turn_cosine: Column
    turn_sine: Column
    arena_size: Column
    active: npt.NDArray[np.bool_]
    reward: Column = field(default_factory=lambda: np.zeros(0))
    ended: npt.NDArray[np.bool_] = field(default_factory=lambda: np.zeros(0, np.bool_))

    def __post_init__(self) -> None:
        if len(self.reward) != len(self.identity):
            self.reward, self.ended = np.zeros(len(self.identity)), np.zeros(len(self.identity), np.bool_)

    def __len__(self) -> int:
        return len(self.identity)

    def rows(self, which: npt.NDArray[Any]) -> Bodies:
        """Return a copy of some rows, selected by index or by mask."""
        own = {name: array for name, array in vars(self).items() if name != "arena_size"}
        columns = {name: np.ascontiguousarray(array[which]) for name, array in own.items()}
        return Bodies(**columns, arena_size=self.arena_size)

    def followed_by(self, other: Bodies) -> Bodies:
        """Return a copy of these bodies, then of others in the same arena."""
        both = {
            name: np.concatenate([array, getattr(other, name)]) for name, array in vars(self).items()
            if name != "arena_size"
        }  # fmt: skip
        return Bodies(**both, arena_size=self.arena_size)
