"""Walls of segments and discs: reflection like mirrors, and nobody leaves or passes through, whatever the step."""

from __future__ import annotations

import math

import numpy as np
import pytest
from chance import generator
from hypothesis import assume, given
from hypothesis import strategies as st
from naive import geometry as naive

from teamsight.world import Arena, Box, Circle, Disc, Polygon, Torus
from teamsight.world.motion import advance_entry, bodies_at, pack_move, turn_limit
from teamsight.world.walls import clearance

ELL = [(0, 0), (4, 0), (4, 2), (2, 2), (2, 4), (0, 4)]
STAR = [((1 + k % 2) * math.cos(k * math.pi / 5), (1 + k % 2) * math.sin(k * math.pi / 5)) for k in range(10)]
# Corners as sharp as needles, walls in one line, a neck that is narrower than any step.
COMB = [(0, 0), (8, 0), (8, 3), (6, 0.01), (5, 3), (4, 0.01), (3.9, 3), (3.8, 0.01), (2, 3), (1, 3), (0, 3)]

ARENAS: list[Arena] = [
    Polygon(ELL),
    Polygon(STAR),
    Polygon(COMB),
    Polygon([(1000 + x, -500 + y) for x, y in ELL]),
    Disc(5.0).with_obstacles(Circle((0, 0), 2)),
    Disc(3.0).with_obstacles(Circle((3, 0), 1), Circle((2, 1), 1), Polygon([(-1, -1), (1, -1), (0, 1)])),
    Box(4.0, 6.0).with_obstacles(Polygon([(-1, -1), (1, -1), (1, 1), (-1, 1)]), Polygon([(1, 1), (2, 1), (2, 3)])),
    Torus(4.0, 6.0).with_obstacles(Polygon([(1.5, 2), (2.5, 2), (2.5, 4), (1.5, 4)]), Circle((0, 0), 1.5)),
    Polygon(ELL).with_obstacles(Circle((1, 1), 0.6), Polygon([(2, 0), (3, 0), (3, 1)])),
]

shares = st.floats(1e-6, 1 - 1e-6)


