"""Outlines: lines along the walls of an arena."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from teamsight import Box, Circle, Disc, Polygon, Torus, World
from teamsight.agents import draw_arena
from teamsight.agents.drawing import obstacles, walls


class Ring(Disc):
    """A disc with a hole, which leaves the origin outside."""

    def contains(self, position: Any) -> Any:
        return super().contains(position) & (np.sum(np.square(np.asarray(position, float)), axis=-1) >= 1)


class Half(Disc):
    """The right half of a disc."""

    def contains(self, position: Any) -> Any:
        return super().contains(position) & (np.asarray(position)[..., 0] >= 0)

    @property
    def bounds(self) -> Any:
        return np.array([0.0, -self.radius]), np.array([self.radius, self.radius])


def length(line: np.ndarray) -> float:
    return float(np.sqrt(np.sum(np.diff(line, axis=0) ** 2, axis=1)).sum())


@pytest.mark.parametrize(
    ("arena", "lengths"),
    [
        (Disc(3.0), [6 * np.pi]),
        (Box(4.0, 2.0), [12.0]),
        (Torus(4.0, 2.0), [12.0]),
        (Ring(3.0), [2 * np.pi, 6 * np.pi]),
        (Half(2.0), [4 + 2 * np.pi]),
        (Polygon([(0, 0), (3, 0), (3, 1), (1, 1), (1, 2), (0, 2)]), [10.0]),
        (Disc(3.0).with_obstacles(Circle((1, 0), 1.0)), [6 * np.pi]),
    ],
    ids=str,
)
def test_the_walls_are_closed_and_as_long_as_they_are(arena: Any, lengths: list[float]) -> None:
    lines = walls(arena)
    assert all((line[0] == line[-1]).all() for line in lines)
    # Corners are cut by half a cell.
    np.testing.assert_allclose(sorted(map(length, lines)), lengths, rtol=0.01)
    low, high = arena.bounds
    for line in lines:
        assert (line >= low - 1e-3).all()
        assert (line <= high + 1e-3).all()


def test_the_walls_of_ones_own_arena_are_where_it_ends() -> None:
    lines = walls(Ring(3.0))
    radii = np.concatenate([np.sqrt(np.sum(line**2, axis=1)) for line in lines])
    assert np.minimum(abs(radii - 3), abs(radii - 1)).max() < 1e-4


def test_obstacles_are_closed_and_shown_on_both_sides_of_a_seam() -> None:
    square = Polygon([(1.5, 0), (2.5, 0), (2.5, 1), (1.5, 1)])
    arena = Torus(4.0, 4.0).with_obstacles(square, Circle((0, -1), 0.5))
    lines = obstacles(arena)
    np.testing.assert_allclose(sorted(map(length, lines)), [np.pi, 4.0, 4.0], rtol=0.01)
    assert all((line[0] == line[-1]).all() for line in lines)
    assert obstacles(Disc(1.0)) == []


def test_an_arena_is_drawn_with_matplotlib() -> None:
    from matplotlib.figure import Figure

    axes = Figure().add_subplot()
    draw_arena(axes, World(Ring(2.0)))
    assert len(axes.lines) == 2
    draw_arena(axes, World(Disc(2.0).with_obstacles(Circle((1, 0), 0.5))))
    assert (len(axes.lines), len(axes.patches)) == (3, 1)
    assert axes.get_aspect() == 1.0
