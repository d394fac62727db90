"""Many worlds in one compiled call: with arrays of all their robots, or as Gymnasium's vector interface has it.

In the latter a policy is shared by all robots: there is one sub-environment for each robot of each world.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, NamedTuple, NoReturn, TypeAlias

import gymnasium
import numpy as np
import numpy.typing as npt
from gymnasium.vector import VectorEnv
from gymnasium.vector.utils import batch_space

from teamsight.agents.world import World
from teamsight.core import checks
from teamsight.env.actions import as_array
from teamsight.env.batch import Batch
from teamsight.env.rendering import FPS, NO_MODE, Views
from teamsight.env.settings import Settings, settings_of, takes_settings

Floats: TypeAlias = npt.NDArray[np.float64]
Flags: TypeAlias = npt.NDArray[np.bool_]
Observations: TypeAlias = npt.NDArray[np.float32]
Array: TypeAlias = npt.NDArray[Any]

#: What happens after the end of an episode: the next begins in the same step, in the next step, or by `reset` only.
AUTORESETS = ("same-step", "next-step", "disabled")
_MOST_WORLDS = 1_000_000


class Step(NamedTuple):
    """What a step of `TeamVectorEnv` returns.

    Attributes
    ----------
    observations : ndarray, shape (worlds, robots, width), float32
        What the robots perceive after the step.
    rewards : ndarray, shape (worlds, robots), float64
        Their rewards.
    terminated, truncated : ndarray, shape (worlds,), bool
        Whether something has stopped a world; whether its episode has lasted for `max_cycles` steps.
    info : dict of str to ndarray
        Of each world the ``observed`` share of targets, ``mean_neighbours`` and ``max_neighbours``, shape (worlds,); of
        each robot the targets ``sensed``, the ``neighbours`` and whether it is ``active``, shape (worlds, robots). With
        "same-step", if episodes have ended: ``final_observations``, shape (worlds, robots, width), whose rows of other
        worlds are as in `observations`; the rest of `info` is of the last step of the episode.
    """

    observations: Observations
    rewards: Floats
    terminated: Flags
    truncated: Flags
    info: dict[str, npt.NDArray[Any]]


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
    threads : int
        How many threads make the steps.
    stagger : bool
        Whether the first episodes end at different steps.

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

    def __init__(
        self, settings: Settings, worlds: int, autoreset: str = "same-step", copy: bool = True, threads: int = 1,
        stagger: bool = False,
    ) -> None:  # fmt: skip
        self.worlds = checks.count("worlds", worlds, most=_MOST_WORLDS)
        self.autoreset = checks.choice("autoreset", autoreset, AUTORESETS)
        self._copies, self._staggers = checks.flag("copy", copy), checks.flag("stagger", stagger)
        self._threads = checks.count("threads", threads, most=self.worlds, cure="each steps a part of the worlds")
        self._batch = batch = Batch(settings, self.worlds, self._threads)
        self.robots, self.max_cycles = batch.robots, settings.max_cycles
        self.observation_space = batch.observation.space()
        self.action_space: gymnasium.spaces.Space[Any] = settings.form.space()
        # Of two dimensions, as the arrays have: worlds, then robots.
        self.batched_action_space = batch_space(batch_space(self.action_space, self.robots), self.worlds)
        self._has_ended = np.zeros(self.worlds, bool)
        # The number of steps of the present episode of each.
        self._lengths = np.full(self.worlds, self.max_cycles)
        self._views = Views("rgb_array")

    def __reduce__(self) -> tuple[type[TeamVectorEnv], tuple[Settings, int, str, bool, int, bool]]:
        # As PettingZoo's EzPickle: a copy is new worlds of these settings, which `reset` begins.
        given = self._batch.settings, self.worlds, self.autoreset, self._copies, self._threads, self._staggers
        return type(self), given

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
        self._begin(places, self._seeds(seed, places))
        if worlds is None and self._staggers:
            self._lengths[:] = -(-self.max_cycles * np.arange(1, self.worlds + 1) // self.worlds)
        return self._batch.observations.copy(), self._info()

    def _begin_next(self, has_ended: Flags) -> None:
        """Begin the next episode of worlds."""
        places = np.flatnonzero(has_ended).tolist()
        self._begin(places, [None] * len(places))

    def _begin(self, places: list[int], seeds: Sequence[int | None]) -> None:
        self._batch.reset(places, seeds)
        self._has_ended[places], self._lengths[places] = False, self.max_cycles

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
        if (isinstance(seed, Sequence) and not isinstance(seed, str)) or (isinstance(seed, np.ndarray) and seed.ndim):
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
        waits = self._has_ended.copy() if self._has_ended.any() else None
        if waits is not None and self.autoreset == "disabled":
            raise RuntimeError(
                f"step(): the episode of world {int(np.argmax(waits))} has ended; begin another, as by "
                "reset(worlds=terminated | truncated), or use autoreset='same-step'"
            )
        batch = self._batch
        batch.step(actions, waits, lambda world, robot: "actions" if robot < 0 else f"actions[{world}, {robot}]")
        if waits is not None:
            self._begin_next(waits)
        terminated, truncated = batch.are_stopped, batch.cycles >= self._lengths
        # Before the rewards, whose function may fail.
        self._has_ended = terminated | truncated
        rewards, info = batch.rewards, self._info()
        if waits is not None:
            rewards[waits] = 0.0
        if self.autoreset == "same-step" and self._has_ended.any():
            info["final_observations"] = batch.observations.copy()
            self._begin_next(self._has_ended)
        observations = batch.observations.copy() if self._copies else batch.observations
        return Step(observations, rewards, terminated, truncated, info)

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
        """Return the states of all worlds, shape (worlds, bodies, 5); see `Place.state`."""
        batch = self._batch
        return np.stack([batch.begun(place, "state()").state(batch.bodies) for place in range(self.worlds)])

    def world(self, number: int) -> World:
        """Return a world, up to date; until it is reset, its steps are then made in Python, with the same result.

        It is built for the rest of its episode, and closed after it, unless all worlds are built one by one.
        """
        return self._batch.world(checks.count("number", number, least=0, most=self.worlds - 1))

    def render(self, number: int = 0) -> npt.NDArray[np.uint8]:
        """Return a picture of a world, shape (height, width, 3)."""
        place = checks.count("number", number, least=0, most=self.worlds - 1)
        pixels = self._views.draw(self._batch.begun(place, "render()"))
        assert pixels is not None
        return pixels

    def close(self) -> None:
        """Release the worlds. Idempotent."""
        self._batch.close()

    def __repr__(self) -> str:
        return f"<{type(self).__name__}: {self.worlds:,} worlds of {self.robots} robots>"


@takes_settings
def vector_env(
    worlds: int,
    *,
    autoreset: str = "same-step",
    copy: bool = True,
    threads: int = 1,
    stagger: bool = False,
    **settings: Any,
) -> TeamVectorEnv:
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
    threads : int
        How many threads make the steps, each those of a part of the worlds; the results are the same.
    stagger : bool
        Whether the first episodes after a `reset` of all worlds are shorter, so that not all end at the same step: that
        of world w has ``max_cycles * (w + 1) / worlds`` steps, rounded up. All that follow have `max_cycles`.
    **settings
        Those of `Environment`, and further parameters of `CMOMMT`, or those of the model.

    Raises
    ------
    TypeError, ValueError
        If a value is of the wrong type or outside its limits, or a name is unknown.

    Notes
    -----
    Each world has the same bits as `parallel_env` of its seed. Worlds in which an event is due, and those whose
    policies, arenas or recorders need Python, make that step in Python; all others are stepped in one call for each
    thread.
    """
    return TeamVectorEnv(settings_of(settings), worlds, autoreset, copy, threads, stagger)


