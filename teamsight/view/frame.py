"""A frame: what the page draws of one tick."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
import numpy.typing as npt

Words: TypeAlias = npt.NDArray[np.uint16]
Offsets: TypeAlias = npt.NDArray[np.int16]

#: The bits of `Frame.flags`: the body is in the world; it is active; it is sensed in a channel that counts.
PRESENT, ACTIVE, OBSERVED = 1, 2, 4
#: The largest part of the box around the arena, and the number of parts of a full turn.
MOST_PART, TURN = 65_535, 65_536
#: What stands for the scale of a list of links.
MOST_OFFSET = 32_767
#: How many links of a relation the frames of a live page hold; view.js names it too.
MOST_LINKS = 100_000


@dataclass(frozen=True, eq=False)
class Links:
    """Who senses whom, sorted by who senses.

    Attributes
    ----------
    source, target : ndarray, shape (m,), uint16
        The slots of who senses and of who is sensed.
    dx, dy : ndarray, shape (m,), int16, optional
        Where it appears to be, seen from the source along the axes of the arena: 32,767 stands for `LinkList.scale`.
        None unless the list is measured.
    omitted : int
        How many links there are that are not in the arrays, since they are more than a frame holds.
    """

    source: Words
    target: Words
    dx: Offsets | None = None
    dy: Offsets | None = None
    omitted: int = 0

    def __len__(self) -> int:
        return len(self.source)


@dataclass(frozen=True, eq=False)
class Frame:
    """What is drawn of one tick. All arrays have one entry for each slot.

    Attributes
    ----------
    time : float
        The tick.
    series : ndarray, shape (S,), float32
        The numbers that `Scene.series` names; NaN where there is none.
    x, y : ndarray, shape (n,), uint16
        Positions as parts of the box around the arena: 0 at its lower, 65,535 at its upper side.
    heading : ndarray, shape (n,), uint16
        Directions as parts of a turn, counter-clockwise from x: 65,536 would be a full turn.
    flags : ndarray, shape (n,), uint16
        `PRESENT`, `ACTIVE` and `OBSERVED`; 0 for a body that has left or not yet come.
    links : tuple of Links
        One for each of `Scene.links`.
    """

    time: float
    series: npt.NDArray[np.float32]
    x: Words
    y: Words
    heading: Words
    flags: Words
    links: tuple[Links, ...] = ()

    def __len__(self) -> int:
        return len(self.x)

    def positions(self, bounds: tuple[float, float, float, float]) -> npt.NDArray[np.float64]:
        """Return the positions in the arena, shape (n, 2) [length].

        Parameters
        ----------
        bounds : tuple of float
            `Scene.bounds`.
        """
        x0, y0, x1, y1 = bounds
        part = np.stack([self.x, self.y], axis=-1) / MOST_PART
        return np.asarray([x0, y0] + part * [x1 - x0, y1 - y0])

    def angles(self) -> npt.NDArray[np.float64]:
        """Return the directions, shape (n,) [rad], counter-clockwise from x, in [0, 2π)."""
        return np.asarray(self.heading * (2 * np.pi / TURN))
