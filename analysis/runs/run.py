"""One run: a world described by value, and what is measured while it runs."""

from __future__ import annotations

import contextlib
import inspect
import json
from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass
from numbers import Real
from typing import TYPE_CHECKING, Any, NamedTuple

from teamsight.analysis.runs.checkpoint import JSON, Codec, code_digest, modules_of
from teamsight.analysis.runs.seeds import canonical, seeds_of
from teamsight.core import checks
from teamsight.policies.interface import Policy

if TYPE_CHECKING:
    from teamsight.agents.reused_worlds import ReusedWorlds
    from teamsight.agents.world import World
    from teamsight.tasks.task import Task

#: Advances a world by a number of steps and returns the result; a function of a module, so that workers find it.
Measure = Callable[["World", int], Any]
#: Called as ``model(**parameters, rng=seed)``.
Model = Callable[..., "World"]

# Cost of comparing two numbers of a lazy memory, in steps of a typical world.
_COMPARISON = 9e-5
# The size of a group that is not given, and the largest whose work matters.
_TYPICAL, _MOST_AGENTS = 15, 10**7
# Characters of a setting that a description shows.
_LONGEST_SETTING = 48


class Outcome(NamedTuple):
    """Result of a run unless something else is measured."""

    observed_fraction: float
    max_neighbours: int


def _outcome_of(content: bytes) -> Outcome:
    fraction, neighbours = json.loads(content)
    if type(fraction) is not float or type(neighbours) is not int:
        raise TypeError("not an outcome")
    return Outcome(fraction, neighbours)


#: Conversion of outcomes for a checkpoint.
OUTCOMES = Codec(JSON.encode, _outcome_of)


def outcome(world: World, steps: int) -> Outcome:
    """Run a world and return what was observed and the largest number of neighbours."""
    world.run(steps)
    return Outcome(float(world.observed_fraction), int(world.max_neighbours))


def check_takes_rng(model: object, parameters: Mapping[str, inspect.Parameter]) -> None:
    """Refuse a model that cannot be called with ``rng``.

    Raises
    ------
    TypeError
        If it cannot.
    """
    if "rng" not in parameters and not any(one.kind is one.VAR_KEYWORD for one in parameters.values()):
        raise TypeError(
            f"model={checks.shown(model)}: takes no rng; add rng=None to its parameters and pass it on to the world, "
            "as in super().__init__(arena, rng=rng)"
        )


def expect_world(found: object) -> World:
    """Return what a model returned, if it is a world."""
    from teamsight.agents.world import World

    if not isinstance(found, World):
        raise TypeError(f"model returned {checks.shown(found)}: must return a World, such as CMOMMT(robots=5)")
    return found


def columns_of(found: Any, taken: Collection[str]) -> Mapping[Any, Any]:
    """Return the columns that a measure returned.

    Parameters
    ----------
    found : object
        A NamedTuple or a mapping of columns.
    taken : collection of str
        Names of the other columns of the table.

    Raises
    ------
    TypeError, ValueError
        If it is something else, or has another column's name.
    """
    if hasattr(found, "_asdict"):
        found = found._asdict()
    if not isinstance(found, Mapping):
        raise TypeError(f"measure returned {type(found).__name__}: must be a NamedTuple or a mapping of columns")
    for name in found:
        if name in taken:
            raise ValueError(f"measure returned {name!r}: the table has this column; take another name")
    return found


@dataclass(frozen=True)
class Run:
    """One world to simulate.

    Parameters
    ----------
    parameters : mapping
        Keyword parameters of the model, without its seed.
    seed : int
        Seed of the world.
    steps : int
        Number of steps.
    measure : callable
        Advances the world and returns the result; see `Measure`.
    model : callable, optional
        Class of the world, or a function that makes one; `CMOMMT` by default.
    """

    parameters: Mapping[str, Any]
    seed: int
    steps: int
    measure: Measure = outcome
    model: Model | None = None

    @property
    def key(self) -> tuple[str, ...]:
        """Texts that identify the run: two runs of equal keys have equal results."""
        named = (f"{name}={canonical(value)}" for name, value in sorted(self.parameters.items()))
        return (
            _name(self.model), *named, f"steps={self.steps}", f"seed={self.seed}", _name(self.measure), self.code,
        )  # fmt: skip

    @property
    def code(self) -> str:
        """A digest of the code that decides the result: that of all runs, and that of the measure and the model."""
        return code_digest(*modules_of(self.measure, self.model))

    @property
    def kind(self) -> tuple[str, ...]:
        """Texts that determine which kernels the run needs: its key without the numbers."""
        named = (
            f"{name}={value!r}"
            for name, value in sorted(self.parameters.items())
            # The usual numbers first: checks against abstract classes are slow.
            if type(value) not in (int, float) and (isinstance(value, bool) or not isinstance(value, Real))
        )
        return (_name(self.model), *named, _name(self.measure))

    @property
    def likeness(self) -> tuple[object, ...]:
        """Sorting key that puts runs together which can share one built world."""
        if self.model is None:
            return (self.kind, *(canonical(self.parameters.get(name)) for name in ("robots", "targets", "delta")))
        numbers = sorted((name, value) for name, value in self.parameters.items() if type(value) in (int, float))
        return (self.kind, *numbers)

    @property
    def cost(self) -> float:
        """Expected work, in steps of a world with 15 robots and 15 targets.

        Fitted to the compiled model: a constant, and a part that grows with the pairs of agents that are compared.
        """
        robots, targets = (_size(self.parameters.get(name)) for name in ("robots", "targets"))
        world = (self.steps + 400.0) * (0.25 + 0.75 * robots * (robots + targets) / 450.0)
        policy = self.parameters.get("policy")
        effort = policy.effort if isinstance(policy, Policy) else 0
        return world + self.steps * robots * effort * _COMPARISON

    def check(self) -> None:
        """Refuse a cycle with which robots of a `CMOMMT` would not decide in so few steps; see `check_run`."""
        if self.model is None and "cycle" in self.parameters:
            from teamsight.agents.decisions import check_run

            check_run(self.parameters["cycle"], self.steps)

    def make(self, worlds: ReusedWorlds) -> Any:
        """Run the world and return what is measured."""
        return self.measure(self.begin(worlds), self.steps)

    def begin(self, worlds: ReusedWorlds) -> World:
        """Return the world before its first step."""
        from teamsight.agents.cmommt import CMOMMT

        return worlds.begin(self.model or CMOMMT, self.parameters, self.seed)

    def describe(self) -> str:
        """Return the settings on one line; long values, such as those of a policy, are cut."""
        texts = {name: " ".join(str(value).split()) for name, value in self.parameters.items()}
        named = "".join(
            f"{name}={text if len(text) <= _LONGEST_SETTING else text[: _LONGEST_SETTING - 1] + '…'}, "
            for name, text in texts.items()
        )
        return f"the run {named}steps={self.steps}, rng={self.seed}"


