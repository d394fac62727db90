"""Features: what a linear approximator sees of a situation, a few overlapping ranges of each reading."""

from __future__ import annotations

from typing import Any

from teamsight.core.kernel import inlined


@inlined
def place_of(reading: float, features: int) -> tuple[int, float]:
    """Return which two features a reading below 1 lies under: the first of them, and the share of the second.

    Tents stand at equal distances from 0 to 1; a single one covers all. The shares of a reading add up to 1; so what is
    learned of one distance is partly learned of those near to it. Below 0, which only a degree of awareness of the
    user's own reads, there is no tent: such a reading is taken for 0.
    """
    if features == 1:
        return 0, 0.0
    where = max(reading, 0.0) * (features - 1)
    first = min(int(where), features - 2)
    return first, where - first


@inlined
def weigh(weights: Any, row: int, situation: Any, inputs: int, features: int) -> float:
    """Return the weights' sum over the features of a situation.

    Parameters
    ----------
    weights : ndarray, shape (actions, 1 + inputs × features)
        A constant, then the weights of each component's features.
    row : int
        Of which action.
    situation : ndarray, shape (inputs,), float32
        Readings over their range; a component that reads 1 has no feature: nothing is there.
    inputs, features : int
        How many components, and features of each.
    """
    total = float(weights[row, 0])
    for component in range(inputs):
        reading = situation[component]
        if reading < 1.0:
            first, share = place_of(float(reading), features)
            at = 1 + component * features + first
            total += (1.0 - share) * weights[row, at]
            if share > 0.0:
                total += share * weights[row, at + 1]
    return total


@inlined
def correct(weights: Any, row: int, situation: Any, inputs: int, features: int, error: float) -> None:
    """Move an action's weights so that their sum over the features of a situation grows by `error`."""
    square = 1.0
    for component in range(inputs):
        reading = situation[component]
        if reading < 1.0:
            _, share = place_of(float(reading), features)
            square += (1.0 - share) * (1.0 - share) + share * share
    part = error / square
    weights[row, 0] += part
    for component in range(inputs):
        reading = situation[component]
        if reading < 1.0:
            first, share = place_of(float(reading), features)
            at = 1 + component * features + first
            weights[row, at] += (1.0 - share) * part
            if share > 0.0:
                weights[row, at + 1] += share * part
