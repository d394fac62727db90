"""Arenas with obstacles: areas, places, the nearest free place, and what is refused."""

from __future__ import annotations

import math
import pickle
import re
from dataclasses import dataclass
from typing import Any

import numpy as np
import pytest
from arenas import Cylinder
from chance import generator
from naive import paper as naive
from scipy import stats

from teamsight import Box, Circle, Disc, Obstructed, Polygon, Torus
from teamsight.world import Arena, Walls
from teamsight.world.arena import _DRAW_AGAIN, ATTEMPT, Attempt, is_free
from teamsight.world.motion import is_watched
from teamsight.world.walls import clearance

ELL = Polygon([(0, 0), (4, 0), (4, 2), (2, 2), (2, 4), (0, 4)])
SQUARE = Polygon([(-1, -1), (1, -1), (1, 1), (-1, 1)])
BESIDE = Polygon([(1, -1), (3, -1), (3, 1), (1, 1)])


@dataclass(frozen=True)
class Ring(Cylinder):
    """A cylinder that says where its walls are."""

    confine = Cylinder.confine

    @property
    def walls(self) -> Walls:
        x, y = self.around / 2, self.height / 2
        return Walls(np.array([[-x, -y, x, -y], [x, y, -x, y]]), np.empty((0, 3)))


LENS = 2 * math.acos(0.5) - 0.5 * math.sqrt(3)
AREAS: list[tuple[Arena, float]] = [
    (Disc(5.0).with_obstacles(Circle((0, 0), 2)), 21 * math.pi),
    (Box(10, 10).with_obstacles(Circle((0, 0), 1), Circle((1, 0), 1)), 100 - 2 * math.pi + LENS),
    (Box(10, 10).with_obstacles(Circle((5, 5), 1), Circle((5, 0), 1)), 100 - 0.75 * math.pi),
    (Box(10, 10).with_obstacles(SQUARE, BESIDE), 92.0),
    (Box(10, 10).with_obstacles(SQUARE, SQUARE, Circle((0, 0), 1)), 96.0),
    (Box(2, 10).with_obstacles(SQUARE), 16.0),
    (Disc(2.0).with_obstacles(SQUARE), 4 * math.pi - 4),
    (Disc(1.0).with_obstacles(Circle((1, 0), 1)), math.pi - LENS),
    (Torus(4, 6).with_obstacles(Circle((2, 3), 1)), 24 - math.pi),
    (Torus(4, 6).with_obstacles(BESIDE, Circle((-1, 0), 0.5)), 24 - 4 - 0.125 * math.pi),
    (ELL.with_obstacles(Circle((2, 2), 1)), 12 - 0.75 * math.pi),
    (ELL.with_obstacles(Polygon([(1, 1), (5, 1), (1, 5)])), 12 - 5.0),
    (Ring(6, 4).with_obstacles(Circle((3, 2), 1)), 24 - 0.5 * math.pi),
]  # fmt: skip
ARENAS = [arena for arena, _ in AREAS]


@pytest.mark.parametrize(("arena", "area"), AREAS, ids=[str(arena)[:40] for arena in ARENAS])
def test_areas_are_those_of_the_formulas(arena: Arena, area: float) -> None:
    assert arena.area == pytest.approx(area, rel=1e-12)


def test_the_area_around_any_polygon_is_the_rest() -> None:
    points = generator().normal(size=(40, 2))
    shape = Polygon(points[np.argsort(np.arctan2(*points.T))])
    assert Box(20, 30).with_obstacles(shape).area == pytest.approx(600 - shape.area, rel=1e-12)


@pytest.mark.parametrize("arena", [*ARENAS, ELL], ids=lambda arena: str(arena)[:40])
@pytest.mark.parametrize("margin", [0.0, 0.05, 0.3])
def test_places_are_free_and_depend_on_their_numbers_only(arena: Arena, margin: float) -> None:
    u, v = generator().random((2, 300))
    places = arena.place(u, v, margin)
    assert arena.contains(places).all()
    assert is_free(arena, places, margin).all()  # type: ignore[arg-type]
    assert np.array_equal(places[7], arena.place(u[7], v[7], margin))
    assert np.array_equal(places[::-1], arena.place(u[::-1], v[::-1], margin))
    assert np.array_equal(places.reshape(3, 100, 2), arena.place(u.reshape(3, 100), v.reshape(3, 100), margin))