@dataclass(frozen=True)
class LabelledRun(Run):
    """A run that is known by a label: what a team has learned has no text of its own that would tell it apart.

    Parameters
    ----------
    label : tuple of str
        Texts that, with steps and seed, determine the result.
    """

    label: tuple[str, ...] = ()

    @property
    def key(self) -> tuple[str, ...]:
        """The label, the steps, the seed and the code."""
        return (*self.label, f"steps={self.steps}", f"seed={self.seed}", self.code)


def _size(value: object) -> int:
    """Return a number of agents for `Run.cost`: a wrong one is refused where the world is built, not before."""
    if type(value) is int:
        return min(max(value, 0), _MOST_AGENTS)
    if isinstance(value, Real):
        with contextlib.suppress(ValueError, OverflowError):
            return min(max(int(float(value)), 0), _MOST_AGENTS)
    return _TYPICAL


def _name(function: object) -> str:
    """Return the full name of a class or function; or the repr of what has no name, or shares it, as lambdas do."""
    if function is None:
        return "CMOMMT"
    name = getattr(function, "__qualname__", None)
    return repr(function) if name is None or "<" in name else f"{getattr(function, '__module__', '')}:{name}"


#: Columns of a run beside the metrics of its task.
NEIGHBOURS = ("max_neighbours", "mean_neighbours")


@dataclass(frozen=True)
class TaskMeasure:
    """Runs a world of a task and returns its metrics, and the neighbours of its team.

    Parameters
    ----------
    task : Task
        The task.
    """

    task: Task

    def __call__(self, world: World, steps: int) -> dict[str, Any]:
        """Run the world and return the columns."""
        world.run(steps)
        return self.columns(world)

    def columns(self, world: World) -> dict[str, Any]:
        """Return the columns of a world that has made its steps."""
        found: dict[str, Any] = self.task.measure(world)
        for name in NEIGHBOURS:
            if name in found:
                raise ValueError(f"metrics: {name!r} is measured of every task; take another name")
        largest = int(world.recording.max_neighbours(self.task.team))
        return found | {"max_neighbours": largest, "mean_neighbours": float(world.recording.mean_neighbours)}


def task_seed(task: Task, root: int, replicate: int, scenario: Mapping[str, Any]) -> int:
    """Return the seed of one run of a task, which depends on the scenario and not on the team.

    Parameters
    ----------
    task : Task
        The task.
    root : int
        The root seed.
    replicate : int
        Number of the run: from 0 upwards; that of a world in which a team learns from −1 downwards.
    scenario : mapping
        The values that are given; the others are the defaults of the task.
    """
    full = {**task.scenario, **scenario}
    return seeds_of(root, full, is_cmommt(task), "scenario" if is_cmommt(task) else "none")(replicate)


def is_cmommt(task: Task) -> bool:
    """Return whether the worlds of a task are `CMOMMT`, of which runs share one, and whose seeds are known."""
    from teamsight.agents.cmommt import CMOMMT

    return task.world is CMOMMT


def task_run(
    task: Task, parameters: Mapping[str, Any], seed: int, steps: int | None = None, measure: Measure | None = None
) -> Run:
    """Return one run of a task.

    Parameters
    ----------
    task : Task
        The task.
    parameters : mapping
        All parameters of the world; see `Task.parameters`.
    seed : int
        The seed.
    steps : int, optional
        Steps; by default those of the task.
    measure : callable, optional
        See `Run`; by default `TaskMeasure`.
    """
    model: Model | None = None if is_cmommt(task) else task.world
    return Run(parameters, seed, task.steps if steps is None else steps, measure or TaskMeasure(task), model)
