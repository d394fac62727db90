"""Grazing: robots go over fresh ground, of which a raster keeps account."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Annotated, Any

import numpy as np
import numpy.typing as npt

from teamsight.core import checks
from teamsight.core.component import Allowed, NonNegative, Positive
from teamsight.core.kernel import inlined, kernel
from teamsight.tasks.foraging.layout import check_circles, refuse_torus
from teamsight.world.arena import Arena
from teamsight.world.interaction import Interaction, InteractionState

# The largest raster, along a side.
_MOST_CELLS = 4000


@inlined
def _mow(ground: Any, x: float, y: float, reach: float, cell: float) -> int:
    """Graze all cells whose centres are within reach of a place; return how many were fresh."""
    cells = ground.shape[0]
    span = int(reach / cell) + 1
    column, row = int(x / cell), int(y / cell)
    grazed = 0
    for r in range(max(row - span, 0), min(row + span + 1, cells)):
        for c in range(max(column - span, 0), min(column + span + 1, cells)):
            dx = (c + 0.5) * cell - x
            dy = (r + 0.5) * cell - y
            if ground[r, c] == 1 and dx * dx + dy * dy <= reach * reach:
                ground[r, c] = 0
                grazed += 1
    return grazed


@inlined
def _probe(ground: Any, x: float, y: float, reach: float, cell: float) -> tuple[float, float]:
    """Return the offset to the nearest fresh cell within reach; (0, 0) if there is none."""
    cells = ground.shape[0]
    span = int(reach / cell) + 1
    column, row = int(x / cell), int(y / cell)
    nearest = reach * reach
    found_x = 0.0
    found_y = 0.0
    for r in range(max(row - span, 0), min(row + span + 1, cells)):
        for c in range(max(column - span, 0), min(column + span + 1, cells)):
            dx = (c + 0.5) * cell - x
            dy = (r + 0.5) * cell - y
            square = dx * dx + dy * dy
            if ground[r, c] == 1 and square < nearest:
                nearest = square
                found_x = dx
                found_y = dy
    return found_x, found_y


@kernel
def _graze(bodies: Any, state: Any, parameters: Any, noise: Any, scores: Any, turn: int) -> None:
    robots, ground = bodies.robots, state.ints
    half = 0.5 * parameters[0]
    for i in range(robots.position.shape[0]):
        if robots.active[i]:
            x, y = robots.position[i, 0] + half, robots.position[i, 1] + half
            share = _mow(ground, x, y, parameters[2], parameters[1]) / state.floats[0, 0]
            robots.reward[i] += share
            scores[0] += share
    for i in range(robots.position.shape[0]):
        x, y = robots.position[i, 0] + half, robots.position[i, 1] + half
        robots.probe_x[i], robots.probe_y[i] = _probe(ground, x, y, parameters[3], parameters[1])


@dataclass(frozen=True)
class Grazing(Interaction):
    """Robots graze all fresh ground within reach; they probe where the nearest of what is left is.

    Parameters
    ----------
    side : float
        The side of the square area, whose centre is (0, 0) [length].
    cell : float
        The side of a cell of the raster [length].
    reach : float
        Distance within which a robot grazes [length].
    probe : float
        Distance within which it senses fresh ground [length].
    obstacles : tuple of (float, float, float)
        Round obstacles, under which there is no ground: x, y and radius [length].

    Raises
    ------
    TypeError, ValueError
        If a value is outside its limits, or no ground is left; in a world whose arena repeats or is larger.
    """

    roles = ("robots",)
    scores = ("grazed",)
    columns = (("robots", "probe_x", 0.0), ("robots", "probe_y", 0.0))
    side: Annotated[Positive, Allowed(unit="length")] = 64.0
    cell: Annotated[Positive, Allowed(unit="length")] = 1.0
    reach: Annotated[Positive, Allowed(unit="length")] = 1.5
    probe: Annotated[NonNegative, Allowed(unit="length")] = 4.0
    obstacles: tuple[tuple[float, float, float], ...] = ()
    kernel = _graze

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.side > _MOST_CELLS * self.cell:
            raise ValueError(
                f"side={self.side:g}: has more than {_MOST_CELLS} cells of {self.cell:g}; take a smaller side, "
                "or larger cells"
            )
        check_circles(self.obstacles)
        if not self._ground.any():
            raise ValueError(
                f"obstacles={checks.shown(self.obstacles)}: leave no ground in a square of side {self.side:g}; take "
                "fewer, or smaller cells"
            )

    def check_fit(self, arena: Arena, order: tuple[str, ...]) -> None:
        refuse_torus("Grazing", arena)
        extent = float(np.abs(arena.bounds).max())
        # Rounding decides nothing.
        if extent > 0.5 * self.side * (1.0 + 1e-9):
            raise ValueError(
                f"side={self.side:g}: {arena} reaches {extent:g} from its middle; give Grazing at least the side "
                f"{2.0 * extent:g}"
            )

    @property
    def parameters(self) -> tuple[float, ...]:
        return self.side, self.cell, self.reach, self.probe

    def start(self, sizes: Any) -> InteractionState:
        """Return the raster, with 1 for fresh ground, and the number of its cells with ground."""
        ground = self._ground
        return InteractionState(np.full((1, 1), float(ground.sum())), ground)

    @property
    def _ground(self) -> npt.NDArray[np.int64]:
        cells = math.ceil(self.side / self.cell)
        centre = (np.arange(cells) + 0.5) * self.cell - 0.5 * self.side
        x, y = np.meshgrid(centre, centre)
        ground = np.ones((cells, cells), np.int64)
        for at_x, at_y, radius in self.obstacles:
            ground[(x - at_x) ** 2 + (y - at_y) ** 2 < radius**2] = 0
        return ground
