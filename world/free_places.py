"""Free places: positions inside an arena with obstacles, the nearest of them, and the free area."""

from __future__ import annotations

from typing import Annotated, NamedTuple, Protocol

import numpy as np
import numpy.typing as npt

from teamsight.core.kernel import Entry, Record, inlined
from teamsight.world.noise import philox
from teamsight.world.polygons import nearest_on_walls
from teamsight.world.walls import Walls, clearance

Points = npt.NDArray[np.float64]
Words = npt.NDArray[np.uint64]

_SAMPLES = 4096
# Attempts at once: first few, since most places need no more; then many. If one place in `_SAMPLES` is free, one in
# e^30 is not found after all rounds; it is then taken from the samples.
_FEW, _MANY, _ROUNDS = 4, 128, 1000
_GOLDEN = 0.6180339887498949
_MOST_KEPT = 64


class WalledArena(Protocol):
    """An arena whose walls are segments and discs; arenas import this file."""

    @property
    def bounds(self) -> tuple[Points, Points]: ...
    @property
    def near_walls(self) -> Walls:
        """Its walls, with the images that are near it if it repeats."""

    def draw(self, u: npt.ArrayLike, v: npt.ArrayLike) -> Points:
        """Map uniform numbers to positions uniform over an area that contains the free area."""

    @property
    def kept(self) -> dict[tuple[str, float], Points]:
        """What searches have found, by their name and the margin; it is empty at first."""

    def contains(self, position: npt.ArrayLike) -> npt.NDArray[np.bool_]: ...
    def displacement(self, start: npt.ArrayLike, end: npt.ArrayLike) -> Points: ...


class Attempt(NamedTuple):
    """The record of a call of `_draw_again`; n places, k attempts at each."""

    words: Annotated[Words, "n", 4]
    first: int
    numbers: Annotated[Points, 2, "n", "k"]


ATTEMPT = Record(Attempt)
attempt_at = ATTEMPT.at


@inlined
def _uniform(high: np.uint64, low: np.uint64) -> float:
    # 52 bits and a half: never 0, never 1.
    return (np.float64(np.int64(high)) * 2.0**20 + np.float64(np.int64(low >> np.uint64(12))) + 0.5) * 2.0**-52


def _draw_again(address: int) -> int:
    attempt = attempt_at(address)
    words, numbers = attempt.words, attempt.numbers
    for i in range(numbers.shape[1]):
        for k in range(numbers.shape[2]):
            a, b, c, d = philox(
                words[i, 0], words[i, 1], np.uint64(attempt.first + k), np.uint64(0), words[i, 2], words[i, 3]
            )
            numbers[0, i, k] = _uniform(a, b)
            numbers[1, i, k] = _uniform(c, d)
    return 0


_DRAW_AGAIN = Entry(_draw_again)


def is_free(arena: WalledArena, position: Points, margin: float) -> npt.NDArray[np.bool_]:
    """Return for each position, shape (..., 2), whether it is inside and at least `margin` from the walls."""
    inside = np.asarray(arena.contains(position))
    return inside & (clearance(arena.near_walls, position) >= margin) if margin > 0 else inside


def _free_samples(arena: WalledArena, margin: float) -> Points:
    found = arena.kept.get(("samples", margin))
    if found is None:
        step = np.arange(float(_SAMPLES))
        samples = arena.draw((step + 0.5) / _SAMPLES, (step * _GOLDEN) % 1.0)
        found = samples[is_free(arena, samples, margin)]
        keep(arena, "samples", margin, found)
    return found


def keep(arena: WalledArena, name: str, margin: float, found: Points) -> None:
    """Keep what a search has found, but not for very many margins."""
    if len(arena.kept) >= _MOST_KEPT:
        arena.kept.clear()
    arena.kept[name, margin] = found


def fits(arena: WalledArena, margin: float) -> bool:
    """Return whether there is room so far from the walls: whether any of 4096 even places is."""
    return len(_free_samples(arena, margin)) > 0


