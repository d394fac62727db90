"""Bodies, and their motion: turn towards the aim, within the turning limit; move, within the speed; stay inside."""

from __future__ import annotations

import math
from typing import Annotated, Any, NamedTuple

import numpy as np
import numpy.typing as npt

from teamsight.core.contracts import is_own
from teamsight.core.elementary import atan2, cos_sin
from teamsight.core.kernel import Entry, Packed, Record, inlined, specialise
from teamsight.core.table import Field, Table
from teamsight.world.arena import Arena, Obstructed, kernel_period
from teamsight.world.drive import Drive, Free

Column = npt.NDArray[np.float64]

#: What a move returns, negative, for each body for which its drive has returned no possible way.
WRONG_DRIVE = 1 << 40
#: What an entry returns in place of 0 if it calls kernels of the user's: one that raises an exception ends it before.
FINISHED = 1 << 62
_FREE = Free()

#: What each agent can do. Those who come to a group have them from the start of a run.
ABILITIES = (
    Field("speed", unit="length/tick", reset="first"),
    # The turning limit; see `motion.turn_limit`.
    Field("turn_cosine", fill=-2.0, reset="first"),
    Field("turn_sine", reset="first"),
    Field("sensing_range", unit="length", reset="first"),
    Field("awareness_range", unit="length", reset="first"),
    Field("radius", unit="length", reset="first"),
)

#: The columns of all agents.
BODIES = (
    # Unique in the world, never reused.
    Field("identity", np.int64),
    # The agent's number within its group, never reused. It selects the agent's noise.
    Field("member", np.int64),
    Field("position", shape=(2,), unit="length"),
    # Unit vectors.
    Field("heading", shape=(2,)),
    # The displacement of the last step.
    Field("moved", shape=(2,), reset="fill", unit="length"),
    *ABILITIES,
    # Whether it takes part: else it neither moves nor decides, senses nobody and is sensed by nobody.
    Field("active", np.bool_, fill=True, reset="fill"),
    # The sum of what interactions have given it since its last decision, and whether one has ended a trial since then.
    Field("reward", reset="fill"),
    Field("ended", np.bool_, fill=False, reset="fill"),
    # The same of the last step alone: the sum, and 1 if one has ended a trial.
    Field("last_rewards", shape=(2,), reset="fill"),
    # Whether another body was in its way in the last step, and how often that has begun.
    Field("blocked", np.bool_, fill=False, reset="fill"),
    Field("bumps", np.int64, reset="fill"),
    # The last action; see `Action`.
    Field("aim", shape=(2,), reset="fill"),
    Field("distance", reset="fill", unit="length"),
)


def bodies_at(position: Column, heading: Column) -> Table:
    """Return bodies that stay at these places, shape (n, 2) each; their columns can be written."""
    table = Table(BODIES, len(position))
    table.position[:], table.heading[:] = position, heading
    table.member[:] = np.arange(len(position))
    return table


class Move(NamedTuple):
    """The record of a move: the bodies of a group, their actions and the arena.

    Attributes
    ----------
    position, heading, moved, speed, turn_cosine, turn_sine
        As in `BODIES`.
    aim : ndarray, shape (n, 2), float64
        The heading that each action asks for: a unit vector; (0, 0) keeps the heading.
    distance : ndarray, shape (n,), float64
        The distance that each action asks for [length]; limited to the range from 0 to the body's speed.
    arena_size : ndarray, shape (sizes,), float64
        The size of the arena, for its wall.
    period : ndarray, shape (2,), float64
        The period of the arena, from `kernel_period`.
    box : ndarray, shape (2, 2), float64
        The lowest and the highest corner of the box around the arena.
    active : ndarray, shape (n,) or (0,), bool
        As in `BODIES`; empty if all are active. One that is not stays where it is.
    blocked : ndarray, shape (n,), bool
        As in `BODIES`.
    drive : ndarray, shape (n or 0, numbers), float64
        The state of the drive; see `Drive`.
    parameters : ndarray, shape (parameters,), float64
        The constants of the drive.
    """

    position: Annotated[Column, "n", 2]
    heading: Annotated[Column, "n", 2]
    moved: Annotated[Column, "n", 2]
    speed: Annotated[Column, "n"]
    turn_cosine: Annotated[Column, "n"]
    turn_sine: Annotated[Column, "n"]
    aim: Annotated[Column, "n", 2]
    distance: Annotated[Column, "n"]
    arena_size: Annotated[Column, "sizes"]
    period: Annotated[Column, 2]
    box: Annotated[Column, 2, 2]
    active: Annotated[npt.NDArray[np.bool_], "conditions"]
    blocked: Annotated[npt.NDArray[np.bool_], "n"]
    drive: Annotated[Column, "driven", "numbers"]
    parameters: Annotated[Column, "parameters"]


