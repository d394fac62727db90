"""Hat features of a linear approximator: each reading activates the two nearest of a few equidistant points."""

from __future__ import annotations

from typing import Any

from teamsight.core.kernel import inlined


@inlined
def hat_of(reading: float, features: int) -> tuple[int, float]:
    """Return the first of the two hat features that a reading below 1 activates, and the activation of the second.

    The hats have equidistant centres from 0 to 1; a single one covers everything. The two activations add up to 1, so
    that learning at one distance generalises to nearby ones. Negative readings, which only user-defined degrees of
    awareness give, count as 0.
    """
    if features == 1:
        return 0, 0.0
    where = max(reading, 0.0) * (features - 1)
    first = min(int(where), features - 2)
    return first, where - first


@inlined
def weigh(weights: Any, row: int, situation: Any, inputs: int, features: int) -> float:
    """Return the value of an action: the sum of its weights over the active features of a situation.

    `weights` has one row for each action: a constant, then the weights of each component's features. A reading of 1
    (nothing sensed) activates no feature.
    """
    total = float(weights[row, 0])
    for component in range(inputs):
        reading = situation[component]
        if reading < 1.0:
            first, share = hat_of(float(reading), features)
            at = 1 + component * features + first
            total += (1.0 - share) * weights[row, at]
            if share > 0.0:
                total += share * weights[row, at + 1]
    return total


@inlined
def correct(weights: Any, row: int, situation: Any, inputs: int, features: int, error: float) -> None:
    """Change an action's weights so that its value in a situation grows by `error`."""
    square = 1.0
    for component in range(inputs):
        reading = situation[component]
        if reading < 1.0:
            _, share = hat_of(float(reading), features)
            square += (1.0 - share) * (1.0 - share) + share * share
    part = error / square
    weights[row, 0] += part
    for component in range(inputs):
        reading = situation[component]
        if reading < 1.0:
            first, share = hat_of(float(reading), features)
            at = 1 + component * features + first
            weights[row, at] += (1.0 - share) * part
            if share > 0.0:
                weights[row, at + 1] += share * part