def place_freely(arena: WalledArena, u: npt.ArrayLike, v: npt.ArrayLike, margin: float) -> Points:
    """Return what `Arena.place` returns: exactly uniform over the free area, a pure function of `u` and `v`.

    A place that is not free is drawn again, with numbers that are Philox of the bits of `u` and `v`. A margin that does
    not fit is left out.
    """
    u, v = np.broadcast_arrays(np.asarray(u, float), np.asarray(v, float))
    shape = u.shape
    u, v = np.ravel(u), np.ravel(v)
    margin = margin if margin > 0 and fits(arena, margin) else 0.0
    places = arena.draw(u, v)
    missing = np.flatnonzero(~is_free(arena, places, margin))
    words = np.stack([u[missing], v[missing]], axis=-1).view(np.uint64)
    words = np.concatenate([words & np.uint64(0xFFFFFFFF), words >> np.uint64(32)], axis=1)
    first = 0
    for count in (_FEW, *[_MANY] * _ROUNDS):
        if not len(missing):
            break
        numbers = np.empty((2, len(missing), count))
        _DRAW_AGAIN(ATTEMPT.pack(Attempt(words, first, numbers)))
        drawn = arena.draw(*numbers)
        free = is_free(arena, drawn, margin)
        found = free.any(axis=1)
        places[missing[found]] = drawn[found, np.argmax(free[found], axis=1)]
        missing, words, first = missing[~found], words[~found], first + count
    if len(missing):
        samples = _free_samples(arena, margin)
        places[missing] = samples[(u[missing] * len(samples)).astype(int)]
    return np.asarray(places.reshape(*shape, 2))


# A place is as far from the walls as the margin says, up to this share of the arena's extent.
_NEAR = 1e-10
# Points moved at once, to limit the memory.
_ROWS = 256


