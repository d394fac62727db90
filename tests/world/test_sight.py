"""Sight: what blocks it is what exact geometry says, also across the seam of a torus and from places on walls."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Annotated, NamedTuple

import numpy as np
import numpy.typing as npt
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from naive import geometry as naive

from teamsight.core.kernel import Entry, Record
from teamsight.world import Arena, Box, Circle, Disc, Polygon, Torus
from teamsight.world.walls import Sight, is_blocked


class Looks(NamedTuple):
    lines: Annotated[npt.NDArray[np.float64], "n", 4]
    blocked: Annotated[npt.NDArray[np.int64], "n"]
    sight: Sight


LOOKS = Record(Looks)
looks_at = LOOKS.at


def _look(address: int) -> int:
    looks = looks_at(address)
    lines = looks.lines
    for k in range(lines.shape[0]):
        looks.blocked[k] = is_blocked(lines[k, 0], lines[k, 1], lines[k, 2], lines[k, 3], looks.sight)
    return 0


LOOK = Entry(_look)

Whole = tuple[int, int]
SHAPES: list[list[Whole]] = [
    [(0, 0), (4, 0), (4, 2), (2, 2), (2, 4), (0, 4)],
    [(0, 0), (3, 1), (1, 3)],
    [(0, 0), (2, 0), (2, 2), (0, 2)],
    [(0, 0), (4, 4), (0, 2), (-4, 4)],
    [(0, 0), (1, 0), (2, 0), (2, 5)],
]

ELL = Polygon([(0, 0), (12, 0), (12, 6), (6, 6), (6, 12), (0, 12)])
IN_ELL = [(x, y) for x in range(13) for y in range(13) if ELL.contains((x, y)) and (x, y) != (6, 6)]

wholes = st.integers(-6, 6)
points = st.tuples(wholes, wholes)


def blocked(arena: Arena, start: Sequence[float], end: Sequence[float]) -> bool:
    """Return whether the arena blocks the line of sight, after a look in both directions."""
    way = arena.displacement(start, end)
    lines = np.array([[*start, *way], [*end, *-way]], float)
    found = np.zeros(2, np.int64)
    LOOK(LOOKS.pack(Looks(lines, found, arena.sight)))
    assert found[0] == found[1], (start, end)
    return bool(found[0])


def is_outside(point: Whole, shape: list[Whole]) -> bool:
    return point not in shape and (naive.on_wall(*point, shape) or not naive.is_inside(*point, shape))  # type: ignore[arg-type]


@pytest.mark.short
@given(shape=st.sampled_from(SHAPES), shift=points, start=points, end=points, turn=st.booleans())
def test_a_polygon_blocks_what_enters_it_or_touches_a_corner(
    shape: list[Whole], shift: Whole, start: Whole, end: Whole, turn: bool
) -> None:
    shape = [(x + shift[0], y + shift[1]) for x, y in shape]
    assume(is_outside(start, shape) and is_outside(end, shape))
    arena = Box(100, 100).with_obstacles(Polygon(shape[::-1] if turn else shape))
    assert blocked(arena, start, end) == naive.polygon_blocks(start, end, shape)


@given(start=st.sampled_from(IN_ELL), end=st.sampled_from(IN_ELL))
def test_the_walls_of_an_arena_that_is_not_convex_block(start: Whole, end: Whole) -> None:
    # What is outside the L between two places in it is its missing corner, a square.
    missing = [(6, 6), (20, 6), (20, 20), (6, 20)]
    assert blocked(ELL, start, end) == naive.polygon_blocks(start, end, missing)


@given(centre=points, radius=st.integers(1, 5), start=points, end=points)
def test_a_circle_blocks_what_enters_it(centre: Whole, radius: int, start: Whole, end: Whole) -> None:
    assume(all((x - centre[0]) ** 2 + (y - centre[1]) ** 2 >= radius**2 for x, y in (start, end)))
    arena = Box(100, 100).with_obstacles(Circle(centre, radius))
    assert blocked(arena, start, end) == naive.circle_blocks(start, end, centre, radius)


inner = st.tuples(st.integers(-6, 5), st.integers(-6, 5))


@given(centre=points, shift=inner, start=points, end=points, shape=st.sampled_from(SHAPES[:3]))
def test_on_a_torus_images_block(centre: Whole, shift: Whole, start: Whole, end: Whole, shape: list[Whole]) -> None:
    side = 12
    shape = [(x + shift[0], y + shift[1]) for x, y in shape]
    arena = Torus(side, side).with_obstacles(Polygon(shape), Circle(centre, 2))
    assume(arena.contains([start, end]).all())
    way = arena.displacement(start, end)
    # Half the period away, two ways are shortest.
    assume((np.abs(way) < side / 2).all())
    end = start[0] + int(way[0]), start[1] + int(way[1])
    images = [(i * side, j * side) for i in (-2, -1, 0, 1, 2) for j in (-2, -1, 0, 1, 2)]
    shapes = [[(x + i, y + j) for x, y in shape] for i, j in images]
    assume(not any(start in image or end in image for image in shapes))
    expected = any(naive.polygon_blocks(start, end, image) for image in shapes)
    expected |= any(naive.circle_blocks(start, end, (centre[0] + i, centre[1] + j), 2) for i, j in images)
    assert blocked(arena, start, end) == expected


@given(angle=st.floats(0, 6.3), other=st.floats(0, 6.3), rounding=st.floats(-1e-13, 1e-13))
def test_a_body_on_a_round_wall_sees_what_is_before_it(angle: float, other: float, rounding: float) -> None:
    arena = Disc(5.0).with_obstacles(Circle((0, 0), 2))
    start = (2 + rounding) * np.array([np.cos(angle), np.sin(angle)])
    out = 1.5 * start
    assert not blocked(arena, start, out)
    end = 2 * np.array([np.cos(other), np.sin(other)])
    assume(abs(np.sin(0.5 * (angle - other))) > 1e-3)
    assert blocked(arena, start, end)


@given(share=st.floats(0.01, 0.99), rounding=st.floats(-1e-13, 1e-13), angle=st.floats(0.01, math.pi - 0.01))
def test_a_body_on_a_slanted_wall_sees_what_is_before_it(share: float, rounding: float, angle: float) -> None:
    arena = Box(20, 20).with_obstacles(Polygon([(0, 0), (3, 1), (1, 3)]))
    way = np.array([3, 1]) / math.sqrt(10)
    start = share * np.array([3, 1]) + rounding * np.array([way[1], -way[0]])
    off = math.atan2(1, 3) - angle
    assert not blocked(arena, start, start + np.array([math.cos(off), math.sin(off)]))
    # Through the obstacle, to its far corner and beyond.
    assert blocked(arena, start, (1.2, 3.6))
    assert blocked(arena, start, (1, 3)) == blocked(arena, start, start + 0.5 * ((1, 3) - start))


def test_a_body_at_a_corner_sees_past_it() -> None:
    arena = Box(20, 20).with_obstacles(Polygon([(-1, -1), (1, -1), (1, 1), (-1, 1)]))
    for end in [(3, 2), (1, 3), (3, 1), (0, 1), (1, 0), (-2, 3), (3, -2)]:
        assert not blocked(arena, (1, 1), end), end
    for end in [(-3, 1), (1, -3), (-2, 0), (-3, -2)]:
        assert blocked(arena, (1, 1), end), end


def test_convex_arenas_without_obstacles_block_nothing() -> None:
    for arena in (Disc(1), Box(1, 2), Torus(1, 2), Polygon([(0, 0), (1, 0), (0, 1)])):
        assert not len(arena.sight.segments) + len(arena.sight.discs)
        assert not blocked(arena, (0.1, 0.1), (0.3, 0.2))
