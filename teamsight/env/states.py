"""The state of a whole world as numbers, for critics that see more than robots do."""

from __future__ import annotations

from typing import TYPE_CHECKING

import gymnasium
import numpy as np
import numpy.typing as npt

if TYPE_CHECKING:
    from teamsight.env.batch import Batch

#: Numbers of each body: x, y, heading x, heading y, and whether it is active.
PER_BODY = 5


class StateView:
    """The state of worlds: for each body, robots first, x and y in [−1, 1], its heading, and 1 if it is active.

    Places are relative to the middle of the box around the arena, in halves of its longer side. Bodies that have left
    are 0, and those that came later are not shown.

    Parameters
    ----------
    batch : Batch
        The worlds.

    Attributes
    ----------
    space : gymnasium.spaces.Box
        The space of the state of one world, shape (bodies × 5,), float32.
    """

    def __init__(self, batch: Batch) -> None:
        self._batch = batch
        self._bodies = sum(batch.groups(0).values())
        self.space = gymnasium.spaces.Box(-1.0, 1.0, (self._bodies * PER_BODY,), np.float32)

    def read(self, place: int) -> npt.NDArray[np.float32]:
        """Return the state of a world, shape (bodies, 5), float32; an error before its first episode."""
        if not self._batch.has_begun(place):
            raise RuntimeError("state(): no episode has begun; call reset() first")
        arena = self._batch.arena(place)
        low, high = np.asarray(arena.bounds, float)
        middle, half = (low + high) / 2, (high - low).max() / 2
        rows = np.zeros((self._bodies, PER_BODY), np.float32)
        at = 0
        for group, size in self._batch.groups(place).items():
            shown = group.bodies.member < size
            here = at + group.bodies.member[shown]
            rows[here, :2] = np.clip((group.bodies.position[shown] - middle) / half, -1.0, 1.0)
            rows[here, 2:4] = np.clip(group.bodies.heading[shown], -1.0, 1.0)
            rows[here, 4] = group.bodies.active[shown]
            at += size
        return rows