def moved(arena: Arena, places: np.ndarray, steps: np.ndarray, angles: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Let bodies go; return where they are and where they face."""
    count = len(places)
    heading = np.stack([np.cos(angles), np.sin(angles)], axis=-1)
    cosine, sine = turn_limit(math.pi)
    bodies = bodies_at(np.array(places), heading)
    bodies.speed[:], bodies.turn_cosine[:], bodies.turn_sine[:] = steps, cosine, sine
    assert advance_entry(arena)(pack_move(arena, bodies, np.zeros((count, 2)), np.array(steps))) == 0
    return bodies.position, bodies.heading


@pytest.mark.short
@pytest.mark.parametrize("arena", [arena for arena in ARENAS if not any(arena.period)], ids=str)
@given(u=shares, v=shares, step=st.floats(0.01, 12), angle=st.floats(0, 2 * math.pi))
def test_walls_reflect_like_mirrors(arena: Arena, u: float, v: float, step: float, angle: float) -> None:
    walls = arena.walls
    assert walls is not None
    segments = [((x0, y0), (x1, y1)) for x0, y0, x1, y1 in walls.segments.tolist()]
    circles = [((x, y), abs(radius)) for x, y, radius in walls.discs.tolist()]
    place = arena.place(u, v)
    # The twin takes a wall where it begins for one that has just reflected it.
    assume(clearance(walls, place) > 1e-3)
    ends = []
    for way in (angle, angle + 1e-7, angle - 1e-7):
        going = step * math.cos(way), step * math.sin(way)
        ends.append(np.concatenate(naive.bounce(tuple(place.tolist()), going, segments, circles)))
    # At a corner, or after many bounces off circles, the smallest change of direction leads elsewhere.
    assume(max(np.abs(end - ends[0]).max() for end in ends[1:]) < 1e-3)
    position, heading = moved(arena, place[None], np.array([step]), np.array([angle]))
    assert np.concatenate([position[0], heading[0]]) == pytest.approx(ends[0], abs=1e-6)


@pytest.mark.parametrize("arena", ARENAS, ids=str)
def test_nobody_leaves_from_walls_and_corners(arena: Arena) -> None:
    rng = generator()
    walls = arena.walls
    assert walls is not None
    places = [arena.place(*rng.random((2, 100)))]
    for x0, y0, x1, y1 in walls.segments:
        share = np.concatenate([[0.0, 1.0, 0.5], rng.random(3)])[:, None]
        places.append((1 - share) * [x0, y0] + share * [x1, y1])
    for x, y, radius in walls.discs:
        angle = np.concatenate([np.arange(4) * math.pi / 2, rng.uniform(0, 7, 4)])
        places.append([x, y] + abs(radius) * np.stack([np.cos(angle), np.sin(angle)], axis=-1))
    # Also along the walls.
    edges = walls.segments[:, 2:] - walls.segments[:, :2]
    along = np.arctan2(edges[:, 1], edges[:, 0])
    ways = np.concatenate([along, along + math.pi, np.arange(8) * math.pi / 4, rng.uniform(0, 7, 8)])
    start = arena.displacement(np.zeros(2), np.concatenate(places))
    start = start[arena.contains(start)]
    place, angle = np.repeat(start, len(ways), axis=0), np.tile(ways, len(start))
    extent = float(np.max(arena.bounds[1] - arena.bounds[0]))
    for length in (0.0, 5e-324, 1e-300, 1e-17, 1e-14, 1e-12, 1e-9, 1e-3, 0.1, 1.0, 30.0, 1e3):
        position, heading = moved(arena, place, np.full(len(place), length * extent), angle)
        assert arena.contains(position).all(), length
        assert np.abs(np.hypot(*heading.T) - 1).max() < 1e-9
        # What begins where a step has ended ends inside too.
        position, _ = moved(arena, position, np.full(len(place), 0.3 * extent), np.arctan2(*heading.T[::-1]))
        assert arena.contains(position).all(), length


def test_nobody_passes_through_a_thin_wall() -> None:
    rng = generator()
    # A wall a thousandth thick that crosses the whole arena, and one made of obstacles that touch each other.
    wall = Polygon([(-0.001, -3), (0.001, -3), (0.001, 3), (-0.001, 3)])
    touching = [Polygon([(-1, low), (1, low), (1, low + 2), (-1, low + 2)]) for low in (-3, -1, 1)]
    for obstacles in ([wall], touching):
        arena = Box(4, 4).with_obstacles(*obstacles)
        position = arena.place(*rng.random((2, 500)))
        side = np.sign(position[:, 0])
        angle = rng.uniform(0, 7, 500)
        for _ in range(100):
            step = rng.choice([1e-9, 0.01, 0.5, 3.0, 40.0], 500)
            position, heading = moved(arena, position, step, angle)
            turn = rng.random(500) < 0.2
            angle = np.where(turn, rng.uniform(0, 7, 500), np.arctan2(heading[:, 1], heading[:, 0]))
            assert np.array_equal(np.sign(position[:, 0]), side)
            assert arena.contains(position).all()


def test_bodies_follow_a_slanted_wall() -> None:
    """Rounding, and places that it has put behind the wall, neither stop them nor turn them."""
    rng = generator()
    arena = Polygon([(0, 0), (3, 1), (0.3, 2.7)])
    along = np.array([3, 1]) / math.sqrt(10)
    normal = np.array([-along[1], along[0]])
    start = rng.uniform(0.1, 1.0, (1000, 1)) * along + rng.choice([0, 1e-16, 2.9e-12], (1000, 1)) * -normal
    position, angle = start, math.atan2(1, 3)
    for _ in range(100):
        position, heading = moved(arena, position, np.full(1000, 1.5), np.full(1000, angle))
        assert np.abs(position - start - 1.5 * along).max() < 1e-9
        assert np.abs(heading - along).max() < 1e-9
        position, heading = moved(arena, position, np.full(1000, 1.5), np.full(1000, angle + math.pi))
        assert np.abs(position - start).max() < 1e-9
        assert arena.contains(position).all()


def test_nobody_leaves_a_needle_through_its_tip() -> None:
    """Where a path meets a wall at a small angle, rounding moves the place far along the wall, here beyond its end."""
    corners = [
        (9.07287751799688, 12.0021209216381), (9.99604439403361, 10.0057443428859), (10.0020263043321, 9.99286187912331),
    ]  # fmt: skip
    arena = Polygon(corners)
    places = np.array([(10.002026304331197, 9.992861879125325)])
    position, _ = moved(arena, places, np.array([100.46295212574137]), np.array([2.003941750923259]))
    assert arena.contains(position).all()


@pytest.mark.parametrize("off", [0.0, 1e-13, -1e-13, 2.9e-12, -2.9e-12])
def test_walls_in_one_line_do_not_act_on_each_other(off: float) -> None:
    """Bodies on the common line of two walls, within the rounding, beside one of them or between them."""
    slanted = np.array([3.0, 1.0])
    blocks = [Polygon([k * slanted, (k + 0.5) * slanted, (k + 0.2) * slanted - [0, 1]]) for k in (0, 1)]
    arena = Box(20, 20).with_obstacles(*blocks)
    way, normal = slanted / math.sqrt(10), np.array([-1, 3]) / math.sqrt(10)
    start = np.array([share * slanted + off * normal for share in (0.1, 0.7, 1.1, 1.6)])
    for turn in (0.0, math.pi):
        for length in (1e-3, 0.3):
            position, heading = moved(arena, start, np.full(4, length), np.full(4, math.atan2(1, 3) + turn))
            assert position == pytest.approx(start + math.cos(turn) * length * way, abs=1e-9)
            assert heading == pytest.approx(math.cos(turn) * np.tile(way, (4, 1)), abs=1e-9)


def test_tiny_steps_beside_a_wall_keep_their_heading() -> None:
    """A body can be on the line of a wall of which it is far, and products of its step be 0."""
    places = np.array([[2.0, 1.0], [1.0, 2.0]])
    for step in (5e-324, 1e-200, 1e-13):
        position, heading = moved(Polygon(ELL), places, np.full(2, step), np.array([0.0, math.pi / 2]))
        assert position == pytest.approx(places)
        assert heading == pytest.approx(np.array([[1, 0], [0, 1]]))


def test_on_a_torus_obstacles_reflect_across_the_seam() -> None:
    arena = Torus(4.0, 4.0).with_obstacles(Circle((2, 0), 1), Polygon([(-0.5, 1.5), (0.5, 1.5), (0.5, 2.5), (-0.5, 2.5)]))
    places = np.array([[0.0, 0.0], [0.0, 0.0], [0.0, 0.0], [1.0, -1.9]])
    position, heading = moved(arena, places, np.array([1.5, 1.5, 2.0, 3.5]), np.array([0.0, math.pi, -math.pi / 2, 0.0]))
    assert position == pytest.approx(np.array([[0.5, 0], [-0.5, 0], [0, -1.0], [-1.5, -1.9]]))
    assert heading == pytest.approx(np.array([[-1, 0], [1, 0], [0, 1], [-1, 0]]), abs=1e-12)
