"""Polygons: what is inside, areas, triangles, and what is refused."""

from __future__ import annotations

import itertools
import math
import pickle
import re
from typing import Any

import numpy as np
import pytest
from chance import generator
from hypothesis import assume, given
from hypothesis import strategies as st

from teamsight import Circle, Polygon
from teamsight.world import polygons

ELL = [(0, 0), (4, 0), (4, 2), (2, 2), (2, 4), (0, 4)]
COMB = [(0, 0), (8, 0), (8, 3), (6, 0.01), (5, 3), (4, 0.01), (3.9, 3), (3.8, 0.01), (2, 3), (1, 3), (0, 3)]


@st.composite
def shapes(draw: st.DrawFn) -> Polygon:
    """Return a polygon whose corners lie around (3, −2), at any distances."""
    count = draw(st.integers(3, 12))
    steps = np.cumsum(draw(st.lists(st.floats(0.1, 1), min_size=count, max_size=count)))
    angle = 2 * math.pi * steps / steps[-1]
    assume(np.diff(angle, prepend=angle[-1] - 2 * math.pi).max() < 3)
    radius = np.array(draw(st.lists(st.floats(0.2, 3), min_size=count, max_size=count)))
    points = np.stack([3 + radius * np.cos(angle), -2 + radius * np.sin(angle)], axis=-1)
    return Polygon(points[:: draw(st.sampled_from([1, -1]))])


@given(shape=shapes(), seed=st.integers(0, 2**32))
def test_triangles_make_the_polygon(shape: Polygon, seed: int) -> None:
    triangles = polygons.triangles(shape.vertices)
    areas = np.array([polygons.signed_area(triangle) for triangle in triangles])
    assert len(triangles) == len(shape.vertices) - 2
    assert (areas >= -1e-12).all()
    assert areas.sum() == pytest.approx(shape.area, rel=1e-12)
    # Each of its places is in one of them, and theirs are its.
    share = np.random.default_rng(seed).dirichlet([1, 1, 1], (len(triangles), 4))
    assert shape.contains(np.einsum("tka,tax->tkx", share, triangles)).all()


@pytest.mark.parametrize("shape", [Polygon(ELL), Polygon(COMB), Polygon(ELL[::-1])], ids=["L", "comb", "L back"])
def test_places_are_uniform(shape: Polygon) -> None:
    """The map from (u, v) stretches all areas alike: its determinant is the area, up to the error of differences."""
    ends = shape._triangles[1]
    u, v = generator().uniform(1e-3, 1 - 1e-3, (2, 1000))
    near = np.abs(u[:, None] - ends).min(axis=1) < 1e-5
    step = 1e-6
    along_u = (shape.place(u + step, v) - shape.place(u - step, v)) / (2 * step)
    along_v = (shape.place(u, v + step) - shape.place(u, v - step)) / (2 * step)
    stretched = np.abs(along_u[:, 0] * along_v[:, 1] - along_u[:, 1] * along_v[:, 0])
    # Near the first corner of a triangle, differences of the root are inaccurate.
    before = np.concatenate([[0.0], ends])[np.searchsorted(ends, u)]
    smooth = ~near & (u - before > 1e-3)
    assert smooth.sum() > 500
    assert stretched[smooth] == pytest.approx(np.full(smooth.sum(), shape.area), rel=1e-3)
    assert shape.contains(shape.place(u, v)).all()


def test_walls_and_corners_are_inside() -> None:
    for shape in (Polygon(ELL), Polygon(COMB), Polygon(np.array(ELL) + [1e5, -1e5])):
        begin, end = shape.vertices, np.roll(shape.vertices, -1, axis=0)
        for share in (0.0, 0.1, 0.5, 1 / 3):
            places = (1 - share) * begin + share * end
            assert shape.contains(places).all()
            assert not shape.covers(places, 1e-9).any()
            assert not shape.contains(places + 1e-3 * (places - shape.place(0.01, 0.5))).all()


def test_the_finest_part_of_a_polygon() -> None:
    assert Polygon(ELL).finest == 2
    assert Polygon(COMB).finest == pytest.approx(0.01)
    assert Polygon([(0, 0), (4, 0), (0, 3)]).finest == 3
    assert Polygon([(0, 0), (4, 0), (2, 0.5), (2, 3)]).finest == 0.5


