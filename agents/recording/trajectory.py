"""Trajectories: the positions of all agents, recorded at regular intervals."""

from __future__ import annotations

import numpy as np
import pandas as pd

from teamsight.agents.group import Group
from teamsight.core.buffer import Buffer


class Trail:
    """The positions of all agents, recorded at regular intervals as long as the groups do not change."""

    def __init__(self, groups: list[Group], every: int, tick: int) -> None:
        self._names = np.repeat([group.name for group in groups], [len(group) for group in groups])
        self._identity = np.concatenate([group.bodies.identity for group in groups]) if groups else np.zeros(0, int)
        self._first = tick // every + 1
        self.every = every
        self.buffer = Buffer((len(self._identity), 2))

    def frame(self) -> pd.DataFrame:
        """Return time, group, identity, x, y."""
        size = len(self._identity)
        times = self.every * (self._first + np.arange(self.buffer.rows))
        kept = self.buffer.written.reshape(-1, 2)
        return pd.DataFrame(
            {
                "time": np.repeat(times, size),
                "group": np.tile(self._names, self.buffer.rows),
                "identity": np.tile(self._identity, self.buffer.rows),
                "x": kept[:, 0],
                "y": kept[:, 1],
            }
        )


def trajectory_frame(trails: list[Trail]) -> pd.DataFrame:
    """Return the rows of all trails."""
    parts = [trail.frame() for trail in trails if trail.buffer.rows] or [Trail([], 1, 0).frame()]
    return pd.concat(parts, ignore_index=True)
