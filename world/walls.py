"""Walls: segments that bodies cannot cross, and the contacts of a move with them."""

from __future__ import annotations

import math
from collections.abc import Iterable
from functools import cache
from itertools import product
from typing import Annotated, Any, NamedTuple

import numpy as np
import numpy.typing as npt

from teamsight.core.elementary import modulo
from teamsight.core.kernel import inlined, kernel
from teamsight.world.polygons import distance_to_walls


@inlined
def confine_disc(
    x: float, y: float, step_x: float, step_y: float, heading_x: float, heading_y: float, size: Any
) -> tuple[float, float, float, float]:
    end_x = x + step_x
    end_y = y + step_y
    if end_x * end_x + end_y * end_y <= size[0] * size[0]:
        return end_x, end_y, heading_x, heading_y
    return _bounce(x, y, step_x, step_y, heading_x, heading_y, size[0])


@kernel
def _bounce(
    x: float, y: float, step_x: float, step_y: float, heading_x: float, heading_y: float, radius: float
) -> tuple[float, float, float, float]:
    square = radius * radius
    for _ in range(64):
        end_x = x + step_x
        end_y = y + step_y
        if end_x * end_x + end_y * end_y <= square:
            return end_x, end_y, heading_x, heading_y
        # The path meets the wall where |place + share · step| = radius.
        a = step_x * step_x + step_y * step_y
        if a == 0.0:
            # The step ends on the wall, but rounding has put the position just outside.
            break
        b = x * step_x + y * step_y
        c = min(x * x + y * y - square, 0.0)
        share = min(max((math.sqrt(max(b * b - a * c, 0.0)) - b) / a, 0.0), 1.0)
        x += share * step_x
        y += share * step_y
        normal = 1.0 / math.sqrt(x * x + y * y)
        normal_x = x * normal
        normal_y = y * normal
        outward = 2.0 * (1.0 - share) * (step_x * normal_x + step_y * normal_y)
        step_x = (1.0 - share) * step_x - outward * normal_x
        step_y = (1.0 - share) * step_y - outward * normal_y
        turned = 2.0 * (heading_x * normal_x + heading_y * normal_y)
        heading_x -= turned * normal_x
        heading_y -= turned * normal_y
    # A step of very many bounces, or one along the wall: stop on the wall.
    inside = radius * (1.0 - 1e-12) / max(math.sqrt(x * x + y * y), radius)
    return x * inside, y * inside, heading_x, heading_y


@inlined
def fold(place: float, half: float) -> tuple[float, float]:
    # The mirror images of a segment repeat every 4 · half. Return the position in the first, and −1 if it is mirrored.
    if place >= -half and place <= half:
        return place, 1.0
    shifted = modulo(place + half, 4.0 * half)
    if shifted <= 2.0 * half:
        return min(max(shifted - half, -half), half), 1.0
    return min(max(3.0 * half - shifted, -half), half), -1.0


@inlined
def confine_box(
    x: float, y: float, step_x: float, step_y: float, heading_x: float, heading_y: float, size: Any
) -> tuple[float, float, float, float]:
    x, turned_x = fold(x + step_x, 0.5 * size[0])
    y, turned_y = fold(y + step_y, 0.5 * size[1])
    return x, y, heading_x * turned_x, heading_y * turned_y


@inlined
def wrap(place: float, side: float) -> float:
    if place >= -0.5 * side and place < 0.5 * side:
        return place
    place -= side * math.floor(place / side + 0.5)
    # Rounding can put a position just outside.
    return place if place >= -0.5 * side and place < 0.5 * side else -0.5 * side


@inlined
def confine_torus(
    x: float, y: float, step_x: float, step_y: float, heading_x: float, heading_y: float, size: Any
) -> tuple[float, float, float, float]:
    return wrap(x + step_x, size[0]), wrap(y + step_y, size[1]), heading_x, heading_y


Points = npt.NDArray[np.float64]

#: The rounding of positions, as a share of the largest coordinate: a body beyond a wall by less is on the wall.
ROUNDING = 1e-12

# A step ends where it is after so many contacts and, in an arena that repeats, halves of the period.
_MOST_LEGS = 1000
# After a contact a body is in front of the wall by this share of the rounding, so that it is not behind it.
_LIFT = 0.001
_HEAD = 4


