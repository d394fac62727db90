"""Target tracks: a robot's memory of targets that it or a teammate has sensed, with their expected positions.

The track of a target is in the slot whose number is the target's identity modulo the number of slots, if that was free
when it began; so it is found at once. Float fields: x, y (offset of the target from the robot) and its displacement per
step. Integer fields: identity, age (steps since it was last sensed), whether a teammate relayed it, and in slot 0 a
word with a bit for each slot in use.
"""

from __future__ import annotations

from typing import Annotated, Any

import numpy as np

from teamsight.core.component import Allowed
from teamsight.core.kernel import inlined, kernel, lowest_bit, trailing_zeros
from teamsight.policies.interface import PolicyState

#: A number of slots; a word has a bit for each.
Slots = Annotated[int, Allowed(least=0, most=64)]

X, Y, STEP_X, STEP_Y = range(4)
IDENTITY, AGE, RELAYED, USED = range(4)
_NONE, _ONE = np.uint64(0), np.uint64(1)


def no_target_tracks(size: int, slots: int) -> PolicyState:
    """Return the state of `size` robots without target tracks, with `slots` slots each."""
    return PolicyState(np.zeros((size, slots, 4)), np.zeros((size, slots, 4), np.int64))


@inlined
def _own_slot(identity: int, ints: Any) -> Any:
    return np.uint64(np.uint32(identity) % np.uint32(ints.shape[0]))


@inlined
def _tracked(identity: int, ints: Any, used: Any) -> Any:
    """Return the slot of the track of a target; 64 if it has none."""
    own = _own_slot(identity, ints)
    if used >> own & _ONE != _NONE and ints[own, IDENTITY] == identity:
        return own
    while used != _NONE:
        slot, used = lowest_bit(used)
        if ints[slot, IDENTITY] == identity:
            return slot
    return np.uint64(64)


@inlined
def _begin(floats: Any, ints: Any, used: Any, seen: Any, k: Any, relayed: int) -> Any:
    """Begin the track of a target, if a slot is free; return a word with the bit of its slot."""
    slot = _own_slot(seen.identity[k], ints)
    if used >> slot & _ONE != _NONE:
        slot = np.uint64(trailing_zeros(~used))
    if slot >= np.uint64(ints.shape[0]):
        return _NONE
    floats[slot, STEP_X] = 0.0
    floats[slot, STEP_Y] = 0.0
    ints[slot, IDENTITY] = seen.identity[k]
    _place(floats, ints, slot, seen, k, relayed)
    return _ONE << slot


@kernel
def _per_step(x: float, y: float, steps: int) -> tuple[float, float]:
    # A separate function, so that the usual case (sensed one step ago) does not execute two divisions.
    return x / steps, y / steps


@inlined
def _expect(floats: Any, ints: Any, slot: Any, moved: Any) -> None:
    """Move a track to the expected position of its target."""
    floats[slot, X] += floats[slot, STEP_X] - moved[0]
    floats[slot, Y] += floats[slot, STEP_Y] - moved[1]
    ints[slot, AGE] += 1


@inlined
def _place(floats: Any, ints: Any, slot: Any, seen: Any, k: Any, relayed: int) -> None:
    """Set a track to the position of its target."""
    floats[slot, X] = seen.offset[k, 0]
    floats[slot, Y] = seen.offset[k, 1]
    ints[slot, AGE] = 0
    ints[slot, RELAYED] = relayed


@inlined
def _correct(floats: Any, ints: Any, slot: Any, seen: Any, k: Any, relayed: int) -> None:
    """Set a track to the position of its target, and correct its displacement by the error of the expected one."""
    error_x = seen.offset[k, 0] - floats[slot, X]
    error_y = seen.offset[k, 1] - floats[slot, Y]
    if ints[slot, AGE] > 1:
        error_x, error_y = _per_step(error_x, error_y, ints[slot, AGE])
    floats[slot, STEP_X] += error_x
    floats[slot, STEP_Y] += error_y
    _place(floats, ints, slot, seen, k, relayed)


@inlined
def update_target_tracks(i: int, percept: Any, state: Any, farthest: float, oldest: float) -> tuple[Any, Any]:
    """Update the target tracks of robot `i`; return a word with a bit for each in use, and one for those it senses.

    Tracks of targets that are neither sensed nor relayed are moved to their expected position, and dropped once they
    are older than `oldest` [steps], farther than `farthest` [length], or expected within the sensing range.
    """
    floats = state.floats[i]
    ints = state.ints[i]
    moved = percept.moved[i]
    targets = percept.targets
    relayed = percept.relayed
    reach = percept.sensing_range[i] * percept.sensing_range[i]
    # No other slots than there are, whatever a saved state says.
    used = np.uint64(ints[0, USED]) & (np.uint64(2**64 - 1) >> np.uint64(64 - ints.shape[0]))
    sensed = _NONE
    new = 0
    for k in range(np.uint64(targets.start[i]), np.uint64(targets.start[i + 1])):
        slot = _tracked(targets.identity[k], ints, used)
        if slot < np.uint64(64):
            _expect(floats, ints, slot, moved)
            _correct(floats, ints, slot, targets, k, 0)
            sensed |= _ONE << slot
        else:
            new += 1
    lost = used & ~sensed
    while lost != _NONE:
        slot, lost = lowest_bit(lost)
        _expect(floats, ints, slot, moved)
        square = floats[slot, X] * floats[slot, X] + floats[slot, Y] * floats[slot, Y]
        if square <= reach or square >= farthest * farthest or ints[slot, AGE] > oldest:
            used &= ~(_ONE << slot)
    if new > 0:
        for k in range(np.uint64(targets.start[i]), np.uint64(targets.start[i + 1])):
            if _tracked(targets.identity[k], ints, used) == np.uint64(64):
                begun = _begin(floats, ints, used, targets, k, 0)
                sensed |= begun
                used |= begun
    known = sensed
    for k in range(np.uint64(relayed.start[i]), np.uint64(relayed.start[i + 1])):
        slot = _tracked(relayed.identity[k], ints, used)
        if slot == np.uint64(64):
            begun = _begin(floats, ints, used, relayed, k, 1)
            known |= begun
            used |= begun
        elif known >> slot & _ONE == _NONE:
            _correct(floats, ints, slot, relayed, k, 1)
            known |= _ONE << slot
    ints[0, USED] = np.int64(used)
    return used, sensed
