"""The state grid: situations as a table needs them, in few states."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from teamsight.core import checks
from teamsight.core.kernel import inlined

#: The most states for which a table is made: with 16 actions, 64 MiB.
MOST_STATES = 1_000_000

#: How many sectors a ring has by default, for targets and, under o(N), for those of each teammate.
_RING = 16


class TooManyStatesError(ValueError):
    """Raised when a degree of awareness leaves more states than a table can hold."""


@dataclass(frozen=True)
class StateGrid:
    """Situations with neighbouring sectors merged and readings in levels.

    Parameters
    ----------
    own, added : int
        How many components of a situation show targets, and how many the degree of awareness adds.
    degree : str, optional
        The degree's name: the sectors of "ring" and "shared" are merged; the distance and the bearing of each teammate
        under "pairwise", and what other degrees add, stay apart.
    sectors : int, default 4
        How many sectors a ring keeps; each reads the nearest of those that it is made of.
    levels : int, default 3
        p, the readings of one sensor: the last is "nothing there", the others divide the range.

    Raises
    ------
    TypeError, ValueError
        If a number is too small, or sectors cannot be merged evenly.
    TooManyStatesError
        If more than `MOST_STATES` states result.

    Notes
    -----
    *Source:* §3, search space size = p^d; here d is `dimensions`.
    """

    own: int
    added: int
    degree: str | None = None
    sectors: int = 4
    levels: int = 3

    def __post_init__(self) -> None:
        checks.count("sectors", self.sectors)
        checks.count("levels", self.levels, least=2, cure="something there, or nothing")
        for name, ring in self._rings():
            if ring % self.sectors:
                even = math.gcd(*(sectors for _, sectors in self._rings()))
                cure = f"; {even} or a divisor of it does" if even > 1 else "; 1 does"
                raise ValueError(f"sectors={self.sectors}: must divide the {ring} sectors {name} evenly{cure}")
        if self.levels**self.dimensions > MOST_STATES:
            raise TooManyStatesError(
                f"a table of {self.levels}^{self.dimensions} states: {self.levels} readings of {self.dimensions} "
                f"sensors; at most {MOST_STATES:,} fit. Merge into fewer sectors or levels, use a degree that adds "
                "fewer inputs, or a learner without a table: LinearQ or LazyQ"
            )

    def _rings(self) -> list[tuple[str, int]]:
        """Return the rings of sectors that stand one after the other, and whose they are."""
        rings = [("of targets", self.own)]
        if self.degree == "ring" and self.added:
            rings.append(("of teammates", self.added))
        if self.degree == "shared":
            rings += [("of targets that a teammate senses", _RING)] * (self.added // _RING)
        return rings

    @property
    def dimensions(self) -> int:
        """d, how many sensors are told apart."""
        return int(self.dimension.max()) + 1

    @property
    def dimension(self) -> npt.NDArray[np.int64]:
        """Which sensor each component of a situation belongs to, shape (own + added,)."""
        rings = self._rings()
        found = [
            # Half of those that are merged to either side of straight ahead.
            (np.arange(ring) + ring // self.sectors // 2) % ring * self.sectors // ring + number * self.sectors
            for number, (_, ring) in enumerate(rings)
        ]
        rest = self.own + self.added - sum(ring for _, ring in rings)
        return np.concatenate([*found, len(rings) * self.sectors + np.arange(rest)]).astype(np.int64)

    def __len__(self) -> int:
        """Return p^d."""
        return int(self.levels**self.dimensions)

    def index(self, situation: npt.NDArray[Any]) -> npt.NDArray[np.int64]:
        """Return the states of situations, shape (pairs,).

        Parameters
        ----------
        situation : ndarray, shape (pairs, own + added), float32
            Readings over their range, 1 for nothing; what lies beyond counts as 0 or 1.
        """
        dimension, state = self.dimension, np.zeros(len(situation), np.int64)
        for number in range(self.dimensions):
            nearest = situation[:, dimension == number].min(axis=1).clip(0, 1)
            level = np.minimum((nearest * np.float32(self.levels - 1)).astype(np.int64), self.levels - 1)
            state = state * self.levels + level
        return state


@inlined
def state_of(situation: Any, levels: int, dimensions: int, dimension: Any, first: int) -> int:
    """Return the state of one situation; ``dimension[first:]`` tells which sensor each component belongs to."""
    state = 0
    for number in range(dimensions):
        nearest = np.float32(1.0)
        for component in range(situation.shape[0]):
            if dimension[first + component] == number and situation[component] < nearest:
                nearest = situation[component]
        reading = max(nearest, np.float32(0.0))
        state = state * levels + min(int(reading * np.float32(levels - 1)), levels - 1)
    return state
