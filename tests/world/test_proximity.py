"""The proximity graph: the same edges by pairs, by cells, by the slow twin and by scipy."""

from __future__ import annotations

import numpy as np
import pytest
from arenas import Cylinder, Ellipse, Hall
from chance import generator
from hypothesis import given, settings
from hypothesis import strategies as st
from naive import paper as naive
from scipy.spatial import cKDTree

from teamsight.core.neighbour_list import NeighbourList
from teamsight.world.arena import Arena, Box, Disc, Torus
from teamsight.world.limits import SHAPES
from teamsight.world.search import MOST_PAIRS, Search, proximity_graph

ARENAS: list[Arena | None] = [
    None, Disc(5.0), Box(12.0, 7.0), Torus(10.0, 8.0), Torus(3.0, 30.0), Cylinder(10.0, 8.0), Cylinder(3.0, 30.0),
    Cylinder(30.0, 1.0), Ellipse(6.0, 4.0), Hall(12.0, 7.0, 0.5),
]  # fmt: skip

seeds = st.integers(0, 2**32 - 1)
sizes = st.integers(0, 90)


def places(arena: Arena | None, rng: np.random.Generator, size: int) -> np.ndarray:
    """Places in an arena: anywhere, on a lattice (so that distances are often exactly the range), or all in a heap."""
    points = (arena or Disc(5.0)).place(rng.random(size), rng.random(size))
    kind = rng.integers(3)
    if kind == 1:
        points = np.clip(np.round(2 * points) / 2, *(arena or Disc(5.0)).bounds)
        points = points[(arena or Disc(5.0)).contains(points)]
    return 0.01 * points if kind == 2 else points


def assert_same(one: NeighbourList, other: NeighbourList) -> None:
    for a, b in zip(one, other, strict=True):
        assert a.tobytes() == b.tobytes()


@pytest.mark.short
@pytest.mark.parametrize("shape", SHAPES)
@pytest.mark.parametrize("arena", ARENAS, ids=str)
@settings(max_examples=6)
@given(seed=seeds, n=sizes, m=sizes, equal=st.booleans())
def test_pairs_and_cells_and_the_slow_twin_agree(
    arena: Arena | None, shape: str, seed: int, n: int, m: int, equal: bool
) -> None:
    rng = np.random.default_rng(seed)
    here, there = places(arena, rng, n), places(arena, rng, m)
    reach = np.full(len(here), 1.0) if equal else rng.choice([0.0, 0.5, 1.0, 1.5], len(here))
    period = arena.period if arena else (0.0, 0.0)
    for observed in (there, None):
        pairs = proximity_graph(here, observed, reach, arena, range_shape=shape, pairs=True)
        assert_same(pairs, proximity_graph(here, observed, reach, arena, range_shape=shape, pairs=False))
        assert_same(pairs, proximity_graph(here, observed, reach, arena, range_shape=shape))
        others = here if observed is None else observed
        found = list(zip(np.repeat(np.arange(len(here)), pairs.degree).tolist(), pairs.identity.tolist(), strict=True))
        assert found == naive.edges(here.tolist(), others.tolist(), reach, period, observed is None, shape)
        ways = others[pairs.identity] - np.repeat(here, pairs.degree, axis=0)
        assert np.array_equal(pairs.offset, arena.displacement(0 * ways, ways) if arena else ways)
        assert pairs.distance == pytest.approx(np.hypot(*pairs.offset.T), rel=1e-15)