class SharedPolicyEnv(VectorEnv):  # type: ignore[type-arg,misc]
    """The robots of many worlds as sub-environments: number ``world × robots + robot``.

    Parameters
    ----------
    team : TeamVectorEnv
        The worlds.
    render_mode : "rgb_array", optional
        What `render` returns.

    Attributes
    ----------
    num_envs : int
        The number of robots in all worlds.
    single_observation_space, single_action_space : gymnasium.Space
        The spaces of one robot.
    observation_space, action_space : gymnasium.Space
        Those of all.
    team : TeamVectorEnv
        The worlds.
    """

    def __init__(self, team: TeamVectorEnv, render_mode: str | None = None) -> None:
        if render_mode is not None:
            checks.choice("render_mode", render_mode, ("rgb_array",))
        self.render_mode = render_mode
        self.team, self.num_envs = team, team.worlds * team.robots
        self.single_observation_space, self.single_action_space = team.observation_space, team.action_space
        self.observation_space = batch_space(self.single_observation_space, self.num_envs)
        self.action_space = batch_space(self.single_action_space, self.num_envs)
        self.metadata = {"render_modes": ["rgb_array"], "render_fps": FPS}
        # Gymnasium knows the modes from version 1.1 on.
        modes: Any = getattr(gymnasium.vector, "AutoresetMode", None)
        if modes is not None:
            self.metadata["autoreset_mode"] = modes[team.autoreset.upper().replace("-", "_")]

    def __reduce__(self) -> tuple[Callable[..., SharedPolicyEnv], tuple[Any, ...], dict[str, Any]]:
        # A copy has worlds of its own, a shallow one too.
        _, given = self.team.__reduce__()
        return _shared, given, {"render_mode": self.render_mode, "spec": self.spec}

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[npt.NDArray[np.float32], dict[str, Any]]:
        """Begin an episode.

        Parameters
        ----------
        seed : int, optional
            The seed of the first world; see `TeamVectorEnv.reset`.
        options : dict, optional
            With "reset_mask", shape (num_envs,), bool: only the worlds of these robots begin an episode.

        Returns
        -------
        observations : ndarray, shape (num_envs, width), float32
            What the robots perceive.
        infos : dict of str to ndarray
            See `step`.

        Raises
        ------
        ValueError
            If the mask selects a part of the robots of a world, or has another shape.
        """
        worlds = None
        if options and "reset_mask" in options:
            mask = np.asarray(options["reset_mask"])
            if mask.dtype != bool or mask.shape != (self.num_envs,):
                raise ValueError(f"reset_mask: must be of shape ({self.num_envs},) and bool, one flag for each robot")
            chosen = mask.reshape(self.team.worlds, self.team.robots)
            worlds = chosen.any(axis=1)
            if not np.array_equal(worlds, chosen.all(axis=1)):
                raise ValueError("reset_mask: selects a part of the robots of a world; its robots begin together")
        super().reset(seed=seed)
        observations, info = self.team.reset(seed, worlds=worlds)
        return observations.reshape(self.num_envs, -1), self._infos(info)

    def step(
        self, actions: npt.ArrayLike
    ) -> tuple[npt.NDArray[np.float32], npt.NDArray[np.float64], Array, Array, dict[str, Any]]:
        """Make a step.

        Parameters
        ----------
        actions : array_like, shape (num_envs, 2), (num_envs,) or (num_envs, 3)
            The actions of the robots; see `parallel_env`.

        Returns
        -------
        observations : ndarray, shape (num_envs, width), float32
            What the robots perceive after the step.
        rewards : ndarray, shape (num_envs,), float64
            Their rewards.
        terminations, truncations : ndarray, shape (num_envs,), bool
            The robots of a world end together.
        infos : dict of str to ndarray
            Those of `Step`, shape (num_envs,) each; with "same-step", when episodes end, also
            ``final_obs``, and ``_final_obs``, the mask of the robots that have one.

        Raises
        ------
        RuntimeError, TypeError, ValueError
            As for `TeamVectorEnv.step`.
        """
        given = as_array(actions)
        if given.shape[:1] != (self.num_envs,):
            shape = (self.num_envs, *(self.single_action_space.shape or ()))
            raise ValueError(f"actions: have the shape {given.shape}; it must be {shape}, one for each robot")
        made = self.team.step(given.reshape(self.team.worlds, self.team.robots, *given.shape[1:]))
        infos = self._infos(made.info)
        terminated, truncated = (np.repeat(one, self.team.robots) for one in (made.terminated, made.truncated))
        if "final_observations" in made.info:
            # As Gymnasium has it: objects, None for a robot whose episode goes on.
            infos["_final_obs"] = has_ended = terminated | truncated
            infos["final_obs"] = final = np.full(self.num_envs, None, dtype=object)
            rows = made.info["final_observations"].reshape(self.num_envs, -1)
            for robot in np.flatnonzero(has_ended).tolist():
                final[robot] = rows[robot]
        return made.observations.reshape(self.num_envs, -1), made.rewards.ravel(), terminated, truncated, infos

    def _infos(self, info: dict[str, Array]) -> dict[str, Any]:
        infos: dict[str, Any] = {}
        for name, values in info.items():
            if name != "final_observations":
                infos[name] = values.ravel() if values.ndim == 2 else np.repeat(values, self.team.robots)
                # Gymnasium marks who has a value.
                infos[f"_{name}"] = np.ones(self.num_envs, bool)
        return infos

    def render(self) -> tuple[npt.NDArray[np.uint8], ...]:
        """Return a picture for each robot, shape (height, width, 3): that of its world.

        Raises
        ------
        RuntimeError
            Before `reset`, or without a `render_mode`.
        """
        if self.render_mode is None:
            raise RuntimeError(NO_MODE)
        pictures = map(self.team.render, range(self.team.worlds))
        return tuple(picture for picture in pictures for _ in range(self.team.robots))

    def close_extras(self, **kwargs: Any) -> None:
        """Release the worlds."""
        self.team.close()


