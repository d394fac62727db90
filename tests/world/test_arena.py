"""Arenas: what is inside, the way from place to place, and the wall."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from naive import paper as naive

from teamsight.world.arena import Arena, Box, Disc, Torus
from teamsight.world.motion import advance_entry, bodies_at, pack_move, turn_limit

ARENAS = [Disc(5.0), Disc(0.3), Box(4.0, 9.0), Torus(3.0, 7.0)]

shares = st.floats(1e-9, 1 - 1e-9)
angles = st.floats(0, 2 * math.pi)
lengths = st.one_of(st.floats(0, 1), st.floats(0, 60))


def confined(arena: Arena, place: object, step: float, angle: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Let one body that faces `angle` go `step`; return where it is, how it got there and where it faces."""
    heading = np.array([[math.cos(angle), math.sin(angle)]])
    cosine, sine = turn_limit(math.pi)
    bodies = bodies_at(np.array([place], float), heading)
    bodies.speed[:], bodies.turn_cosine[:], bodies.turn_sine[:] = step, cosine, sine
    move = pack_move(arena, bodies, heading, np.array([step]))
    assert advance_entry(arena)(move) == 0
    return bodies.position[0], bodies.moved[0], bodies.heading[0]


@pytest.mark.short
@given(u=shares, v=shares, step=lengths, angle=angles, radius=st.floats(0.1, 20))
def test_the_wall_of_a_disc_reflects_like_a_mirror(
    u: float, v: float, step: float, angle: float, radius: float
) -> None:
    place = Disc(radius).place(u, v)
    position, _, heading = confined(Disc(radius), place, step, angle)
    # Along the wall a ray bounces without end: such rays are in the next test.
    distance = abs(place[0] * math.sin(angle) - place[1] * math.cos(angle))
    assume(distance < 0.99 * radius and step < 20 * radius)
    there, face = naive.bounce_in_disc(
        place, (step * math.cos(angle), step * math.sin(angle)), (math.cos(angle), math.sin(angle)), radius
    )
    assert position == pytest.approx(there, abs=1e-6 * radius)
    assert heading == pytest.approx(face, abs=1e-6)


@given(angle=angles, off=st.floats(-1e-6, 1e-6), depth=st.floats(0, 1e-12), step=st.floats(0, 1e4))
def test_nothing_leaves_a_disc_along_its_wall(angle: float, off: float, depth: float, step: float) -> None:
    place = Disc(1.0).place(1 - depth, angle / (2 * math.pi) % 1)
    position, _, heading = confined(Disc(1.0), place, step, angle + math.pi / 2 + off)
    assert Disc(1.0).contains(position)
    assert np.hypot(*heading) == pytest.approx(1, abs=1e-12)


@given(u=shares, v=shares, step=lengths, angle=angles, width=st.floats(0.5, 20), height=st.floats(0.5, 20))
def test_the_walls_of_a_box_reflect_like_mirrors(
    u: float, v: float, step: float, angle: float, width: float, height: float
) -> None:
    arena = Box(width, height)
    x, y = arena.place(u, v)
    position, moved, heading = confined(arena, (x, y), step, angle)
    there_x, sign_x = naive.fold(x + step * math.cos(angle), width / 2)
    there_y, sign_y = naive.fold(y + step * math.sin(angle), height / 2)
    assert position == pytest.approx((there_x, there_y), abs=1e-9)
    assert moved == pytest.approx((there_x - x, there_y - y), abs=1e-9)
    near_wall = np.abs(np.abs(position) - arena.bounds[1]) < 1e-9  # There, rounding decides which image it is.
    expected = np.array([sign_x * math.cos(angle), sign_y * math.sin(angle)])
    assert np.all(near_wall | (np.abs(heading - expected) < 1e-12))


@given(u=shares, v=shares, step=st.floats(0, 3), angle=angles, width=st.floats(7, 20), height=st.floats(7, 20))
def test_on_a_torus_what_leaves_comes_back(
    u: float, v: float, step: float, angle: float, width: float, height: float
) -> None:
    arena = Torus(width, height)
    place = arena.place(u, v)
    position, moved, heading = confined(arena, place, step, angle)
    way = (step * math.cos(angle), step * math.sin(angle))
    assert arena.displacement(place + way, position) == pytest.approx((0, 0), abs=1e-12)
    assert moved == pytest.approx(way, abs=1e-12)
    assert heading == pytest.approx((math.cos(angle), math.sin(angle)), abs=1e-12)


@pytest.mark.parametrize("arena", ARENAS, ids=str)
@given(u=shares, v=shares, step=lengths, angle=angles)
def test_places_and_moves_stay_inside(arena: Arena, u: float, v: float, step: float, angle: float) -> None:
    place = arena.place(u, v)
    position, _, heading = confined(arena, place, step, angle)
    low, high = arena.bounds
    assert arena.contains(place)
    assert arena.contains(position)
    assert np.all((low <= position) & (position <= high))
    assert np.hypot(*heading) == pytest.approx(1, abs=1e-9)


@given(st.tuples(*[st.floats(-20, 20)] * 4))
def test_displacements_on_a_torus_are_the_shortest(numbers: tuple[float, ...]) -> None:
    start, end = numbers[:2], numbers[2:]
    way = Torus(30.0, 40.0).displacement(start, end)
    expected = naive.shortest((end[0] - start[0], end[1] - start[1]), (30.0, 40.0))
    # Half a side away, both ways are shortest.
    assert np.abs(way) == pytest.approx(np.abs(expected), abs=1e-9)
    assert Disc(30.0).displacement(start, end) == pytest.approx(np.subtract(end, start))


@pytest.mark.parametrize("arena", ARENAS, ids=str)
def test_areas_by_counting(arena: Arena) -> None:
    low, high = arena.bounds
    count = 400
    steps = (np.arange(count) + 0.5) / count
    grid = np.stack(np.meshgrid(*(low[:, None] + (high - low)[:, None] * steps)), axis=-1)
    # The number of cells that a curve of this length cuts bounds the error.
    assert arena.contains(grid).mean() * np.prod(high - low) == pytest.approx(arena.area, rel=8 / count)


@pytest.mark.parametrize("arena", [Torus(3.0, 7.0), Torus(7.0, 3.0)], ids=str)
def test_a_torus_refuses_ranges_that_see_a_body_twice(arena: Arena) -> None:
    arena.check_reach(1.5)
    with pytest.raises(ValueError, match=r"range=1\.51: .* at most half .* 1\.5; take"):
        arena.check_reach(1.51)
    Disc(0.1).check_reach(100.0)