@pytest.mark.parametrize("arena", ARENAS, ids=lambda arena: str(arena)[:40])
def test_places_are_uniform_over_the_free_area(arena: Arena) -> None:
    """The share of the places left of a line is that of the area."""
    places = arena.place(*generator().random((2, 4000)))
    low, high = arena.bounds
    for cut in (0.3, 0.6):
        x = low[0] + cut * (high[0] - low[0])
        right = Polygon([(x, low[1] - 1), (high[0] + 1, low[1] - 1), (high[0] + 1, high[1] + 1), (x, high[1] + 1)])
        obstacles = arena.obstacles  # type: ignore[attr-defined]
        # On a torus the cut would repeat: it is taken in its box, whose obstacles are there as often as they reach it.
        images = [(one, np.zeros(2)) for one in obstacles] if not any(arena.period) else arena._images  # type: ignore[attr-defined]
        inner = arena.arena if not any(arena.period) else Box(*(high - low))  # type: ignore[attr-defined]
        share = Obstructed(inner, (right, *(shifted(*image) for image in images))).area / arena.area
        # Fails by chance once in a billion comparisons.
        assert stats.binomtest(int((places[:, 0] < x).sum()), len(places), share).pvalue > 1e-9


def shifted(obstacle: Any, shift: np.ndarray) -> Any:
    if isinstance(obstacle, Circle):
        return Circle(tuple(obstacle.centre + shift), obstacle.radius)
    return Polygon(obstacle.vertices + shift)


