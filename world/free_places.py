"""Places among walls: uniform over the free area, and the nearest one that is free."""

from __future__ import annotations

from typing import Annotated, NamedTuple, Protocol

import numpy as np
import numpy.typing as npt

from teamsight.core.kernel import Entry, Record, inlined
from teamsight.world.noise import philox
from teamsight.world.wall_contacts import Walls, clearance

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