def nearest_free(arena: WalledArena, points: Points, margin: float) -> Points:
    """Return for each point, shape (n, 2), itself if it is free, else the nearest place that is.

    Places at least `margin` from the walls end at lines beside segments, and at circles around their ends and around
    discs. The nearest one is the foot of a point on one of these, or a place where two of them meet. A margin that does
    not fit is left out.
    """
    margin = margin if fits(arena, margin) else 0.0
    points = np.array(arena.displacement(np.zeros(2), points))
    stuck = np.flatnonzero(~is_free(arena, points, margin))
    lines, circles = _limits(arena.near_walls, margin)
    meetings = _meetings(arena, margin, lines, circles)
    for rows in np.array_split(stuck, len(stuck) // _ROWS + 1):
        moving = points[rows]
        shared = np.broadcast_to(meetings, (len(rows), *meetings.shape))
        feet = np.concatenate([nearest_on_walls(moving, lines), _feet_on_circles(moving, circles), shared], axis=1)
        feet = arena.displacement(np.zeros(2), feet)
        distance = np.sum(arena.displacement(moving[:, None], feet) ** 2, axis=2)
        distance[~is_free(arena, feet, _rounded(arena, margin))] = np.inf
        best = np.argmin(distance, axis=1)
        found = np.isfinite(distance[np.arange(len(rows)), best])
        points[rows[found]] = feet[found, best[found]]
    return points


def _rounded(arena: WalledArena, margin: float) -> float:
    """Return a margin that rounding cannot miss."""
    low, high = arena.bounds
    return max(margin - _NEAR * float(np.max(high - low)), 0.0)


def _limits(walls: Walls, margin: float) -> tuple[Points, Points]:
    """Return the lines and the circles (x, y, radius) at which the places that are `margin` from the walls end."""
    segments = walls.segments
    edge = segments[:, 2:] - segments[:, :2]
    normal = np.stack([-edge[:, 1], edge[:, 0]], axis=1) / np.hypot(*edge.T)[:, None]
    lines = segments + margin * np.tile(normal, 2)
    ends = np.concatenate([segments[:, :2], np.full((len(segments), 1), margin)], axis=1)
    discs = walls.discs + np.array([0.0, 0.0, margin])
    # The places within a hollow disc end at a smaller circle.
    discs[:, 2] = np.abs(discs[:, 2]) * (np.sign(discs[:, 2]) == np.sign(walls.discs[:, 2]))
    return lines, np.concatenate([np.unique(ends, axis=0), discs])


def _feet_on_circles(points: Points, circles: Points) -> Points:
    off = points[:, None] - circles[:, :2]
    length = np.hypot(off[..., 0], off[..., 1])[..., None]
    # From the centre, all places of a circle are equally near.
    way = np.where(length > 0, off / np.maximum(length, 1e-300), [1.0, 0.0])
    return np.asarray(circles[:, :2] + circles[:, 2:] * way)


def _meetings(arena: WalledArena, margin: float, lines: Points, circles: Points) -> Points:
    """Return the free places where two of the limits meet, shape (k, 2)."""
    found = arena.kept.get(("meetings", margin))
    if found is None:
        places = crossings(lines, circles)
        found = places[is_free(arena, places, _rounded(arena, margin))]
        keep(arena, "meetings", margin, found)
    return found


def crossings(segments: Points, circles: Points) -> Points:
    """Return where segments x0, y0, x1, y1 and circles x, y, radius cross or meet each other, shape (k, 2)."""
    with np.errstate(divide="ignore", invalid="ignore"):
        places = np.concatenate([_of_segments(segments), _of_both(segments, circles), _of_circles(circles)])
    return np.asarray(places[np.isfinite(places).all(axis=1)])


def _of_segments(segments: Points) -> Points:
    one, other = np.triu_indices(len(segments), 1)
    begin, edge = segments[one, :2], segments[one, 2:] - segments[one, :2]
    off, way = segments[other, :2] - begin, segments[other, 2:] - segments[other, :2]
    cross = edge[:, 0] * way[:, 1] - edge[:, 1] * way[:, 0]
    share = (off[:, 0] * way[:, 1] - off[:, 1] * way[:, 0]) / cross
    there = (off[:, 0] * edge[:, 1] - off[:, 1] * edge[:, 0]) / cross
    return np.asarray((begin + share[:, None] * edge)[_is_share(share) & _is_share(there)])


def _is_share(share: Points) -> npt.NDArray[np.bool_]:
    return (share >= -1e-9) & (share <= 1 + 1e-9)


def _of_both(segments: Points, circles: Points) -> Points:
    begin, edge = segments[:, None, :2], segments[:, None, 2:] - segments[:, None, :2]
    length_2 = np.sum(edge**2, axis=2)
    off = begin - circles[None, :, :2]
    along = -np.sum(off * edge, axis=2) / length_2
    half = np.sqrt((circles[None, :, 2] ** 2 - np.sum((off + along[..., None] * edge) ** 2, axis=2)) / length_2)
    found = [np.empty((0, 2))]
    for share in (along - half, along + half):
        found.append((begin + share[..., None] * edge)[_is_share(share)])
    return np.concatenate(found)


def _of_circles(circles: Points) -> Points:
    one, other = np.triu_indices(len(circles), 1)
    way = circles[other, :2] - circles[one, :2]
    length = np.hypot(*way.T)
    along = 0.5 * (length + (circles[one, 2] ** 2 - circles[other, 2] ** 2) / length)
    half = np.sqrt(circles[one, 2] ** 2 - along**2)
    way = way / length[:, None]
    middle = circles[one, :2] + along[:, None] * way
    across = half[:, None] * np.stack([-way[:, 1], way[:, 0]], axis=1)
    return np.concatenate([middle - across, middle + across])


_NODES = 24
# Lines at once, to limit the memory.
_LINES = 1000


def free_area(arena: WalledArena) -> float:
    """Return the area of all that `arena` contains, accurate to rounding.

    Between the heights at which walls begin, end or meet, the free length is a sum of straight lines and arcs, which
    a quadrature whose nodes lie more densely at the ends integrates to rounding.
    """
    low, high = arena.bounds
    walls = arena.near_walls
    circles = np.abs(walls.discs)
    circles[:, :2] = walls.discs[:, :2]
    tops = [circles[:, 1] - circles[:, 2], circles[:, 1] + circles[:, 2]]
    ends = [walls.segments[:, 1], walls.segments[:, 3], *tops, crossings(walls.segments, circles)[:, 1]]
    heights = np.unique(np.clip(np.concatenate([*ends, [low[1], high[1]]]), low[1], high[1]))
    node, weight = np.polynomial.legendre.leggauss(_NODES)
    angle = 0.5 * np.pi * (node + 1.0)
    half = 0.5 * np.diff(heights)[:, None]
    lines = (heights[:-1, None] + half * (1.0 - np.cos(angle))).ravel()
    weights = (half * (0.5 * np.pi * weight * np.sin(angle))).ravel()
    parts = np.array_split(np.arange(len(lines)), len(lines) // _LINES + 1)
    return float(sum(np.sum(weights[part] * _free_length(arena, lines[part], circles)) for part in parts))


def _free_length(arena: WalledArena, y: Points, circles: Points) -> Points:
    """Return the length of the free parts of the line along x at each height."""
    low, high = arena.bounds
    x0, y0, x1, y1 = arena.near_walls.segments.T
    height = y[:, None]
    with np.errstate(divide="ignore", invalid="ignore"):
        on_segments = np.where((y0 > height) != (y1 > height), x0 + (height - y0) * ((x1 - x0) / (y1 - y0)), np.nan)
        half = np.sqrt(circles[:, 2] ** 2 - (height - circles[:, 1]) ** 2)
    ends = np.broadcast_to([low[0], high[0]], (len(y), 2))
    places = np.concatenate([ends, on_segments, circles[:, 0] - half, circles[:, 0] + half], axis=1)
    places = np.sort(np.clip(np.where(np.isnan(places), high[0], places), low[0], high[0]), axis=1)
    # Where a line meets few walls, the last places are all at the end.
    places = places[:, : int((places < high[0]).sum(axis=1).max()) + 1]
    middle = 0.5 * (places[:, :-1] + places[:, 1:])
    is_free = arena.contains(np.stack([middle, np.broadcast_to(height, middle.shape)], axis=-1))
    return np.asarray(np.sum(np.diff(places, axis=1) * is_free, axis=1))
