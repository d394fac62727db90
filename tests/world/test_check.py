"""`check_arena`: what ships passes, and an arena that breaks the contract is named with the cure."""

from __future__ import annotations

import math
import re
from dataclasses import dataclass
from typing import Any

import numpy as np
import pytest
from arenas import Cylinder, Ellipse, Hall

from teamsight.core.kernel import kernel
from teamsight.world import Arena, Box, Circle, Disc, Polygon, Torus, check_arena


@pytest.mark.short
@pytest.mark.parametrize(
    "arena",
    [Disc(2.0), Box(3.0, 4.0), Torus(3.0, 4.0), Disc(1e-6), Disc(5.43e7), Box(1e5, 1.0), Torus(0.1, 30.0)],
    ids=str,
)
def test_every_arena_that_ships_keeps_the_contract(arena: Arena) -> None:
    check_arena(arena)


@pytest.mark.parametrize(
    "arena",
    [
        Polygon([(10, 20), (14, 20), (14, 22), (12, 22), (12, 24), (10, 24)]),
        Polygon([(0, 0), (1e7, 0), (0, 1e5)]),
        Box(4, 4).with_obstacles(Polygon([(1, 1), (1, 3), (3, 1)]), Circle((-1, 0), 1)),
        Torus(4, 3).with_obstacles(Polygon([(1, 1), (2.2, 1), (2.2, 2), (1, 2)]), Circle((-2, 1), 0.5)),
    ],
    ids=str,
)
def test_polygons_and_obstacles_keep_the_contract(arena: Arena) -> None:
    check_arena(arena)


@kernel
def _tube(x: float, y: float, step_x: float, step_y: float, heading_x: float, heading_y: float, size: Any) -> Any:
    x += step_x
    y += step_y
    x -= size[0] * math.floor(x / size[0] + 0.5)
    half = 0.5 * size[1]
    if abs(y) > half:
        y = (y + half) % (2.0 * size[1])
        if y > size[1]:
            y = 2.0 * size[1] - y
            heading_y = -heading_y
        y -= half
    return min(max(x, -0.5 * size[0]), 0.5 * size[0]), min(max(y, -half), half), heading_x, heading_y


@dataclass(frozen=True)
class Tube(Box):
    """Walls above and below, and no end to the left and right."""

    confine = _tube

    @property
    def period(self) -> tuple[float, float]:
        return self.width, 0.0


@kernel
def _diamond(x: float, y: float, step_x: float, step_y: float, heading_x: float, heading_y: float, size: Any) -> Any:
    if abs(x + step_x) + abs(y + step_y) <= size[0]:
        return x + step_x, y + step_y, heading_x, heading_y
    return x, y, -heading_x, -heading_y


@dataclass(frozen=True)
class Diamond(Arena):
    """A square on its corner, at whose wall bodies turn round where they are."""

    radius: float = 2.0
    confine = _diamond

    @property
    def size(self) -> tuple[float, float]:
        return self.radius, 0.0

    @property
    def area(self) -> float:
        return 2.0 * self.radius**2

    @property
    def bounds(self) -> Any:
        return np.full(2, -self.radius), np.full(2, self.radius)

    def contains(self, position: Any) -> Any:
        return np.abs(position).sum(axis=-1) <= self.radius

    def place(self, u: Any, v: Any, margin: float = 0.0) -> Any:
        side = max(self.radius - math.sqrt(2.0) * margin, 0.0)
        u, v = np.asarray(u, float), np.asarray(v, float)
        return (1 - 1e-15) * side * np.stack([u + v - 1.0, u - v], axis=-1)


@pytest.mark.parametrize(
    "arena", [Tube(3.0, 2.0), Diamond(), Cylinder(3.0, 2.0), Ellipse(3.0, 2.0), Hall(3.0, 2.0, 0.2)], ids=str
)
def test_arenas_of_ones_own_pass(arena: Arena) -> None:
    check_arena(arena)


@kernel
def _open(x: float, y: float, step_x: float, step_y: float, heading_x: float, heading_y: float, size: Any) -> Any:
    return x + step_x, y + step_y, heading_x, heading_y


@kernel
def _once(x: float, y: float, step_x: float, step_y: float, heading_x: float, heading_y: float, size: Any) -> Any:
    """Reflects at one wall only once."""
    x += step_x
    y += step_y
    if abs(x) + abs(y) > size[0]:
        return x - 2.0 * step_x, y - 2.0 * step_y, -heading_x, -heading_y
    return x, y, heading_x, heading_y