class Walls(NamedTuple):
    """Walls that reflect.

    Attributes
    ----------
    segments : ndarray, shape (s, 4), float64
        The ends x0, y0, x1, y1 of each [length]. Seen from the first end, what is free lies on the left.
    discs : ndarray, shape (d, 3), float64
        x, y and radius of each [length]: what is free lies outside, or within, if the radius is negative.
    """

    segments: Points
    discs: Points


def no_walls() -> Walls:
    """Return walls that are none."""
    return Walls(np.empty((0, 4)), np.empty((0, 3)))


def joined(parts: Iterable[Walls | None]) -> Walls:
    """Return several walls as one."""
    known = [part for part in parts if part is not None]
    return Walls(
        np.concatenate([np.empty((0, 4)), *(part.segments for part in known)]),
        np.concatenate([np.empty((0, 3)), *(part.discs for part in known)]),
    )


def repeated(walls: Walls, period: tuple[float, float], bounds: tuple[Points, Points]) -> Walls:
    """Return walls with their images, as far as these reach into the bounds or half a period around them."""
    if not any(period):
        return walls
    low, high = bounds[0] - 0.5 * np.array(period), bounds[1] + 0.5 * np.array(period)
    images = []
    for shift in product(*(sorted({0.0, -side, side}) for side in period)):
        segments = walls.segments + np.tile(shift, 2)
        discs = walls.discs + np.array([*shift, 0.0])
        radius = np.abs(discs[:, 2:])
        ends = segments.reshape(-1, 2, 2)
        images.append(Walls(
            segments[_reaches(ends.min(axis=1), ends.max(axis=1), low, high)],
            discs[_reaches(discs[:, :2] - radius, discs[:, :2] + radius, low, high)],
        ))  # fmt: skip
    return joined(images)


def _reaches(first: Points, last: Points, low: Points, high: Points) -> npt.NDArray[np.bool_]:
    return np.asarray(((first <= high) & (last >= low)).all(axis=1))


def clearance(walls: Walls, position: Points) -> Points:
    """Return the distance of each position, shape (..., 2), from the nearest wall; infinite without walls."""
    distance = distance_to_walls(position, walls.segments)
    for x, y, radius in walls.discs:
        off = np.hypot(position[..., 0] - x, position[..., 1] - y)
        distance = np.minimum(distance, np.abs(off - abs(radius)))
    return distance


def inset(walls: Walls, margin: float) -> Walls:
    """Return the walls at which the centre of a body of this radius reflects: moved inwards, and round its corners."""
    segments = walls.segments
    edge = segments[:, 2:] - segments[:, :2]
    normal = np.stack([-edge[:, 1], edge[:, 0]], axis=1) / np.hypot(*edge.T)[:, None]
    corners = np.concatenate([segments[:, :2], np.full((len(segments), 1), margin)], axis=1)
    return Walls(
        segments + margin * np.tile(normal, 2),
        np.concatenate([np.unique(corners, axis=0), walls.discs + np.array([0.0, 0.0, margin])]),
    )


def walls_size(walls: Walls, period: tuple[float, float], slack: float) -> tuple[float, ...]:
    """Return what `confine_walls` reads as the arena's `size`: period, slack, number of segments, segments, discs."""
    # Twice the slack: what is inside with the slack is not behind a wall by rounding.
    head = *period, 2.0 * slack, float(len(walls.segments))
    return (*head, *walls.segments.ravel().tolist(), *walls.discs.ravel().tolist())


@inlined
def _wall_share(x: float, y: float, end_x: float, end_y: float, edge_x: float, edge_y: float, slack: float) -> float:
    """Return the share of a step at which it meets a wall; 2 if it does not. All is seen from the wall's first end."""
    begin = edge_x * y - edge_y * x
    end = edge_x * end_y - edge_y * end_x
    length_2 = edge_x * edge_x + edge_y * edge_y
    if end >= 0.0 or is_behind(begin, length_2, slack):
        return 2.0
    step_x = end_x - x
    step_y = end_y - y
    step_2 = step_x * step_x + step_y * step_y
    share = max(begin, 0.0) / (begin - end) if end < begin else 0.0
    along = x * edge_x + y * edge_y
    if step_2 <= slack * slack:
        is_past = is_behind(along, length_2, 2.0 * slack) or is_behind(length_2 - along, length_2, 2.0 * slack)
        return 2.0 if is_past else share
    # The ends must lie to both sides of the path, or within the slack: no path slips between two walls.
    first = step_x * y - step_y * x
    second = step_y * (x - edge_x) - step_x * (y - edge_y)
    if is_behind(first, step_2, slack) or is_behind(second, step_2, slack):
        return 2.0
    forward = step_x * edge_x + step_y * edge_y
    meets = along + share * forward
    if (meets < 0.0 or meets > length_2) and 2.0 * forward * forward > step_2 * length_2:
        # Along the wall rounding moves the place at which they meet: it is the wall's end, if the path gets there.
        share = (min(max(meets, 0.0), length_2) - along) / forward
        is_left = share < 0.0 and is_behind(-abs(share * forward), length_2, 2.0 * slack)
        return 2.0 if is_left or share > 1.0 else max(share, 0.0)
    return share


