"""Arenas that a user might write: one that repeats along x only, one that is neither round nor square, one of three sizes."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from teamsight.core.kernel import kernel
from teamsight.world import Arena
from teamsight.world.walls import fold, wrap


@kernel
def _on_a_cylinder(
    x: float, y: float, step_x: float, step_y: float, heading_x: float, heading_y: float, size: Any
) -> Any:
    y, turned = fold(y + step_y, 0.5 * size[1])
    return wrap(x + step_x, size[0]), y, heading_x, turned * heading_y


@dataclass(frozen=True)
class Cylinder(Arena):
    """Repeats along x; has walls below and above."""

    around: float
    height: float
    confine = _on_a_cylinder

    @property
    def size(self) -> tuple[float, ...]:
        return self.around, self.height

    @property
    def period(self) -> tuple[float, float]:
        return self.around, 0.0

    @property
    def area(self) -> float:
        return self.around * self.height

    @property
    def bounds(self) -> Any:
        corner = np.array([self.around / 2, self.height / 2])
        return -corner, corner

    def contains(self, position: Any) -> Any:
        return (np.abs(position) <= self.bounds[1]).all(axis=-1)

    def place(self, u: Any, v: Any, margin: float = 0.0) -> Any:
        height = max(self.height - 2 * margin, 0.0)
        return np.stack([(np.asarray(u) - 0.5) * self.around, (np.asarray(v) - 0.5) * height], axis=-1)


@kernel
def _in_an_ellipse(
    x: float, y: float, step_x: float, step_y: float, heading_x: float, heading_y: float, size: Any
) -> Any:
    if ((x + step_x) / size[0]) ** 2 + ((y + step_y) / size[1]) ** 2 <= 1.0:
        return x + step_x, y + step_y, heading_x, heading_y
    return x, y, -heading_x, -heading_y


@dataclass(frozen=True)
class Ellipse(Arena):
    """At its wall bodies turn round where they are."""

    a: float
    b: float
    confine = _in_an_ellipse

    @property
    def size(self) -> tuple[float, ...]:
        return self.a, self.b

    @property
    def area(self) -> float:
        return math.pi * self.a * self.b

    @property
    def bounds(self) -> Any:
        return -np.array(self.size), np.array(self.size)

    def contains(self, position: Any) -> Any:
        return np.square(np.asarray(position, float) / self.size).sum(axis=-1) <= 1.0

    def place(self, u: Any, v: Any, margin: float = 0.0) -> Any:
        # An ellipse of smaller half axes is not everywhere as far from the wall, but at least so far.
        half = np.maximum(np.array(self.size) - margin * max(self.size) / min(self.size), 0.0)
        radius, angle = (1 - 1e-15) * np.sqrt(np.asarray(u, float)), 2 * np.pi * np.asarray(v, float)
        return half * np.stack([radius * np.cos(angle), radius * np.sin(angle)], axis=-1)


@kernel
def _in_a_hall(x: float, y: float, step_x: float, step_y: float, heading_x: float, heading_y: float, size: Any) -> Any:
    x, turned_x = fold(x + step_x, 0.5 * size[0] - size[2])
    y, turned_y = fold(y + step_y, 0.5 * size[1] - size[2])
    return x, y, heading_x * turned_x, heading_y * turned_y


@dataclass(frozen=True)
class Hall(Arena):
    """A rectangle with walls of some thickness: three sizes."""

    width: float
    height: float
    wall: float
    confine = _in_a_hall

    @property
    def size(self) -> tuple[float, ...]:
        return self.width, self.height, self.wall

    @property
    def area(self) -> float:
        return (self.width - 2 * self.wall) * (self.height - 2 * self.wall)

    @property
    def bounds(self) -> Any:
        corner = np.array([self.width / 2, self.height / 2]) - self.wall
        return -corner, corner

    def contains(self, position: Any) -> Any:
        return (np.abs(position) <= self.bounds[1]).all(axis=-1)

    def place(self, u: Any, v: Any, margin: float = 0.0) -> Any:
        sides = np.maximum(2 * (self.bounds[1] - margin), 0.0)
        return sides * (np.stack([np.asarray(u), np.asarray(v)], axis=-1) - 0.5)
