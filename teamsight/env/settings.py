"""The settings of an environment, checked, and the worlds that they describe."""

from __future__ import annotations

import inspect
import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Annotated, Any, TypeVar

from teamsight.agents.attributes import AwarenessLike
from teamsight.agents.awareness import AWARENESS, Awareness
from teamsight.agents.awareness.registry import Delta, awareness_named, with_option
from teamsight.agents.cmommt import CMOMMT
from teamsight.agents.group import Group
from teamsight.agents.reused_worlds import ReusedWorlds
from teamsight.agents.teammates import of_team
from teamsight.agents.world import World
from teamsight.core import checks
from teamsight.core.component import Allowed, Component, Count, declared
from teamsight.env.actions import ActionForm, ActionLike
from teamsight.env.observations import LayoutLike, Nearest, layout_of
from teamsight.env.rewards import Reward, RewardLike, reward_of
from teamsight.policies.trained import ENCODINGS
from teamsight.tasks.model import TaskModel
from teamsight.tasks.named import task_of
from teamsight.tasks.task import Task

F = TypeVar("F", bound=Callable[..., Any])

#: Parameters of `CMOMMT` that environments set themselves, and what to give instead.
_OWN = {
    "policy": "actions come from outside; action chooses their form",
    "policy_options": "actions come from outside; action chooses their form",
    "awareness": "give the degree of awareness as observation",
    "rng": "give the seed to reset(seed=…)",
    "seed": "give the seed to reset(seed=…)",
    "steps": "give the length of an episode as max_cycles",
    "task": "give a task, or its name, as model",
}


@dataclass(frozen=True)
class Settings:
    """The settings of an environment; see `parallel_env`.

    Attributes
    ----------
    model : callable
        Called as ``model(**parameters, rng=seed)``; it returns a world.
    parameters : mapping of str to object
        Its parameters.
    group : str or None
        The name of the group that is steered; None for the first of the team of a task.
    degree : Awareness or None
        Its degree of awareness; None for that of the model.
    layout : Nearest or None
        The layout of observations.
    encoding : {"nearness", "distance"}
        What they say of distances.
    form : ActionForm
        The form of actions.
    reward : callable
        The reward.
    max_cycles : int
        The number of steps of an episode.
    """

    model: Callable[..., World]
    parameters: Mapping[str, Any]
    group: str | None
    degree: Awareness | None
    layout: Nearest | None
    encoding: str
    form: ActionForm
    reward: Reward
    max_cycles: int

    @property
    def name(self) -> str:
        """The name of the environment in PettingZoo's form: "teamsight_cmommt_v0"."""
        words = re.findall("[a-z0-9]+", getattr(self.model, "__name__", "world").lower())
        return "_".join(["teamsight", *words, "v0"])

    @property
    def is_kept(self) -> bool:
        """Whether the user's model may have kept its worlds, so that they can change between steps."""
        return self.model is not CMOMMT

    def begin(self, worlds: ReusedWorlds, seed: int) -> tuple[World, Group]:
        """Return a world before its first step, and the group that is steered.

        Parameters
        ----------
        worlds : ReusedWorlds
            Where the last world of this place is kept.
        seed : int
            The seed of the run.

        Raises
        ------
        TypeError, ValueError
            If the model refuses its parameters, returns no world, or has no such group.
        """
        world: Any = worlds.begin(self.model, self.parameters, seed)
        if not isinstance(world, World):
            name = getattr(self.model, "__name__", "model")
            raise TypeError(f"model={name}: returned {type(world).__name__}; it must return a World")
        if not world.running:
            raise ValueError("model: returned a world that is closed, or was stopped; build a new one on each call")
        if world.tick:
            raise ValueError(f"model: returned a world at tick {world.tick:,}; it must be before its first step")
        group = self._group_of(world)
        if group.policy != self.form.policy or self.degree not in (None, group.awareness):
            world.adjust(group, policy=self.form.policy, awareness=self.degree)
        return world, group

    def _group_of(self, world: World) -> Group:
        if self.group is None:
            assert isinstance(self.model, TaskModel)
            return of_team(world.groups, self.model.task.team)[0]
        for group in world.groups:
            if group.name == self.group:
                return group
        names = ", ".join(repr(group.name) for group in world.groups) or "none"
        raise ValueError(f"group={checks.shown(self.group)}: the world has no such group; it has {names}")