@inlined
def _disc_share(x: float, y: float, end_x: float, end_y: float, radius: float) -> float:
    """Return the share of a step at which it meets the edge of a disc around the origin; 2 if it does not."""
    step_x = end_x - x
    step_y = end_y - y
    a = step_x * step_x + step_y * step_y
    b = x * step_x + y * step_y
    c = x * x + y * y - radius * radius
    if radius > 0.0:
        root = b * b - a * max(c, 0.0)
        if b >= 0.0 or root < 0.0:
            return 2.0
        share = max(c, 0.0) / (math.sqrt(root) - b)
        return share if share <= 1.0 else 2.0
    if end_x * end_x + end_y * end_y <= radius * radius or a == 0.0:
        return 2.0
    c = min(c, 0.0)
    root = math.sqrt(b * b - a * c)
    return min(-c / (root + b) if b > 0.0 else (root - b) / a, 1.0)


@inlined
def reflected(x: float, y: float, normal_x: float, normal_y: float) -> tuple[float, float]:
    into = 2.0 * (x * normal_x + y * normal_y)
    return x - into * normal_x, y - into * normal_y


@kernel
def first_contact(
    x: float, y: float, step_x: float, step_y: float, size: Any
) -> tuple[float, float, float, float, float]:
    """Return where a step first meets a wall: share of the step, place, normal; the share is 2 if it does not."""
    slack = size[2]
    lift = _LIFT * slack
    discs = _HEAD + 4 * int(size[3])
    # A wall and a step of at most half a period meet near the middle of the step.
    middle_x = x + 0.5 * step_x
    middle_y = y + 0.5 * step_y
    end_x = x + step_x
    end_y = y + step_y
    first, at_x, at_y, normal_x, normal_y = 2.0, x, y, 0.0, 0.0
    for across in range(images(size[0])):
        for up in range(images(size[1])):
            for k in range(_HEAD, discs, 4):
                shift_x = image(0.5 * (size[k] + size[k + 2]), middle_x, size[0], across)
                shift_y = image(0.5 * (size[k + 1] + size[k + 3]), middle_y, size[1], up)
                from_x = x - size[k] - shift_x
                from_y = y - size[k + 1] - shift_y
                edge_x = size[k + 2] - size[k]
                edge_y = size[k + 3] - size[k + 1]
                to_x = end_x - size[k] - shift_x
                to_y = end_y - size[k + 1] - shift_y
                share = _wall_share(from_x, from_y, to_x, to_y, edge_x, edge_y, slack)
                if share < first:
                    first = share
                    length_2 = edge_x * edge_x + edge_y * edge_y
                    normal_x = -edge_y / math.sqrt(length_2)
                    normal_y = edge_x / math.sqrt(length_2)
                    # On the wall: in a sharp corner rounding could put the place beyond its end.
                    meet_x = from_x + share * (to_x - from_x)
                    meet_y = from_y + share * (to_y - from_y)
                    along = min(max((meet_x * edge_x + meet_y * edge_y) / length_2, 0.0), 1.0)
                    at_x = size[k] + shift_x + along * edge_x + lift * normal_x
                    at_y = size[k + 1] + shift_y + along * edge_y + lift * normal_y
            for k in range(discs, size.shape[0], 3):
                centre_x = size[k] + image(size[k], middle_x, size[0], across)
                centre_y = size[k + 1] + image(size[k + 1], middle_y, size[1], up)
                share = _disc_share(x - centre_x, y - centre_y, end_x - centre_x, end_y - centre_y, size[k + 2])
                if share < first:
                    first = share
                    out_x = x + share * step_x - centre_x
                    out_y = y + share * step_y - centre_y
                    side = 1.0 if size[k + 2] > 0.0 else -1.0
                    length = side * math.sqrt(out_x * out_x + out_y * out_y)
                    normal_x = out_x / length
                    normal_y = out_y / length
                    at_x = centre_x + (size[k + 2] + lift) * normal_x
                    at_y = centre_y + (size[k + 2] + lift) * normal_y
    return first, at_x, at_y, normal_x, normal_y


