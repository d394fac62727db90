"""The vectorised environment: many worlds in one compiled call, with arrays of all their robots."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import gymnasium
import numpy as np
import numpy.typing as npt
from gymnasium.vector.utils import batch_space

from teamsight.agents.world import World
from teamsight.core import checks
from teamsight.env.actions import as_array
from teamsight.env.batch import Batch
from teamsight.env.settings import Settings, settings_of, takes_settings
from teamsight.env.states import StateView
from teamsight.env.vector_step import Flags, Observations, Step
from teamsight.env.views import Views

#: What happens after the end of an episode: the next begins in the same step, in the next step, or by `reset` only.
AUTORESETS = ("same-step", "next-step", "disabled")
_MOST_WORLDS = 1_000_000


class TeamVectorEnv:
    """Many worlds of the same settings; `vector_env` makes it.

    Parameters
    ----------
    settings : Settings
        What the worlds are.
    worlds : int
        Their number.
    autoreset : {"same-step", "next-step", "disabled"}
        What happens after the end of an episode.
    copy : bool
        Whether `step` returns new arrays.

    Attributes
    ----------
    worlds, robots : int
        The numbers of worlds, and of robots in each.
    observation_space, action_space : gymnasium.spaces.Box, gymnasium.Space
        The spaces of one robot.
    batched_action_space : gymnasium.Space
        That of all, whose samples `step` takes.
    max_cycles : int
        The number of steps of an episode.
    """

    def __init__(self, settings: Settings, worlds: int, autoreset: str = "same-step", *, copy: bool = True) -> None:
        self.worlds = checks.count("worlds", worlds, most=_MOST_WORLDS)
        self.autoreset = checks.choice("autoreset", autoreset, AUTORESETS)
        self._copies = checks.flag("copy", copy)
        self._settings = settings
        self._batch = batch = Batch(settings, self.worlds)
        self.robots, self.max_cycles = batch.robots, settings.max_cycles
        self.observation_space = batch.observation.space()
        self.action_space: gymnasium.spaces.Space[Any] = settings.form.space()
        # Of two dimensions, as the arrays have: worlds, then robots.
        self.batched_action_space = batch_space(batch_space(self.action_space, self.robots), self.worlds)
        self._has_ended = np.zeros(self.worlds, bool)
        self._states, self._views = StateView(batch), Views("rgb_array")

    def __reduce__(self) -> tuple[Callable[..., TeamVectorEnv], tuple[Settings, int, str, bool]]:
        # As PettingZoo's EzPickle: a copy is new worlds of these settings, which `reset` begins.
        return _again, (self._settings, self.worlds, self.autoreset, self._copies)

    def reset(
        self, seed: int | Sequence[int] | None = None, *, worlds: npt.ArrayLike | None = None
    ) -> tuple[Observations, dict[str, npt.NDArray[Any]]]:
        """Begin an episode in all worlds, or in some.

        Parameters
        ----------
        seed : int or sequence of int, optional
            The seed of the first world, of which the others have the next numbers; or one for each world that is reset.
            A world begins as ``CMOMMT(seed=…)`` of its seed. Later episodes have seeds that derive from it.
        worlds : array_like of int or of bool, optional
            The worlds, by numbers or by a mask; by default all.

        Returns
        -------
        observations : ndarray, shape (worlds, robots, width), float32
            What the robots of all worlds perceive.
        info : dict of str to ndarray
            See `Step`.

        Raises
        ------
        TypeError, ValueError
            If seeds or worlds are no whole numbers, too many or too few, or outside their limits.
        """
        places = self._places(worlds)
        self._batch.reset(places, self._seeds(seed, places))
        self._has_ended[places] = False
        return self._batch.observations.copy(), self._info()

    def _places(self, worlds: npt.ArrayLike | None) -> list[int]:
        if worlds is None:
            return list(range(self.worlds))
        given = as_array(worlds)
        if given.shape == (0,):
            return []
        if given.dtype == bool and given.shape == (self.worlds,):
            return np.flatnonzero(given).tolist()
        if given.dtype.kind not in "iu" or given.ndim != 1:
            raise TypeError(f"worlds={checks.shown(worlds)}: must be numbers of worlds, or {self.worlds} flags")
        if ((given < 0) | (given >= self.worlds)).any():
            raise ValueError(f"worlds={checks.shown(worlds)}: must be numbers from 0 to {self.worlds - 1}")
        return list(dict.fromkeys(given.tolist()))

    def _seeds(self, seed: int | Sequence[int] | None, places: list[int]) -> list[int | None]:
        if seed is None:
            return [None] * len(places)
        if isinstance(seed, Sequence) or (isinstance(seed, np.ndarray) and seed.ndim):
            if len(seed) != len(places):
                raise ValueError(f"seed: has {len(seed)} numbers; give one to each of the {len(places)} worlds")
            return [checks.seed(None, one) for one in seed]
        first = checks.seed(None, seed)
        return [first + place for place in places]

    def step(self, actions: npt.ArrayLike) -> Step:
        """Make a step in all worlds.

        Parameters
        ----------
        actions : array_like, shape (worlds, robots, 2), (worlds, robots) or (worlds, robots, 3)
            The actions of all robots: "continuous", "grid" or "heading". With "next-step", the values of those of a
            world whose episode has ended are ignored: the step begins the next one, with rewards of 0.

        Returns
        -------
        Step
            Observations, rewards, terminated, truncated and info. They are new arrays, unless `copy` is False: then the
            next step overwrites the observations.

        Raises
        ------
        RuntimeError
            Before `reset`, also after an error within a step; and with "disabled" after the end of an episode.
        TypeError, ValueError
            If actions are not numbers, of another shape, NaN or outside their space. Nothing is changed then.
        """
        waits = self._waiting()
        batch = self._batch
        batch.step(actions, waits, _name)
        if waits is not None:
            batch.reset(np.flatnonzero(waits).tolist(), [None] * int(waits.sum()))
        terminated, truncated = batch.are_stopped, batch.cycles >= self.max_cycles
        # Before the rewards, whose function may fail.
        self._has_ended = terminated | truncated
        rewards, info = batch.rewards, self._info()
        if waits is not None:
            rewards[waits] = 0.0
        if self.autoreset == "same-step" and self._has_ended.any():
            info["final_observations"] = batch.observations.copy()
            self.reset(worlds=self._has_ended)
        observations = batch.observations.copy() if self._copies else batch.observations
        return Step(observations, rewards, terminated, truncated, info)

    def _waiting(self) -> Flags | None:
        """Return the worlds that begin an episode in this step; None for none."""
        if not self._has_ended.any():
            return None
        if self.autoreset == "disabled":
            world = int(np.argmax(self._has_ended))
            raise RuntimeError(
                f"step(): the episode of world {world} has ended; begin another, as by reset(worlds=terminated | "
                "truncated), or use autoreset='same-step'"
            )
        return self._has_ended

    def _info(self) -> dict[str, npt.NDArray[Any]]:
        facts = self._batch.facts
        return {
            "observed": facts.observed_fraction[:, 0],
            "mean_neighbours": facts.mean_neighbours[:, 0],
            "max_neighbours": facts.max_neighbours[:, 0].copy(),
            "sensed": facts.sensed.copy(),
            "neighbours": facts.neighbours.copy(),
            "active": facts.active != 0,
        }

    def state(self) -> npt.NDArray[np.float32]:
        """Return the states of all worlds, shape (worlds, bodies, 5); see `StateView`."""
        return np.stack([self._states.read(place) for place in range(self.worlds)])

    def world(self, number: int) -> World:
        """Return a world, up to date; until it is reset, its steps are then made in Python, with the same result."""
        return self._batch.world(checks.count("number", number, least=0, most=self.worlds - 1))

    def render(self, number: int = 0) -> npt.NDArray[np.uint8]:
        """Return a picture of a world, shape (height, width, 3)."""
        place = checks.count("number", number, least=0, most=self.worlds - 1)
        # Another world may have another arena.
        self._views.begin()
        pixels = self._views.draw(self._batch, place)
        assert pixels is not None
        return pixels

    def close(self) -> None:
        """Release the worlds. Idempotent."""
        self._batch.close()

    def __repr__(self) -> str:
        return f"<{type(self).__name__}: {self.worlds:,} worlds of {self.robots} robots>"


def _again(settings: Settings, worlds: int, autoreset: str, copy: bool) -> TeamVectorEnv:
    return TeamVectorEnv(settings, worlds, autoreset, copy=copy)


def _name(world: int, robot: int) -> str:
    return "actions" if robot < 0 else f"actions[{world}, {robot}]"


@takes_settings
def vector_env(worlds: int, *, autoreset: str = "same-step", copy: bool = True, **settings: Any) -> TeamVectorEnv:
    """Return many worlds that make their steps in one compiled call.

    Parameters
    ----------
    worlds : int
        Their number.
    autoreset : {"same-step", "next-step", "disabled"}
        What happens after the end of an episode: the next begins in the same step, whose observations are then its
        first; in the next step; or only by `reset`.
    copy : bool
        Whether `step` returns new arrays; if not, the next step overwrites the observations.
    **settings
        Those of `Environment`, and further parameters of `CMOMMT`, or those of the model.

    Raises
    ------
    TypeError, ValueError
        If a value is of the wrong type or outside its limits, or a name is unknown.

    Notes
    -----
    Each world has the same bits as `parallel_env` of its seed. Worlds in which an event is due, and those whose
    policies, arenas or recorders need Python, make that step in Python; all others are stepped in one call.
    """
    return TeamVectorEnv(settings_of(settings), worlds, autoreset, copy=copy)
