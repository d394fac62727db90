"""The lazy memory: what robots met while they explored, kept for learners that ask only when they need an answer."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import numpy.typing as npt

Table = npt.NDArray[np.float32]

ACTION = ("rotation", "distance")


@dataclass(frozen=True, eq=False)
class LazyMemory:
    """Pairs of situation and action, what followed them, and the facts that rewards are made of.

    Parameters
    ----------
    table : ndarray, shape (columns, pairs), float32
        One row a component, so that the components which a learner compares lie together: the situation (`inputs`
        rows), the action (rotation [rad], distance [share of the robot's speed]), the next situation (`inputs` rows),
        and one row for each fact. Pairs stand in the order of their content, so that a place says nothing.
    own, added : int
        How many components of a situation show targets, and how many the degree of awareness adds.
    facts : tuple of str
        The names of the last rows.
    settings : mapping
        What made the pairs, fit for JSON; "awareness" names the degree.
    """

    table: Table
    own: int
    added: int
    facts: tuple[str, ...]
    settings: Mapping[str, Any] = field(default_factory=dict)

    @property
    def inputs(self) -> int:
        """How many components a situation has."""
        return self.own + self.added

    def __len__(self) -> int:
        return self.table.shape[1]

    @property
    def situation(self) -> Table:
        """Where the robot was, shape (pairs, inputs); readings over their range, 1 for nothing."""
        return self.table[: self.inputs].T

    @property
    def action(self) -> Table:
        """What it did, shape (pairs, 2): rotation [rad], distance [share of its speed]."""
        return self.table[self.inputs : self.inputs + len(ACTION)].T

    @property
    def next_situation(self) -> Table:
        """Where that led, shape (pairs, inputs)."""
        first = self.inputs + len(ACTION)
        return self.table[first : first + self.inputs].T

    def fact(self, name: str) -> Table:
        """Return a fact of every pair, shape (pairs,)."""
        return self.table[2 * self.inputs + len(ACTION) + self.facts.index(name)]
