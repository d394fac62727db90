"""Checks of what policies return."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from teamsight.core import checks
from teamsight.policies.interface import Action

# A little more, for rounding.
_FULL_TURN = 2.0 * math.pi * (1.0 + 1e-9)


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
    if abs(turn) > _FULL_TURN:
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
