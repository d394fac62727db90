"""Many worlds that make their steps together: what both kinds of environments are made of."""

from __future__ import annotations

import weakref
from collections.abc import Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

from teamsight.agents.engine.loop import RUN
from teamsight.agents.group import Group
from teamsight.agents.world import World
from teamsight.core.interrupts import deferred
from teamsight.env.actions import Names
from teamsight.env.facts import OF_ROBOTS, OF_WORLDS, Facts
from teamsight.env.loop import STEP_ALL
from teamsight.env.records import BATCH, DONE, NEEDS_PYTHON, WAITS, BatchArrays
from teamsight.env.rewards import rewards_of
from teamsight.env.seeding import EpisodeSeeds
from teamsight.env.settings import Settings
from teamsight.env.stepped_world import Shown, SteppedWorld
from teamsight.world.arena import Arena

Floats = npt.NDArray[np.float64]


class Batch:
    """Worlds of the same settings, one after the other at each place.

    Parameters
    ----------
    settings : Settings
        What the worlds are.
    worlds : int
        Their number.

    Attributes
    ----------
    robots : int
        The number of robots of a world.
    observation : Observation
        How observations are made.
    observations : ndarray, shape (worlds, robots, width), float32
        What the robots perceive now; the next step overwrites it.
    facts : Facts
        What has happened in the last step.
    of_robots, of_worlds : ndarray, shape (worlds, robots, facts) and (worlds, facts), float64
        The same numbers, in the order of `OF_ROBOTS` and `OF_WORLDS`.
    cycles : ndarray, shape (worlds,), int64
        The number of steps of each episode so far.
    """

    def __init__(self, settings: Settings, worlds: int) -> None:
        self._settings = settings
        self._worlds = [SteppedWorld(settings) for _ in range(worlds)]
        self._seeds = [EpisodeSeeds() for _ in range(worlds)]
        # One world says how many robots there are, and what they perceive.
        _, group = self._worlds[0].begin(0)
        self.robots, self.observation = len(group), self._worlds[0].observation()
        self.observations = np.zeros((worlds, self.robots, self.observation.width), np.float32)
        self.of_robots = np.zeros((worlds, self.robots, len(OF_ROBOTS)))
        self.of_worlds = np.zeros((worlds, len(OF_WORLDS)))
        self._teammates = np.zeros((worlds, 1))
        self.facts = Facts(self.of_robots, self.of_worlds, self._teammates)
        self.cycles = np.zeros(worlds, np.int64)
        self._given = np.zeros((worlds, self.robots, settings.form.none.size))
        self._steering = np.zeros((worlds, self.robots, 3))
        self._status, self._quiet_until = np.zeros(worlds, np.int64), np.zeros(worlds, np.int64)
        self._has_begun, self._have_all_begun = np.zeros(worlds, bool), False
        # The worlds whose last step was completed in Python.
        self._in_python: list[int] = []
        self._record: Any = None
        # mesa 3.3 would keep the worlds of an environment that is never closed.
        weakref.finalize(self, _close, self._worlds)

    def __len__(self) -> int:
        return len(self._worlds)

    def reset(self, places: Sequence[int], seeds: Sequence[int | None]) -> None:
        """Begin an episode at some places.

        Parameters
        ----------
        places : sequence of int
            The worlds.
        seeds : sequence of int or None
            Their seeds; None continues the seeds of a place.

        Raises
        ------
        TypeError, ValueError
            If a seed is not a whole number of at least 0, or the model refuses its parameters.
        """
        self._record = None
        for place, given in zip(places, seeds, strict=True):
            self._set_begun(place, False)
            one = self._worlds[place]
            _, group = one.begin(self._seeds[place].next(given))
            self._check_like_first(one, len(group))
            shown = Shown(self.observations[place], self.of_robots[place], self.of_worlds[place])
            one.show_in(shown, self.observation)
            self.cycles[place], self._teammates[place] = 0, self.observation.teammates
            self._set_begun(place, True)
            self._note(place)

    def _check_like_first(self, one: SteppedWorld, robots: int) -> None:
        found = one.observation()
        if robots != self.robots or found.width != self.observation.width:
            raise ValueError(
                f"model: returned a world with {robots} robots and observations of {found.width} numbers, and the "
                f"first had {self.robots} and {self.observation.width}; return the same for all seeds"
            )
        self.observation = found

    def step(self, actions: Any, waits: npt.NDArray[np.bool_] | None, names: Names) -> None:
        """Make a step of all worlds but those that wait.

        Parameters
        ----------
        actions : array_like, shape (worlds, robots, …)
            See `ActionForm`.
        waits : ndarray, shape (worlds,), bool, optional
            The worlds that make no step; by default none.
        names : callable
            ``names(world, robot)`` returns the name of an action in errors.

        Raises
        ------
        RuntimeError
            If a world was not reset, or robots have come or left.
        TypeError, ValueError
            If an action is wrong; then no world has made a step. After any other error, all worlds must be reset.
        """
        form = self._settings.form
        form.take(actions, self._given, names)
        if not self._have_all_begun:
            self._check_begun(waits)
        if self._settings.is_kept:
            for place, one in enumerate(self._worlds):
                if self._has_begun[place] and one.has_changed:
                    self._quiet_until[place] = 0
        if self._record is None:
            self._bind()
        self._status[:] = DONE if waits is None else waits
        try:
            with deferred():
                result = STEP_ALL(self._record)
            self._in_python = np.flatnonzero(self._status > WAITS).tolist() if result < 0 else []
            for place in self._in_python:
                self._go_on(place)
        except BaseException:
            # Some worlds are a step ahead of others now, or between two steps.
            self._has_begun[:] = self._have_all_begun = False
            raise
        if result > 0:
            raise form.refusal(self._given, result - 1, names)
        if self._settings.is_kept:
            for one in self._worlds:
                one.sync()
        self.cycles += 1 if waits is None else ~waits

    def _check_begun(self, waits: npt.NDArray[np.bool_] | None) -> None:
        ready = self._has_begun if waits is None else self._has_begun | waits
        if not ready.all():
            raise RuntimeError(f"step(): world {int(np.argmin(ready))} has not begun an episode; call reset() first")

    def _go_on(self, place: int) -> None:
        """Complete a step that compiled code cannot make alone."""
        one, status = self._worlds[place], int(self._status[place])
        sight = one.sight
        try:
            if status == NEEDS_PYTHON:
                one.step(self._steering[place])
            else:
                one.finish(status)
        except Exception as error:
            if len(self) > 1:
                error.add_note(f"teamsight.env: in world {place}")
            raise
        self._note(place)
        if one.sight is not sight:
            self._record = None

    def _set_begun(self, place: int, value: bool) -> None:
        self._has_begun[place] = value
        self._have_all_begun = bool(self._has_begun.all())

    def _note(self, place: int) -> None:
        self._quiet_until[place] = self._worlds[place].quiet_until

    def _bind(self) -> None:
        sights = [one.sight for one in self._worlds]
        form = self._settings.form
        self._record = BATCH.pack(BatchArrays(
            RUN, sights, form.number, form.table, self._given, self._steering, self._quiet_until, self._status,
        ))  # fmt: skip

    @property
    def rewards(self) -> Floats:
        """The rewards of the last step, shape (worlds, robots)."""
        return rewards_of(self._settings.reward, self.facts)

    def is_stopped(self, place: int) -> bool:
        """Whether something has stopped a world."""
        return not self._worlds[place].is_running

    @property
    def are_stopped(self) -> npt.NDArray[np.bool_]:
        """Whether something has stopped each world, shape (worlds,)."""
        # Only Python can stop a world, so the others need not be asked.
        stopped = np.zeros(len(self), bool)
        for place in self._in_python:
            stopped[place] = self.is_stopped(place)
        return stopped

    def has_begun(self, place: int) -> bool:
        """Whether an episode has begun."""
        return bool(self._has_begun[place])

    def arena(self, place: int) -> Arena:
        """Return the arena of a world."""
        return self._worlds[place].arena

    def groups(self, place: int) -> dict[Group, int]:
        """Return the groups of a world, the robots first, with the numbers of agents that they began with."""
        return self._worlds[place].groups

    def world(self, place: int) -> World:
        """Return the world of a place; from now on its steps are made in Python, until it is reset.

        Raises
        ------
        RuntimeError
            Before `reset`, and after `close`. After an error the world can be looked at.
        """
        if not self._worlds[place].is_shown:
            raise RuntimeError("world: no episode has begun; call reset() first")
        world = self._worlds[place].world
        self._note(place)
        return world

    def close(self) -> None:
        """Release the worlds. Idempotent."""
        self._has_begun[:] = self._have_all_begun = False
        _close(self._worlds)


def _close(worlds: list[SteppedWorld]) -> None:
    for one in worlds:
        one.close()