MOVE = Record(Move)
move_at = MOVE.at


@inlined
def turn(
    heading_x: float, heading_y: float, aim_x: float, aim_y: float, cosine: float, sine: float
) -> tuple[float, float]:
    """Turn a heading towards an aim, both unit vectors, by at most the angle with this cosine and sine.

    A limit of half a turn or more has cosine −2. If the aim is straight behind, the turn is to the left.
    """
    along = heading_x * aim_x + heading_y * aim_y
    if along >= cosine:
        return aim_x, aim_y
    if heading_x * aim_y - heading_y * aim_x < 0.0:
        sine = -sine
    x = cosine * heading_x - sine * heading_y
    y = sine * heading_x + cosine * heading_y
    # One Newton step keeps the length at 1 over millions of turns.
    length = 1.5 - 0.5 * (x * x + y * y)
    return x * length, y * length


@inlined
def is_action(heading_x: float, heading_y: float, distance: float) -> bool:
    """Whether a heading is a unit vector or (0, 0), and a distance is not NaN."""
    square = heading_x * heading_x + heading_y * heading_y
    return (abs(square - 1.0) < 1e-6 or square == 0.0) and distance == distance


@inlined
def _beyond_box(box: Any, x: float, y: float) -> bool:
    # So written, it is also True for NaN.
    return not (box[0, 0] <= x <= box[1, 0] and box[0, 1] <= y <= box[1, 1])


@inlined
def _nowhere(box: Any, x: float, y: float) -> bool:
    return False


@inlined
def _turned(move: Any, i: int) -> tuple[float, float]:
    """Return the heading of a body after the turn that its action asks for, within its turning limit."""
    aim_x = move.aim[i, 0]
    aim_y = move.aim[i, 1]
    heading_x = move.heading[i, 0]
    heading_y = move.heading[i, 1]
    if aim_x * aim_x + aim_y * aim_y > 0.0:
        return turn(heading_x, heading_y, aim_x, aim_y, move.turn_cosine[i], move.turn_sine[i])  # type: ignore[no-any-return]
    return heading_x, heading_y


@inlined
def _free(move: Any, i: int, carry: Any) -> tuple[float, float, float, float, int]:
    heading_x, heading_y = _turned(move, i)
    distance = min(max(move.distance[i], 0.0), move.speed[i])
    return distance * heading_x, distance * heading_y, heading_x, heading_y, 0


@inlined
def _driven(move: Any, i: int, carry: Any) -> tuple[float, float, float, float, int]:
    before_x = move.heading[i, 0]
    before_y = move.heading[i, 1]
    wanted_x, wanted_y = _turned(move, i)
    angle = atan2(before_x * wanted_y - before_y * wanted_x, before_x * wanted_x + before_y * wanted_y)
    speed = move.speed[i]
    distance = min(max(move.distance[i], 0.0), speed)
    ahead, left, turned = carry(angle, distance, speed, move.blocked[i], move.drive[i], move.parameters)
    cosine, sine = cos_sin(turned)
    # So written, it is also wrong for NaN.
    if not (ahead * ahead + left * left <= speed * speed * (1.0 + 1e-9) and cosine == cosine):
        return 0.0, 0.0, before_x, before_y, 1
    x = cosine * before_x - sine * before_y
    y = sine * before_x + cosine * before_y
    # As in `turn`.
    length = 1.5 - 0.5 * (x * x + y * y)
    return ahead * before_x - left * before_y, ahead * before_y + left * before_x, x * length, y * length, 0


@inlined
def _rest(move: Any, i: int) -> None:
    """Let a body that is inactive stay where it is."""
    move.moved[i, 0] = 0.0
    move.moved[i, 1] = 0.0
    if move.drive.shape[0] > 0:
        for number in range(move.drive.shape[1]):
            move.drive[i, number] = 0.0


def _intend(address: int) -> int:
    move = move_at(address)
    are_all_active = move.active.shape[0] == 0
    wrong = 0
    for i in range(move.position.shape[0]):
        if not (are_all_active or move.active[i]):
            _rest(move, i)
            continue
        way_x, way_y, heading_x, heading_y, is_wrong = intended(move, i, carry)  # type: ignore[name-defined]  # noqa: F821
        wrong += is_wrong
        move.heading[i, 0] = heading_x
        move.heading[i, 1] = heading_y
        move.moved[i, 0] = way_x
        move.moved[i, 1] = way_y
    return -WRONG_DRIVE * wrong if wrong > 0 else finished  # type: ignore[name-defined,no-any-return]  # noqa: F821


