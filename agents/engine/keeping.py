"""What a step that fails after bodies have moved puts back: places, and all that interactions have written."""

from __future__ import annotations

import numpy as np

from teamsight.agents.engine.records import group_at, world_at
from teamsight.core.kernel import array_at, kernel
from teamsight.world.motion import move_at


@kernel
def keep(address: int, back: bool) -> None:
    """Save the positions of all bodies and what interactions write, or restore them."""
    world = world_at(address)
    at = 0
    for g in range(world.groups.shape[0]):
        move = move_at(group_at(world.groups[g]).move)
        for i in range(move.position.shape[0]):
            for axis in range(2):
                if back:
                    move.position[i, axis] = world.undo[at, axis]
                    move.heading[i, axis] = world.undo[at, 2 + axis]
                    move.moved[i, axis] = world.undo[at, 4 + axis]
                else:
                    world.undo[at, axis] = move.position[i, axis]
                    world.undo[at, 2 + axis] = move.heading[i, axis]
                    world.undo[at, 4 + axis] = move.moved[i, axis]
            at += 1
    for number in range(world.copies.shape[0]):
        size = world.copies[number, 2]
        present = array_at(world.copies[number, 0], size, np.uint8)
        copy = array_at(world.copies[number, 1], size, np.uint8)
        for byte in range(size):
            if back:
                present[byte] = copy[byte]
            else:
                copy[byte] = present[byte]
