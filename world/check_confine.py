"""The check of `Arena.confine`: every step from a position inside ends inside."""

from __future__ import annotations

from collections.abc import Callable
from typing import Annotated, Any, NamedTuple

import numpy as np
import numpy.typing as npt

from teamsight.core.kernel import Entry, Record, specialise
from teamsight.core.kernel.guarded_arrays import Axis, machine_code, run_guarded
from teamsight.core.kernel.guarded_copy import guarded
from teamsight.core.kernel.guarded_record import GuardedRecord
from teamsight.world.arena import Arena, Points
from teamsight.world.motion import advance_entry


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
_DIRECTIONS = 24
_HALVINGS = 60
_WALKERS, _WALK = 64, 300

_STEP, _PART = Axis("steps", "there are no more"), Axis("components", "there are no more")
_GUARDED = GuardedRecord(
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


_ENTRIES: dict[Callable[..., Any], Entry | None] = {}


def check_confine(arena: Arena, places: Points, extent: float, rng: np.random.Generator) -> None:
    """Refuse an arena whose `confine` returns a position outside, or a heading that is not a unit vector.

    Steps begin at `places` inside; `extent` is the longer side of the box around the arena.
    """
    walls = _at_the_wall(arena, places[:64], extent)
    begin = np.concatenate([places[:256], walls])
    for length in _LENGTHS:
        for heading in _headings(begin, rng):
            _check_steps(arena, begin, length * extent * heading, heading)
    _check_short_steps(arena, places, extent, rng)
    _check_walk(arena, begin[rng.integers(0, len(begin), _WALKERS)], extent, rng)


def _at_the_wall(arena: Arena, places: Points, extent: float) -> Points:
    """Return positions at the wall, found from `places` in all directions, with corners and the centre."""
    low, high = (np.asarray(corner, float) for corner in arena.bounds)
    angle = 2 * np.pi * np.arange(_DIRECTIONS) / _DIRECTIONS
    # The directions along the axes are exact, so that positions found there lie on the wall itself.
    ways = np.stack([np.cos(angle), np.sin(angle)], axis=-1).round(15)
    inside = np.repeat(places, _DIRECTIONS, axis=0)
    way = np.tile(ways, (len(places), 1))
    near, far = np.zeros(len(inside)), np.full(len(inside), 2.0 * extent)
    for _ in range(_HALVINGS):
        middle = 0.5 * (near + far)
        is_inside = np.asarray(arena.contains(inside + middle[:, None] * way))
        near, far = np.where(is_inside, middle, near), np.where(is_inside, far, middle)
    found = inside + near[:, None] * way
    centre = 0.5 * (low + high)
    corners = [low, high, [low[0], high[1]], [high[0], low[1]], [high[0], centre[1]], [centre[0], low[1]]]
    found = np.concatenate([found, np.array(corners), [centre, [0.0, 0.0]]])
    return found[np.asarray(arena.contains(found))]


def _headings(begin: Points, rng: np.random.Generator) -> list[Points]:
    """Return headings: random, along the axes, away from the origin, and perpendicular to that."""
    angle = rng.uniform(0, 2 * np.pi, len(begin))
    length = np.hypot(begin[:, 0], begin[:, 1])[:, None]
    outward = np.divide(begin, length, out=np.tile([1.0, 0.0], (len(begin), 1)), where=length > 0)
    fixed = [np.tile(way, (len(begin), 1)) for way in ([1.0, 0.0], [0.0, -1.0])]
    across = np.stack([-outward[:, 1], outward[:, 0]], axis=-1)
    return [np.stack([np.cos(angle), np.sin(angle)], axis=-1), outward, across, *fixed]


def _check_steps(arena: Arena, begin: Points, step: Points, heading: Points) -> npt.NDArray[np.float64]:
    """Make the steps; return the positions and headings after them, shape (n, 4)."""
    given = np.ascontiguousarray(np.concatenate([begin, step, heading], axis=1))
    reached = _confined(arena, given)
    finite = np.asarray(np.isfinite(reached).all(axis=1))
    inside = np.asarray(arena.contains(np.where(finite[:, None], reached[:, :2], 0.0)))
    unit: npt.NDArray[np.bool_] = np.abs(reached[:, 2] ** 2 + reached[:, 3] ** 2 - 1.0) <= 1e-6
    for kept, what in (
        (finite, "which is not finite; return four finite numbers"),
        (inside, "which is outside according to contains(); return a position inside, or on the wall"),
        (unit, "whose heading is not a unit vector; reflect it without changing its length"),
    ):
        if not kept.all():
            raise ValueError(f"{_result(arena, given, reached, int(np.argmin(kept)))}, {what}")
    return reached


def _result(arena: Arena, given: Any, reached: Any, k: int) -> str:
    x, y, step_x, step_y, heading_x, heading_y = given[k].tolist()
    to = reached[k].tolist()
    return (
        f"{type(arena).__name__}: confine({x}, {y}, {step_x}, {step_y}, {heading_x}, {heading_y}, size) returns "
        f"({', '.join(map(str, to))})"
    )


def _check_short_steps(arena: Arena, places: Points, extent: float, rng: np.random.Generator) -> None:
    """Check that a step far from the wall ends at position + step, with its heading."""
    angle = rng.uniform(0, 2 * np.pi, len(places))
    heading = np.stack([np.cos(angle), np.sin(angle)], axis=-1)
    for length in (0.0, 1e-3 * extent):
        # Free: in many directions, no wall at the step's length nor at twice that.
        free = np.ones(len(places), bool)
        for share in (1.0, 2.0):
            for way in _circle(places, share * length):
                free &= np.asarray(arena.contains(way))
        step = length * heading
        reached = _check_steps(arena, places, step, heading)
        wrong = np.abs(arena.displacement(places + step, reached[:, :2])).max(axis=1) > 1e-9 * extent
        wrong = (wrong | (np.abs(reached[:, 2:] - heading).max(axis=1) > 1e-9)) & free
        if wrong.any():
            given = np.concatenate([places, step, heading], axis=1)
            result = _result(arena, given, reached, int(np.argmax(wrong)))
            raise ValueError(f"{result}, although no wall is near; add the step to the position and keep the heading")


def _circle(places: Points, radius: float) -> list[Points]:
    angle = 2 * np.pi * np.arange(_DIRECTIONS) / _DIRECTIONS
    return [places + radius * np.array([np.cos(a), np.sin(a)]) for a in angle]


def _check_walk(arena: Arena, begin: Points, extent: float, rng: np.random.Generator) -> None:
    """Check that walks of many steps stay inside."""
    place, heading = begin, _headings(begin, rng)[0]
    for _ in range(_WALK):
        reached = _check_steps(arena, place, extent * rng.choice([0.01, 0.2, 0.9]) * heading, heading)
        place, heading = reached[:, :2].copy(), reached[:, 2:].copy()


def _confined(arena: Arena, given: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
    """Return the positions and headings after these steps; shapes as in `Steps`."""
    rule, name = type(arena).confine, type(arena).__name__
    if rule not in _ENTRIES:
        made = specialise(_confine_all, f"{name.lower()}-guarded", confine=guarded(rule), steps_at=_GUARDED.at)
        _ENTRIES[rule] = machine_code(name, "confine", made, advance_entry(arena))
    entry = _ENTRIES[rule] or specialise(_confine_all, name.lower(), confine=rule)
    size, reached = np.array(arena.size, float), np.full((len(given), 4), np.nan)
    run_guarded(name, "confine", entry, STEPS.pack(Steps(given, reached, size)), _GUARDED.arrays)
    return reached