def test_a_place_is_drawn_again_with_philox_of_its_numbers() -> None:
    u, v = generator().random(2)
    words = np.array([[u, v]]).view(np.uint64)
    low, high = words & np.uint64(2**32 - 1), words >> np.uint64(32)
    numbers = np.empty((2, 1, 3))
    _DRAW_AGAIN(ATTEMPT.pack(Attempt(np.concatenate([low, high], axis=1), 5, numbers)))
    for k in range(3):
        a, b, c, d = naive.philox((*low[0].tolist(), 5 + k, 0), tuple(high[0].tolist()))
        assert numbers[:, 0, k].tolist() == [(a * 2**20 + b // 2**12 + 0.5) / 2**52, (c * 2**20 + d // 2**12 + 0.5) / 2**52]


@pytest.mark.parametrize("arena", [*ARENAS, ELL], ids=lambda arena: str(arena)[:40])
@pytest.mark.parametrize("margin", [0.0, 0.2])
def test_inside_returns_the_nearest_free_place(arena: Arena, margin: float) -> None:
    rng = generator()
    low, high = arena.bounds
    free = arena.place(*rng.random((2, 5000)), margin)
    points = rng.uniform(low - 0.5 * (high - low), high + 0.5 * (high - low), (200, 2))
    moved = arena.inside(points, margin)
    extent = float((high - low).max())
    assert arena.contains(moved).all()
    assert is_free(arena, moved, margin - 1e-9 * extent).all()  # type: ignore[arg-type]
    way = np.hypot(*np.moveaxis(arena.displacement(points, moved), -1, 0))
    others = np.hypot(*np.moveaxis(arena.displacement(points[:, None], free), -1, 0)).min(axis=1)
    assert (way <= others + 1e-9 * extent).all()
    assert np.abs(arena.displacement(arena.inside(free[:50], margin), free[:50])).max() < 1e-9 * extent


def test_a_margin_that_does_not_fit_is_left_out() -> None:
    arena = Disc(5.0).with_obstacles(Circle((0, 0), 2))
    assert arena.fits(1.4)
    assert not arena.fits(1.6)
    u, v = generator().random((2, 50))
    assert np.array_equal(arena.place(u, v, 1.6), arena.place(u, v))
    assert clearance(arena.near_walls, arena.place(u, v, 1.4)).min() >= 1.4


def test_obstacles_are_a_value() -> None:
    one = Disc(5.0).with_obstacles(Circle((0, 0), 2)).with_obstacles(SQUARE)
    other = Disc(5.0).with_obstacles(Circle((0, 0), 2), SQUARE)
    assert one == other == pickle.loads(pickle.dumps(one))
    assert hash(one) == hash(other)
    assert one.arena == Disc(5.0)
    assert one != Disc(5.0).with_obstacles(SQUARE, Circle((0, 0), 2))
    assert repr(one) == (
        "Disc(radius=5.0).with_obstacles(Circle(centre=(0.0, 0.0), radius=2.0), "
        "Polygon([(-1, -1), (1, -1), (1, 1), (-1, 1)]))"
    )
    assert eval(repr(one)) == one
    assert one.size == other.size


def test_outlines_are_what_is_drawn() -> None:
    wall, obstacles = Torus(4, 6).with_obstacles(Circle((2, 0), 1), SQUARE).outline()
    assert wall.tolist() == [[-2, -3], [2, -3], [2, 3], [-2, 3]]
    # The circle crosses the seam.
    assert [len(one) for one in obstacles] == [180, 180, 4]
    centres = sorted(one[:, 0].mean() for one in obstacles)
    assert centres == pytest.approx([-2, 0, 2], abs=1e-9)
    assert Disc(2.0).outline().wall.shape == (180, 2)
    assert np.hypot(*Disc(2.0).outline().wall.T) == pytest.approx(np.full(180, 2.0))
    assert np.array_equal(ELL.outline().wall, ELL.vertices)
    assert ELL.outline().obstacles == ()


def test_only_arenas_and_obstacles_of_users_are_watched() -> None:
    class Own(Circle):
        pass

    assert not any(map(is_watched, [ELL, *(arena for arena in ARENAS if "Ring" not in str(arena))]))
    assert is_watched(Ring(6, 4).with_obstacles(SQUARE))
    assert is_watched(ELL.with_obstacles(Own((1, 1), 0.5)))


@dataclass(frozen=True)
class Open(Box):
    """Its walls are those of a box, but not its `confine`."""

    confine = Torus.confine


@pytest.mark.parametrize(
    ("arena", "obstacles", "error", "message"),
    [
        (Disc(2.0), [], ValueError, r"Disc\(radius=2\.0\)\.with_obstacles\(\): give at least one obstacle, such as"),
        (Disc(2.0), [3.0], TypeError, r"obstacle 3\.0: must be a shape, such as Circle\(\(0, 0\), 1\)"),
        (Disc(2.0), [Box(1, 1)], TypeError, r"obstacle Box\(width=1\.0, height=1\.0\): must be a shape"),
        (Disc(2.0), [Circle((4, 0), 1)], ValueError, r"Circle.*: is outside Disc.*bounds are \[-2\.0, -2\.0\], .*; move it inside or"),
        (Disc(2.0), [Circle((0, 0), 3)], ValueError, r"cover the whole arena; leave some out or make them smaller"),
        (Disc(1e6), [Circle((0, 0), 1e-4)], ValueError, r"only 0\.0002 wide, less than 1e-09 of the largest coordinate 1e\+06, .*thicker"),
        (Disc(1e6), [Polygon([(0, 0), (9, 0), (9, 9), (8.9999, 1e-4)])], ValueError, r"only 0\.000\d+ wide, .*; make it thicker"),
        (Torus(4, 6), [Circle((0, 0), 2)], ValueError, r"is 4 long, but Torus.* repeats after 4; make it smaller"),
        (Cylinder(4, 6), [SQUARE], TypeError, r"Cylinder: cannot have obstacles, because .*; define `walls`.* or use Polygon"),
        (Open(4, 6), [SQUARE], TypeError, r"Open: cannot have obstacles, because .*; define `walls`"),
    ],
)  # fmt: skip


def test_what_cannot_be_is_refused(arena: Arena, obstacles: Any, error: type[Exception], message: str) -> None:
    with pytest.raises(error, match=message) as raised:
        arena.with_obstacles(*obstacles)
    assert "\n" not in re.sub(r" $", "", str(raised.value))


def test_many_obstacles_are_counted_where_a_world_is_described_and_named_by_repr() -> None:
    few, many = (Box(40, 40).with_obstacles(*(Circle((3.0 * i - 18, 0), 1) for i in range(n))) for n in (2, 12))
    assert str(few) == repr(few)
    assert str(many) == f"{Box(40, 40)!r} with 12 obstacles"
    assert repr(many).count("Circle(") == 12