@kernel
def _shrinks(x: float, y: float, step_x: float, step_y: float, heading_x: float, heading_y: float, size: Any) -> Any:
    if abs(x + step_x) + abs(y + step_y) <= size[0]:
        return x + step_x, y + step_y, heading_x, heading_y
    return x, y, -0.9 * heading_x, -0.9 * heading_y


@kernel
def _lost(x: float, y: float, step_x: float, step_y: float, heading_x: float, heading_y: float, size: Any) -> Any:
    if abs(x + step_x) + abs(y + step_y) > size[0]:
        return x, y, -heading_x, -heading_y
    # 0 / 0 for a step of no length.
    length = math.sqrt(step_x * step_x + step_y * step_y)
    return x + length * (step_x / length), y + length * (step_y / length), heading_x, heading_y


@kernel
def _sticks(x: float, y: float, step_x: float, step_y: float, heading_x: float, heading_y: float, size: Any) -> Any:
    return x, y, heading_x, heading_y


@kernel
def _third_size(x: float, y: float, step_x: float, step_y: float, heading_x: float, heading_y: float, size: Any) -> Any:
    return x * size[2], y, heading_x, heading_y  # third_size


@kernel
def _three(x: float, y: float, step_x: float, step_y: float, heading_x: float, heading_y: float, size: Any) -> Any:
    return x, y, heading_x


@kernel
def _typo(x: float, y: float, step_x: float, step_y: float, heading_x: float, heading_y: float, size: Any) -> Any:
    return x, y, heading_x, headng_y  # type: ignore[name-defined]  # noqa: F821


def changed(base: type[Arena] = Diamond, **members: Any) -> Arena:
    """Return an arena of another kind than `base` in these members."""
    properties = {k: property(v) if k in ("size", "area", "bounds", "period") else v for k, v in members.items()}
    return type("Changed", (base,), properties)(*((3.0, 2.0) if base is not Diamond else ()))


def disc_place(self: Any, u: Any, v: Any, margin: float = 0.0) -> Any:
    """Forgets the root of u."""
    radius, angle = (self.radius - margin if margin < self.radius else 0.0) * np.asarray(u), 2 * np.pi * np.asarray(v)
    return np.stack([radius * np.cos(angle), radius * np.sin(angle)], axis=-1)


def no_margin(self: Any, u: Any, v: Any, margin: float = 0.0) -> Any:
    return Diamond.place(self, u, v)


def wide(self: Any, u: Any, v: Any, margin: float = 0.0) -> Any:
    return 1.0000001 * Diamond.place(self, u, v, margin)


def shaken(self: Any, points: Any, margin: float = 0.0) -> Any:
    return Diamond.inside(self, points, margin) * 0.99


