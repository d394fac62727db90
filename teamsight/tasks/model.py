"""A task as a model: what studies, environments, live pages and `run_many` call to get a world."""

from __future__ import annotations

import inspect
from collections.abc import Iterable, Mapping
from typing import TYPE_CHECKING, Any

from teamsight.core import checks
from teamsight.tasks.task import AWARENESS, Named, Task, Treatment

if TYPE_CHECKING:
    from teamsight.agents.world import World

#: The parameter that names the team.
TREATMENT = "treatment"
_SEED = inspect.Parameter("rng", inspect.Parameter.KEYWORD_ONLY, default=None)


class TaskModel:
    """Called as ``model(**setting, rng=seed)``, it returns a world of a task.

    A setting has values of the scenario, ``treatment`` ("explore", "skilled" or a mapping), and further parameters of
    the world, such as ``awareness``, which replace those of the team.

    Parameters
    ----------
    task : Task
        The task.
    treatment : "explore", "skilled" or mapping, optional
        The team where a setting names none; by default the one with skill, if the task has one.
    rng : int
        The root seed of the learning of a skilled team. Each team learns once in a process.
    """

    def __init__(self, task: Task, treatment: Treatment | None = None, rng: int = 0) -> None:
        self.task = task
        self.treatment: Treatment = treatment or ("explore" if task.skilled is None else "skilled")
        self._rng = rng
        self._learned: dict[str, dict[str, Any]] = {}

    @property
    def __name__(self) -> str:
        """The name of the task, for titles and errors."""
        return self.task.name

    @property
    def makes(self) -> Any:
        """The class or function that makes the worlds; what it declares holds for the model."""
        return self.task.world

    def __repr__(self) -> str:
        return f"TaskModel({self.task.name!r}, {self.treatment!r}, rng={self._rng})"

    def __call__(self, *, rng: int | None = None, **setting: Any) -> World:
        return self.task.world(**self.parameters(setting), rng=rng)

    def parameters(self, setting: Mapping[str, Any]) -> dict[str, Any]:
        """Return all keyword parameters of the world for a setting.

        Raises
        ------
        TypeError, ValueError
            As `Task.parameters`; and if a name is a parameter neither of the scenario nor of the world.
        """
        task = self.task
        scenario = self.scenario(setting)
        more = {name: value for name, value in setting.items() if name not in scenario and name != TREATMENT}
        self.parameters_known(more)
        treatment: Treatment = setting.get(TREATMENT, self.treatment)
        if isinstance(treatment, str) and callable(task.teams.get(treatment)):
            degree = more.pop(AWARENESS, None)
            key = f"{sorted(scenario.items())!r}{degree!r}"
            if key not in self._learned:
                self._learned[key] = task.parameters(treatment, scenario, awareness=degree, rng=self._rng)
            return {**self._learned[key], **more}
        return {**task.parameters(treatment, scenario), **more}

    def scenario(self, setting: Mapping[str, Any]) -> dict[str, Any]:
        """Return the whole scenario of a setting."""
        own = self.task.scenario
        return {**own, **{name: value for name, value in setting.items() if name in own}}

    @property
    def __signature__(self) -> inspect.Signature:
        """The names that a setting may have, with their defaults."""
        plain = inspect.Parameter
        named = {TREATMENT: plain(TREATMENT, plain.KEYWORD_ONLY, default=self.treatment, annotation=Named)}
        for name, value in self.task.scenario.items():
            kind = type(value) if isinstance(value, (int, float, str)) else plain.empty
            named[name] = plain(name, plain.KEYWORD_ONLY, default=value, annotation=kind)
        rest = []
        for name, one in _parameters(self.task).items():
            if one.kind is plain.VAR_KEYWORD:
                rest.append(one)
            elif name not in (*named, "rng", "seed") and one.kind is not plain.VAR_POSITIONAL:
                # The team gives what has no default.
                named[name] = one.replace(
                    kind=plain.KEYWORD_ONLY, default=None if one.default is one.empty else one.default
                )
        return inspect.Signature([*named.values(), _SEED, *rest])

    def parameters_known(self, more: Iterable[str]) -> None:
        """Refuse names that are parameters neither of the scenario nor of the world.

        Raises
        ------
        ValueError
            If there is one; the message suggests the nearest.
        """
        if not more:
            return
        known = self.__signature__.parameters
        if any(one.kind is one.VAR_KEYWORD for one in known.values()):
            return
        names = [name for name in known if name != "rng"]
        for name in more:
            if name not in names:
                raise ValueError(
                    f"{name}: is no parameter of the task {self.task.name}; {checks.suggestion(name, names)}its "
                    f"scenario is {', '.join(self.task.scenario)}"
                )


def _parameters(task: Task) -> Mapping[str, inspect.Parameter]:
    """Return the parameters of the world of a task."""
    try:
        return inspect.signature(task.world).parameters
    except (TypeError, ValueError):  # of a class that is not written in Python
        return {}
