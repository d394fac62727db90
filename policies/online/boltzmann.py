"""The choice of an action by its values: Boltzmann exploration, or the best."""

from __future__ import annotations

import math
from typing import Any

from teamsight.core.kernel import inlined


@inlined
def largest(values: Any) -> Any:
    """Return the largest of some values."""
    best = values[0]
    for a in range(1, values.shape[0]):
        best = max(best, values[a])
    return best


@inlined
def chosen_action(values: Any, temperature: float, fraction: float) -> int:
    """Return an action with a probability proportional to exp(value / temperature).

    Parameters
    ----------
    values : ndarray, shape (actions,), float64
        The values of the actions.
    temperature : float
        Above 0; or 0 for an action of the largest value, each of equals with the same probability.
    fraction : float
        A uniform number in (0, 1), which chooses.
    """
    best = largest(values)
    total = 0.0
    for a in range(values.shape[0]):
        total += _weight(values[a] - best, temperature)
    rest = fraction * total
    last = 0
    for a in range(values.shape[0]):
        weight = _weight(values[a] - best, temperature)
        if weight > 0.0:
            last = a
            if rest < weight:
                return a
            rest -= weight
    # Only rounding leads here.
    return last


@inlined
def _weight(below: float, temperature: float) -> float:
    if temperature > 0.0:
        return math.exp(below / temperature)
    return 1.0 if below == 0.0 else 0.0