@pytest.mark.parametrize("shape", SHAPES)
@pytest.mark.parametrize("arena", [Disc(40.0), Torus(80.0, 60.0), Torus(3.2, 80.0), Cylinder(80.0, 60.0)], ids=str)
@pytest.mark.parametrize("reach", [0.1, 1.0, 1.2])
def test_many_bodies_too(arena: Arena, shape: str, reach: float) -> None:
    # Some places are crowded, with more than 8 bodies in a row of cells, and some bodies hidden, observers or not.
    rng = generator()
    here = np.concatenate([arena.place(rng.random(1500), rng.random(1500)), 0.2 * rng.standard_normal((100, 2))])
    hidden = rng.random(len(here)) < 0.1
    found = []
    for pairs in (True, False):
        search = Search(here, np.full(len(here), reach), len(here), 0, arena, shape=shape, pairs=pairs)
        search.x[:], search.y[:] = np.where(hidden, np.nan, here.T)
        search.run()
        found.append(search.graph)
    assert_same(*found)
    assert not hidden[found[0].identity].any()
    others = arena.place(rng.random(1500), rng.random(1500))
    assert_same(*(proximity_graph(here, others, reach, arena, range_shape=shape, pairs=pairs) for pairs in (True, False)))


@pytest.mark.parametrize("arena", [Box(10.0, 8.0), Torus(10.0, 8.0), Cylinder(10.0, 8.0)], ids=str)
@given(seed=seeds, n=sizes, reach=st.floats(0.01, 3))
def test_scipy_finds_the_same_edges(arena: Arena, seed: int, n: int, reach: float) -> None:
    rng = np.random.default_rng(seed)
    here = arena.place(rng.random(n), rng.random(n))
    graph = proximity_graph(here, None, reach, arena)
    # To scipy, 0 is a side that does not repeat.
    tree = cKDTree((here + [5.0, 4.0]) % [10.0, 8.0], boxsize=arena.period)
    observer = np.repeat(np.arange(n), graph.degree)
    found = {(i, j) for i, j in zip(observer.tolist(), graph.identity.tolist(), strict=True) if i < j}
    assert found == tree.query_pairs(reach)
    assert np.all(np.diff(graph.identity)[np.diff(observer) == 0] > 0)


def test_cells_miss_nobody_across_the_rounding_of_a_cell() -> None:
    # −1 − 2⁻⁵¹ lies in the fourth cell of width 1 from −5, and −4e−16 + 5 rounds into the sixth; their distance is 1.
    crowd = [[4.0, y / 9] for y in range(-40, 41)]
    here = np.array([[-1 - 2**-51, 0.0], [-4e-16, 0.0], *crowd])
    pairs = proximity_graph(here, None, 1.0, Box(10.0, 10.0), pairs=True)
    assert 1 in pairs.identity[: pairs.start[1]]
    assert_same(pairs, proximity_graph(here, None, 1.0, Box(10.0, 10.0), pairs=False))


@pytest.mark.parametrize("arena", ARENAS, ids=str)
def test_cells_are_taken_for_many_and_give_the_same_bits(arena: Arena | None) -> None:
    rng = generator()
    here = (arena or Disc(5.0)).place(rng.random(1500), rng.random(1500))
    assert len(here) ** 2 > MOST_PAIRS
    reach = rng.uniform(0.1, 0.7, len(here))
    assert_same(proximity_graph(here, None, reach, arena), proximity_graph(here, None, reach, arena, pairs=True))


def test_the_wall_of_the_range_is_inside_it() -> None:
    graph = proximity_graph([[0.0, 0.0]], [[3.0, 4.0], [0.0, np.nextafter(5.0, 6.0)]], 5.0)
    assert graph.identity.tolist() == [0]
    assert graph.distance.tolist() == [5.0]


def test_two_in_one_place_see_each_other_but_nobody_sees_itself() -> None:
    graph = proximity_graph(np.zeros((3, 2)), None, 0.0)
    assert graph.identity.tolist() == [1, 2, 0, 2, 0, 1]


@pytest.mark.parametrize("pairs", [True, False])
@pytest.mark.parametrize("reach", [1e12, 1e149, 1e155, 1e300])
def test_no_range_reaches_bodies_that_do_not_exist(reach: float, pairs: bool) -> None:
    graph = proximity_graph([[0.0, 0.0], [1.0, 1.0], [2.0, 0.0]], None, reach, pairs=pairs)
    assert graph.identity.tolist() == [1, 2, 0, 2, 0, 1]


