"""Bodies that meet: the same as event by event, never an overlap, whatever the arena, the speed and the order of rows."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from naive import contact as naive
from numpy.random import default_rng
from scipy.spatial import cKDTree

from teamsight.core.kernel import kernel
from teamsight.core.table import Table
from teamsight.world import Arena, Box, Circle, Disc, Polygon, Torus
from teamsight.world.contact import _MOST_LEGS, Contact, SolidBodies, contact_entry, contact_of
from teamsight.world.drive import Free
from teamsight.world.motion import BODIES, FINISHED, advance_entry, bodies_at, intend_entry, pack_move
from teamsight.world.noise import key_of
from teamsight.world.placement import Founders, starts
from teamsight.world.walls import clearance, repeated

OPEN = Box(1000.0, 1000.0)
ARENAS: list[Arena] = [
    Box(10.0, 8.0), Disc(5.0), Torus(10.0, 8.0), Polygon([(0, 0), (9, 0), (9, 5), (4, 5), (4, 9), (0, 9)]),
    Box(10.0, 8.0).with_obstacles(Circle((1, 1), 1.2), Polygon([(-3, -3), (-1, -3), (-2, 0)])),
    Torus(10.0, 8.0).with_obstacles(Circle((4.5, 0), 1.2)),
]  # fmt: skip


@kernel
def _bounce(
    way_x: float, way_y: float, heading_x: float, heading_y: float, normal_x: float, normal_y: float, parameters: Any
) -> tuple[float, float, float, float]:
    into = 2.0 * min(way_x * normal_x + way_y * normal_y, 0.0)
    ahead = 2.0 * min(heading_x * normal_x + heading_y * normal_y, 0.0)
    return (
        way_x - into * normal_x, way_y - into * normal_y, heading_x - ahead * normal_x, heading_y - ahead * normal_y
    )  # fmt: skip


class Bounce(Contact):
    """Bodies are thrown back like light from a mirror."""

    meet = _bounce


class Crowd:
    """Bodies in an arena, with the ways that they intend."""

    def __init__(self, arena: Arena, place: Any, radius: Any, contact: Any = "slide") -> None:
        self.arena, self.contact = arena, contact_of(contact, arena)
        self.bodies = Table(BODIES, len(place))
        self.bodies.position[:], self.bodies.radius[:] = place, radius
        self.bodies.turn_cosine[:], self.bodies.heading[:] = -2.0, (1.0, 0.0)
        self._intend = pack_move(arena, self.bodies, self.bodies.aim, self.bodies.distance)
        self._solid = SolidBodies(self.contact, arena, [self.bodies], [False], np.array(arena.size, float))

    def go(self, way: Any) -> None:
        """Make a step in which each intends this way."""
        length = np.hypot(*np.asarray(way, float).T)
        self.bodies.speed[:] = self.bodies.distance[:] = length
        self.bodies.aim[:] = np.where(length[:, None] > 0, way / np.maximum(length, 1e-300)[:, None], 0.0)
        intend_entry(Free())(self._intend)
        while (need := contact_entry(self.contact, self.arena)(self._solid.record())) not in (0, FINISHED):
            self._solid.grow(need)

    @property
    def gap(self) -> float:
        """The least distance between the surfaces of two bodies."""
        bodies, side = self.bodies, np.array(self.arena.period)
        ways = self.arena.displacement(bodies.position[:, None], bodies.position)
        assert side.shape == (2,)
        apart = np.hypot(ways[..., 0], ways[..., 1]) - bodies.radius[:, None] - bodies.radius
        np.fill_diagonal(apart, np.inf)
        return float(apart.min())


def scattered(arena: Arena, count: int, radius: Any, seed: int) -> np.ndarray:
    """Return places at which bodies do not overlap."""
    radii = np.broadcast_to(np.asarray(radius, float), count)
    founders = Founders(0, count, "uniform", 0.0, radius=radii)
    return starts(arena, [founders], key_of(seed)[np.newaxis]).position[0]


def ways_of(rng: np.random.Generator, count: int, longest: float) -> np.ndarray:
    """Return ways of all directions and of very different lengths."""
    angle, length = rng.uniform(0, 2 * math.pi, count), longest * rng.choice([0.0, 0.05, 0.3, 1.0], count)
    return length[:, None] * np.stack([np.cos(angle), np.sin(angle)], axis=1)


@pytest.mark.short
@pytest.mark.parametrize(("contact", "meet"), [("stop", naive.stop), ("slide", naive.slide)])
@given(seed=st.integers(0, 10**6), count=st.integers(2, 9))
def test_contacts_are_found_in_their_order(contact: str, meet: Callable[..., Any], seed: int, count: int) -> None:
    rng = default_rng(seed)
    radius = rng.uniform(0.2, 0.6, count)
    place = scattered(Box(4.0, 4.0), count, radius, seed)
    way = ways_of(rng, count, 3.0)
    crowd = Crowd(OPEN, place, radius, contact)
    crowd.go(way)
    pairs = [list(map(tuple, array.tolist())) for array in (place, way)]
    expected, is_pocket = naive.step(*pairs, radius.tolist(), meet, _MOST_LEGS)
    assume(not is_pocket)
    np.testing.assert_allclose(crowd.bodies.position, expected, atol=1e-6)


@pytest.mark.short
@pytest.mark.parametrize("arena", ARENAS, ids=str)
@pytest.mark.parametrize("contact", ["stop", "slide", Bounce()], ids=["stop", "slide", "bounce"])
@given(seed=st.integers(0, 10**6))
def test_bodies_never_overlap(arena: Arena, contact: Any, seed: int) -> None:
    rng = default_rng(seed)
    radius = rng.choice([0.1, 0.25, 0.4], 30)
    crowd = Crowd(arena, scattered(arena, 30, radius, seed), radius, contact)
    assert arena.walls is not None
    walls = repeated(arena.walls, arena.period, arena.bounds)
    for _ in range(8):
        crowd.go(ways_of(rng, 30, 1.5))
        assert crowd.gap >= -1e-9
        assert np.asarray(arena.contains(crowd.bodies.position)).all()
        assert (clearance(walls, crowd.bodies.position) >= radius - 1e-9).all()
        np.testing.assert_allclose(np.hypot(*crowd.bodies.heading.T), 1.0, atol=1e-9)


@pytest.mark.parametrize("contact", ["stop", "slide"])
def test_five_thousand_in_a_crowd_stay_apart(contact: str) -> None:
    rng, arena, count = default_rng(5), Box(100.0, 100.0), 5000
    radius = math.sqrt(0.4 * arena.area / count / math.pi)
    crowd = Crowd(arena, scattered(arena, count, radius, 1), radius, contact)
    for _ in range(10):
        crowd.go(ways_of(rng, count, 0.7))
        nearest = cKDTree(crowd.bodies.position).query(crowd.bodies.position, k=2)[0][:, 1]
        assert nearest.min() >= 2 * radius - 1e-9
        assert np.abs(crowd.bodies.position).max() <= 50 - radius + 1e-9


@pytest.mark.short
@given(seed=st.integers(0, 10**6), arena=st.sampled_from(ARENAS))
def test_the_order_of_rows_changes_no_bit(seed: int, arena: Arena) -> None:
    rng = default_rng(seed)
    radius = rng.choice([0.2, 0.35], 25)
    place, order = scattered(arena, 25, radius, seed), rng.permutation(25)
    one, other = Crowd(arena, place, radius), Crowd(arena, place[order], radius[order])
    for _ in range(4):
        way = ways_of(rng, 25, 1.0)
        one.go(way)
        other.go(way[order])
        for name in ("position", "heading", "moved", "bumps", "blocked"):
            assert np.array_equal(one.bodies[name][order], other.bodies[name]), name


@pytest.mark.short
def test_cells_find_the_pairs_that_all_pairs_find() -> None:
    # Two far groups of bodies: the first moves as alone, whether pairs are found in cells or among all.
    rng = default_rng(2)
    long = Box(60.0, 8.0)
    few = scattered(Box(6.0, 6.0), 40, 0.3, 1) - (25.0, 0.0)
    many = np.concatenate([few, scattered(Box(6.0, 6.0), 40, 0.3, 2) + (25.0, 0.0)])
    alone, together = Crowd(long, few, 0.3), Crowd(long, many, 0.3)
    for _ in range(10):
        way = ways_of(rng, 80, 0.8)
        alone.go(way[:40])
        together.go(way)
        assert np.array_equal(alone.bodies.position, together.bodies.position[:40])


@pytest.mark.short
def test_two_that_meet_head_on_stop_where_they_touch() -> None:
    crowd = Crowd(OPEN, [(-2.0, 0.0), (2.0, 0.0)], 0.5, "stop")
    crowd.go([(10.0, 0.0), (-10.0, 0.0)])
    np.testing.assert_allclose(crowd.bodies.position, [(-0.5, 0.0), (0.5, 0.0)], atol=1e-9)
    assert crowd.bodies.bumps.tolist() == [1, 1]
    # They go on to press: that is the same bump.
    crowd.go([(1.0, 0.0), (-1.0, 0.0)])
    assert crowd.bodies.bumps.tolist() == [1, 1]
    assert crowd.bodies.blocked.all()
    crowd.go([(-1.0, 0.0), (1.0, 0.0)])
    np.testing.assert_allclose(crowd.bodies.position, [(-1.5, 0.0), (1.5, 0.0)], atol=1e-9)
    assert not crowd.bodies.blocked.any()


@pytest.mark.short
def test_a_fast_body_does_not_pass_through_a_small_one() -> None:
    crowd = Crowd(OPEN, [(-400.0, 0.0), (0.0, 0.0)], 0.001, "stop")
    crowd.go([(900.0, 0.0), (0.0, 0.0)])
    np.testing.assert_allclose(crowd.bodies.position[0], (-0.002, 0.0), atol=1e-8)
    assert crowd.bodies.bumps.tolist() == [1, 0]


@pytest.mark.short
def test_sliding_keeps_what_is_left_along_the_tangent() -> None:
    # It meets the other at 45°, after 3 of 5; the tangential part of the other 2 is √2.
    at = np.array([-1.0, 1.0]) / math.sqrt(2)
    crowd = Crowd(OPEN, [at + (-3.0, 0.0), (0.0, 0.0)], 0.5)
    crowd.go([(5.0, 0.0), (0.0, 0.0)])
    np.testing.assert_allclose(crowd.bodies.position[0], at + np.array([1.0, 1.0]), atol=1e-9)
    np.testing.assert_allclose(crowd.bodies.moved[0], np.array([4.0, 1.0]), atol=1e-9)


@pytest.mark.short
def test_one_that_is_run_into_from_behind_goes_on() -> None:
    crowd = Crowd(OPEN, [(0.0, 0.0), (2.0, 0.0)], 0.5, "stop")
    crowd.go([(5.0, 0.0), (1.0, 0.0)])
    # The pursuer catches up at 1.25, and stops there.
    np.testing.assert_allclose(crowd.bodies.position, [(1.25, 0.0), (3.0, 0.0)], atol=1e-9)
    assert crowd.bodies.bumps.tolist() == [1, 0]


@pytest.mark.short
@pytest.mark.parametrize(("arena", "smaller"), [(Box(10.0, 8.0), Box(9.0, 7.0)), (Disc(5.0), Disc(4.5))], ids=str)
def test_a_single_body_is_reflected_like_a_point_in_a_smaller_arena(arena: Arena, smaller: Arena) -> None:
    rng = default_rng(3)
    place = smaller.place(*rng.uniform(0, 1, (2, 200)))
    way = ways_of(rng, 200, 6.0)
    points = bodies_at(place, np.tile((1.0, 0.0), (200, 1)))
    length = points.speed[:] = np.hypot(*way.T)
    points.turn_cosine[:] = -2.0
    aim = way / np.maximum(length, 1e-300)[:, None]
    advance_entry(smaller)(pack_move(smaller, points, aim, length))
    expected, headings = points.position, points.heading
    for row in range(200):
        crowd = Crowd(arena, place[row : row + 1], 0.5)
        crowd.go(way[row : row + 1])
        if length[row]:
            np.testing.assert_allclose(crowd.bodies.position[0], expected[row], atol=1e-8)
            np.testing.assert_allclose(crowd.bodies.heading[0], headings[row], atol=1e-8)
        else:
            assert (crowd.bodies.position[0] == place[row]).all()


@pytest.mark.short
def test_bodies_that_overlap_can_leave_each_other() -> None:
    crowd = Crowd(OPEN, [(0.0, 0.0), (0.4, 0.0)], 0.5, "stop")
    crowd.go([(0.1, 0.0), (0.0, 0.0)])
    assert crowd.bodies.position[0].tolist() == [0.0, 0.0]
    crowd.go([(-3.0, 0.0), (0.0, 0.0)])
    assert crowd.bodies.position[0].tolist() == [-3.0, 0.0]
