"""The check that the arena of a world is the square for which an interaction is made."""

from __future__ import annotations

from typing import Protocol

import numpy as np

from teamsight.world.arena import Arena, Obstructed

# Sides that differ by this share are equal, but for rounding.
_ROUNDING = 1e-9


class _InSquare(Protocol):
    """The part of an interaction that describes the arena."""

    @property
    def side(self) -> float: ...


def check_square(rule: _InSquare, arena: Arena) -> None:
    """Refuse an arena that repeats, or is not the square of a rule around the origin; it may have obstacles.

    Raises
    ------
    ValueError
        Naming the side and the arena.
    """
    name, side = type(rule).__name__, float(rule.side)
    plain = arena.arena if isinstance(arena, Obstructed) else arena
    low, high = plain.bounds
    is_around = float(np.abs([low + 0.5 * side, high - 0.5 * side]).max()) <= _ROUNDING * side
    # A disc, or another shape, has the same bounds and a smaller area.
    is_square = is_around and bool(np.isclose(plain.area, side**2, rtol=_ROUNDING, atol=0.0))
    if is_square and not any(period > 0.0 for period in plain.period):
        return
    needed = f"Box({side:.12g}, {side:.12g})"
    raise ValueError(
        f"side={side:.12g}: {name} is made for {needed}, and the arena is {arena}; take that one, or another square "
        f"Box and give {name} its side"
    )
