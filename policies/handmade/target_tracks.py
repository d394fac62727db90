"""Target tracks: a robot's memory of targets that it or a teammate has sensed, with their expected positions.

A target track is one slot of a robot's state. Float fields: x, y (offset of the target from the robot) and its
displacement per step. Integer fields: identity, age (steps since it was last sensed), and whether a teammate relayed
it. Used slots come first; identity −1 marks the end.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from teamsight.core.kernel import inlined, kernel
from teamsight.policies.interface import PolicyState

X, Y, STEP_X, STEP_Y = range(4)
IDENTITY, AGE, RELAYED = range(3)


def no_target_tracks(size: int, slots: int) -> PolicyState:
    """Return the state of `size` robots without target tracks, with room for `slots` targets each."""
    ints = np.zeros((size, slots, 3), np.int64)
    ints[:, :, IDENTITY] = -1
    return PolicyState(np.zeros((size, slots, 4)), ints)


@inlined
def find(identity: Any, wanted: int, first: int, last: int, guess: int) -> int:
    """Return the index of `wanted` between `first` and `last`, or −1; try `guess` first."""
    if first <= guess < last and identity[guess] == wanted:
        return guess
    for k in range(first, last):
        if identity[k] == wanted:
            return k
    return -1


@kernel
def _per_step(x: float, y: float, steps: int) -> tuple[float, float]:
    # A separate function, so that the usual case (sensed one step ago) does not execute two divisions.
    return x / steps, y / steps


@inlined
def _see(floats: Any, ints: Any, slot: int, seen: Any, k: int, moved: Any) -> None:
    """Set a track to the sensed position of its target, and correct its displacement by the error of the prediction."""
    error_x = seen.offset[k, 0] - (floats[slot, X] + floats[slot, STEP_X] - moved[0])
    error_y = seen.offset[k, 1] - (floats[slot, Y] + floats[slot, STEP_Y] - moved[1])
    if ints[slot, AGE] > 0:
        error_x, error_y = _per_step(error_x, error_y, ints[slot, AGE] + 1)
    floats[slot, STEP_X] += error_x
    floats[slot, STEP_Y] += error_y
    floats[slot, X] = seen.offset[k, 0]
    floats[slot, Y] = seen.offset[k, 1]
    ints[slot, AGE] = 0


@inlined
def _expect(floats: Any, ints: Any, slot: int, moved: Any) -> None:
    """Move the track of a target out of range to its expected position."""
    floats[slot, X] += floats[slot, STEP_X] - moved[0]
    floats[slot, Y] += floats[slot, STEP_Y] - moved[1]
    ints[slot, AGE] += 1


@inlined
def _append(floats: Any, ints: Any, slot: int, seen: Any, k: int, relayed: int) -> int:
    """Begin a track in `slot` if that exists; return the number of target tracks."""
    if slot >= ints.shape[0]:
        return slot
    floats[slot, X] = seen.offset[k, 0]
    floats[slot, Y] = seen.offset[k, 1]
    floats[slot, STEP_X] = 0.0
    floats[slot, STEP_Y] = 0.0
    ints[slot, IDENTITY] = seen.identity[k]
    ints[slot, AGE] = 0
    ints[slot, RELAYED] = relayed
    return slot + 1


@inlined
def _keep(floats: Any, ints: Any, slot: int, new: int) -> None:
    if slot != new:
        for field in range(4):
            floats[new, field] = floats[slot, field]
        for field in range(3):
            ints[new, field] = ints[slot, field]


@inlined
def update_target_tracks(i: int, percept: Any, state: Any, farthest: float, oldest: float) -> int:
    """Update the target tracks of robot `i`; return their number.

    Sensed targets are matched by identity. Tracks of others are moved to their expected position, and dropped once they
    are older than `oldest` [steps], farther than `farthest` [length], or expected within the sensing range.
    """
    floats = state.floats[i]
    ints = state.ints[i]
    moved = percept.moved[i]
    targets = percept.targets
    first = targets.start[i]
    last = targets.start[i + 1]
    sensed = percept.sensing_range[i] * percept.sensing_range[i]
    count = 0
    matched = 0
    for slot in range(ints.shape[0]):
        if ints[slot, IDENTITY] < 0:
            break
        k = find(targets.identity, ints[slot, IDENTITY], first, last, first + matched)
        if k >= 0:
            _see(floats, ints, slot, targets, k, moved)
            ints[slot, RELAYED] = 0
            matched += 1
        else:
            _expect(floats, ints, slot, moved)
            square = floats[slot, X] * floats[slot, X] + floats[slot, Y] * floats[slot, Y]
            if square <= sensed or square >= farthest * farthest or ints[slot, AGE] > oldest:
                continue
        _keep(floats, ints, slot, count)
        count += 1
    if matched < last - first:
        for k in range(first, last):
            if _slot_of(ints, targets.identity[k], count) < 0:
                count = _append(floats, ints, count, targets, k, 0)
    if percept.relayed.start[i + 1] > percept.relayed.start[i]:
        count = _add_relayed(i, percept, floats, ints, count)
    if count < ints.shape[0]:
        ints[count, IDENTITY] = -1
    return count


@inlined
def _slot_of(ints: Any, identity: int, count: int) -> int:
    for slot in range(count):
        if ints[slot, IDENTITY] == identity:
            return slot
    return -1


@inlined
def _add_relayed(i: int, percept: Any, floats: Any, ints: Any, count: int) -> int:
    """Add or update target tracks of relayed targets that the robot does not sense itself."""
    relayed = percept.relayed
    for k in range(relayed.start[i], relayed.start[i + 1]):
        slot = _slot_of(ints, relayed.identity[k], count)
        if slot < 0:
            count = _append(floats, ints, count, relayed, k, 1)
        elif ints[slot, AGE] > 0:
            # `_expect` has already moved it by the robot's own step; the rest is the target's displacement.
            steps = ints[slot, AGE]
            floats[slot, STEP_X] += (relayed.offset[k, 0] - floats[slot, X]) / steps
            floats[slot, STEP_Y] += (relayed.offset[k, 1] - floats[slot, Y]) / steps
            floats[slot, X] = relayed.offset[k, 0]
            floats[slot, Y] = relayed.offset[k, 1]
            ints[slot, AGE] = 0
            ints[slot, RELAYED] = 1
    return count