def test_a_search_makes_room_and_overwrites_what_it_found() -> None:
    rng = generator()
    here = rng.uniform(-1, 1, (300, 2))
    search = Search(here, np.full(300, 9.0), 300, 0, Box(40.0, 40.0))
    search.x[:], search.y[:] = here.T
    assert len(search.room.identity) < 300 * 299
    assert search.run() == 300 * 299
    search.x[:] += 30.0
    assert search.run() == 0
    assert len(search.graph.identity) == 0


@pytest.mark.parametrize(
    ("observers", "observed", "reach", "arena", "message"),
    [
        ([[0.0, np.nan]], None, 1.0, None, r"observers: row 0 is .*; positions must be finite"),
        ([[0.0, 0.0]], [[0.0, 0.0], [np.inf, 0.0]], 1.0, None, r"observed: row 1 is .*; positions must be finite"),
        ([0.0, 0.0], None, 1.0, None, r"observers: has the shape \(2,\); give positions of shape \(n, 2\)"),
        ([[0.0, 0.0]], None, -1.0, None, r"reach: .* at least 0"),
        ([[0.0, 0.0]], None, np.nan, None, r"reach: .* finite"),
        ([[0.0, 0.0]], None, 6.0, Torus(10, 12), r"range=6: .* at most half .* 5;"),
        pytest.param([[0.0, 0.0]], None, [1.0, 2.0], None, r"reach: "),
    ],
)
def test_bad_input_is_named(
    observers: object, observed: object, reach: object, arena: Arena | None, message: str
) -> None:
    with pytest.raises(ValueError, match=message):
        proximity_graph(observers, observed, reach, arena)  # type: ignore[arg-type]


def test_places_outside_a_torus_are_wrapped_or_refused() -> None:
    here = generator().uniform(-5, 15, (60, 2))
    try:
        pairs = proximity_graph(here, None, 1.0, Torus(10, 10), pairs=True)
    except ValueError:
        return
    assert_same(pairs, proximity_graph(here, None, 1.0, Torus(10, 10), pairs=False))


@pytest.mark.short
@pytest.mark.parametrize("pairs", [True, False])
def test_on_a_lattice_distances_are_exact(pairs: bool) -> None:
    # Cells of size 1 on a torus, from far outside the middle: a range of d holds (2d + 1)² − 1 other cells.
    column, row = np.meshgrid(np.arange(20), np.arange(20))
    cells = np.column_stack([column.ravel(), row.ravel()]) - 9.5
    for d in range(1, 10):
        graph = proximity_graph(cells, None, float(d), Torus(20.0, 20.0), range_shape="square", pairs=pairs)
        assert set(graph.degree.tolist()) == {(2 * d + 1) ** 2 - 1}
        assert np.array_equal(graph.offset, np.rint(graph.offset))
        assert np.abs(graph.offset).max() == d
        assert np.array_equal(graph.distance, np.sqrt((graph.offset**2).sum(axis=1)))


def test_a_square_range_holds_its_sides_and_corners_and_nothing_beyond() -> None:
    there = [[1.0, 1.0], [-1.0, 0.3], [1.0, -1.0], [np.nextafter(1.0, 2.0), 0.0], [0.0, -1.1]]
    graph = proximity_graph([[0.0, 0.0]], there, 1.0, range_shape="square")
    assert graph.identity.tolist() == [0, 1, 2]
    assert graph.distance.tolist() == [np.sqrt(2.0), np.hypot(1.0, 0.3), np.sqrt(2.0)]
    with pytest.raises(ValueError, match="range_shape='circle': unknown; .*known are disc, square"):
        proximity_graph([[0.0, 0.0]], there, 1.0, range_shape="circle")