@kernel
def room_beside(x: float, y: float, size: Any) -> float:
    """Return the distance from the nearest wall, infinite without walls; `size` as in `confine_walls`."""
    room = math.inf
    discs = _HEAD + 4 * int(size[3])
    # Of a wall that is shorter than the period, one of the images on both sides is the nearest.
    for across in range(images(size[0])):
        for up in range(images(size[1])):
            for k in range(_HEAD, discs, 4):
                edge_x = size[k + 2] - size[k]
                edge_y = size[k + 3] - size[k + 1]
                off_x = x - size[k] - image(0.5 * (size[k] + size[k + 2]), x, size[0], across)
                off_y = y - size[k + 1] - image(0.5 * (size[k + 1] + size[k + 3]), y, size[1], up)
                share = min(max((off_x * edge_x + off_y * edge_y) / (edge_x * edge_x + edge_y * edge_y), 0.0), 1.0)
                off_x -= share * edge_x
                off_y -= share * edge_y
                room = min(room, math.sqrt(off_x * off_x + off_y * off_y))
            for k in range(discs, size.shape[0], 3):
                off_x = x - size[k] - image(size[k], x, size[0], across)
                off_y = y - size[k + 1] - image(size[k + 1], y, size[1], up)
                room = min(room, abs(math.sqrt(off_x * off_x + off_y * off_y) - abs(size[k + 2])))
    return room


@kernel
def confine_walls(
    x: float, y: float, step_x: float, step_y: float, heading_x: float, heading_y: float, size: Any
) -> tuple[float, float, float, float]:
    """Reflect a body at walls of segments and discs; `size` is that of `walls_size`."""
    for _ in range(_MOST_LEGS):
        leg = 1.0
        if size[0] > 0.0 and abs(step_x) > 0.5 * size[0]:
            leg = 0.5 * size[0] / abs(step_x)
        if size[1] > 0.0 and abs(step_y) * leg > 0.5 * size[1]:
            leg = 0.5 * size[1] / abs(step_y)
        share, at_x, at_y, normal_x, normal_y = first_contact(x, y, leg * step_x, leg * step_y, size)
        is_free = share > 1.0
        share = leg * min(share, 1.0)
        x = x + share * step_x if is_free else at_x
        y = y + share * step_y if is_free else at_y
        if size[0] > 0.0:
            x = wrap(x, size[0])
        if size[1] > 0.0:
            y = wrap(y, size[1])
        if is_free and leg == 1.0:
            break
        step_x *= 1.0 - share
        step_y *= 1.0 - share
        # A body that is only lifted from a wall keeps its heading.
        if step_x * normal_x + step_y * normal_y < 0.0:
            step_x, step_y = reflected(step_x, step_y, normal_x, normal_y)
            heading_x, heading_y = reflected(heading_x, heading_y, normal_x, normal_y)
    return x, y, heading_x, heading_y


Floats = npt.NDArray[np.float64]


class Sight(NamedTuple):
    """What blocks sight in an arena; it can be part of a `Record`.

    Attributes
    ----------
    segments : ndarray, shape (s, 4), float64
        Walls: the ends x0, y0, x1, y1 of each [length]. Seen from the first end, what is free lies on the left.
    discs : ndarray, shape (d, 3), float64
        Discs: x, y and radius of each [length].
    period : ndarray, shape (2,), float64
        The period of the arena [length]; 0 along an axis that does not repeat.
    slack : float
        A position beyond a wall by at most this distance is on the wall [length].
    """

    segments: Annotated[Floats, ".segments", 4]
    discs: Annotated[Floats, ".discs", 3]
    period: Annotated[Floats, 2]
    slack: float


@cache
def open_sight() -> Sight:
    """Return the sight in an arena where nothing blocks it."""
    return Sight(np.empty((0, 4)), np.empty((0, 3)), np.zeros(2), 0.0)


