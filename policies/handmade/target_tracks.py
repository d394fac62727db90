"""Tracks: what a robot remembers of targets that it saw or was told of, and where it expects them now.

A track is one slot of a robot's memory: real fields x, y (the target's offset from the robot) and its displacement a
step; whole fields identity, age (steps since it was last seen) and whether a teammate reported it. Tracks fill the
slots from the front; identity −1 ends them.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from teamsight.core.kernel import inlined, kernel
from teamsight.policies.interface import PolicyState

X, Y, STEP_X, STEP_Y = range(4)
IDENTITY, AGE, REPORTED = range(3)


def no_tracks(size: int, slots: int) -> PolicyState:
    """Return the memory of `size` robots that have seen nothing yet, with room for `slots` targets each."""
    whole = np.zeros((size, slots, 3), np.int64)
    whole[:, :, IDENTITY] = -1
    return PolicyState(np.zeros((size, slots, 4)), whole)


@inlined
def find(identity: Any, wanted: int, first: int, last: int, guess: int) -> int:
    """Return where `wanted` stands between `first` and `last`, or −1; look at `guess` first."""
    if first <= guess < last and identity[guess] == wanted:
        return guess
    for k in range(first, last):
        if identity[k] == wanted:
            return k
    return -1


@kernel
def _per_step(x: float, y: float, steps: int) -> tuple[float, float]:
    # On its own, so that the usual case of a target seen a step ago does not wait for two divisions.
    return x / steps, y / steps


@inlined
def _see(real: Any, whole: Any, slot: int, seen: Any, k: int, moved: Any) -> None:
    """Bring a track up to what is seen of its target now, and its step by what was wrong with the expectation."""
    wrong_x = seen.offset[k, 0] - (real[slot, X] + real[slot, STEP_X] - moved[0])
    wrong_y = seen.offset[k, 1] - (real[slot, Y] + real[slot, STEP_Y] - moved[1])
    if whole[slot, AGE] > 0:
        wrong_x, wrong_y = _per_step(wrong_x, wrong_y, whole[slot, AGE] + 1)
    real[slot, STEP_X] += wrong_x
    real[slot, STEP_Y] += wrong_y
    real[slot, X] = seen.offset[k, 0]
    real[slot, Y] = seen.offset[k, 1]
    whole[slot, AGE] = 0


@inlined
def _expect(real: Any, whole: Any, slot: int, moved: Any) -> None:
    """Move a track of a target that is not seen to where it is expected now."""
    real[slot, X] += real[slot, STEP_X] - moved[0]
    real[slot, Y] += real[slot, STEP_Y] - moved[1]
    whole[slot, AGE] += 1


@inlined
def _append(real: Any, whole: Any, slot: int, seen: Any, k: int, reported: int) -> int:
    """Begin a track in `slot`, if there is one; return the number of tracks."""
    if slot >= whole.shape[0]:
        return slot
    real[slot, X] = seen.offset[k, 0]
    real[slot, Y] = seen.offset[k, 1]
    real[slot, STEP_X] = 0.0
    real[slot, STEP_Y] = 0.0
    whole[slot, IDENTITY] = seen.identity[k]
    whole[slot, AGE] = 0
    whole[slot, REPORTED] = reported
    return slot + 1


@inlined
def _keep(real: Any, whole: Any, slot: int, new: int) -> None:
    if slot != new:
        for field in range(4):
            real[new, field] = real[slot, field]
        for field in range(3):
            whole[new, field] = whole[slot, field]


@inlined
def update_tracks(i: int, percept: Any, memory: Any, farthest: float, oldest: float) -> int:
    """Bring the tracks of robot `i` up to date; return how many there are.

    Seen targets are matched by identity; those lost are moved to where they are expected, and forgotten once they are
    older than `oldest` [steps], farther than `farthest` [length], or expected where the robot would see them.
    """
    real = memory.floats[i]
    whole = memory.ints[i]
    moved = percept.moved[i]
    targets = percept.targets
    first = targets.start[i]
    last = targets.start[i + 1]
    sensed = percept.sensing_range[i] * percept.sensing_range[i]
    count = 0
    matched = 0
    for slot in range(whole.shape[0]):
        if whole[slot, IDENTITY] < 0:
            break
        k = find(targets.identity, whole[slot, IDENTITY], first, last, first + matched)
        if k >= 0:
            _see(real, whole, slot, targets, k, moved)
            whole[slot, REPORTED] = 0
            matched += 1
        else:
            _expect(real, whole, slot, moved)
            square = real[slot, X] * real[slot, X] + real[slot, Y] * real[slot, Y]
            if square <= sensed or square >= farthest * farthest or whole[slot, AGE] > oldest:
                continue
        _keep(real, whole, slot, count)
        count += 1
    if matched < last - first:
        for k in range(first, last):
            if _slot_of(whole, targets.identity[k], count) < 0:
                count = _append(real, whole, count, targets, k, 0)
    if percept.relayed.start[i + 1] > percept.relayed.start[i]:
        count = _hear(i, percept, real, whole, count)
    if count < whole.shape[0]:
        whole[count, IDENTITY] = -1
    return count


@inlined
def _slot_of(whole: Any, identity: int, count: int) -> int:
    for slot in range(count):
        if whole[slot, IDENTITY] == identity:
            return slot
    return -1


@inlined
def _hear(i: int, percept: Any, real: Any, whole: Any, count: int) -> int:
    """Take over reported targets that the robot does not see itself."""
    relayed = percept.relayed
    for k in range(relayed.start[i], relayed.start[i + 1]):
        slot = _slot_of(whole, relayed.identity[k], count)
        if slot < 0:
            count = _append(real, whole, count, relayed, k, 1)
        elif whole[slot, AGE] > 0:
            # `_expect` has already moved it by the own step, so only the target's remains.
            steps = whole[slot, AGE]
            real[slot, STEP_X] += (relayed.offset[k, 0] - real[slot, X]) / steps
            real[slot, STEP_Y] += (relayed.offset[k, 1] - real[slot, Y]) / steps
            real[slot, X] = relayed.offset[k, 0]
            real[slot, Y] = relayed.offset[k, 1]
            whole[slot, AGE] = 0
            whole[slot, REPORTED] = 1
    return count
