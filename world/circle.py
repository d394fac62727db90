"""Circles: round obstacles."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from teamsight.core import checks
from teamsight.world import limits
from teamsight.world.polygons import round_boundary
from teamsight.world.walls import Walls

Points = npt.NDArray[np.float64]


@dataclass(frozen=True)
class Circle:
    """A round obstacle, for `Arena.with_obstacles`.

    Parameters
    ----------
    centre : tuple of float
        x and y of its centre [length].
    radius : float
        [length], above 0.

    Raises
    ------
    TypeError, ValueError
        If the centre is not two finite numbers, or the radius not a number above 0 within the limits of lengths.
    """

    centre: tuple[float, float]
    radius: float

    def __post_init__(self) -> None:
        given = checks.shown(self.centre)
        try:
            centre = np.array(self.centre, float)
        except (TypeError, ValueError):
            raise TypeError(f"centre={given}: must be two numbers, such as (0, 0)") from None
        if centre.shape != (2,) or not (np.abs(centre) <= limits.LONGEST).all():
            raise ValueError(f"centre={given}: must be two numbers of at most {limits.LONGEST:g}, such as (0, 0)")
        object.__setattr__(self, "centre", tuple(centre.tolist()))
        object.__setattr__(self, "radius", limits.length("radius", self.radius))

    @property
    def bounds(self) -> tuple[Points, Points]:
        """The lower left and the upper right corner of the box around it, each of shape (2,)."""
        return np.array(self.centre) - self.radius, np.array(self.centre) + self.radius

    @property
    def finest(self) -> float:
        """Its diameter [length]."""
        return 2.0 * self.radius

    @property
    def faces(self) -> Walls:
        """Its wall, seen from outside."""
        return Walls(np.empty((0, 4)), np.array([[*self.centre, self.radius]]))

    def covers(self, position: npt.ArrayLike, slack: float = 0.0) -> npt.NDArray[np.bool_]:
        """Return for each position, shape (..., 2), whether it is inside by more than `slack` [length]."""
        off = np.asarray(position, float) - self.centre
        return np.asarray(np.hypot(off[..., 0], off[..., 1]) < self.radius - slack)

    @property
    def boundary(self) -> Points:
        """A polygon that looks like it, as vertices for drawing, shape (k, 2) [length]."""
        return round_boundary(self.centre, self.radius)