@dataclass(frozen=True, kw_only=True)
class Environment(Component):
    """What an environment is made of.

    Parameters
    ----------
    observation : str or Awareness, optional
        What robots perceive of teammates, a degree of awareness: "none", "ring", "pairwise", "shared", or an object.
        None for that of the `model`.
    delta : int
        The number of sectors of "ring".
    layout : {"sectors", "nearest"} or Nearest
        How observations show it: the situation vectors of the degree, which begin with 16 sectors of targets; or lists
        of the nearest targets and teammates, as ``Nearest(targets=5, teammates=5)``. docs/environments.md has a table.
    encoding : {"nearness", "distance"}
        What observations say of a distance d in ranges: 1 − d, from 0 where nothing is sensed to 1 at the robot; or d,
        which is 1 where nothing is sensed. It holds for all values of sectors, for the readings of a lidar, and for the
        first number of each body of "nearest".
    action : {"vector", "continuous", "grid", "heading"} or ActionGrid
        The form of actions: the way ahead and to the left, both in [−1, 1] and in units of the speed, which is the
        farthest; rotation and distance, both in [−1, 1], for −π to π and 0 to the speed; the number of an action of a
        grid; or a direction x, y and a distance [length], as in `Action`: unit vectors and (0, 0), which
        keeps the heading, are carried out to the last bit, and others are normalised.
    reward : str, mapping of str to float, or callable
        A name of `REWARDS`, several with weights, or ``reward(facts)``, which returns an array of shape (worlds,
        robots); see `Facts`.
    max_cycles : int
        The number of steps of an episode.
    model : callable, Task or str, optional
        Instead of `CMOMMT`, ``model(**parameters, rng=seed)``, which returns a `World`; or a task or its name, then
        parameters are those of its scenario and its world. Its robots must be as many for every seed; their policy is
        replaced.
    group : str, optional
        The name of the group of the world whose robots are agents; by default "robots", and of a task the first of its
        team.
    """

    observation: AwarenessLike | None = "ring"
    delta: Delta | None = None
    layout: LayoutLike = "sectors"
    encoding: Annotated[str, Allowed(choices=ENCODINGS)] = "nearness"
    action: ActionLike = "vector"
    reward: RewardLike = "alone"
    max_cycles: Count = 600
    model: Callable[..., World] | Task | str | None = None
    group: str | None = None

    def settings(self, parameters: Mapping[str, Any]) -> Settings:
        """Return the settings of an environment with these parameters of its worlds.

        Raises
        ------
        TypeError, ValueError
            If one is of the wrong type or outside its limits, or a name is unknown.
        """
        model, given, group = self.model, dict(parameters), self.group or "robots"
        if model is not None and not callable(model) and not isinstance(model, (Task, str)):
            raise TypeError(
                f"model={checks.shown(model)}: must be a function or a class that returns a World, or a task"
            )
        form, degree = ActionForm(self.action), _degree(self.observation, self.delta)
        called: str | None = group
        if isinstance(model, (Task, str)):
            model, called = _task_model(model, given), self.group
        if model is None or model is CMOMMT:
            _check_parameters(given)
            given |= {"policy": form.policy} | ({} if degree is None else {"awareness": degree})
        else:
            _check_call(model, given)
        return Settings(
            model or CMOMMT, given, called, degree, layout_of(self.layout), self.encoding, form,
            reward_of(self.reward), self.max_cycles,
        )  # fmt: skip


def settings_of(values: Mapping[str, Any]) -> Settings:
    """Return the settings that a user gives: those of an `Environment`, and parameters of its worlds."""
    own = declared(Environment)
    parameters = {name: value for name, value in values.items() if name not in own}
    return Environment(**{name: value for name, value in values.items() if name in own}).settings(parameters)


def takes_settings(make: F) -> F:
    """Let the signature and the docstring of a function with ``**settings`` say what they are."""
    shown: Any = make
    own = list(inspect.signature(make).parameters.values())[:-1]
    keyword = inspect.Parameter.KEYWORD_ONLY
    known = {**declared(Environment), **{name: one for name, one in declared(CMOMMT).items() if name not in _OWN}}
    named = [
        inspect.Parameter(name, keyword, default=one.default)
        for name, one in known.items() if name not in {one.name for one in own}
    ]  # fmt: skip
    shown.__signature__ = inspect.signature(make).replace(parameters=[*own, *named])
    meaning = inspect.cleandoc(Environment.__doc__ or "").partition("----------\n")[2]
    shown.__doc__ = inspect.cleandoc(make.__doc__ or "").replace("**settings\n", f"{meaning}\n**parameters\n")
    return make


def _task_model(task: Task | str, given: Mapping[str, Any]) -> TaskModel:
    """Return a task as a model, after a check of its parameters."""
    found = task_of(task)
    # Actions come from outside, so no team has to learn first.
    model = TaskModel(found, "skilled" if found.explore is None else "explore")
    model.parameters_known(given)
    return model


def _degree(observation: AwarenessLike | None, delta: int | None) -> Awareness | None:
    if observation is None:
        return None
    if isinstance(observation, str):
        name = checks.choice("observation", observation, AWARENESS)
        having = with_option("delta")
        if name not in having and delta is not None:
            shown = " or ".join(f"observation={one!r}" for one in having)
            raise ValueError(f"delta={delta}: applies to {shown}; leave it out")
        return awareness_named(name, {"delta": delta})
    if not isinstance(observation, Awareness):
        raise TypeError(
            f"observation={checks.shown(observation)}: must be a degree of awareness, such as RingAwareness(8), or one "
            f"of {', '.join(AWARENESS)}"
        )
    return observation


def _check_call(model: Callable[..., World], given: Mapping[str, Any]) -> None:
    """Refuse a model that does not take its parameters."""
    try:
        inspect.signature(model).bind(**given, rng=0)
    except TypeError as error:
        called = ", ".join([*(f"{name}=…" for name in given), "rng=…"])
        raise TypeError(f"model={checks.shown(model)}: is called as model({called}), and refuses it: {error}") from None
    except ValueError:
        # Some functions that are not written in Python have no signature.
        return


def _check_parameters(given: Mapping[str, Any]) -> None:
    # Those of environments are near to slips too.
    known = dict.fromkeys([*(name for name in declared(CMOMMT) if name not in _OWN), *declared(Environment)])
    for name in given:
        if name in _OWN:
            raise TypeError(f"{name}: is not a parameter of environments; {_OWN[name]}")
        if name not in known:
            raise TypeError(
                f"{name}={checks.shown(given[name])}: unknown; {checks.suggestion(name, known)}environments take "
                f"{', '.join(known)}"
            )
