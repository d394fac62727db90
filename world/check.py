"""The check of the arena contract; `teamsight.world.check_confine` checks the walls."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

from teamsight.world.arena import Arena, Points
from teamsight.world.check_confine import check_confine

_SAMPLES = 100_000
# Shares of the box that are estimated from the samples; their standard error is 0.0016 at most.
_TOLERANCE = 0.01
_CELLS = 4
_PLACES = 40_000
_DIRECTIONS = 16
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
    name = type(arena).__name__
    if not isinstance(arena, Arena):
        name = arena.__name__ if isinstance(arena, type) else name
        raise TypeError(f"{name}: must be an object of a subclass of Arena, such as Disc(2.0)")
    rng = np.random.default_rng(seed)
    _check_numbers(name, arena)
    low, high = (np.asarray(corner, float) for corner in arena.bounds)
    extent = float((high - low).max())
    samples = rng.uniform(low, high, (_SAMPLES, 2))
    _check_contains(name, arena, samples)
    _check_box(name, arena, samples, rng)
    places = _check_place(name, arena, samples, rng)
    _check_inside(name, arena, places, rng)
    check_confine(arena, places[rng.permutation(len(places))[:1000]], extent, rng)


def _flat(value: Any) -> str:
    """Return the repr of a value, in one line of at most 120 characters."""
    text = " ".join(repr(value).split())
    return text if len(text) < 120 else f"{text[:117]}…"


def _numbers(name: str, value: Any, what: str = "numbers") -> npt.NDArray[np.float64]:
    try:
        numbers = np.array([float(number) for number in value])
    except (TypeError, ValueError):
        raise TypeError(f"{name}={_flat(value)}: must be {what}, such as (2.0, 0.0)") from None
    if not np.isfinite(numbers).all():
        raise ValueError(f"{name}={_flat(value)}: must be finite {what}")
    return numbers


def _pair(name: str, value: Any, least: float) -> npt.NDArray[np.float64]:
    numbers = _numbers(name, value, "two numbers")
    if numbers.shape != (2,) or (numbers < least).any():
        limit = " of at least 0" if least == 0 else ""
        raise ValueError(f"{name}={_flat(value)}: must be two numbers{limit}")
    return numbers


def _check_numbers(name: str, arena: Arena) -> None:
    """Check `size`, `bounds`, `period` and `area` as numbers."""
    _numbers(f"{name}.size", arena.size)
    bounds = arena.bounds
    if not isinstance(bounds, (Sequence, np.ndarray)) or len(bounds) != 2:
        raise TypeError(f"{name}.bounds={_flat(bounds)}: must be two corners, the lower left and the upper right one")
    low, high = (_pair(f"{name}.bounds[{i}]", corner, -np.inf) for i, corner in enumerate(bounds))
    if not (low < high).all():
        raise ValueError(
            f"{name}.bounds={low.tolist()}, {high.tolist()}: the first corner must be the lower left, the second the "
            "upper right one"
        )
    period = _pair(f"{name}.period", arena.period, 0.0)
    for axis, (side, repeats) in enumerate(zip(high - low, period, strict=True)):
        if repeats > 0 and abs(side - repeats) > 1e-9 * side:
            raise ValueError(
                f"{name}.period[{axis}]={repeats:g}: must be 0, or the side of the bounds along that axis, {side:g}"
            )
    try:
        area = float(arena.area)
    except (TypeError, ValueError):
        raise TypeError(f"{name}.area={_flat(arena.area)}: must be a number") from None
    if not (np.isfinite(area) and area > 0):
        raise ValueError(f"{name}.area={area}: must be a finite number above 0")


def _check_contains(name: str, arena: Arena, samples: Points) -> None:
    """Check that `contains` gives the same result for positions of all shapes."""
    few = samples[:6]
    answers = []
    for positions in (few, few.reshape(2, 3, 2), few[:0]):
        shape = positions.shape
        answer = _contains(name, arena, positions)
        if answer.shape != shape[:-1] or answer.dtype != bool:
            raise ValueError(
                f"{name}.contains of positions of shape {shape} has the shape {answer.shape} and the type "
                f"{answer.dtype}; it must be {shape[:-1]} and bool: work along the last axis"
            )
        answers.append(answer.ravel())
    single = [_contains(name, arena, position) for position in few]
    if any(one.shape != () for one in single):
        raise ValueError(f"{name}.contains of one position has the shape {single[0].shape}; it must be (), one bool")
    if not (np.array_equal(answers[0], answers[1]) and np.array_equal(answers[0], [bool(one) for one in single])):
        raise ValueError(f"{name}.contains differs between one position and several; work along the last axis")


def _contains(name: str, arena: Arena, positions: Points) -> npt.NDArray[Any]:
    try:
        return np.asarray(arena.contains(positions))
    except Exception as error:
        raise ValueError(
            f"{name}.contains of positions of shape {positions.shape} raises {_shown(error)}; work along the last "
            "axis, as in position[..., 0]"
        ) from error


def _shown(error: Exception) -> str:
    return f"{type(error).__name__}({str(error)[:80]!r})"


def _check_box(name: str, arena: Arena, samples: Points, rng: np.random.Generator) -> None:
    """Check that nothing is inside beyond the bounds, and that `area` agrees with `contains`."""
    low, high = (np.asarray(corner, float) for corner in arena.bounds)
    sides = high - low
    around = rng.uniform(low - sides, high + sides, (_SAMPLES, 2))
    beyond = ((around < low - 1e-9 * sides) | (around > high + 1e-9 * sides)).any(axis=1)
    outside = np.flatnonzero(beyond & np.asarray(arena.contains(around)))
    if len(outside):
        raise ValueError(
            f"{name}.contains({around[outside[0]].tolist()}) is True, although that is beyond the bounds "
            f"{low.tolist()}, {high.tolist()}; widen the bounds"
        )
    share, box = float(np.mean(arena.contains(samples))), float(sides.prod())
    if abs(share - arena.area / box) > _TOLERANCE:
        raise ValueError(
            f"{name}.area={arena.area:g}: by contains() it is {share * box:.4g}, a share of {share:.3f} of the bounds; "
            f"they must agree to {_TOLERANCE:g} of the bounds"
        )


def _check_place(name: str, arena: Arena, samples: Points, rng: np.random.Generator) -> Points:
    """Check `place`; return positions inside."""
    low, high = (np.asarray(corner, float) for corner in arena.bounds)
    edges = np.stack(np.meshgrid(_EDGES, _EDGES), axis=-1).reshape(-1, 2)
    u, v = np.concatenate([edges, rng.random((_PLACES, 2)).clip(2.0**-54, 1 - 2.0**-53)]).T
    # No margin, one that surely fits, and one that surely does not.
    small = 0.01 * min(np.sqrt(arena.area), float((high - low).min()))
    for margin in (0.0, small, 10.0 * float((high - low).max())):
        places = _placed(name, arena, u, v, margin)
        inside = np.asarray(arena.contains(places))
        if not inside.all():
            k = int(np.argmin(inside))
            place = f"{_placing(name, u, v, margin, k)} is {places[k].tolist()}"
            raise ValueError(f"{place}, which is outside according to contains(); {_INSIDE}")
        if margin == small:
            k, ahead = _nearest_to_wall(arena, places, margin)
            if ahead is not None:
                raise ValueError(
                    f"{_placing(name, u, v, margin, k)} is {places[k].tolist()}, nearer to the wall than the margin: "
                    f"{ahead} is outside; return positions at least the margin from the wall"
                )
    places = _placed(name, arena, u, v, 0.0)
    _check_uniform(name, arena, places[len(edges) :], samples)
    _placed(name, arena, 0.5, 0.5, 0.0)
    return places


_INSIDE = "map all of (0, 1) × (0, 1) inside, also after rounding"


def _placed(name: str, arena: Arena, u: Any, v: Any, margin: float) -> Points:
    try:
        places = np.asarray(arena.place(u, v, margin), float)
    except Exception as error:
        raise ValueError(
            f"{name}.place of numbers of shape {np.shape(u)}, margin={margin:g} raises {_shown(error)}; accept numbers "
            "and arrays, and any margin"
        ) from error
    if places.shape != (*np.shape(u), 2):
        raise ValueError(
            f"{name}.place of numbers of shape {np.shape(u)} has the shape {places.shape}; stack x and y along the "
            "last axis"
        )
    if not np.isfinite(places).all():
        k = int(np.argmin(np.isfinite(places).all(axis=-1)))
        place = places.reshape(-1, 2)[k].tolist()
        raise ValueError(f"{_placing(name, np.ravel(u), np.ravel(v), margin, k)} is {place}; it must be finite")
    return places


def _placing(name: str, u: Any, v: Any, margin: float, k: int) -> str:
    return f"{name}.place({float(u[k])!r}, {float(v[k])!r}, margin={margin:g})"


def _nearest_to_wall(arena: Arena, places: Points, margin: float) -> tuple[int, list[float] | None]:
    """Return the row of a position nearer to the wall than the margin and a point outside, or None instead of it."""
    for ahead in _circle(places, margin * (1 - 1e-6)):
        # Along an axis that repeats, the arena continues.
        is_free = np.asarray(arena.contains(arena.displacement(np.zeros(2), ahead)))
        if not is_free.all():
            k = int(np.argmin(is_free))
            return k, ahead[k].tolist()
    return 0, None


def _circle(places: Points, radius: float) -> list[Points]:
    """Return the positions, and the points around them in all directions."""
    angles = 2 * np.pi * np.arange(_DIRECTIONS) / _DIRECTIONS
    return [places, *(places + radius * np.array([np.cos(angle), np.sin(angle)]) for angle in angles)]


def _check_inside(name: str, arena: Arena, places: Points, rng: np.random.Generator) -> None:
    """Check that `inside` moves points from anywhere inside, and keeps those that are."""
    low, high = (np.asarray(corner, float) for corner in arena.bounds)
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
        around = _circle(moved, 1e-9 * float(sides.max()))
        is_inside = np.any([arena.contains(arena.displacement(np.zeros(2), near)) for near in around], axis=0)
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


def _check_uniform(name: str, arena: Arena, places: Points, samples: Points) -> None:
    """Compare the share of positions in each cell of a grid over the bounds with its share of the area."""
    low, high = (np.asarray(corner, float) for corner in arena.bounds)
    inside = samples[np.asarray(arena.contains(samples))]
    edges = [np.linspace(low[axis], high[axis], _CELLS + 1) for axis in range(2)]
    wanted, found = (np.histogram2d(part[:, 0], part[:, 1], bins=edges)[0] / len(part) for part in (inside, places))
    worst = np.unravel_index(np.argmax(np.abs(found - wanted)), wanted.shape)
    if abs(found[worst] - wanted[worst]) > _TOLERANCE:
        x, y = (low + (np.array(worst) + 0.5) * (high - low) / _CELLS).tolist()
        raise ValueError(
            f"{name}.place puts {found[worst]:.3f} of all positions into the cell around ({x:.3g}, {y:.3g}), which has "
            f"{wanted[worst]:.3f} of the area; positions must be uniform over the area (in a disc, radius ∝ √u)"
        )