def _advance(address: int) -> int:
    move = move_at(address)
    position, heading, moved = move.position, move.heading, move.moved
    # Read once: for the compiler, the loop's writes could change the period.
    period_x = move.period[0]
    period_y = move.period[1]
    are_all_active = move.active.shape[0] == 0
    outside = wrong = 0
    for i in range(position.shape[0]):
        if not (are_all_active or move.active[i]):
            _rest(move, i)
            continue
        x = position[i, 0]
        y = position[i, 1]
        way_x, way_y, heading_x, heading_y, is_wrong = intended(move, i, carry)  # type: ignore[name-defined]  # noqa: F821
        wrong += is_wrong
        new_x, new_y, heading_x, heading_y = confine(  # type: ignore[name-defined]  # noqa: F821
            x, y, way_x, way_y, heading_x, heading_y, move.arena_size
        )
        outside += is_outside(move.box, new_x, new_y)  # type: ignore[name-defined]  # noqa: F821
        step_x = new_x - x
        step_y = new_y - y
        if period_x > 0.0:
            step_x -= period_x * np.rint(step_x / period_x)
            step_y -= period_y * np.rint(step_y / period_y)
        position[i, 0] = new_x
        position[i, 1] = new_y
        heading[i, 0] = heading_x
        heading[i, 1] = heading_y
        moved[i, 0] = step_x
        moved[i, 1] = step_y
    if outside + wrong > 0:
        return -outside - WRONG_DRIVE * wrong
    return finished  # type: ignore[name-defined,no-any-return]  # noqa: F821


def is_watched(arena: Arena) -> bool:
    """Whether an arena, or an obstacle in it, is user-defined, so that every step checks that bodies stay inside."""
    if not isinstance(arena, Obstructed):
        return not _is_shipped(arena)
    return not all(map(_is_shipped, (arena, arena.arena, *arena.obstacles)))


def _is_shipped(part: object) -> bool:
    return type(part).__module__.startswith("teamsight.world.")


def intend_entry(drive: Drive) -> Entry:
    """Return the kernel that writes how bodies turn, and to `moved` the way that they make if nothing is in it.

    It returns minus `WRONG_DRIVE` times the number of bodies for which the drive has returned no possible way; else
    `end_status`.
    """
    return specialise(_intend, type(drive).__name__.lower(), finished=end_status(is_own(drive)), **_carrying(drive))


def advance_entry(arena: Arena, drive: Drive = _FREE) -> Entry:
    """Return the compiled step of bodies with a drive of this class in arenas of this class.

    In a user-defined arena it returns minus the number of bodies that have left the box around the arena, and with a
    user-defined drive as `intend_entry`; else `end_status`.
    """
    names = [type(arena).__name__.lower()] + [type(drive).__name__.lower()] * (not isinstance(drive, Free))
    is_outside = _beyond_box if is_watched(arena) else _nowhere
    return specialise(
        _advance, "-".join(names), confine=type(arena).confine, is_outside=is_outside,
        finished=end_status(is_own(drive) or is_watched(arena)), **_carrying(drive),
    )  # fmt: skip


def end_status(has_own: bool) -> int:
    """Return what an entry returns when it is done; see `FINISHED`."""
    return FINISHED if has_own else 0


def _carrying(drive: Drive) -> dict[str, Any]:
    kind = type(drive)
    return {"intended": _free, "carry": _free} if kind is Free else {"intended": _driven, "carry": kind.carry}


def pack_move(
    arena: Arena,
    bodies: Table,
    aim: Column,
    distance: Column,
    *,
    arena_size: Column | None = None,
    has_inactive: bool = False,
    drive: Drive = _FREE,
) -> Packed[Move]:
    """Return the record of a move of `bodies` under the actions that `aim` and `distance` will hold; see `Move`.

    `arena_size` is the array that holds the arena's size, if that is rewritten later; `has_inactive` says whether some
    may be inactive, now or later. For a drive that keeps numbers, `bodies` have the column "drive".
    """
    period, box = kernel_period(arena.period), np.array(arena.bounds, float)
    size = np.array(arena.size, float) if arena_size is None else arena_size
    return MOVE.pack(Move(
        bodies.position, bodies.heading, bodies.moved, bodies.speed, bodies.turn_cosine, bodies.turn_sine, aim,
        distance, size, period, box, bodies.active if has_inactive else np.zeros(0, np.bool_), bodies.blocked,
        bodies.drive if "drive" in bodies else np.zeros((0, 0)), np.array(drive.parameters, float),
    ))  # fmt: skip


def turn_limit(limit: float) -> tuple[float, float]:
    """Return the cosine and sine of a turning limit [rad per step] for `turn`."""
    if limit >= math.pi:
        return -2.0, 0.0
    return math.cos(limit), math.sin(limit)


def limit_of_turn(cosine: npt.NDArray[np.float64], sine: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
    """Return the turning limits [rad per step] with these cosines and sines; see `turn_limit`."""
    return np.where(cosine < -1.0, math.pi, np.arctan2(sine, cosine))
