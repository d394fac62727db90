"""The nearest place that is at least a margin from all walls."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from teamsight.world.free_places import WalledArena, fits, is_free, keep
from teamsight.world.polygons import nearest_on_walls
from teamsight.world.wall_contacts import Walls

Points = npt.NDArray[np.float64]

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
