"""Actions: rotation and distance, freely chosen or from a grid, and the check of what a policy in Python answers."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from teamsight.core import checks
from teamsight.core.angles import direction
from teamsight.core.component import Component, Count
from teamsight.core.kernel import inlined
from teamsight.policies.interface import Action, Floats, Integers

_FULL_TURN = 2.0 * math.pi
_TURNS_PER_RADIAN = 0.15915494309189535


@dataclass(frozen=True)
class ActionGrid(Component):
    """Equally spaced rotations, each combined with a few distances.

    Parameters
    ----------
    rotations : int, default 8
        Number of rotations. The first is 0; they go anticlockwise in steps of 2π / rotations.
    distances : tuple of float, default (0.0, 1.0)
        Distances as shares of the speed, in [0, 1]. Where two are equally near to a recorded distance, the one listed
        first is used.

    Raises
    ------
    TypeError, ValueError
        If `rotations` is below 1, or the distances are not different numbers in [0, 1].

    Notes
    -----
    *Departs:* §8 says that actions consist of rotation and distance, but not how they are discretised.
    """

    rotations: Count = 8
    distances: tuple[float, ...] = (0.0, 1.0)

    def __post_init__(self) -> None:
        super().__post_init__()
        if not isinstance(self.distances, tuple) or len(set(self.distances)) < max(len(self.distances), 1):
            shown = checks.shown(self.distances)
            raise ValueError(f"distances={shown}: must be a tuple of different numbers, such as (0.0, 1.0)")
        for distance in self.distances:
            checks.number("distances", distance, least=0, most=1)

    def __len__(self) -> int:
        return self.rotations * len(self.distances)

    @property
    def actions(self) -> Floats:
        """Rotation in (−π, π] [rad] and distance [share of the speed] of each action, shape (actions, 2)."""
        turn = np.arange(self.rotations)
        rotation = np.where(2 * turn > self.rotations, turn - self.rotations, turn) * (_FULL_TURN / self.rotations)
        return np.stack([np.repeat(rotation, len(self.distances)), np.tile(self.distances, self.rotations)], axis=1)

    def index(self, action: npt.NDArray[Any]) -> Integers:
        """Return the nearest action of the grid for each recorded action.

        Parameters
        ----------
        action : ndarray, shape (transitions, 2)
            Rotation [rad] and distance [share of the speed].

        Returns
        -------
        ndarray, shape (transitions,), int64
        """
        rotation, distance = np.asarray(action, float).T
        turn = np.rint(rotation * (self.rotations / _FULL_TURN)).astype(np.int64) % self.rotations
        place = np.abs(distance[:, None] - np.array(self.distances)).argmin(axis=1)
        return np.asarray(turn * len(self.distances) + place)


@inlined
def go(action: Any, i: int, x: float, y: float, distance: float) -> None:
    """Write the action of robot `i`: turn to the direction (x, y), of any length, and go a distance [length].

    (0, 0) keeps the heading.
    """
    length = math.sqrt(x * x + y * y)
    # Squares of numbers below about 1e-154 lose digits, and the heading would be no unit vector. NaN is passed on.
    if length <= 1e-100:
        x, y, length = 0.0, 0.0, 1.0
    action.heading[i, 0] = x / length
    action.heading[i, 1] = y / length
    action.distance[i] = distance


@inlined
def turned_by(x: float, y: float, turns: float) -> tuple[float, float]:
    """Return the heading (x, y) turned anticlockwise by a share of a full turn, between −1 and 1."""
    cosine, sine = direction(turns if turns >= 0.0 else turns + 1.0)
    x, y = cosine * x - sine * y, sine * x + cosine * y
    # One Newton step, so that rounding errors of many turns do not change the length of the heading.
    length = 1.5 - 0.5 * (x * x + y * y)
    return x * length, y * length


@inlined
def act(rotation: float, share: float, i: int, percept: Any, action: Any) -> None:
    """Write the action of robot `i`: turn by `rotation` [rad] and go a share of its speed."""
    x, y = turned_by(percept.heading[i, 0], percept.heading[i, 1], rotation * _TURNS_PER_RADIAN)
    action.heading[i, 0] = x
    action.heading[i, 1] = y
    action.distance[i] = share * percept.speed[i]


@inlined
def act_along(x: float, y: float, i: int, percept: Any, action: Any) -> None:
    """Write the action of robot `i`: turn to (x, y), ahead and to its left, and go as far, at most its speed.

    Parameters
    ----------
    x, y : float
        In units of the speed; (0, 0) keeps the heading.
    i : int
        The robot.
    percept, action
        The arguments of a policy's kernel.
    """
    ahead_x = percept.heading[i, 0]
    ahead_y = percept.heading[i, 1]
    distance = min(math.sqrt(x * x + y * y), 1.0) * percept.speed[i]
    go(action, i, x * ahead_x - y * ahead_y, x * ahead_y + y * ahead_x, distance)


# A little more, for rounding.
_LARGEST_TURN = 2.0 * math.pi * (1.0 + 1e-9)


def check_answer(name: str, answer: Any, i: int) -> tuple[float, float]:
    """Return (turn, distance) as two numbers, or raise an error if a rule returned anything else for robot `i`."""
    try:
        turn, distance = answer
        turn, distance = float(turn), float(distance)
    except (TypeError, ValueError):
        raise TypeError(
            f"{name}: returned {checks.shown(answer)} for robot {i}; a rule for one robot returns two numbers, "
            "(turn, distance)"
        ) from None
    if not (math.isfinite(turn) and math.isfinite(distance)):
        raise ValueError(f"{name}: returned (turn, distance) = ({turn}, {distance}) for robot {i}; both must be finite")
    if abs(turn) > _LARGEST_TURN:
        raise ValueError(
            f"{name}: returned the turn {turn:g} for robot {i}; it is in radians, from -2π to 2π: np.radians(turn) of "
            "degrees, or turn % (2 * np.pi)"
        )
    return turn, distance


def check_action(name: str, action: Action, size: int) -> None:
    """Raise an error unless an action has the shapes for `size` robots, is finite, and headings have length 1 or 0."""
    if not isinstance(action, tuple) or len(action) != 2:
        raise TypeError(f"{name}: returned {type(action).__name__} as action; it must be Action(heading, distance)")
    for part, array, shape in (("heading", action[0], (size, 2)), ("distance", action[1], (size,))):
        if np.shape(array) != shape:
            raise ValueError(f"{name}: action.{part} has the shape {np.shape(array)}; {size} robots need {shape}")
        finite = np.isfinite(np.asarray(array, float))
        if not finite.all():
            row = int(np.argwhere(~finite)[0][0])
            raise ValueError(f"{name}: action.{part} of robot {row} is {np.asarray(array)[row]}; it must be finite")
    heading = np.asarray(action[0], float)
    square = heading[:, 0] ** 2 + heading[:, 1] ** 2
    wrong = (np.abs(square - 1) > 1e-6) & (square != 0)
    if wrong.any():
        row = int(np.argmax(wrong))
        raise ValueError(
            f"{name}: action.heading of robot {row} has the length {np.sqrt(square[row]):g}; "
            "it must be a unit vector, or (0, 0) to keep the heading"
        )