def test_a_polygon_is_a_value() -> None:
    shape, back = Polygon(ELL), Polygon([ELL[0], *ELL[:0:-1]])
    assert shape == back == Polygon(np.array(ELL)) == pickle.loads(pickle.dumps(shape))
    assert hash(shape) == hash(back)
    assert shape != Polygon(ELL[:3])
    assert shape != Circle((0, 0), 1)
    assert repr(shape) == "Polygon([(0, 0), (4, 0), (4, 2), (2, 2), (2, 4), (0, 4)])"
    assert eval(repr(shape)) == shape
    assert str(Polygon(COMB)) == "Polygon([(0, 0), (8, 0), (8, 3), (6, 0.01), (5, 3), (4, 0.01), …])"
    with pytest.raises(ValueError, match="read-only"):
        shape.vertices[0] = 3.0


@pytest.mark.parametrize(
    ("vertices", "error", "message"),
    [
        ([(0, 0), (1, 1)], ValueError, r"vertices=\[\(0, 0\), \(1, 1\)\]: must be at least 3 pairs of numbers, such as"),
        ([(0, 0, 0), (1, 1, 0), (2, 0, 0)], ValueError, r"must be at least 3 pairs"),
        (3.0, ValueError, r"vertices=3\.0: must be at least 3 pairs"),
        ("triangle", TypeError, r"vertices='triangle': must be pairs of numbers, such as"),
        ([(0, 0), (1, 0), (1,)], TypeError, r"must be pairs of numbers, such as"),
        ([(0, 0), (1, 0), (1, math.nan)], ValueError, r"nan\)\]: must be finite numbers"),
        ([(0, 0), (1, 0), (1, math.inf)], ValueError, r"inf\)\]: must be finite numbers"),
        ([(0, 0), (2, 2), (2, 0), (0, 2)], ValueError, r"from \(0, 0\) to \(2, 2\) and from \(2, 0\) to \(0, 2\) cross or touch; list"),
        ([(0, 0), (1, 0), (2, 0)], ValueError, r"runs back along itself; leave the vertex out"),
        ([(0, 0), (2, 0), (1, 0), (1, 1)], ValueError, r"vertex 1, \(2, 0\): the polygon runs back along itself"),
        ([(0, 0), (2, 0), (2, 2), (1, 0), (0, 2)], ValueError, r"from \(0, 0\) to \(2, 0\) and from .* cross or touch"),
        ([(0, 0), (2, 0), (2, 2), (2, 2)], ValueError, r"vertex 2, \(2, 2\): coincides with the next; leave one"),
        ([(0, 0), (2, 0), (2, 2), (0, 0)], ValueError, r"vertex 3, \(0, 0\): coincides with the next; leave one"),
        ([(1e9, 0), (1e9 + 1, 0), (1e9, 1)], ValueError, r"is 1e\+09 from the origin, more than 100000 times its size 1; move it"),
        ([(0, 0), (1e-12, 0), (0, 1e-12)], ValueError, r"the longer side of the polygon=1e-12: must be from 1e-09 to"),
    ],
)  # fmt: skip
def test_what_is_no_simple_polygon_is_refused(vertices: Any, error: type[Exception], message: str) -> None:
    with pytest.raises(error, match=message):
        Polygon(vertices)


def test_any_order_of_corners_that_crosses_is_refused() -> None:
    """Of the six orders of the corners of a square, two lead around it."""
    corners = [(0, 0), (4, 0), (4, 4), (0, 4)]
    simple = 0
    for order in itertools.permutations(corners[1:]):
        try:
            simple += Polygon([corners[0], *order]).area > 0
        except ValueError as error:
            assert re.search("cross or touch", str(error))
    assert simple == 2


@pytest.mark.parametrize(
    ("centre", "radius", "error", "message"),
    [
        ((0, 0), 0, ValueError, r"radius=0\.0: must be a finite number, above 0"),
        ((0, 0), "wide", TypeError, r"radius='wide': must be a number"),
        ((0, 0, 0), 1, ValueError, r"centre=\(0, 0, 0\): must be two numbers"),
        ((0, math.nan), 1, ValueError, r"centre=\(0, nan\): must be two numbers"),
        ("here", 1, TypeError, r"centre='here': must be two numbers, such as \(0, 0\)"),
    ],
)
def test_what_is_no_circle_is_refused(centre: Any, radius: Any, error: type[Exception], message: str) -> None:
    with pytest.raises(error, match=message):
        Circle(centre, radius)
