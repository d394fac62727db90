"""Gymnasium's vector interface for a policy that all robots share: one sub-environment for each robot of each world."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import gymnasium
import numpy as np
import numpy.typing as npt
from gymnasium.vector import VectorEnv
from gymnasium.vector.utils import batch_space

from teamsight.core import checks
from teamsight.env.actions import as_array
from teamsight.env.vector import TeamVectorEnv, vector_env
from teamsight.env.vector_step import Step
from teamsight.env.views import FPS, NO_MODE

Array = npt.NDArray[Any]
_RENDER_MODES = ("rgb_array",)


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
            checks.choice("render_mode", render_mode, _RENDER_MODES)
        self.render_mode = render_mode
        self.team, self.num_envs = team, team.worlds * team.robots
        self.single_observation_space, self.single_action_space = team.observation_space, team.action_space
        self.observation_space = batch_space(self.single_observation_space, self.num_envs)
        self.action_space = batch_space(self.single_action_space, self.num_envs)
        self.metadata = {"render_modes": list(_RENDER_MODES), "render_fps": FPS, **_mode(team.autoreset)}

    def __reduce__(self) -> tuple[Callable[..., SharedPolicyEnv], tuple[Any, ...], dict[str, Any]]:
        # A copy has worlds of its own, a shallow one too.
        make, given = self.team.__reduce__()
        return _shared, (make, *given), {"render_mode": self.render_mode, "spec": self.spec}

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
        return self._of_robots(observations), self._infos(info)

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
            Those of `teamsight.env.vector.Step`, shape (num_envs,) each; with "same-step", when episodes end, also
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
        terminated, truncated = self._of_worlds(made.terminated), self._of_worlds(made.truncated)
        if "final_observations" in made.info:
            infos["_final_obs"] = terminated | truncated
            infos["final_obs"] = self._final(made, infos["_final_obs"])
        return self._of_robots(made.observations), made.rewards.ravel(), terminated, truncated, infos

    def _final(self, made: Step, has_ended: Array) -> Array:
        """Return the last observations as Gymnasium does: objects, None for a robot whose episode goes on."""
        final = np.full(self.num_envs, None, dtype=object)
        rows = self._of_robots(made.info["final_observations"])
        for robot in np.flatnonzero(has_ended).tolist():
            final[robot] = rows[robot]
        return final

    def _of_robots(self, observations: Array) -> Array:
        return observations.reshape(self.num_envs, -1)

    def _of_worlds(self, values: Array) -> Array:
        return np.repeat(values, self.team.robots)

    def _infos(self, info: dict[str, Array]) -> dict[str, Any]:
        infos: dict[str, Any] = {}
        for name, values in info.items():
            if name != "final_observations":
                infos[name] = values.ravel() if values.ndim == 2 else self._of_worlds(values)
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


def _shared(make: Callable[..., TeamVectorEnv], *given: Any) -> SharedPolicyEnv:
    return SharedPolicyEnv(make(*given))


def _mode(autoreset: str) -> dict[str, Any]:
    """Return the metadata of an autoreset mode, which Gymnasium knows from version 1.1 on."""
    modes: Any = getattr(gymnasium.vector, "AutoresetMode", None)
    if modes is None:
        return {}
    names = {"same-step": "SAME_STEP", "next-step": "NEXT_STEP", "disabled": "DISABLED"}
    return {"autoreset_mode": getattr(modes, names[autoreset])}


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
