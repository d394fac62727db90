"""The action grid: the few actions among which an eager learner chooses."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from teamsight.core import checks
from teamsight.core.kernel import inlined

_FULL_TURN = 2.0 * math.pi


@dataclass(frozen=True)
class ActionGrid:
    """Rotations in equal steps, each with distances in equal steps.

    Parameters
    ----------
    turns : int, default 8
        How many rotations; the first is none, and they go anticlockwise.
    paces : int, default 2
        How many distances, from 0 to the speed; with 1 there is only the speed.

    Raises
    ------
    TypeError, ValueError
        If a number is below 1.

    Notes
    -----
    *Departs:* §8 says that actions are rotation and distance, and not into how many they are divided.
    """

    turns: int = 8
    paces: int = 2

    def __post_init__(self) -> None:
        for name in ("turns", "paces"):
            checks.count(name, getattr(self, name))

    def __len__(self) -> int:
        return self.turns * self.paces

    def index(self, action: npt.NDArray[Any]) -> npt.NDArray[np.int64]:
        """Return the actions of the grid that are nearest to those taken.

        Parameters
        ----------
        action : ndarray, shape (pairs, 2)
            Rotation [rad] and distance [share of the speed].
        """
        turn = np.rint(np.asarray(action[:, 0], float) * (self.turns / _FULL_TURN)).astype(np.int64) % self.turns
        pace = np.rint(np.asarray(action[:, 1], float) * (self.paces - 1)).astype(np.int64)
        return np.asarray(turn * self.paces + pace)


@inlined
def grid_rotation(number: int, turns: int, paces: int) -> float:
    """Return the rotation of an action of the grid, in (−π, π] [rad]."""
    turn = number // paces
    return (turn - turns if 2 * turn > turns else turn) * (_FULL_TURN / turns)


@inlined
def grid_distance(number: int, paces: int) -> float:
    """Return the distance of an action of the grid [share of the speed]."""
    return (number % paces) / (paces - 1) if paces > 1 else 1.0