NUMBER = r"[-+.\de]+"
WRONG = [
    ({"confine": _open}, rf"confine\({NUMBER}, .*, size\) returns \({NUMBER}, .*\), which is outside according to contains\(\); return a position inside"),
    ({"confine": _once}, r"which is outside according to contains\(\); return a position inside"),
    ({"confine": _shrinks}, r"whose heading is not a unit vector; reflect it"),
    ({"confine": _lost}, r"confine\(.*\) returns \(nan, nan, .*\), which is not finite; return four finite numbers"),
    ({"confine": _sticks}, r"although no wall is near; add the step to the position and keep the heading"),
    ({"confine": _third_size}, r"test_check\.py:\d+: confine uses index 2 of size, whose number of elements is 2; return as many numbers"),
    ({"size": lambda self: (1.0, math.nan)}, r"size=\(1\.0, nan\): must be finite numbers"),
    ({"size": lambda self: 2.0}, r"size=2\.0: must be finite numbers in 1 dimension, such as"),
    ({"bounds": lambda self: (np.ones(2), -np.ones(2))}, r"bounds=\[\[1\.0, 1\.0\], \[-1\.0, -1\.0\]\]: must be two corners, the lower left"),
    ({"bounds": lambda self: 4.0}, r"bounds=4\.0: must be finite numbers in 2 dimensions"),
    ({"bounds": lambda self: (np.full(2, -1.5), np.full(2, 1.5))}, r"contains\(\[.*\]\) is True, although that is beyond the bounds \[-1\.5, -1\.5\], .*; widen the bounds"),
    ({"period": lambda self: (4.0, 3.0)}, r"period\[1\]=3: must be 0, or the side of the bounds along that axis, 4"),
    ({"period": lambda self: (-4.0, 0.0)}, r"period=\(-4\.0, 0\.0\): must be two numbers of at least 0"),
    ({"area": lambda self: 12.0}, r"area=12: by contains\(\) it is 8\.\d+, a share of 0\.\d+ of the bounds; they must agree to 0\.01"),
    ({"area": lambda self: -1.0}, r"area=-1\.0: must be a finite number, above 0"),
    ({"area": lambda self: None}, r"area=None: must be a number"),
    ({"contains": lambda self, p: np.abs(p[:, 0]) + np.abs(p[:, 1]) <= 2.0}, r"contains of positions of shape \(2, 3, 2\) .*last axis"),
    ({"contains": lambda self, p: bool((np.abs(p).sum(axis=-1) <= 2.0).all())}, r"contains of positions of shape \(6, 2\) has the shape \(\).*last axis"),
    ({"contains": lambda self, p: np.abs(p).sum(axis=-1)}, r"has the shape \(6,\) and the type float64; it must be \(6,\) and bool"),
    ({"place": wide}, r"place\(.*, margin=0\) is \[.*\], which is outside according to contains\(\); map all of \(0, 1\)"),
    ({"place": no_margin}, r"place\(.*, margin=0\.02\d*\) is \[.*\], nearer to the wall than the margin: \[.*\] is outside; return positions"),
    ({"place": lambda self, u, v, margin=0.0: np.stack([u, v])}, r"place of numbers of shape \(\d+,\) has the shape \(2, \d+\); stack x and y"),
    ({"place": lambda self, u, v, margin=0.0: np.stack([u * np.nan, v], axis=-1)}, r"place\(.*\) is \[nan, .*\]; it must be finite"),
    ({"place": lambda self, u, v, margin=0.0: u[:, None] * v[:, None]}, r"place of numbers of shape .* has the shape"),
    ({"inside": lambda self, points, margin=0.0: np.clip(points, -2.0, 2.0)}, r"inside\(\[.*\], margin=0\) is \[.*\], which is outside or nearer"),
    ({"inside": lambda self, points, margin=0.0: Diamond.inside(self, points)}, r"inside\(\[.*\], margin=0\.\d+\) is \[.*\], which is outside or nearer"),
    ({"inside": shaken}, r"inside\(\[.*\]\) moves a point that is inside; return it unchanged"),
    ({"inside": lambda self, points, margin=0.0: points[:, 0]}, r"inside of points of shape \(\d+, 2\) has the shape \(\d+,\); it must be the same"),
    ({"place": lambda self, u, v: u}, r"place of numbers of shape .* raises TypeError.*; accept numbers and arrays, and any margin"),
]  # fmt: skip


@pytest.mark.parametrize(
    ("members", "message"), WRONG, ids=[f"{n}-{'-'.join(case[0])}" for n, case in enumerate(WRONG)]
)
def test_what_breaks_the_contract_is_named(members: dict[str, Any], message: str) -> None:
    with pytest.raises((TypeError, ValueError)) as raised:
        check_arena(changed(**members))
    assert re.match(rf"Changed.*{message}", str(raised.value))
    assert len(str(raised.value)) < 400
    assert "\n" not in str(raised.value)


def test_places_that_are_not_uniform_are_named() -> None:
    arena = type("Dense", (Disc,), {"place": disc_place})(2.0)
    with pytest.raises(ValueError, match=r"Dense\.place puts 0\.\d+ of all positions into the cell around .*radius ∝ √u"):
        check_arena(arena)


def test_a_place_found_by_the_check_is_one_that_leaks() -> None:
    arena = changed(confine=_once)
    with pytest.raises(ValueError, match="outside") as raised:
        check_arena(arena)
    given, reached = re.findall(r"\(([^()]*)\)", str(raised.value))[:2]
    place = [float(number) for number in given.split(", ")[:6]]
    size = np.array(arena.size)
    assert list(_once.py_func(*place, size)) == [float(number) for number in reached.split(", ")]  # type: ignore[attr-defined]
    assert arena.contains(place[:2])


def test_a_confine_that_cannot_be_compiled_is_named_with_its_line() -> None:
    with pytest.raises(
        TypeError, match=r"test_check\.py:\d+: name 'headng_y' is not defined; did you mean 'heading_y'"
    ):
        check_arena(changed(confine=_typo))
    with pytest.raises(TypeError, match=r"test_check\.py:\d+: 3 values are given where 4 are expected"):
        check_arena(changed(confine=_three))


def test_something_else_than_an_arena_is_refused() -> None:
    with pytest.raises(TypeError, match=r"2\.0: must be an object of a subclass of Arena"):
        check_arena(2.0)  # type: ignore[arg-type]
    with pytest.raises(TypeError, match=r"Disc: is a class; give an object, such as Disc"):
        check_arena(Disc)  # type: ignore[arg-type]