def _shared(*given: Any) -> SharedPolicyEnv:
    return SharedPolicyEnv(TeamVectorEnv(*given))


def gymnasium_env(
    worlds: int, *, autoreset: str = "next-step", render_mode: str | None = None, **settings: Any
) -> SharedPolicyEnv:
    """Return many worlds as a vector environment of Gymnasium, with one sub-environment for each robot.

    Parameters
    ----------
    worlds : int
        Their number; there are ``worlds × robots`` sub-environments.
    autoreset : {"next-step", "same-step", "disabled"}
        What happens after the end of an episode; see `vector_env`. Gymnasium's wrappers take "next-step".
    render_mode : "rgb_array", optional
        Let `render` return pictures.
    **settings
        The others of `vector_env`.

    Raises
    ------
    TypeError, ValueError
        As for `vector_env`.
    """
    return SharedPolicyEnv(vector_env(worlds, autoreset=autoreset, **settings), render_mode)


def many_robots(num_envs: int, **settings: Any) -> SharedPolicyEnv:
    """Return the environment that `gymnasium.make_vec` makes of an id; `num_envs` is the number of worlds."""
    return gymnasium_env(num_envs, **settings)


def one_robot(**_: Any) -> NoReturn:
    """Refuse `gymnasium.make`, whose environments have one robot that acts alone."""
    raise ValueError(
        "gymnasium.make: a team is several environments, one for each robot; use gymnasium.make_vec(id, "
        "num_envs=WORLDS)"
    )
