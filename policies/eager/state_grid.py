"""The state grid: discretises situations for a table."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from teamsight.core import checks
from teamsight.core.kernel import inlined

#: Largest number of states of a table: with 16 actions, 64 MiB.
MOST_STATES = 1_000_000


class TooManyStatesError(ValueError):
    """Raised when a table would need more than `MOST_STATES` states."""


@dataclass(frozen=True)
class StateGrid:
    """A discretisation of situations: neighbouring sectors are merged, and readings become levels.

    Parameters
    ----------
    own, added : int
        Number of components that show targets, and of those that the degree of awareness adds.
    rings : sequence of int, optional
        Numbers of sectors of the rings with which the added components begin; see ``Awareness.rings``. Components that
        belong to no ring are kept as they are.
    sectors : int, default 4
        Sectors per ring after merging. A merged sector has the smallest reading of its parts.
    levels : int, default 3
        p, the levels of one sensor: the last is "nothing sensed", the others divide the range.

    Raises
    ------
    TypeError, ValueError
        If a number is too small, or sectors cannot be merged evenly.
    TooManyStatesError
        If there are more than `MOST_STATES` states.

    Notes
    -----
    *Source:* §3, search space size = p^d; here d is `dimensions`.
    """

    own: int
    added: int
    rings: Sequence[int] = ()
    sectors: int = 4
    levels: int = 3

    def __post_init__(self) -> None:
        checks.count("sectors", self.sectors)
        checks.count("levels", self.levels, least=2, cure="one for a sensed body, one for none")
        rings = self.rings
        if not isinstance(rings, Sequence) or sum(checks.count("rings", ring) for ring in rings) > self.added:
            raise ValueError(f"rings={checks.shown(rings)}: must be numbers of sectors, in all at most {self.added}")
        object.__setattr__(self, "rings", tuple(rings))
        for ring in (self.own, *rings):
            if ring % self.sectors:
                even = math.gcd(self.own, *rings)
                whose = "targets" if ring == self.own else "a ring that the degree of awareness adds"
                cure = f"give {even} or a divisor of it" if even > 1 else "give 1"
                raise ValueError(f"sectors={self.sectors}: must divide the {ring} sectors of {whose} evenly; {cure}")
        if self.levels**self.dimensions > MOST_STATES:
            raise TooManyStatesError(
                f"a table of {self.levels}^{self.dimensions} states ({self.levels} readings of {self.dimensions} "
                f"sensors): must have at most {MOST_STATES:,}; merge into fewer sectors or levels, use a degree that "
                "adds fewer inputs, or a learner without a table: LinearQ or LazyQ"
            )

    @property
    def dimensions(self) -> int:
        """d, the number of sensors."""
        return int(self.dimension.max()) + 1

    @property
    def dimension(self) -> npt.NDArray[np.int64]:
        """The sensor that each component of a situation belongs to, shape (own + added,)."""
        rings = (self.own, *self.rings)
        found = [
            # The first merged sector is centred on straight ahead.
            (np.arange(ring) + ring // self.sectors // 2) % ring * self.sectors // ring + number * self.sectors
            for number, ring in enumerate(rings)
        ]
        rest = self.own + self.added - sum(rings)
        return np.concatenate([*found, len(rings) * self.sectors + np.arange(rest)]).astype(np.int64)

    def __len__(self) -> int:
        """Return p^d."""
        return int(self.levels**self.dimensions)

    def index(self, situation: npt.NDArray[Any]) -> npt.NDArray[np.int64]:
        """Return the state of each situation, shape (transitions,).

        Parameters
        ----------
        situation : ndarray, shape (transitions, own + added), float32
            Readings as shares of their range, 1 where nothing is sensed; clipped to [0, 1].
        """
        dimension, state = self.dimension, np.zeros(len(situation), np.int64)
        for number in range(self.dimensions):
            nearest = situation[:, dimension == number].min(axis=1).clip(0, 1)
            level = np.minimum((nearest * np.float32(self.levels - 1)).astype(np.int64), self.levels - 1)
            state = state * self.levels + level
        return state


@inlined
def state_of(situation: Any, levels: int, dimensions: int, dimension: Any, first: int) -> int:
    """Return the state of one situation; ``dimension[first:]`` is the sensor of each component."""
    state = 0
    for number in range(dimensions):
        nearest = np.float32(1.0)
        for component in range(situation.shape[0]):
            if dimension[first + component] == number and situation[component] < nearest:
                nearest = situation[component]
        reading = max(nearest, np.float32(0.0))
        state = state * levels + min(int(reading * np.float32(levels - 1)), levels - 1)
    return state
