"""Bodies: what there is of a group of agents in the world, one array for each property."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

Column = npt.NDArray[np.float64]


@dataclass
class Bodies:
    """The bodies of n agents.

    Attributes
    ----------
    identity : ndarray, shape (n,), int64
        Who: unique in its world, never reused.
    member : ndarray, shape (n,), int64
        Its number within its group, never reused: whose noise it draws.
    position : ndarray, shape (n, 2), float64
        Where [length].
    heading : ndarray, shape (n, 2), float64
        Which way each faces: unit vectors.
    moved : ndarray, shape (n, 2), float64
        The displacement of the last step [length].
    speed : ndarray, shape (n,), float64
        The largest distance a step [length].
    turn_cosine, turn_sine : ndarray, shape (n,), float64
        The turning limit, as `motion.turn_limit` gives it.
    arena_size : ndarray, shape (2,), float64
        The arena's two numbers.
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

    def __len__(self) -> int:
        return len(self.identity)

    def rows(self, which: npt.NDArray[Any]) -> Bodies:
        """Return new bodies: those of these rows, given by number or by mask."""
        own = {name: array for name, array in vars(self).items() if name != "arena_size"}
        columns = {name: np.ascontiguousarray(array[which]) for name, array in own.items()}
        return Bodies(**columns, arena_size=self.arena_size)
