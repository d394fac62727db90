"""Slow twins of the eager learners, one transition at a time, with dictionaries."""

from __future__ import annotations

import math
from typing import Any

import numpy as np


def sensors(own: int, added: int, degree: str | None, sectors: int) -> list[list[int]]:
    """The components that each sensor is merged from: a ring's quarter is centred, as far as it can be, on its middle."""
    rings = (
        [own] + ([added] if degree == "ring" and added else []) + ([16] * (added // 16) if degree == "shared" else [])
    )
    found, first = [], 0
    for ring in rings:
        each = ring // sectors
        found += [[first + (number * each - each // 2 + k) % ring for k in range(each)] for number in range(sectors)]
        first += ring
    return found + [[component] for component in range(first, own + added)]


def state(situation: Any, merged: list[list[int]], levels: int) -> tuple[int, ...]:
    """The level of each sensor: the last when there is nothing, the others divide the range."""
    found = []
    for members in merged:
        nearest = min(float(situation[component]) for component in members)
        found.append(levels - 1 if nearest >= 1 else min(int(nearest * (levels - 1)), levels - 2))
    return tuple(found)


def action_number(rotation: float, distance: float, rotations: int, distances: tuple[float, ...]) -> int:
    """The action of the grid with the nearest rotation and the nearest distance."""
    gaps = [abs(math.remainder(rotation - 2 * math.pi * turn / rotations, 2 * math.pi)) for turn in range(rotations)]
    place = min(range(len(distances)), key=lambda p: abs(distance - distances[p]))
    return gaps.index(min(gaps)) * len(distances) + place


def table(transitions: list[tuple[Any, int, Any, float]], discount: float, sweeps: int) -> dict[Any, dict[int, float]]:
    """Q by state and action: each sweep, the mean over the transitions of what they were worth by the Q of the last sweep."""
    values: dict[Any, dict[int, float]] = {}
    for before, action, _, _ in transitions:
        values.setdefault(before, {})[action] = 0.0
    for _ in range(sweeps):
        worth: dict[Any, dict[int, list[float]]] = {}
        for before, action, after, reward in transitions:
            best = max(values[after].values()) if after in values else 0.0
            worth.setdefault(before, {}).setdefault(action, []).append(reward + discount * best)
        values = {s: {a: sum(w) / len(w) for a, w in actions.items()} for s, actions in worth.items()}
    return values


def features(situation: Any, count: int) -> Any:
    """A constant, and for each component the activation of each hat feature; none for a reading of 1."""
    found = [1.0]
    for reading in map(float, situation):
        centres = [k / (count - 1) for k in range(count)] if count > 1 else [reading]
        wide = 1 / (count - 1) if count > 1 else 1.0
        found += [max(0.0, 1 - abs(reading - centre) / wide) if reading < 1 else 0.0 for centre in centres]
    return np.array(found)


def weights(
    transitions: list[tuple[Any, int, Any, float]],
    actions: int,
    count: int,
    discount: float,
    rate: float,
    sweeps: int,
    seed: int,
) -> Any:
    """Semi-gradient Q-learning with normalised steps; the rate falls evenly to 0 over all sweeps."""
    found = np.zeros((actions, len(features(transitions[0][0], count))))
    rng = np.random.default_rng(seed)
    total = sweeps * len(transitions)
    for sweep in range(sweeps):
        for step, transition in enumerate(rng.permutation(len(transitions))):
            before, action, after, reward = transitions[transition]
            seen = features(before, count)
            error = reward + discount * (found @ features(after, count)).max() - found[action] @ seen
            now = rate * (1 - (sweep * len(transitions) + step) / total)
            found[action] += now * error * seen / (seen @ seen)
    return found