@inlined
def images(period: float) -> int:
    """Return the number of images of a thing that can be near a place, along an axis with this period."""
    return 2 if period > 0.0 else 1


@inlined
def image(thing: float, place: float, period: float, which: int) -> float:
    """Return the shift of an image of `thing`: the nearest above `place`, or (1) the nearest below it."""
    if period > 0.0:
        return -period * (math.floor((thing - place) / period) + which)
    return 0.0


@inlined
def is_behind(side: float, length_2: float, slack: float) -> bool:
    """Whether a point is behind a wall by more than the slack; `side` is its distance times the wall's length."""
    return side < 0.0 and side * side > slack * slack * length_2


@kernel
def is_crossed(x: float, y: float, way_x: float, way_y: float, walls: Any, k: int, slack: float) -> bool:
    """Whether the way from (x, y) crosses wall `k` of `walls`, x0, y0, x1, y1 each, from whichever side."""
    edge_x = walls[k, 2] - walls[k, 0]
    edge_y = walls[k, 3] - walls[k, 1]
    length_2 = edge_x * edge_x + edge_y * edge_y
    from_x = x - walls[k, 0]
    from_y = y - walls[k, 1]
    begin = edge_x * from_y - edge_y * from_x
    end = edge_x * (from_y + way_y) - edge_y * (from_x + way_x)
    is_begin_behind = is_behind(begin, length_2, slack)
    if is_begin_behind == is_behind(end, length_2, slack):
        return False
    share = min(max(begin / (begin - end), 0.0), 1.0)
    along = (from_x + share * way_x) * edge_x + (from_y + share * way_y) * edge_y
    if is_behind(along, length_2, slack) or is_behind(length_2 - along, length_2, slack):
        return False
    # A body at a corner is on two walls; it looks past the one that it looks along from behind.
    distance_2 = share * share * (way_x * way_x + way_y * way_y)
    to_corner = min(abs(along), abs(length_2 - along))
    is_at_corner = to_corner * to_corner <= slack * slack * length_2
    rest_2 = (1.0 - share) * (1.0 - share) * (way_x * way_x + way_y * way_y)
    return not (is_at_corner and min(distance_2, rest_2) <= slack * slack)


@kernel
def is_entered(x: float, y: float, way_x: float, way_y: float, centre_x: float, centre_y: float, radius: float) -> bool:
    """Whether the way from (x, y) comes nearer than `radius` to a centre."""
    to_x = centre_x - x
    to_y = centre_y - y
    length_2 = way_x * way_x + way_y * way_y
    share = 0.0
    if length_2 > 0.0:
        share = min(max((to_x * way_x + to_y * way_y) / length_2, 0.0), 1.0)
    off_x = to_x - share * way_x
    off_y = to_y - share * way_y
    return radius > 0.0 and off_x * off_x + off_y * off_y < radius * radius


@kernel
def is_blocked(x: float, y: float, way_x: float, way_y: float, sight: Any) -> bool:
    """Whether something blocks the line of sight from (x, y) to (x + way_x, y + way_y).

    Parameters
    ----------
    x, y : float
        Where the observer is [length].
    way_x, way_y : float
        The shortest way to what it looks at [length].
    sight : Sight
        What blocks sight.
    """
    segments, discs, slack = sight.segments, sight.discs, sight.slack
    period_x = sight.period[0]
    period_y = sight.period[1]
    # A thing and a line of sight that is at most half a period long meet near the middle of the line.
    middle_x = x + 0.5 * way_x
    middle_y = y + 0.5 * way_y
    for across in range(images(period_x)):
        for up in range(images(period_y)):
            for k in range(segments.shape[0]):
                from_x = x - image(0.5 * (segments[k, 0] + segments[k, 2]), middle_x, period_x, across)
                from_y = y - image(0.5 * (segments[k, 1] + segments[k, 3]), middle_y, period_y, up)
                if is_crossed(from_x, from_y, way_x, way_y, segments, k, slack):
                    return True
            for k in range(discs.shape[0]):
                centre_x = discs[k, 0] + image(discs[k, 0], middle_x, period_x, across)
                centre_y = discs[k, 1] + image(discs[k, 1], middle_y, period_y, up)
                if is_entered(x, y, way_x, way_y, centre_x, centre_y, discs[k, 2] - slack):
                    return True
    return False
