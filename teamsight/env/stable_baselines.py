"""stable-baselines3's vector interface for a policy that all robots share."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np
import numpy.typing as npt

from teamsight.env.vector import SharedPolicyEnv, gymnasium_env

try:
    from stable_baselines3.common.vec_env import VecEnv
except ImportError:
    # With PyTorch it is too large for an extra of this package.
    VecEnv = object

Array = npt.NDArray[Any]
Indices = int | Iterable[int] | None


class TeamVecEnv(VecEnv):  # type: ignore[misc]
    """The robots of many worlds as stable-baselines3's environments; `stable_baselines_env` makes it.

    Parameters
    ----------
    shared : SharedPolicyEnv
        The same for Gymnasium, with autoreset "same-step".

    Attributes
    ----------
    num_envs : int
        The number of robots in all worlds.
    shared : SharedPolicyEnv
        The same for Gymnasium.
    """

    def __init__(self, shared: SharedPolicyEnv) -> None:
        self.shared = shared
        super().__init__(shared.num_envs, shared.single_observation_space, shared.single_action_space)
        self._actions: npt.ArrayLike = ()

    def reset(self) -> npt.NDArray[np.float32]:
        """Begin an episode in all worlds; after ``seed(s)``, world w has the seed s + w."""
        observations, _ = self.shared.reset(seed=self._seeds[0])
        self._reset_seeds()
        self._reset_options()
        return observations

    def step_async(self, actions: npt.ArrayLike) -> None:
        """Keep the actions of the robots for `step_wait`."""
        self._actions = actions

    def step_wait(self) -> tuple[npt.NDArray[np.float32], npt.NDArray[np.float32], Array, list[dict[str, Any]]]:
        """Make a step; worlds whose episode has ended begin the next.

        Returns
        -------
        observations : ndarray, shape (num_envs, width), float32
            What the robots perceive, in the next episode if one has ended.
        rewards : ndarray, shape (num_envs,), float32
            Their rewards.
        dones : ndarray, shape (num_envs,), bool
            Whether their episode has ended.
        infos : list of dict
            After the last step of an episode ``terminal_observation``, ``TimeLimit.truncated`` and what `Step.info` of
            `TeamVectorEnv` has of the robot; else empty.
        """
        observations, rewards, terminated, truncated, found = self.shared.step(self._actions)
        dones = terminated | truncated
        infos: list[dict[str, Any]] = [{} for _ in range(self.num_envs)]
        for robot in np.flatnonzero(dones).tolist():
            infos[robot] = {name: values[robot] for name, values in found.items() if not name.startswith("_")}
            infos[robot]["terminal_observation"] = infos[robot].pop("final_obs")
            infos[robot]["TimeLimit.truncated"] = bool(truncated[robot] and not terminated[robot])
        return observations, rewards.astype(np.float32), dones, infos

    def get_images(self) -> list[npt.NDArray[np.uint8]]:
        """Return a picture of each world."""
        return list(self.shared.render()[:: self.shared.team.robots])

    def get_attr(self, attr_name: str, indices: Indices = None) -> list[Any]:
        """Return an attribute of `shared`, once for each robot."""
        return [getattr(self.shared, attr_name)] * self._number(indices)

    def set_attr(self, attr_name: str, value: Any, indices: Indices = None) -> None:
        """Refuse it, since no robot has an environment of its own."""
        raise AttributeError(
            f"{attr_name}: cannot be set, as the robots of a world share one environment; give it to "
            "stable_baselines_env(…), or change a world, env.shared.team.world(number)"
        )

    def env_method(self, method_name: str, *args: Any, indices: Indices = None, **kwargs: Any) -> list[Any]:
        """Call a method of `shared` once, and return what it returns once for each robot."""
        return [getattr(self.shared, method_name)(*args, **kwargs)] * self._number(indices)

    def env_is_wrapped(self, wrapper_class: type, indices: Indices = None) -> list[bool]:
        """Return False for each robot."""
        return [False] * self._number(indices)

    def _number(self, indices: Indices) -> int:
        return len(list(self._get_indices(indices)))

    def close(self) -> None:
        """Release the worlds. Idempotent."""
        self.shared.close()


def stable_baselines_env(worlds: int, *, render_mode: str | None = None, **settings: Any) -> TeamVecEnv:
    """Return many worlds as a `VecEnv` of stable-baselines3, with one environment for each robot.

    Parameters
    ----------
    worlds : int
        Their number; there are ``worlds × robots`` environments.
    render_mode : "rgb_array", optional
        Let `render` and video recorders have pictures, one for each world.
    **settings
        Those of `vector_env`, without `autoreset`, as `VecEnv` begins the next episode in the same step.

    Raises
    ------
    ImportError
        Without stable-baselines3: ``pip install stable-baselines3``.
    TypeError, ValueError
        As for `vector_env`.
    """
    if VecEnv is object:
        raise ImportError(
            "stable_baselines_env needs stable_baselines3, which is not installed: pip install stable-baselines3"
        )
    return TeamVecEnv(gymnasium_env(worlds, autoreset="same-step", render_mode=render_mode, **settings))
