"""Contacts: what happens when bodies that have a radius meet.

All bodies move at once, each along a straight way. The earliest contact is found first; it ends the way of whoever
drives into the other. `Contact.meet` says what becomes of the rest of that way, which the next *leg* makes after all
others. No leg brings two bodies nearer than the sum of their radii, however fast they are.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Annotated, Any, ClassVar, NamedTuple

import numpy as np
import numpy.typing as npt

from teamsight.core.component import Component
from teamsight.core.contracts import is_own, object_of, parameters_of
from teamsight.core.kernel import Entry, Packed, Record, inlined, kernel, specialise
from teamsight.core.table import Table
from teamsight.world.arena import Arena, kernel_period, states_walls
from teamsight.world.motion import end_status, is_watched
from teamsight.world.registry import CONTACTS
from teamsight.world.walls import ROUNDING, first_contact, inset, reflected, room_beside, walls_size, wrap

Floats = npt.NDArray[np.float64]
Integers = npt.NDArray[np.int64]
Flags = npt.NDArray[np.bool_]

#: The column of the history with the number of bodies into whose way another has come in a step.
BUMPS = "bumps"
#: Bodies stop apart by this share of the arena's extent, so that rounding never lets them overlap.
SKIN = 1e-13
# A body makes a step in at most so many straight legs; what is left of its way then is not made.
_MOST_LEGS = 8
# So many contacts that follow from one another are in their exact order.
_MOST_TURNS = 32
# With more bodies than these, pairs are found in cells.
_FEW = 64


@inlined
def _stop(
    way_x: float, way_y: float, heading_x: float, heading_y: float, normal_x: float, normal_y: float, parameters: Any
) -> tuple[float, float, float, float]:
    return 0.0, 0.0, heading_x, heading_y


@inlined
def _slide(
    way_x: float, way_y: float, heading_x: float, heading_y: float, normal_x: float, normal_y: float, parameters: Any
) -> tuple[float, float, float, float]:
    into = min(way_x * normal_x + way_y * normal_y, 0.0)
    return way_x - into * normal_x, way_y - into * normal_y, heading_x, heading_y


class Contact(Component):
    """What becomes of a body that drives into another: the base class.

    A subclass defines `meet`. The fields of one that is a dataclass are the constants of the kernel.

    Attributes
    ----------
    meet : kernel
        ``meet(way_x, way_y, heading_x, heading_y, normal_x, normal_y, parameters)`` returns the rest of the way
        [length] and the heading, a unit vector: four numbers. The way is what is left of the step, and the normal the
        unit vector from the other body to this one. A way that leads into a body ends there again, and one that is
        longer than what was left is cut, so no kernel can let bodies overlap.

    Examples
    --------
    >>> @kernel
    ... def bounce(way_x, way_y, heading_x, heading_y, normal_x, normal_y, parameters):
    ...     into = 2.0 * min(way_x * normal_x + way_y * normal_y, 0.0)
    ...     ahead = 2.0 * min(heading_x * normal_x + heading_y * normal_y, 0.0)
    ...     return (
    ...         way_x - into * normal_x, way_y - into * normal_y,
    ...         heading_x - ahead * normal_x, heading_y - ahead * normal_y,
    ...     )
    >>> class Bounce(Contact):
    ...     meet = bounce
    """

    meet: ClassVar[Callable[..., tuple[float, float, float, float]]]

    @property
    def parameters(self) -> tuple[float, ...] | Floats:
        """The constants, in the order in which the kernel reads them; by default the fields of a dataclass."""
        return parameters_of(self, Contact)


@dataclass(frozen=True)
class Pass(Contact):
    """Bodies pass through each other, and their radius has no effect on how they move."""


@dataclass(frozen=True)
class Stop(Contact):
    """A body that drives into another stays where they meet until the end of the step."""

    meet = _stop


@dataclass(frozen=True)
class Slide(Contact):
    """A body that drives into another slides along it without friction; it does not push."""

    meet = _slide


def contact_of(value: Any, arena: Arena) -> Contact:
    """Return the contact that a user gives for a world in this arena, as an object or by name.

    Raises
    ------
    TypeError, ValueError
        If it is no contact, its name is unknown, or the arena does not say where its walls are.
    """
    contact: Contact = object_of("contact", value, CONTACTS, Contact)
    if isinstance(contact, Pass):
        return contact
    if not hasattr(type(contact), "meet"):
        raise TypeError(
            f"contact={type(contact).__name__}: has no 'meet'; give meet(way_x, way_y, heading_x, heading_y, normal_x, "
            "normal_y, parameters) -> (way_x, way_y, heading_x, heading_y)"
        )
    if not states_walls(arena):
        raise TypeError(
            f"contact={value!r}: bodies meet the walls too, and {type(arena).__name__} does not say where they are; "
            "define `walls`, the segments and discs at which its confine reflects, or use Polygon"
        )
    return contact


class SolidGroup(NamedTuple):
    """The record of the bodies of a group that can meet others; see `BODIES`. `active` is empty if all are."""

    position: Annotated[Floats, "n", 2]
    heading: Annotated[Floats, "n", 2]
    moved: Annotated[Floats, "n", 2]
    radius: Annotated[Floats, "n"]
    blocked: Annotated[Flags, "n"]
    bumps: Annotated[Integers, "n"]
    active: Annotated[Flags, "conditions"]


class Rows(NamedTuple):
    """Room to work in, with a row for each body; all but `anchor` is written anew in each step.

    Attributes
    ----------
    place, way, heading : ndarray, shape (n, 2), float64
        Where each is now, not wrapped; the rest of its way; its heading.
    radius, length : ndarray, shape (n,), float64
        Its radius, −1 if it meets nobody; and the length of the whole way.
    x, y, reach : ndarray, shape (n,), float64
        Where those that meet others begin, and the sum of radius and length; those that do not are endlessly far away.
    anchor : ndarray, shape (n, 3), float64
        A place, and how far a body may be from it without touching a wall.
    wall : ndarray, shape (n, 5), float64
        In this leg: the share of the way at which it meets a wall, where, and the normal there.
    first, end : ndarray, shape (n,), float64
        The share of its way at which it meets something; and that at which its way ends.
    normal : ndarray, shape (n, 3), float64
        How far its way leads into the body that it meets, negative; and the normal there.
    moves, is_new, is_blocked : ndarray, shape (n,), bool
        Whether it has a way; whether the end of that has changed, and then whether it is at a body; and whether any way
        of this step was.
    kind : ndarray, shape (n,), int64
        The row of `ContactArrays.walls` for its radius.
    next_one : ndarray, shape (n,), int64
        The next body in the same cell; −1 after the last.
    """

    place: Annotated[Floats, "bodies", 2]
    way: Annotated[Floats, "bodies", 2]
    heading: Annotated[Floats, "bodies", 2]
    radius: Annotated[Floats, "bodies"]
    length: Annotated[Floats, "bodies"]
    x: Annotated[Floats, "bodies"]
    y: Annotated[Floats, "bodies"]
    reach: Annotated[Floats, "bodies"]
    anchor: Annotated[Floats, "bodies", 3]
    wall: Annotated[Floats, "bodies", 5]
    first: Annotated[Floats, "bodies"]
    end: Annotated[Floats, "bodies"]
    normal: Annotated[Floats, "bodies", 3]
    moves: Annotated[Flags, "bodies"]
    is_new: Annotated[Flags, "bodies"]
    is_blocked: Annotated[Flags, "bodies"]
    kind: Annotated[Integers, "bodies"]
    next_one: Annotated[Integers, "bodies"]

    @classmethod
    def of(cls, size: int) -> Rows:
        """Return room for so many bodies."""
        dtypes: dict[str, Any] = dict.fromkeys(("moves", "is_new", "is_blocked"), np.bool_)
        dtypes |= dict.fromkeys(("kind", "next_one"), np.int64)
        widths = {"place": 2, "way": 2, "heading": 2, "anchor": 3, "wall": 5, "normal": 3}
        return cls(*(
            np.zeros((size, widths[name]) if name in widths else size, dtypes.get(name, np.float64))
            for name in cls._fields
        ))  # fmt: skip


class Pairs(NamedTuple):
    """The pairs of bodies that may meet in a step.

    Attributes
    ----------
    rows : ndarray, shape (room, 2), int64
        Both bodies.
    share : ndarray, shape (room, 2), float64
        The share of the leg at which the first drives into the second, and that at which the second does into the
        first; 2 or more if it does not.
    """

    rows: Annotated[Integers, "pairs", 2]
    share: Annotated[Floats, "pairs", 2]

    @classmethod
    def of(cls, room: int) -> Pairs:
        """Return room for so many pairs."""
        return cls(np.zeros((room, 2), np.int64), np.zeros((room, 2)))


class ContactArrays(NamedTuple):
    """The record of the contacts of a world.

    Attributes
    ----------
    groups : list of Packed of SolidGroup
        The groups with bodies that have a radius. `moved` and `heading` are what they want; see `motion.intend_entry`.
    mover : int
        The index of the group whose turn it is to move; −1 if all move at once.
    rows, pairs
        Room to work in.
    cells : ndarray, shape (cells,), int64
        The first body in each cell; −1 for none.
    low : ndarray, shape (2,), float64
        The lowest corner of the arena [length].
    extent : ndarray, shape (2,), float64
        Its width and height [length].
    arena_size : ndarray, shape (sizes,), float64
        Its size, for bodies without a radius.
    walls : ndarray, shape (kinds, …), float64
        For each kind of radius the walls for the centres of bodies, as `walls_size` writes them. First those of the
        arena, then those for points: within the arena even after rounding.
    period : ndarray, shape (2,), float64
        As in `Move`.
    skin : float
        The distance at which bodies stop from each other [length].
    parameters : ndarray, shape (k,), float64
        The constants of `Contact.meet`.
    bumped : ndarray, shape (1,), int64
        The number of bumps in this step.
    """

    groups: list[Packed[SolidGroup]]
    mover: int
    rows: Rows
    pairs: Pairs
    cells: Annotated[Integers, "cells"]
    low: Annotated[Floats, 2]
    extent: Annotated[Floats, 2]
    arena_size: Annotated[Floats, "sizes"]
    walls: Annotated[Floats, "kinds", "walls"]
    period: Annotated[Floats, 2]
    skin: float
    parameters: Annotated[Floats, "parameters"]
    bumped: Annotated[Integers, 1]


SOLID = Record(SolidGroup)
CONTACT = Record(ContactArrays)
solid_at, contact_at = SOLID.at, CONTACT.at


@kernel
def _gather(address: int) -> None:
    """Write the rows of all bodies: where they are, and the way that they intend."""
    here: Any = contact_at(address)
    rows = here.rows
    # Of what is farther, another image may be nearer at the end of a step.
    quarter = 0.25 * min(here.period[0], here.period[1]) if here.period[0] > 0.0 else math.inf
    at = 0
    for g in range(here.groups.shape[0]):
        group = solid_at(here.groups[g])
        for i in range(group.position.shape[0]):
            is_active = group.active.shape[0] == 0 or group.active[i]
            moves = is_active and (here.mover < 0 or here.mover == g)
            x = group.moved[i, 0] if moves else 0.0
            y = group.moved[i, 1] if moves else 0.0
            is_solid = is_active and group.radius[i] > 0.0
            length = math.sqrt(x * x + y * y)
            if is_solid and length > quarter - group.radius[i]:
                cut = max(quarter - group.radius[i], 0.0) / length
                x *= cut
                y *= cut
                length *= cut
            rows.way[at, 0] = x
            rows.way[at, 1] = y
            for axis in range(2):
                rows.place[at, axis] = group.position[i, axis]
                rows.heading[at, axis] = group.heading[i, axis]
            rows.radius[at] = group.radius[i] if is_solid else -1.0
            rows.length[at] = length
            rows.reach[at] = rows.radius[at] + rows.length[at] if is_solid else 0.0
            rows.x[at] = group.position[i, 0] if is_solid else math.inf
            rows.y[at] = group.position[i, 1]
            rows.is_blocked[at] = False
            at += 1


@inlined
def _apart(rows: Any, i: int, j: int, period: Any) -> tuple[float, float]:
    """Return the shortest way from a body to another."""
    x = rows.place[j, 0] - rows.place[i, 0]
    y = rows.place[j, 1] - rows.place[i, 1]
    if period[0] > 0.0:
        x -= period[0] * np.rint(x / period[0])
        y -= period[1] * np.rint(y / period[1])
    return x, y


@inlined
def _are_near(rows: Any, i: int, j: int, period: Any, skin: float) -> bool:
    x = rows.x[j] - rows.x[i]
    y = rows.y[j] - rows.y[i]
    if period[0] > 0.0:
        x -= period[0] * np.rint(x / period[0])
        y -= period[1] * np.rint(y / period[1])
    reach = rows.reach[i] + rows.reach[j] + skin
    # Two that stand stay apart.
    return bool(x * x + y * y < reach * reach and (rows.length[i] > 0.0 or rows.length[j] > 0.0))


@inlined
def _count_near(rows: Any, i: int, period: Any, skin: float) -> int:
    """Return how many bodies after this one may be near: a loop for SIMD lanes, where most have none."""
    x, y, reach = rows.x[i], rows.y[i], rows.reach[i] + skin
    xs, ys, reaches = rows.x, rows.y, rows.reach
    near = 0
    if period[0] > 0.0:
        return xs.shape[0]  # type: ignore[no-any-return]
    for j in range(i + 1, xs.shape[0]):
        off_x = xs[j] - x
        off_y = ys[j] - y
        apart = reach + reaches[j]
        near += 1 if off_x * off_x + off_y * off_y < apart * apart else 0
    return near


@inlined
def _cell(place: float, low: float, width: float, count: int) -> Any:
    return min(max(math.floor((place - low) / width), 0), count - 1)


@kernel
def _find_pairs(address: int) -> int:
    """List all pairs of bodies that may meet in this step; return their number, which may exceed the room."""
    here: Any = contact_at(address)
    rows, pairs, period, skin = here.rows, here.pairs.rows, here.period, here.skin
    size, room, found = rows.radius.shape[0], pairs.shape[0], 0
    widest = 0.0
    for i in range(size):
        widest = max(widest, rows.reach[i])
    width = 2.0 * widest + skin
    # At most one cell for each body on average.
    width = max(width, math.sqrt(here.extent[0] * here.extent[1] / here.cells.shape[0]))
    across = max(math.floor(here.extent[0] / width), 1)
    up = max(math.floor(here.extent[1] / width), 1)
    # On an axis that repeats, two cells would be neighbours on both sides.
    if size <= _FEW or across * up > here.cells.shape[0] or (period[0] > 0.0 and (across < 3 or up < 3)):
        for i in range(size):
            if rows.radius[i] > 0.0 and _count_near(rows, i, period, skin) > 0:
                for j in range(i + 1, size):
                    if _are_near(rows, i, j, period, skin):
                        if found < room:
                            pairs[found, 0] = i
                            pairs[found, 1] = j
                        found += 1
        return found
    wide_x = here.extent[0] / across
    wide_y = here.extent[1] / up
    for cell in range(across * up):
        here.cells[cell] = -1
    for i in range(size):
        if rows.radius[i] > 0.0:
            cell_x = _cell(rows.place[i, 0], here.low[0], wide_x, across)
            cell_y = _cell(rows.place[i, 1], here.low[1], wide_y, up)
            rows.next_one[i] = here.cells[cell_y * across + cell_x]
            here.cells[cell_y * across + cell_x] = i
    for i in range(size):
        if not rows.radius[i] > 0.0:
            continue
        cell_x = _cell(rows.place[i, 0], here.low[0], wide_x, across)
        cell_y = _cell(rows.place[i, 1], here.low[1], wide_y, up)
        for step_y in range(-1, 2):
            for step_x in range(-1, 2):
                near_x = cell_x + step_x
                near_y = cell_y + step_y
                if period[0] > 0.0:
                    near_x = (near_x + across) % across
                    near_y = (near_y + up) % up
                elif near_x < 0 or near_y < 0 or near_x >= across or near_y >= up:
                    continue
                # The lists descend.
                j = here.cells[near_y * across + near_x]
                while j > i:
                    if _are_near(rows, i, j, period, skin):
                        if found < room:
                            pairs[found, 0] = i
                            pairs[found, 1] = j
                        found += 1
                    j = rows.next_one[j]
    return found


@inlined
def touch(x: float, y: float, way_x: float, way_y: float, apart: float, skin: float) -> float:
    """Return the share of a way at which a body gets within `apart` of another; 2 if it does not.

    The other is at (x, y), and the way is that of the other as seen from the body. What is less than `apart` away
    may only leave. They stop `skin` before, so that rounding does not add up to an overlap.
    """
    b = x * way_x + y * way_y
    if b >= 0.0:
        return 2.0
    a = way_x * way_x + way_y * way_y
    square = x * x + y * y
    at = min(-b / a, 1.0)
    nearest = square + at * (2.0 * b + at * a)
    if nearest >= apart * apart:
        return 2.0
    c = square - (apart + skin) * (apart + skin)
    if c <= 0.0:
        return 0.0
    return min(c / (math.sqrt(max(b * b - a * c, 0.0)) - b), at)


@kernel
def _share(rows: Any, i: int, j: int, period: Any, skin: float) -> float:
    """Return the share of its way at which a body drives into another, whose way ends at `end`; 2 if it does not."""
    x, y = _apart(rows, i, j, period)
    apart = rows.radius[i] + rows.radius[j]
    way_x = rows.way[i, 0]
    way_y = rows.way[i, 1]
    its_x = rows.way[j, 0]
    its_y = rows.way[j, 1]
    end = rows.end[j]
    # Even if the other ends before it would be within `apart`: so two that drive into each other agree to the last bit.
    share = touch(x, y, its_x - way_x, its_y - way_y, apart, skin)
    if share <= end:
        x += share * (its_x - way_x)
        y += share * (its_y - way_y)
        # If only the other one drives, its way ends there, and this one goes on. One that slides along it does not
        # drive into it, whatever rounding says.
        drives = way_x * x + way_y * y > skin * rows.length[i]
        return share if drives or its_x * x + its_y * y > -skin * rows.length[j] else 2.0
    # From then on, the other stands.
    x += end * (its_x - way_x)
    y += end * (its_y - way_y)
    return end + touch(x, y, -way_x, -way_y, apart, skin)  # type: ignore[no-any-return]


@kernel
def _meet_walls(address: int) -> None:
    """Begin a leg: find where each way first meets a wall."""
    here: Any = contact_at(address)
    rows = here.rows
    for i in range(rows.radius.shape[0]):
        way_x = rows.way[i, 0]
        way_y = rows.way[i, 1]
        rows.wall[i, 0] = 2.0
        rows.moves[i] = rows.radius[i] > 0.0 and (way_x != 0.0 or way_y != 0.0)
        rows.end[i] = 0.0
        if not rows.moves[i]:
            continue
        rows.end[i] = 1.0
        x = rows.place[i, 0]
        y = rows.place[i, 1]
        off_x = x - rows.anchor[i, 0]
        off_y = y - rows.anchor[i, 1]
        length = rows.length[i]
        room = rows.anchor[i, 2] - length
        if room > 0.0 and off_x * off_x + off_y * off_y < room * room:
            continue
        # Without the slack: who is as near as that is not sure to be before the wall.
        slack = here.walls[0, 2]
        room = room_beside(x, y, here.walls[0]) - rows.radius[i] - slack
        rows.anchor[i, 0] = x
        rows.anchor[i, 1] = y
        rows.anchor[i, 2] = room
        if length < room:
            continue
        # What something has put into a wall is confined like a point, until it is out.
        kind = rows.kind[i] if room >= -2.0 * slack else 1
        share, at_x, at_y, normal_x, normal_y = first_contact(x, y, way_x, way_y, here.walls[kind])
        rows.wall[i, 0] = share
        rows.wall[i, 1] = at_x
        rows.wall[i, 2] = at_y
        rows.wall[i, 3] = normal_x
        rows.wall[i, 4] = normal_y
        rows.end[i] = min(share, 1.0)


@kernel
def _end_ways(address: int, found: int) -> None:
    """Find where each way of a leg ends.

    A way ends at the first contact, which depends on where the ways of others end. Ends are computed from those of the
    round before until none changes: after k rounds, the first k contacts in order of time are right. Within the skin
    two bodies may take turns to wait for each other; so after many rounds ends only get earlier, which is safe.
    """
    here: Any = contact_at(address)
    rows, pairs = here.rows, here.pairs
    size = rows.radius.shape[0]
    turn, has_more = 0, found > 0
    while has_more:
        for i in range(size):
            rows.first[i] = rows.wall[i, 0]
        for p in range(found):
            i = pairs.rows[p, 0]
            j = pairs.rows[p, 1]
            if turn == 0 or rows.is_new[j]:
                pairs.share[p, 0] = _share(rows, i, j, here.period, here.skin) if rows.moves[i] else 2.0
            if turn == 0 or rows.is_new[i]:
                pairs.share[p, 1] = _share(rows, j, i, here.period, here.skin) if rows.moves[j] else 2.0
            rows.first[i] = min(rows.first[i], pairs.share[p, 0])
            rows.first[j] = min(rows.first[j], pairs.share[p, 1])
        has_more = False
        for i in range(size):
            end = min(rows.first[i], 1.0) if rows.moves[i] else 0.0
            if turn > _MOST_TURNS:
                end = min(end, rows.end[i])
            rows.is_new[i] = end != rows.end[i]
            has_more = has_more or rows.is_new[i]
            rows.end[i] = end
        turn += 1
    for i in range(size):
        rows.is_new[i] = False
    for p in range(found):
        i = pairs.rows[p, 0]
        j = pairs.rows[p, 1]
        if pairs.share[p, 0] <= 1.0 and pairs.share[p, 0] == rows.end[i] and rows.wall[i, 0] > rows.end[i]:
            _note(rows, i, j, here.period)
        if pairs.share[p, 1] <= 1.0 and pairs.share[p, 1] == rows.end[j] and rows.wall[j, 0] > rows.end[j]:
            _note(rows, j, i, here.period)


@inlined
def _note(rows: Any, i: int, j: int, period: Any) -> None:
    """Note that the way of a body ends at another; of several that it meets at once, at that most in its way."""
    x, y = _apart(rows, i, j, period)
    share = rows.end[i]
    other = min(share, rows.end[j])
    x += other * rows.way[j, 0] - share * rows.way[i, 0]
    y += other * rows.way[j, 1] - share * rows.way[i, 1]
    length = math.sqrt(x * x + y * y)
    normal_x = -x / length
    normal_y = -y / length
    into = rows.way[i, 0] * normal_x + rows.way[i, 1] * normal_y
    if rows.is_new[i]:
        # So chosen, the order of bodies has no effect.
        if into > rows.normal[i, 0]:
            return
        if into == rows.normal[i, 0]:
            if normal_x < rows.normal[i, 1]:
                return
            if normal_x == rows.normal[i, 1] and normal_y <= rows.normal[i, 2]:
                return
    rows.is_new[i] = True
    rows.normal[i, 0] = into
    rows.normal[i, 1] = normal_x
    rows.normal[i, 2] = normal_y


@kernel
def _make_leg(address: int) -> bool:
    """Move all to where their ways end; those that meet a body keep the rest of their way, for `Contact.meet`.

    Return whether anybody has met anything.
    """
    here: Any = contact_at(address)
    rows = here.rows
    has_met: bool = False
    for i in range(rows.radius.shape[0]):
        if not rows.moves[i]:
            continue
        way_x = rows.way[i, 0]
        way_y = rows.way[i, 1]
        share = rows.end[i]
        has_met = has_met or rows.is_new[i] or rows.wall[i, 0] <= share
        if rows.is_new[i]:
            rows.is_blocked[i] = True
        elif rows.wall[i, 0] <= share:
            rows.place[i, 0] = rows.wall[i, 1]
            rows.place[i, 1] = rows.wall[i, 2]
            normal_x = rows.wall[i, 3]
            normal_y = rows.wall[i, 4]
            way_x *= 1.0 - share
            way_y *= 1.0 - share
            # A body that is only lifted from a wall keeps its heading.
            if way_x * normal_x + way_y * normal_y < 0.0:
                way_x, way_y = reflected(way_x, way_y, normal_x, normal_y)
                rows.heading[i, 0], rows.heading[i, 1] = reflected(
                    rows.heading[i, 0], rows.heading[i, 1], normal_x, normal_y
                )
            rows.way[i, 0] = way_x
            rows.way[i, 1] = way_y
            continue
        rows.place[i, 0] += share * way_x
        rows.place[i, 1] += share * way_y
        # What has met nothing has no way left.
        rest = 1.0 - share if rows.is_new[i] else 0.0
        rows.way[i, 0] = rest * way_x
        rows.way[i, 1] = rest * way_y
    return has_met


@kernel
def _scatter(address: int) -> None:
    """Write where the bodies are into their groups, and count bumps."""
    here: Any = contact_at(address)
    rows, period = here.rows, here.period
    at = 0
    if here.mover <= 0:
        here.bumped[0] = 0
    for g in range(here.groups.shape[0]):
        group = solid_at(here.groups[g])
        if here.mover >= 0 and here.mover != g:
            at += group.position.shape[0]
            continue
        for i in range(group.position.shape[0]):
            x = rows.place[at, 0]
            y = rows.place[at, 1]
            step_x = x - group.position[i, 0]
            step_y = y - group.position[i, 1]
            if period[0] > 0.0:
                step_x -= period[0] * np.rint(step_x / period[0])
                step_y -= period[1] * np.rint(step_y / period[1])
                x = wrap(x, period[0])
                y = wrap(y, period[1])
            group.moved[i, 0] = step_x
            group.moved[i, 1] = step_y
            group.position[i, 0] = x
            group.position[i, 1] = y
            group.heading[i, 0] = rows.heading[at, 0]
            group.heading[i, 1] = rows.heading[at, 1]
            if rows.is_blocked[at] and not group.blocked[i]:
                group.bumps[i] += 1
                here.bumped[0] += 1
            group.blocked[i] = rows.is_blocked[at]
            at += 1


def _collide(address: int) -> int:
    """Move all bodies; see `contact_entry`."""
    here: Any = contact_at(address)
    rows = here.rows
    _gather(address)
    found = _find_pairs(address)
    if found > here.pairs.rows.shape[0]:
        return found  # type: ignore[no-any-return]
    for _ in range(_MOST_LEGS):
        _meet_walls(address)
        _end_ways(address, found)
        if not _make_leg(address):
            break
        for i in range(rows.radius.shape[0]):
            if rows.is_new[i]:
                x, y, heading_x, heading_y = meet(  # type: ignore[name-defined]  # noqa: F821
                    rows.way[i, 0], rows.way[i, 1], rows.heading[i, 0], rows.heading[i, 1], rows.normal[i, 1],
                    rows.normal[i, 2], here.parameters,
                )  # fmt: skip
                left = rows.way[i, 0] * rows.way[i, 0] + rows.way[i, 1] * rows.way[i, 1]
                taken = x * x + y * y
                if not taken < math.inf or not abs(heading_x * heading_x + heading_y * heading_y - 1.0) < 1e-6:
                    return -1
                cut = math.sqrt(left / taken) if taken > left else 1.0
                rows.way[i, 0] = cut * x
                rows.way[i, 1] = cut * y
                rows.heading[i, 0] = heading_x
                rows.heading[i, 1] = heading_y
    for i in range(rows.radius.shape[0]):
        if rows.radius[i] < 0.0 and (rows.way[i, 0] != 0.0 or rows.way[i, 1] != 0.0):
            rows.place[i, 0], rows.place[i, 1], rows.heading[i, 0], rows.heading[i, 1] = confine(  # type: ignore[name-defined]  # noqa: F821
                rows.place[i, 0], rows.place[i, 1], rows.way[i, 0], rows.way[i, 1], rows.heading[i, 0],
                rows.heading[i, 1], here.arena_size,
            )  # fmt: skip
    _scatter(address)
    return done  # type: ignore[name-defined,no-any-return]  # noqa: F821


def contact_entry(contact: Contact, arena: Arena) -> Entry:
    """Return the compiled motion of bodies that have a radius, for this kind of contact in arenas of this class.

    Its argument is the address of `ContactArrays`. It returns `motion.end_status`, or a number of pairs for which to
    make room; or −1 if `Contact.meet` has returned what is no way or no heading, and nobody has moved then.
    """
    name = f"{type(contact).__name__}_{type(arena).__name__}".lower()
    has_own = is_own(contact) or is_watched(arena)
    return specialise(
        _collide, name, meet=type(contact).meet, confine=type(arena).confine, done=end_status(has_own)
    )


class SolidBodies:
    """The bodies that have a radius, in a world where bodies meet, and their records.

    Parameters
    ----------
    contact : Contact
        What happens when they meet.
    arena : Arena
        The arena.
    groups : sequence of Table
        The bodies of all groups in which any has a radius; see `BODIES`.
    conditional : sequence of bool
        For each group, whether some may be inactive, now or later.

    Attributes
    ----------
    arrays : ContactArrays
        The arrays of the motion of all at once.
    """

    def __init__(
        self,
        contact: Contact,
        arena: Arena,
        groups: Sequence[Table],
        conditional: Sequence[bool],
        arena_size: Floats,
    ) -> None:
        radius = np.concatenate([bodies.radius for bodies in groups])
        radii, kind = np.unique(radius, return_inverse=True)
        (low, high), walls = arena.bounds, arena.walls
        assert walls is not None
        reach = float(np.abs([low, high]).max())
        rows = Rows.of(len(radius))
        rows.kind[:] = kind + 2
        records = [
            SOLID.pack(SolidGroup(
                one.position, one.heading, one.moved, one.radius, one.blocked, one.bumps,
                one.active if is_conditional else np.zeros(0, np.bool_),
            ))
            for one, is_conditional in zip(groups, conditional, strict=True)
        ]  # fmt: skip
        self.arrays = ContactArrays(
            records, -1, rows, Pairs.of(8 * len(radius)), np.zeros(len(radius) + 1, np.int64), np.array(low, float),
            np.asarray(high, float) - low, arena_size,
            np.array([
                walls_size(inset(walls, one), arena.period, ROUNDING * reach)
                for one in (0.0, ROUNDING * reach, *radii)
            ]),
            kernel_period(arena.period), SKIN * reach, np.array(contact.parameters, float), np.zeros(1, np.int64),
        )  # fmt: skip
        self._packed: dict[int, Packed[ContactArrays]] = {}

    def record(self, mover: int = -1) -> Packed[ContactArrays]:
        """Return the record of the motion of one group, given by its index, while all others stand; −1 for all."""
        if mover not in self._packed:
            self._packed[mover] = CONTACT.pack(self.arrays._replace(mover=mover))
        return self._packed[mover]

    def grow(self, pairs: int) -> None:
        """Make room for so many pairs, and some to spare."""
        self.arrays = self.arrays._replace(pairs=Pairs.of(2 * pairs))
        for mover, packed in self._packed.items():
            packed.put(self.arrays._replace(mover=mover))
