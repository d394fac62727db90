"""The checks of an arena, its area, starts, distances and `confine`; of contacts, drives and interactions."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import cache, partial
from typing import Annotated, Any, NamedTuple

import numpy as np
import numpy.typing as npt

from teamsight.core import checks
from teamsight.core.contracts import class_name, numbers, random_headings
from teamsight.core.kernel import Record, specialise
from teamsight.core.kernel.guard import Axis, Guard, begin_check
from teamsight.world.arena import Arena, Points, Torus, farthest_inside
from teamsight.world.contact import Contact, Stop, contact_of
from teamsight.world.drive import Drive, Free, drive_of
from teamsight.world.interaction import (
    Interacting,
    InteractingBodies,
    Interaction,
    InteractionState,
    Kinds,
    bodies_type,
    check_interaction_declarations,
    first_state,
    interacting_record,
    lanes_of,
    length_of,
    sizes_type,
)
from teamsight.world.noise import LANES


class Steps(NamedTuple):
    """The record of some steps.

    Attributes
    ----------
    given : ndarray, shape (k, 6), float64
        Position, step and heading of each.
    reached : ndarray, shape (k, 4), float64
        Written: position and heading after each step.
    size : ndarray, shape (sizes,), float64
        The size of the arena.
    """

    given: Annotated[Points, "k", 6]
    reached: Annotated[Points, "k", 4]
    size: Annotated[Points, "sizes"]


STEPS = Record(Steps)
steps_at = STEPS.at

# Steps in units of the arena's extent: none, some too short to change a position, up to many crossings.
_LENGTHS = (0.0, 5e-324, 1e-300, 1e-17, 1e-12, 1e-6, 0.01, 0.3, 1.0, 7.3, 1e3)
_WAYS = 24
# Those along the axes are exact, so that positions found there lie on the wall itself.
_AROUND = np.stack([wave(2 * np.pi * np.arange(_WAYS) / _WAYS) for wave in (np.cos, np.sin)], axis=-1).round(15)
_HERE_AND_AROUND = np.concatenate([np.zeros((1, 2)), _AROUND])
_HALVINGS = 60
# Of drives [rad].
_MOST_TURN = 1e6
_WALKERS, _WALK = 64, 300

_STEP, _PART = Axis("steps", "there are no more"), Axis("components", "there are no more")
_GUARD = Guard(
    STEPS,
    ("given", "reached"),
    {"k": _STEP, "6": _PART, "4": _PART, "sizes": Axis("elements", "return as many numbers from `size`")},
)


def _confine_all(address: int) -> int:
    steps = steps_at(address)
    given, reached, size = steps.given, steps.reached, steps.size
    for k in range(given.shape[0]):
        x, y, heading_x, heading_y = confine(  # type: ignore[name-defined]  # noqa: F821
            given[k, 0], given[k, 1], given[k, 2], given[k, 3], given[k, 4], given[k, 5], size
        )
        reached[k, 0] = x
        reached[k, 1] = y
        reached[k, 2] = heading_x
        reached[k, 3] = heading_y
    return 0


# Steps of each call that also run as plain Python.
_INTERPRETED = 8


def _check_confine(arena: Arena, box: Points, places: Points, rng: np.random.Generator) -> None:
    """Refuse an arena whose `confine` returns a position outside, or a heading that is not a unit vector.

    Steps begin at `places` inside; `box` are the bounds.
    """
    extent = float(np.ptp(box, axis=0).max())
    begin = np.concatenate([places[:256], _at_the_wall(arena, box, places[:64], extent)])
    for length in _LENGTHS:
        for heading in _headings(begin, rng):
            _check_steps(arena, begin, length * extent * heading, heading)
    _check_short_steps(arena, places, extent, rng)
    # Walks of many steps stay inside.
    place = begin[rng.integers(0, len(begin), _WALKERS)]
    heading = random_headings(_WALKERS, rng)
    for number in range(_WALK):
        step = extent * rng.choice([0.01, 0.2, 0.9]) * heading
        reached = _check_steps(arena, place, step, heading, is_interpreted=number % 10 == 0)
        place, heading = reached[:, :2].copy(), reached[:, 2:].copy()


def _at_the_wall(arena: Arena, box: Points, places: Points, extent: float) -> Points:
    """Return positions at the wall, found from `places` in all directions, with corners and the centre."""
    inside = np.repeat(places, _WAYS, axis=0)
    way = np.tile(_AROUND, (len(places), 1))
    far = np.full(len(inside), 2.0 * extent)
    near = farthest_inside(lambda share: arena.contains(inside + share[:, None] * way), far, _HALVINGS)
    found = inside + near[:, None] * way
    # The corners, the middles of the sides, the centre, and the origin.
    grid = np.stack(np.meshgrid(*np.linspace(box[0], box[1], 3).T), axis=-1).reshape(-1, 2)
    found = np.concatenate([found, grid, np.zeros((1, 2))])
    return found[np.asarray(arena.contains(found))]


def _headings(begin: Points, rng: np.random.Generator) -> list[Points]:
    """Return headings: random, along the axes, away from the origin, and perpendicular to that."""
    length = np.hypot(begin[:, 0], begin[:, 1])[:, None]
    outward = np.divide(begin, length, out=np.tile([1.0, 0.0], (len(begin), 1)), where=length > 0)
    fixed = [np.tile(way, (len(begin), 1)) for way in ([1.0, 0.0], [0.0, -1.0])]
    across = np.stack([-outward[:, 1], outward[:, 0]], axis=-1)
    return [random_headings(len(begin), rng), outward, across, *fixed]


def _check_steps(
    arena: Arena, begin: Points, step: Points, heading: Points, *, is_interpreted: bool = True
) -> npt.NDArray[np.float64]:
    """Make the steps, a few of them as plain Python too; return positions and headings after them, shape (n, 4)."""
    given = np.ascontiguousarray(np.concatenate([begin, step, heading], axis=1))
    name = type(arena).__name__
    entry = specialise(_confine_all, name.lower(), confine=type(arena).confine)
    steps = Steps(given, np.full((len(given), 4), np.nan), np.array(arena.size, float))
    if is_interpreted:
        few = slice(None, None, max(1, len(given) // _INTERPRETED))
        _GUARD.interpret(name, "confine", entry, steps._replace(given=given[few], reached=steps.reached[few]))
    reached = _GUARD.execute(name, "confine", entry, steps)[1].reached
    finite = np.asarray(np.isfinite(reached).all(axis=1))
    inside = np.asarray(arena.contains(np.where(finite[:, None], reached[:, :2], 0.0)))
    unit: npt.NDArray[np.bool_] = np.abs(reached[:, 2] ** 2 + reached[:, 3] ** 2 - 1.0) <= 1e-6
    _refuse_calls(
        partial(_result, arena, given, reached),
        (finite, "which is not finite; return four finite numbers"),
        (inside, "which is outside according to contains(); return a position inside, or on the wall"),
        (unit, "whose heading is not a unit vector; reflect it without changing its length"),
    )
    return reached


def _result(arena: Arena, given: Any, reached: Any, k: int) -> str:
    return f"{type(arena).__name__}: confine({_listed(given[k])}, size) returns ({_listed(reached[k])})"


def _listed(row: Any) -> str:
    return ", ".join(map(str, row.tolist()))


def _refuse_calls(shown: Callable[[int], str], *parts: tuple[Any, str]) -> None:
    """Refuse the first call of a kernel that is not as it must be.

    Parameters
    ----------
    shown : callable
        Returns a call, given by its number, with its result.
    *parts : (ndarray, str)
        Whether each call is right, and what is wrong with one that is not, with the cure.
    """
    for is_right, wrong in parts:
        if not is_right.all():
            raise ValueError(f"{shown(int(np.argmin(is_right)))}, {wrong}")


def _check_short_steps(arena: Arena, places: Points, extent: float, rng: np.random.Generator) -> None:
    """Check that a step far from the wall ends at position + step, with its heading."""
    heading = random_headings(len(places), rng)
    for length in (0.0, 1e-3 * extent):
        # Free: in many directions, no wall at the step's length nor at twice that.
        free = np.all([_inside_around(arena, places, share * length) for share in (1.0, 2.0)], axis=(0, 1))
        step = length * heading
        reached = _check_steps(arena, places, step, heading)
        wrong = np.abs(arena.displacement(places + step, reached[:, :2])).max(axis=1) > 1e-9 * extent
        wrong = (wrong | (np.abs(reached[:, 2:] - heading).max(axis=1) > 1e-9)) & free
        if wrong.any():
            given = np.concatenate([places, step, heading], axis=1)
            result = _result(arena, given, reached, int(np.argmax(wrong)))
            raise ValueError(f"{result}, although no wall is near; add the step to the position and keep the heading")


def _inside_around(arena: Arena, places: Points, radius: float) -> npt.NDArray[np.bool_]:
    """Return whether positions, and the points around them, are inside, shape (1 + directions, n)."""
    # Along an axis that repeats, the arena continues.
    around = (arena.displacement(np.zeros(2), places + radius * way) for way in _HERE_AND_AROUND)
    return np.array([arena.contains(each) for each in around])


class Meetings(NamedTuple):
    """The record of some meetings of two bodies.

    Attributes
    ----------
    given : ndarray, shape (k, 6), float64
        The rest of the way, heading and normal of each.
    after : ndarray, shape (k, 4), float64
        Written: the way and the heading after it.
    parameters : ndarray, shape (parameters,), float64
        The constants of the contact.
    """

    given: Annotated[Points, "k", 6]
    after: Annotated[Points, "k", 4]
    parameters: Annotated[Points, "parameters"]


MEETINGS = Record(Meetings)
meetings_at = MEETINGS.at

_MEETINGS = Guard(
    MEETINGS,
    ("given", "after"),
    {"k": _STEP, "6": _PART, "4": _PART, "parameters": Axis("elements", "return as many numbers from `parameters`")},
)


def _meet_all(address: int) -> int:
    meetings = meetings_at(address)
    given, after = meetings.given, meetings.after
    for k in range(given.shape[0]):
        after[k, 0], after[k, 1], after[k, 2], after[k, 3] = meet(  # type: ignore[name-defined]  # noqa: F821
            given[k, 0], given[k, 1], given[k, 2], given[k, 3], given[k, 4], given[k, 5], meetings.parameters
        )
    return 0


def check_contact(contact: Contact, *, seed: int = 1) -> None:
    """Check whether a contact keeps the contract of `Contact`, with many ways, headings and normals.

    Parameters
    ----------
    contact : Contact
        The contact to check.
    seed : int, default 1
        Seed of the samples.

    Raises
    ------
    TypeError
        If it is not a `Contact`, or `meet` cannot be compiled.
    ValueError
        If `meet` returns what is not finite, a heading that is no unit vector, or a way that is longer than what was
        left. The message has the call, its result and the cure.
    """
    name = class_name(contact, Contact, "Bounce()")
    contact_of(contact, Torus(1.0, 1.0))
    begin_check()
    parameters = np.array(numbers(f"{name}.parameters", contact.parameters), float)
    rng = np.random.default_rng(seed)
    way, heading, normal = (random_headings(_WALK, rng) for _ in range(3))
    # No way is left, a short one, a long one; straight into the other, and along it.
    way *= rng.choice(_LENGTHS, _WALK)[:, None]
    way[:8], heading[:8] = -normal[:8], -normal[:8]
    way[8:16] = np.stack([-normal[8:16, 1], normal[8:16, 0]], axis=-1)
    given = np.ascontiguousarray(np.concatenate([way, heading, normal], axis=1))
    entry = specialise(_meet_all, name.lower(), meet=getattr(type(contact), "meet", Stop.meet))
    meetings = Meetings(given, np.full((_WALK, 4), np.nan), parameters)
    few = slice(None, None, _WALK // _INTERPRETED)
    _MEETINGS.interpret(name, "meet", entry, meetings._replace(given=given[few], after=meetings.after[few]))
    after = _MEETINGS.execute(name, "meet", entry, meetings)[1].after
    length = np.hypot(way[:, 0], way[:, 1])
    _refuse_calls(
        lambda k: f"{name}: meet({_listed(given[k])}, parameters) returns ({_listed(after[k])})",
        (np.isfinite(after).all(axis=1), "which is not finite; return four finite numbers"),
        (np.abs(after[:, 2] ** 2 + after[:, 3] ** 2 - 1.0) <= 1e-6, "whose heading is no unit vector; keep its length"),
        (np.hypot(after[:, 0], after[:, 1]) <= length * (1 + 1e-9), "a longer way than is left; it would be cut"),
    )


class Rides(NamedTuple):
    """The record of one step of some bodies.

    Attributes
    ----------
    asked : ndarray, shape (k, 3), float64
        The turn and the distance that are asked for, and the speed.
    blocked : ndarray, shape (k,), bool
        Whether each was blocked in the last step.
    state : ndarray, shape (k, numbers), float64
        The numbers of the drive.
    done : ndarray, shape (k, 3), float64
        Written: how far ahead and to the left, and the turn.
    parameters : ndarray, shape (parameters,), float64
        The constants of the drive.
    """

    asked: Annotated[Points, "k", 3]
    blocked: Annotated[npt.NDArray[np.bool_], "k"]
    state: Annotated[Points, "k", "numbers"]
    done: Annotated[Points, "k", 3]
    parameters: Annotated[Points, "parameters"]


RIDES = Record(Rides)
rides_at = RIDES.at

_RIDES = Guard(
    RIDES,
    ("state", "done"),
    {
        "k": _STEP, "3": _PART, "numbers": Axis("numbers", "name as many as it needs in `state`"),
        "parameters": Axis("elements", "return as many numbers from `parameters`"),
    },
)  # fmt: skip


def _carry_all(address: int) -> int:
    rides = rides_at(address)
    asked, done = rides.asked, rides.done
    for k in range(asked.shape[0]):
        done[k, 0], done[k, 1], done[k, 2] = carry(  # type: ignore[name-defined]  # noqa: F821
            asked[k, 0], asked[k, 1], asked[k, 2], rides.blocked[k], rides.state[k], rides.parameters
        )
    return 0


def check_drive(drive: Drive, *, steps: int = 40, seed: int = 1) -> None:
    """Check whether a drive keeps the contract of `Drive`, on bodies that ask for many turns and distances.

    Parameters
    ----------
    drive : Drive
        The drive to check.
    steps : int
        The number of steps that each body makes.
    seed : int, default 1
        Seed of the samples.

    Raises
    ------
    TypeError
        If it is not a `Drive`, or `carry` cannot be compiled.
    ValueError
        If `carry` returns or keeps what is not finite, or a way that is longer than the speed. The message has the
        call, its result and the cure.
    """
    name = class_name(drive, Drive, "DifferentialDrive(0.1)")
    checks.count("steps", steps, least=1)
    if isinstance(drive_of(drive), Free):
        return
    begin_check()
    parameters = np.array(numbers(f"{name}.parameters", drive.parameters), float)
    rng = np.random.default_rng(checks.count("seed", seed, least=0))
    speed = rng.choice([0.0, 1e-6, 0.1, 1.0, 50.0], _WALK)
    entry = specialise(_carry_all, name.lower(), carry=type(drive).carry)
    state, few = np.zeros((_WALK, len(drive.state))), slice(None, None, _WALK // _INTERPRETED)
    for number in range(steps):
        turn = rng.uniform(-np.pi, np.pi, _WALK) * rng.choice([0.0, 1e-9, 0.1, 1.0], _WALK)
        asked = np.stack([turn, speed * rng.choice([0.0, 0.3, 1.0], _WALK), speed], axis=-1)
        rides = Rides(asked, rng.random(_WALK) < 0.1, state.copy(), np.full((_WALK, 3), np.nan), parameters)
        if number % 10 == 0:
            parts = {part: getattr(rides, part)[few] for part in ("asked", "blocked", "state", "done")}
            _RIDES.interpret(name, "carry", entry, rides._replace(**parts))
        after = _RIDES.execute(name, "carry", entry, rides)[1]
        called = [*asked.T, rides.blocked]
        _refuse_calls(
            lambda k: (
                f"{name}: carry({', '.join(str(one[k].item()) for one in called)}, {state[k].tolist()}, parameters) "  # noqa: B023
                f"returns ({_listed(after.done[k])})"  # noqa: B023
            ),
            (np.isfinite(after.done).all(axis=1), "which is not finite; return three finite numbers"),
            (np.hypot(*after.done[:, :2].T) <= speed * (1 + 1e-9), "a longer way than the speed; limit it to that"),
            (np.abs(after.done[:, 2]) < _MOST_TURN, "a turn of too many rounds; return it in radians"),
            (np.isfinite(after.state).all(axis=1), "and keeps what is not finite; write finite numbers to `state`"),
        )
        state = after.state


_SAMPLES = 100_000
# Shares of the box that are estimated from the samples; their standard error is 0.0016 at most.
_TOLERANCE = 0.01
_CELLS = 4
_PLACES = 40_000
_MOVED = 2_000
# The relative error that `Arena.inside` may have in the margin.
_COARSE = 2e-3

# The smallest and the largest number in (0, 1) that noise can give, and some in between.
_EDGES = (2.0**-54, 1e-9, 0.25, 0.5, 0.75, 1 - 1e-9, 1 - 2.0**-53)


def check_arena(arena: Arena, *, seed: int = 1) -> None:
    """Check whether an arena keeps the contract of `Arena`, with many positions and steps.

    It checks that `size`, `bounds`, `period` and `area` are consistent; that `contains` takes positions of all shapes;
    that `place` returns positions inside, uniform over the area and at least the margin from the wall; that `inside`
    moves points inside and keeps those that are; and that `confine` ends every step inside with a unit heading.

    Parameters
    ----------
    arena : Arena
        The arena to check.
    seed : int, default 1
        Seed of the positions and steps.

    Raises
    ------
    TypeError
        If it is not an `Arena`, a member has the wrong type, or `confine` cannot be compiled.
    ValueError
        If it breaks the contract. The message names the arena, the call, its result and the cure.
    """
    name = class_name(arena, Arena, "Disc(2.0)")
    begin_check()
    rng = np.random.default_rng(seed)
    box = _check_numbers(name, arena)
    samples = rng.uniform(box[0], box[1], (_SAMPLES, 2))
    _check_contains(name, arena, samples[:6])
    _check_box(name, arena, box, samples, rng)
    places = _check_place(name, arena, box, samples, rng)
    _check_inside(name, arena, box, places, rng)
    _check_confine(arena, box, places[rng.permutation(len(places))[:1000]], rng)


def _check_numbers(name: str, arena: Arena) -> Points:
    """Check `size`, `bounds`, `period` and `area` as numbers; return the bounds, shape (2, 2)."""
    numbers(f"{name}.size", arena.size)
    bounds = numbers(f"{name}.bounds", arena.bounds, 2)
    if bounds.shape != (2, 2) or not (bounds[0] < bounds[1]).all():
        corners = bounds.tolist()
        raise ValueError(f"{name}.bounds={corners}: must be two corners, the lower left and the upper right one")
    period = numbers(f"{name}.period", arena.period)
    if period.shape != (2,) or (period < 0).any():
        raise ValueError(f"{name}.period={checks.shown(arena.period)}: must be two numbers of at least 0")
    for axis, (side, repeats) in enumerate(zip(bounds[1] - bounds[0], period, strict=True)):
        if repeats > 0 and abs(side - repeats) > 1e-9 * side:
            raise ValueError(
                f"{name}.period[{axis}]={repeats:g}: must be 0, or the side of the bounds along that axis, {side:g}"
            )
    checks.number(f"{name}.area", arena.area, above=0)
    return bounds


def _check_contains(name: str, arena: Arena, few: Points) -> None:
    """Check that `contains` gives the same result for positions of all shapes."""
    answers = []
    for positions in (few, few.reshape(2, 3, 2), few[:0], *few):
        shape, cure = positions.shape, "work along the last axis, as in position[..., 0]"
        answer = np.asarray(_called(f"{name}.contains of positions of shape {shape}", cure, arena.contains, positions))
        if answer.shape != shape[:-1] or answer.dtype != bool:
            raise ValueError(
                f"{name}.contains of positions of shape {shape} has the shape {answer.shape} and the type "
                f"{answer.dtype}; it must be {shape[:-1]} and bool: {cure}"
            )
        answers.append(answer.ravel())
    whole, folded, _, *single = answers
    if not (np.array_equal(whole, folded) and np.array_equal(whole, np.concatenate(single))):
        raise ValueError(f"{name}.contains differs between one position and several; work along the last axis")


def _called(what: str, cure: str, function: Callable[..., Any], *arguments: Any) -> Any:
    try:
        return function(*arguments)
    except Exception as error:
        said = f"{type(error).__name__}({str(error)[:80]!r})"
        raise ValueError(f"{what} raises {said}; {cure}") from error


def _check_box(name: str, arena: Arena, box: Points, samples: Points, rng: np.random.Generator) -> None:
    """Check that nothing is inside beyond the bounds, and that `area` agrees with `contains`."""
    low, high = box
    sides = high - low
    around = rng.uniform(low - sides, high + sides, (_SAMPLES, 2))
    beyond = ((around < low - 1e-9 * sides) | (around > high + 1e-9 * sides)).any(axis=1)
    outside = np.flatnonzero(beyond & np.asarray(arena.contains(around)))
    if len(outside):
        raise ValueError(
            f"{name}.contains({around[outside[0]].tolist()}) is True, although that is beyond the bounds "
            f"{low.tolist()}, {high.tolist()}; widen the bounds"
        )
    share, whole = float(np.mean(arena.contains(samples))), float(sides.prod())
    if abs(share - arena.area / whole) > _TOLERANCE:
        raise ValueError(
            f"{name}.area={arena.area:g}: by contains() it is {share * whole:.4g}, a share of {share:.3f} of the "
            f"bounds; they must agree to {_TOLERANCE:g} of the bounds"
        )


def _check_place(name: str, arena: Arena, box: Points, samples: Points, rng: np.random.Generator) -> Points:
    """Check `place`; return positions inside."""
    extent = float(np.ptp(box, axis=0).max())
    edges = np.stack(np.meshgrid(_EDGES, _EDGES), axis=-1).reshape(-1, 2)
    u, v = np.concatenate([edges, rng.random((_PLACES, 2)).clip(2.0**-54, 1 - 2.0**-53)]).T
    # No margin, one that surely fits, and one that surely does not.
    small = 0.01 * min(np.sqrt(arena.area), float(np.ptp(box, axis=0).min()))
    for margin in (0.0, small, 10.0 * extent):
        places = _placed(name, arena, u, v, margin)
        inside = np.asarray(arena.contains(places))
        if not inside.all():
            k = int(np.argmin(inside))
            raise ValueError(
                f"{_placing(name, u, v, margin, k)} is {places[k].tolist()}, which is outside according to contains(); "
                "map all of (0, 1) × (0, 1) inside, also after rounding"
            )
        if margin == small:
            k, ahead = _nearest_to_wall(arena, places, margin)
            if ahead is not None:
                raise ValueError(
                    f"{_placing(name, u, v, margin, k)} is {places[k].tolist()}, nearer to the wall than the margin: "
                    f"{ahead} is outside; return positions at least the margin from the wall"
                )
    places = _placed(name, arena, u, v, 0.0)
    _check_uniform(name, arena, box, places[len(edges) :], samples)
    _placed(name, arena, 0.5, 0.5, 0.0)
    return places


def _placed(name: str, arena: Arena, u: Any, v: Any, margin: float) -> Points:
    what, cure = f"{name}.place of numbers of shape {np.shape(u)}", "accept numbers and arrays, and any margin"
    places = np.asarray(_called(f"{what}, margin={margin:g}", cure, arena.place, u, v, margin), float)
    if places.shape != (*np.shape(u), 2):
        raise ValueError(f"{what} has the shape {places.shape}; stack x and y along the last axis")
    is_finite = np.isfinite(places.reshape(-1, 2)).all(axis=1)
    if not is_finite.all():
        k = int(np.argmin(is_finite))
        place = places.reshape(-1, 2)[k].tolist()
        raise ValueError(f"{_placing(name, np.ravel(u), np.ravel(v), margin, k)} is {place}; it must be finite")
    return places


def _placing(name: str, u: Any, v: Any, margin: float, k: int) -> str:
    return f"{name}.place({float(u[k])!r}, {float(v[k])!r}, margin={margin:g})"


def _nearest_to_wall(arena: Arena, places: Points, margin: float) -> tuple[int, list[float] | None]:
    """Return the row of a position nearer to the wall than the margin and a point outside, or None instead of it."""
    radius = margin * (1 - 1e-6)
    outside = np.argwhere(~_inside_around(arena, places, radius))
    if not len(outside):
        return 0, None
    way, k = outside[0].tolist()
    return k, (places[k] + radius * _HERE_AND_AROUND[way]).tolist()


def _check_inside(name: str, arena: Arena, box: Points, places: Points, rng: np.random.Generator) -> None:
    """Check that `inside` moves points from anywhere inside, and keeps those that are."""
    low, high = box
    sides = high - low
    few = places[rng.permutation(len(places))[:_MOVED]]
    points = np.concatenate([rng.uniform(low - sides, high + sides, (_MOVED, 2)), few])
    small = 0.01 * min(np.sqrt(arena.area), float(sides.min()))
    for margin in (0.0, small):
        moved = np.asarray(arena.inside(points, margin))
        if moved.shape != points.shape or not np.isfinite(moved).all():
            raise ValueError(
                f"{name}.inside of points of shape {points.shape} has the shape {moved.shape}; it must be the same, "
                "and finite"
            )
        # Points on the wall may be outside by a rounding error: a point near them must be inside.
        is_inside = np.asarray(_inside_around(arena, moved, 1e-9 * float(sides.max())).any(axis=0))
        nearer = (0, None) if margin == 0 else _nearest_to_wall(arena, moved, margin * (1 - _COARSE))
        k, ahead = nearer if is_inside.all() else (int(np.argmin(is_inside)), None)
        if not is_inside[k] or ahead is not None:
            raise ValueError(
                f"{name}.inside({points[k].tolist()}, margin={margin:g}) is {moved[k].tolist()}, which is outside or "
                "nearer to the wall than the margin; define inside() for this shape"
            )
    far = np.abs(arena.displacement(few, arena.inside(few))).max(axis=1) > 1e-9 * sides.max()
    if far.any():
        k = int(np.argmax(far))
        raise ValueError(f"{name}.inside({few[k].tolist()}) moves a point that is inside; return it unchanged")


def _check_uniform(name: str, arena: Arena, box: Points, places: Points, samples: Points) -> None:
    """Compare the share of positions in each cell of a grid over the bounds with its share of the area."""
    inside = samples[np.asarray(arena.contains(samples))]
    wanted, found = (np.histogram2d(x, y, bins=_CELLS, range=box.T)[0] / len(x) for x, y in (inside.T, places.T))
    worst = np.unravel_index(np.argmax(np.abs(found - wanted)), wanted.shape)
    if abs(found[worst] - wanted[worst]) > _TOLERANCE:
        x, y = (box[0] + (np.array(worst) + 0.5) * np.ptp(box, axis=0) / _CELLS).tolist()
        raise ValueError(
            f"{name}.place puts {found[worst]:.3f} of all positions into the cell around ({x:.3g}, {y:.3g}), which has "
            f"{wanted[worst]:.3f} of the area; positions must be uniform over the area (in a disc, radius ∝ √u)"
        )


_STATE = "start(sizes) determines the shape"


@cache
def _guard(kinds: Kinds, writes: tuple[str, ...]) -> Guard[Interacting]:
    axes = {
        "2": Axis("components", "0 is x, and 1 is y"),
        "parameters": Axis("parameters", "add what it needs to `parameters`"),
        "scores": Axis("scores", "declare as many as it needs as `scores`"),
        "draws": Axis("draws", "declare as many as it needs as `draws`"),
        "floatrows": Axis("rows", _STATE), "floatfields": Axis("fields", _STATE),
        "introws": Axis("rows", _STATE), "intfields": Axis("fields", _STATE),
    }  # fmt: skip
    writable = ["state", "scores"]
    for role, columns in kinds:
        count = f"bodies.{role}.position.shape[0]"
        axes[length_of(role)] = Axis("bodies", f"{role} are 0 to n − 1, and n is {count}")
        axes[lanes_of(role)] = Axis("bodies", f"rows of noise can be longer than there are {role}: stop at {count}")
        writable += [f"bodies.{role}.{name}" for name in (*writes, *(name for name, _ in columns))]
    return Guard(interacting_record(kinds, writes), tuple(writable), axes)


def call_of(
    interaction: Interaction, kinds: Kinds, bodies: Mapping[str, Any], state: InteractionState,
    noise: Mapping[str, npt.NDArray[np.float64]], turn: int,
) -> Interacting:  # fmt: skip
    """Return the arguments of the kernel of an interaction, from the bodies and the noise of each role."""
    bodies_node, _, _, noise_node, *_ = interacting_record(kinds, interaction.writes).node.parts
    parameters, scores = np.array(interaction.parameters, float), np.zeros(len(interaction.scores))
    return Interacting(bodies_node.kind(**bodies), state, parameters, noise_node.kind(**noise), scores, turn)


# The number of bodies of each role in turn, and the share of the arena over which they are spread.
_SCENES = (((1,), 1.0), ((7, 4), 1.0), ((4, 9, 2), 0.2), ((3, 0), 0.5), ((0, 5), 0.5), ((12, 12), 0.02), ((5, 3), 0.0))
# A step, as a share of that spread.
_STRIDE = 0.2


def check_interaction(
    interaction: Interaction, arena: Arena | None = None, *, steps: int = 40, seed: int = 1
) -> None:
    """Check whether an interaction keeps the contract of `Interaction`, on random bodies.

    Its kernel runs with bounds checks: on bodies that are alone, crowded and at one place, on roles without bodies, and
    with inactive bodies.

    Parameters
    ----------
    interaction : Interaction
        The interaction to check.
    arena : Arena, optional
        The arena of the world for which it is made; by default ``Torus(10, 10)``.
    steps : int
        The number of steps for each set of bodies.
    seed : int
        The seed of the bodies.

    Raises
    ------
    TypeError
        If it is not an `Interaction`, declares something of a wrong type, or its kernel cannot be compiled.
    ValueError
        If the kernel reads or writes outside its arrays, writes read-only ones, depends on numbers behind those of the
        bodies, or leaves a body outside the arena, a heading that is no unit vector, a negative speed, or a number that
        is not finite.
    """
    check_interaction_declarations(interaction)
    if arena is not None:
        interaction.check_fit(arena, interaction.roles)
    begin_check()
    rng = np.random.default_rng(seed)
    for sizes, spread in _SCENES:
        numbers = {role: sizes[at % len(sizes)] for at, role in enumerate(interaction.roles)}
        scene = _Scene(interaction, arena or Torus(10.0, 10.0), numbers, spread, rng)
        try:
            for _ in range(steps):
                scene.step()
        except ValueError as error:
            if empty := [role for role, size in numbers.items() if not size]:
                raise ValueError(f"{error} (with 0 bodies in the role {empty[0]!r}, as when all have left)") from None
            raise


class _Scene:
    """Some bodies of each role, which move at random."""

    def __init__(
        self, interaction: Interaction, arena: Arena, sizes: dict[str, int], spread: float, rng: np.random.Generator
    ) -> None:
        self._interaction, self._arena, self._sizes, self._rng = interaction, arena, sizes, rng
        self._step = _STRIDE * spread * float(np.ptp(arena.bounds, axis=0).max())
        self._kinds: Kinds = tuple(
            (role, tuple((name, np.asarray(fill).dtype.str) for of, name, fill in interaction.columns if of == role))
            for role in interaction.roles
        )
        self._state = first_state(interaction, sizes_type(interaction.roles)(**sizes))
        middle = np.array(arena.place(*rng.random((2, 1))))
        self._bodies: dict[str, Any] = {}
        identity = 1
        for role, columns in self._kinds:
            size = sizes[role]
            place = np.array(arena.place(*rng.random((2, size)))).reshape(size, 2)
            place = self._inside(middle + spread * arena.displacement(middle, place))
            first = {name: fill for of, name, fill in interaction.columns if of == role}
            own = InteractingBodies(
                place, random_headings(size, rng), place.copy(), np.zeros((size, 2)), np.full(size, self._step),
                rng.random(size) < 0.8, np.zeros(size), np.zeros(size, np.bool_), identity + np.arange(size),
            )  # fmt: skip
            more = [np.full(size, first[name], kind) for name, kind in columns]
            self._bodies[role] = bodies_type(role, columns, interaction.writes)(*own, *more)
            identity += size

    def _inside(self, place: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
        if not len(place):
            return place
        # Not on the wall, where rounding decides.
        margin = 1e-9 * float(np.ptp(self._arena.bounds, axis=0).max())
        return np.ascontiguousarray(self._arena.inside(np.ascontiguousarray(place), margin))

    def step(self) -> None:
        """Move the active bodies, and call the kernel as often as in a step."""
        interaction, kinds = self._interaction, self._kinds
        for role, bodies in self._bodies.items():
            way = self._step * self._rng.normal(size=bodies.position.shape) * bodies.active[:, np.newaxis]
            place = np.where(bodies.active[:, np.newaxis], self._inside(bodies.position + way), bodies.position)
            moved = np.ascontiguousarray(self._arena.displacement(bodies.position, place))
            self._bodies[role] = bodies._replace(position=place, before=bodies.position, moved=moved)
        noise = {
            role: self._rng.random((interaction.draws, (size // LANES + 2) * LANES))
            for role, size in self._sizes.items()
        }
        name, sizes = type(interaction).__name__, {f"noise.{role}": size for role, size in self._sizes.items()}
        for turn in range(len(interaction.roles)) if interaction.in_turn else (-1,):
            bodies = {
                role: one._replace(reward=np.zeros_like(one.reward), ended=np.zeros_like(one.ended))
                for role, one in self._bodies.items()
            }
            given = call_of(interaction, kinds, bodies, self._state, noise, turn)
            done = _guard(kinds, interaction.writes).run(name, "its kernel", interaction.entry(kinds), given, sizes)[1]
            _check_written(name, interaction, self._arena, done)
            self._bodies, self._state = done.bodies._asdict(), done.state


def _check_written(name: str, interaction: Interaction, arena: Arena, done: Interacting) -> None:
    """Refuse what a world would refuse after a call."""
    for role, bodies in done.bodies._asdict().items():
        if not len(bodies.position):
            continue
        length = np.hypot(*bodies.heading.T)
        for good, array, wrong in (
            (np.asarray(arena.contains(bodies.position)), bodies.position, f"a position outside {arena}"),
            (np.abs(length - 1.0) < 1e-6, bodies.heading, "a heading that is no unit vector"),
            ((bodies.speed >= 0.0) & np.isfinite(bodies.speed), bodies.speed, "a speed that is not finite or negative"),
            (np.isfinite(bodies.reward), bodies.reward, "a reward that is not finite"),
        ):
            if not good.all():
                row = int(np.argmin(good))
                raise ValueError(
                    f"{name}: its kernel leaves {role} {row} with {wrong}, {np.round(array[row], 6).tolist()}; a world "
                    "undoes the step and stops. Give check_interaction the arena for which it is made"
                )
    for score, value in zip(interaction.scores, done.scores.tolist(), strict=True):
        if not np.isfinite(value):
            raise ValueError(f"{name}: its kernel leaves the score {score!r} at {value}; scores must be finite")
