"""The environment for PettingZoo: one world, in which each robot is an agent."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Literal, TypeAlias

import gymnasium
import numpy as np
import numpy.typing as npt
from pettingzoo import AECEnv, ParallelEnv
from pettingzoo.utils import wrappers
from pettingzoo.utils.conversions import parallel_to_aec

from teamsight.agents.world import World
from teamsight.core import checks
from teamsight.env.actions import as_array
from teamsight.env.batch import PER_BODY, Batch
from teamsight.env.rendering import FPS, NO_MODE, RENDER_MODES, Views
from teamsight.env.rewards import OF_ROBOTS
from teamsight.env.settings import Settings, settings_of, takes_settings

Array: TypeAlias = npt.NDArray[Any]
_SENSED, _NEIGHBOURS, _ACTIVE = map(OF_ROBOTS.index, ("sensed", "neighbours", "active"))
Infos: TypeAlias = dict[str, dict[str, float]]


class TeamParallelEnv(ParallelEnv):  # type: ignore[type-arg,misc]
    """A world whose robots are PettingZoo's agents; `parallel_env` makes it.

    Parameters
    ----------
    settings : Settings
        What the world is.
    render_mode : {"rgb_array", "human"}, optional
        What `render` does.

    Attributes
    ----------
    possible_agents : list of str
        "robot_0", "robot_1" and so on.
    agents : list of str
        All of them during an episode; none before and after it.
    max_cycles : int
        The number of steps of an episode, after which all agents are truncated.
    metadata : dict
        What PettingZoo reads; its ``name`` is that of the task or of the user's model: "teamsight_cmommt_v0".
    """

    metadata = {"render_modes": list(RENDER_MODES), "render_fps": FPS, "is_parallelizable": True}  # noqa: RUF012

    def __init__(self, settings: Settings, render_mode: str | None = None) -> None:
        if render_mode is not None:
            checks.choice("render_mode", render_mode, RENDER_MODES)
        self.render_mode, self.max_cycles = render_mode, settings.max_cycles
        self.metadata = {"name": settings.name, **type(self).metadata}
        self._batch = batch = Batch(settings, 1)
        self.possible_agents = [f"robot_{number}" for number in range(batch.robots)]
        self.agents: list[str] = []
        self.observation_spaces = {agent: batch.observation.space() for agent in self.possible_agents}
        self.action_spaces = {agent: settings.form.space() for agent in self.possible_agents}
        self._views = Views(render_mode)

    def __reduce__(self) -> tuple[type[TeamParallelEnv], tuple[Settings, str | None]]:
        # As PettingZoo's EzPickle: a copy is a new environment of these settings, which `reset` begins.
        return type(self), (self._batch.settings, self.render_mode)

    def observation_space(self, agent: str) -> gymnasium.spaces.Space[Any]:
        """Return the space of the observations of an agent, always the same object."""
        return self.observation_spaces[checks.choice("agent", agent, self.possible_agents)]

    def action_space(self, agent: str) -> gymnasium.spaces.Space[Any]:
        """Return the space of the actions of an agent, always the same object."""
        return self.action_spaces[checks.choice("agent", agent, self.possible_agents)]

    def reset(self, seed: int | None = None, options: dict[str, Any] | None = None) -> tuple[dict[str, Array], Infos]:
        """Begin an episode.

        Parameters
        ----------
        seed : int, optional
            The seed of the world: ``CMOMMT(seed=seed)`` begins in the same way. Without one, the episode is the next
            after those since the last seed, which it determines; at first, a seed is drawn.
        options : dict, optional
            Not used.

        Returns
        -------
        observations : dict of str to ndarray, shape (width,), float32
            What each robot perceives.
        infos : dict of str to dict
            See `step`.
        """
        self._batch.reset([0], [seed])
        self.agents = self.possible_agents[:]
        return self._observations(), self._infos()

    def step(
        self, actions: dict[str, Any]
    ) -> tuple[dict[str, Array], dict[str, float], dict[str, bool], dict[str, bool], Infos]:
        """Make a step.

        Parameters
        ----------
        actions : dict of str to array_like
            The action of each agent. After the end of an episode there is none, and {} returns five empty dicts.

        Returns
        -------
        observations : dict of str to ndarray, shape (width,), float32
            What each robot perceives after the step.
        rewards : dict of str to float
            Their rewards.
        terminations : dict of str to bool
            Whether something has stopped the world; robots that fail stay agents, see `infos`.
        truncations : dict of str to bool
            Whether the episode has lasted for `max_cycles` steps.
        infos : dict of str to dict of str to float
            The share of targets that are ``observed``, the ``mean_neighbours`` and ``max_neighbours`` of the team; and
            of the robot the targets ``sensed``, the ``neighbours``, and 1 if it is ``active``.

        Raises
        ------
        RuntimeError
            Before `reset`, also after an error within a step; and after the end of an episode.
        TypeError, ValueError
            If actions are missing, unknown, not numbers, of another shape, NaN or outside their space. Nothing is
            changed then.
        """
        batch = self._batch
        if not self.agents and actions == {} and batch.has_begun[0]:
            # Wrappers such as SuperSuit's black_death_v3 take a step more, to learn that no agent is left.
            return {}, {}, {}, {}, {}
        self._check_agents(actions)
        names = self.possible_agents
        batch.step(_stacked({agent: actions[agent] for agent in names}, batch.settings.form.none), None, self._name)
        is_stopped, is_over = bool(batch.are_stopped[0]), bool(batch.cycles[0] >= self.max_cycles)
        # Before the rewards, whose function may fail.
        if is_stopped or is_over:
            self.agents = []
        observations, infos = self._observations(), self._infos()
        rewards = dict(zip(names, batch.rewards[0].tolist(), strict=True))
        terminations, truncations = dict.fromkeys(names, is_stopped), dict.fromkeys(names, is_over)
        if self.render_mode == "human":
            self.render()
        return observations, rewards, terminations, truncations, infos

    def _check_agents(self, actions: dict[str, Any]) -> None:
        if not self.agents:
            when = "the episode has ended" if self._batch.cycles[0] else "no episode has begun"
            raise RuntimeError(f"step(): {when}; call reset() first")
        if not isinstance(actions, dict):
            raise TypeError(f"actions={checks.shown(actions)}: must be a dict with an action for each agent")
        if actions.keys() != self.action_spaces.keys():
            missing = [agent for agent in self.agents if agent not in actions]
            strange = [agent for agent in actions if agent not in self.action_spaces]
            wrong = f"has no action for {missing[0]!r}" if missing else f"has an action for {strange[0]!r}"
            raise ValueError(f"actions: {wrong}; give one to each of the {len(self.agents)} agents, and to no other")

    def _name(self, world: int, robot: int) -> str:
        return "actions" if robot < 0 else f"actions[{self.possible_agents[robot]!r}]"

    def _observations(self) -> dict[str, Array]:
        # A copy: the next step overwrites the array.
        return dict(zip(self.possible_agents, self._batch.observations[0].copy(), strict=True))

    def _infos(self) -> Infos:
        observed, targets, in_all, largest, active = self._batch.of_worlds[0].tolist()
        facts = self._batch.of_robots[:, 0].T.tolist()
        share, mean = observed / (targets or 1.0), in_all / (active or 1.0)
        return {
            agent: {
                "observed": share, "mean_neighbours": mean, "max_neighbours": largest,
                "sensed": own[_SENSED], "neighbours": own[_NEIGHBOURS], "active": own[_ACTIVE],
            }
            for agent, own in zip(self.possible_agents, facts, strict=True)
        }  # fmt: skip

    @property
    def state_space(self) -> gymnasium.spaces.Box:
        """The space of `state`."""
        return gymnasium.spaces.Box(-1.0, 1.0, (self._batch.bodies * PER_BODY,), np.float32)

    def state(self) -> npt.NDArray[np.float32]:
        """Return the state of the whole world, which no robot perceives; see `Place.state`."""
        return self._batch.begun(0, "state()").state(self._batch.bodies).ravel()

    @property
    def world(self) -> World:
        """The world of this episode, up to date: to record it, to attach an event, or to look at it.

        Since it may then be changed, further steps of the episode are made one by one in Python, with the same result.
        """
        return self._batch.world(0)

    def render(self) -> npt.NDArray[np.uint8] | None:
        """Return a picture of the world, shape (height, width, 3); or show it, and return None.

        Raises
        ------
        RuntimeError
            Before `reset`, without a `render_mode`, or if there is no display for "human".
        """
        if self.render_mode is None:
            raise RuntimeError(NO_MODE)
        return self._views.draw(self._batch.begun(0, "render()"))

    def close(self) -> None:
        """Release the world and the window. Idempotent."""
        self.agents = []
        self._views.close()
        self._batch.close()


def _stacked(actions: Mapping[str, Any], example: npt.NDArray[Any]) -> npt.NDArray[Any]:
    """Return the actions of all agents as one array, shape (1, agents, …).

    Parameters
    ----------
    actions : mapping of str to array_like
        The action of each agent, in the order of the array.
    example : ndarray
        A good action.

    Raises
    ------
    TypeError, ValueError
        If one is not a number or an array of numbers, or has another shape than the example.
    """
    shape, listed = example.shape, list(actions.values())
    if shape and all(type(one) is np.ndarray and one.shape == shape and one.dtype.kind == "f" for one in listed):
        # The usual case, in a fifth of the time.
        return np.concatenate(listed).reshape(1, -1, *shape)
    for agent, action in actions.items():
        array = as_array(action)
        what, good = f"actions[{agent!r}]", example.tolist()
        if array.dtype.kind not in "iuf":
            raise TypeError(f"{what}={checks.shown(action)}: must be of shape {shape}, as in {good}")
        if array.shape != shape:
            raise ValueError(f"{what}: has the shape {array.shape}; it must be {shape}, as in {good}")
    return np.asarray(listed)[np.newaxis]


@takes_settings
def parallel_env(*, render_mode: Literal["rgb_array", "human"] | None = None, **settings: Any) -> TeamParallelEnv:
    """Return a PettingZoo environment in which each robot of a team is an agent.

    Parameters
    ----------
    render_mode : {"rgb_array", "human"}, optional
        What `render` does.
    **settings
        Those of `Environment`, and further parameters of `CMOMMT`, such as `robots`, `radius`, `target_policy`,
        `sensor`, `cycle` or `events`, or those of the model.

    Raises
    ------
    TypeError, ValueError
        If a value is of the wrong type or outside its limits, or a name is unknown.
    """
    return TeamParallelEnv(settings_of(settings), render_mode)


def env(**settings: Any) -> AECEnv[str, Array, Any]:
    """Return `parallel_env` as an environment in which agents act one after the other, by PettingZoo's conversion.

    Parameters
    ----------
    **settings
        Those of `parallel_env`.
    """
    return wrappers.OrderEnforcingWrapper(parallel_to_aec(parallel_env(**settings)))
