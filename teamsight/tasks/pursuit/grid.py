"""The grid of pursuit: the check that a rule has the sides of the arena, and the groups in its order."""

from __future__ import annotations

from typing import Any, Protocol

import numpy as np

from teamsight.world.arena import Arena


class _OnGrid(Protocol):
    """The part of the rules of pursuit that describes the arena."""

    @property
    def width(self) -> int: ...
    @property
    def height(self) -> int: ...
    @property
    def torus(self) -> bool: ...


def check_grid(rule: _OnGrid, arena: Arena) -> None:
    """Refuse an arena that is not the grid of a rule.

    Raises
    ------
    ValueError
        Naming the sides.
    """
    sides = np.array([rule.width, rule.height], float)
    name = type(rule).__name__
    needed = f"{'Torus' if rule.torus else 'Box'}({rule.width}, {rule.height})"
    low, high = (np.asarray(corner, float) for corner in arena.bounds)
    if not (np.array_equal(high - low, sides) and np.array_equal(high + low, np.zeros(2))):
        raise ValueError(
            f"{name}: is made for {needed}, and the arena is {arena}; give {name} the width and the height of the arena"
        )
    if bool(np.any(np.array(arena.period) > 0)) != rule.torus:
        raise ValueError(f"{name}: has torus={rule.torus}, and the arena is {arena}; give it torus={not rule.torus}")


def check_order(rule: Any, order: tuple[str, ...]) -> None:
    """Refuse groups that do not move in the order of the roles.

    Raises
    ------
    ValueError
        Naming the order.
    """
    if order != rule.roles:
        raise ValueError(
            f"{type(rule).__name__}: {order[0]} would move before {order[1]}; add the {rule.roles[0]} to the world "
            f"before the {rule.roles[1]}"
        )
