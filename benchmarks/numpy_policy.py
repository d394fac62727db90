"""A-CMOMMT without tracks, in NumPy: what a user writes who wants no compiler."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from teamsight.policies.interface import Action, Percept, Policy

Floats = npt.NDArray[np.float64]


class NumpyACmommt(Policy):
    """Follow targets that no teammate is nearer to, keep away from teammates, and redraw the heading without forces."""

    draws = 1

    def start(self, size: int) -> None:
        """Remember nothing."""

    def decide(self, percept: Percept, memory: None, noise: Floats) -> tuple[Action, None]:
        """Return where all robots head."""
        targets, teammates = percept.targets, percept.teammates
        size = len(percept.heading)
        force = np.zeros((size, 2))
        watcher = np.repeat(np.arange(size), np.diff(targets.start))
        mate_of = np.repeat(np.arange(size), np.diff(teammates.start))
        push = np.interp(teammates.distance, [0.481, 0.769], [-1.0, 0.0]) / np.maximum(teammates.distance, 1e-12)
        _add(force, mate_of, push[:, None] * teammates.offset)
        pull = np.interp(targets.distance, [0.0, 0.154, 0.154, 0.308], [-1.0, 0.0, 0.0, 1.0])
        pull = np.where(_taken(targets, teammates, watcher), 0.0, pull) / np.maximum(targets.distance, 1e-12)
        _add(force, watcher, pull[:, None] * targets.offset)
        length = np.hypot(force[:, 0], force[:, 1])
        angle = 2 * np.pi * noise[0]
        searches = length <= 1e-9
        heading = force / np.where(searches, 1.0, length)[:, None]
        heading[searches] = np.stack([np.cos(angle), np.sin(angle)], axis=-1)[searches]
        return Action(heading, np.where(searches, 1.0, np.minimum(length, 1.0)) * percept.speed), None


def _add(force: Floats, row: npt.NDArray[np.int64], part: Floats) -> None:
    for axis in (0, 1):
        force[:, axis] += np.bincount(row, part[:, axis], len(force))


def _taken(targets: Any, teammates: Any, watcher: npt.NDArray[np.int64]) -> npt.NDArray[np.bool_]:
    """Say for each entry of a target whether a perceived teammate is nearer to it."""
    degree = np.diff(teammates.start)[watcher]
    entry = np.repeat(np.arange(len(watcher)), degree)
    # For each entry all teammates of the robot that sees: the numbers of their entries, counted up from its first.
    first = np.repeat(teammates.start[watcher] - np.cumsum(degree) + degree, degree)
    teammate = np.arange(len(entry)) + first
    way = targets.offset[entry] - teammates.offset[teammate]
    nearer = np.einsum("ij,ij->i", way, way) < targets.distance[entry] ** 2
    return np.bincount(entry, nearer, len(watcher)) > 0
