"""Trajectories: the positions of all agents, recorded each so many steps."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
import pandas as pd

from teamsight.agents.group import Group


class Trail:
    """Positions of all agents, kept each so many steps while the groups stay as they are."""

    def __init__(self, groups: list[Group], every: int, tick: int) -> None:
        self._names = np.repeat([group.name for group in groups], [len(group) for group in groups])
        self._identity = np.concatenate([group.bodies.identity for group in groups]) if groups else np.zeros(0, int)
        self._first = tick // every + 1
        self._every = every
        self.raw: npt.NDArray[np.float64] = np.zeros((16, len(self._identity), 2))
        self.rows = 0

    def make_room(self, rows: int) -> None:
        """Make room for this many more rows."""
        if self.rows + rows > len(self.raw):
            longer = np.zeros((max(self.rows + rows, 2 * len(self.raw)), *self.raw.shape[1:]))
            longer[: self.rows] = self.raw[: self.rows]
            self.raw = longer

    def frame(self) -> pd.DataFrame:
        """Return time, group, identity, x, y."""
        size = len(self._identity)
        times = self._every * (self._first + np.arange(self.rows))
        kept = self.raw[: self.rows].reshape(-1, 2)
        return pd.DataFrame(
            {
                "time": np.repeat(times, size),
                "group": np.tile(self._names, self.rows),
                "identity": np.tile(self._identity, self.rows),
                "x": kept[:, 0],
                "y": kept[:, 1],
            }
        )


def trajectory_frame(trails: list[Trail]) -> pd.DataFrame:
    """Return the rows of all trails."""
    parts = [trail.frame() for trail in trails if trail.rows] or [Trail([], 1, 0).frame()]
    return pd.concat(parts, ignore_index=True)
