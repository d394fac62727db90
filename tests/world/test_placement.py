"""Placement: uniform over the area, or spread without overlap where that is possible."""

from __future__ import annotations

import numpy as np
import pytest
from arenas import Cylinder, Ellipse, Hall
from chance import generator
from scipy import stats

from teamsight.world import placement
from teamsight.world.arena import Arena, Box, Disc, Torus, is_free
from teamsight.world.search import proximity_graph
from teamsight.world.shapes import Circle, Polygon

ARENAS: list[Arena] = [
    Disc(5.0), Box(12.0, 7.0), Torus(10.0, 8.0), Cylinder(10.0, 8.0), Ellipse(6.0, 4.5), Hall(12.0, 7.0, 0.2),
]  # fmt: skip


@pytest.mark.parametrize("arena", ARENAS, ids=str)
def test_uniform_places_are_uniform_over_the_area(arena: Arena) -> None:
    points = arena.place(*generator().random((2, 4000)))
    assert arena.contains(points).all()
    if isinstance(arena, Disc):
        shares = [np.sum(points**2, axis=1) / 25, (np.arctan2(points[:, 1], points[:, 0]) / (2 * np.pi)) % 1]
    elif isinstance(arena, Ellipse):
        unit = points / arena.size
        shares = [np.sum(unit**2, axis=1), (np.arctan2(unit[:, 1], unit[:, 0]) / (2 * np.pi)) % 1]
    else:
        shares = list((points / (2 * arena.bounds[1]) + 0.5).T)
    for share in shares:
        # Fails by chance once in ten million runs.
        assert stats.kstest(share, "uniform").pvalue > 1e-7


@pytest.mark.parametrize("arena", ARENAS, ids=str)
@pytest.mark.parametrize("count", [1, 2, 7, 12, 15])
def test_discs_that_fit_neither_overlap_nor_cross_the_wall(arena: Arena, count: int) -> None:
    points = placement.spread(arena, generator().random((2, count)), 1.0)
    assert len(points) == count
    apart = proximity_graph(points, None, 2 - 1e-6, arena)
    assert not len(apart.identity)
    if isinstance(arena, Disc):
        assert np.all(np.hypot(*points.T) <= 4 + 1e-9)
    elif isinstance(arena, Box):
        assert np.all(np.abs(points) <= arena.bounds[1] - 1 + 1e-9)
    elif isinstance(arena, Cylinder):
        assert np.all(np.abs(points[:, 1]) <= arena.height / 2 - 1 + 1e-9)
    elif isinstance(arena, Ellipse):
        wall = arena.place(np.full(1000, 1.0), np.linspace(0, 1, 1000))
        assert np.min(np.hypot(*(wall[:, None] - points).T)) >= 1 - 2e-3


@pytest.mark.parametrize(
    "arena", [Disc(3.0), Disc(0.5), Box(1.0, 30.0), Torus(6.0, 5.0), Cylinder(6.0, 5.0), Ellipse(4.0, 2.0)], ids=str
)
@pytest.mark.parametrize("count", [2, 40])
def test_discs_that_do_not_fit_are_spread_evenly(arena: Arena, count: int) -> None:
    rng = generator()
    points = placement.spread(arena, rng.random((2, count)), 1.0)
    assert np.isfinite(points).all()
    assert arena.contains(points).all()
    # Even: the worst served of many places is nearer to somebody than under random placement.
    samples = arena.place(rng.random(4000), rng.random(4000))

    def worst(of: np.ndarray) -> float:
        ways = arena.displacement(of[None, :, :], samples[:, None, :])
        return float(np.sqrt(np.min(np.sum(ways**2, axis=-1), axis=1)).max())

    if count == 40:
        random = [worst(arena.place(*rng.random((2, count)))) for _ in range(5)]
        assert worst(points) < 0.8 * np.mean(random)


@pytest.mark.parametrize(
    "arena",
    [
        Polygon([(0, 0), (12, 0), (12, 5), (5, 5), (5, 12), (0, 12)]),
        Polygon([(0, 0), (12, 0), (12, 5), (5, 5), (5, 12), (0, 12)]).with_obstacles(Circle((9, 4), 1.0)),
        Torus(12, 8).with_obstacles(Circle((6, 4), 2.0)),
        Disc(6.0).with_obstacles(Circle((0, 0), 2.0)),
    ],
    ids=lambda arena: str(arena)[:40],
)
@pytest.mark.parametrize(("count", "radius"), [(7, 1.0), (40, 1.0), (5, 4.0)])
def test_discs_are_spread_among_obstacles(arena: Arena, count: int, radius: float) -> None:
    points = placement.spread(arena, generator().random((2, count)), radius)
    assert arena.contains(points).all()
    if count == 7:
        assert is_free(arena, points, radius - 1e-6).all()  # type: ignore[arg-type]
        assert not len(proximity_graph(points, None, 2 * radius - 1e-6, arena).identity)


def test_the_even_arrangement_is_inside_where_the_arena_is_hollow() -> None:
    # The centre of half of this ring is in its hole.
    arena = Disc(6.0).with_obstacles(Circle((0, 0), 5.0))
    points = placement.spread(arena, generator().random((2, 2)), 8.0)
    assert arena.contains(points).all()
    assert np.hypot(*(points[0] - points[1])) > 9


def test_spread_robots_see_more_than_random_ones() -> None:
    rng = generator()
    samples = Disc(5.0).place(rng.random(5000), rng.random(5000))

    def covered(points: np.ndarray) -> float:
        return float((np.diff(proximity_graph(samples, points, 1.0).start) > 0).mean())

    spread = covered(placement.spread(Disc(5.0), rng.random((2, 12)), 1.0))
    # 12 discs of a 25th of the area that do not overlap; 3 standard deviations of counting are 0.02.
    assert spread == pytest.approx(12 / 25, abs=0.03)
    assert covered(Disc(5.0).place(*rng.random((2, 12)))) < spread + 0.02


@pytest.mark.parametrize("arena", [Box(4.0, 3.0), Torus(3.0, 6.0)], ids=str)
def test_cells_are_equally_likely_and_bodies_at_their_centres(arena: Arena) -> None:
    places = placement.in_cells(arena, generator().random((2, 12_000)))
    cells = places - np.asarray(arena.bounds[0]) - 0.5
    assert np.array_equal(cells, np.rint(cells))
    _, count = np.unique(cells, axis=0, return_counts=True)
    assert len(count) == round(arena.area)
    # Fails by chance once in ten million runs.
    assert stats.chisquare(count).pvalue > 1e-7


def test_cells_whose_centre_is_outside_are_refused() -> None:
    with pytest.raises(ValueError, match="whole numbers"):
        placement.in_cells(Box(4.3, 4.3), np.array([[0.99], [0.5]]))
