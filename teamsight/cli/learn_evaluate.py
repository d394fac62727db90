"""``teamsight learn evaluate``: learn from a memory, and compare with other policies on the same worlds."""

from __future__ import annotations

import contextlib
import math
import time
import warnings
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from functools import partial
from typing import TYPE_CHECKING, Annotated, Any

from teamsight.analysis.runs.limits import Runs, Steps
from teamsight.cli import learn_evaluate_task, limits
from teamsight.cli.errors import when_stopped
from teamsight.cli.options import Works, Writes
from teamsight.cli.paths import check_apart
from teamsight.cli.values import Agents, File, Learner, Matches, Reward
from teamsight.cli.world_settings import TaskName
from teamsight.core.component import Allowed, Probability, Seed
from teamsight.world.limits import Length

if TYPE_CHECKING:
    import pandas as pd

    from teamsight.analysis.learning.evaluation import Scenario
    from teamsight.analysis.learning.learners import Objective, Progress
    from teamsight.policies.memory import LazyMemory
    from teamsight.tasks.task import Task

# Searches of the nearest situations that take longer are announced [s].
_LONG = 30
# Steps in each world of CMOMMT.
_STEPS = 600


@dataclass(frozen=True, kw_only=True)
class EvaluateSettings(Works, Writes):
    """Options of ``teamsight learn evaluate``.

    Parameters
    ----------
    memory : Path
        Memory to learn from.
    learner : str
        What learns.
    reward : str, optional
        Reward of a transition. See docs/learning.md.
    k : int, optional
        Number k of nearest transitions that a learner uses.
    discount : float, optional
        Discount factor γ, in [0, 1].
    task : str, optional
        Task in whose worlds robots are evaluated.
    set : mapping of str to object
        A value of the scenario of a task other than cmommt; by default that of the exploration. May be given several
        times.
    robots : int, optional
        Number of robots.
    targets : int
        Number of targets.
    radius : float
        Radius of the arena, in sensing ranges.
    runs : int
        Number of worlds.
    steps : int, optional
        Number of steps in each world.
    seed : int
        Seed of the worlds, which always differ from the explored ones.
    sample : int, optional
        Number of transitions to learn from, drawn at random with --seed.
    save : Path, optional
        Write one row per policy and world to this Parquet file.
    """

    memory: Annotated[File, Allowed(metavar="MEMORY", is_argument=True)]
    learner: Learner = "regression"
    reward: Annotated[
        Reward | None, Allowed(shown="keep for regression, own for others; interaction with a task other than cmommt")
    ] = None
    k: Matches = None
    discount: Annotated[Probability | None, Allowed(shown="0.7; regression uses none")] = None
    task: Annotated[TaskName | None, Allowed(shown="that of the exploration")] = None
    set: Mapping[str, Any] = field(default_factory=dict)
    robots: Annotated[Agents | None, Allowed(shown="as many as explored")] = None
    targets: Agents = 15
    radius: Length = 3.0
    runs: Runs = 30
    steps: Annotated[Steps | None, Allowed(shown="600, or that of the task")] = None
    seed: Seed = 0
    sample: Annotated[int | None, Allowed(least=1, shown="all")] = None
    save: File | None = None

    def check(self) -> None:
        """Refuse worlds that are too large."""
        limits.check_worlds(self.robots or 1, self.targets, self.radius, self.length, self.runs)

    @property
    def length(self) -> int:
        """Number of steps in each world of CMOMMT."""
        return _STEPS if self.steps is None else self.steps


def evaluate(settings: EvaluateSettings) -> None:
    """Learn from a memory, and measure how much robots then observe.

    Compares on the same worlds: the cooperative learner, which uses all inputs; the collective learner, which uses the
    robot's own inputs of the same transitions; teams in which the force of free targets is set by hand and nothing is
    learned; A-CMOMMT; the policy 'evolved'; and a random walk. Speeds and sensing ranges are those of the exploration.
    Robots that explored another task are evaluated in its worlds, by its
    objective, beside its team with skill and the one that explores.

    \b
    Examples:
      teamsight learn evaluate memory.safetensors
      teamsight learn evaluate memory.safetensors --learner tabular \\
          --reward team --robots 10 --radius 4
      teamsight learn evaluate many.safetensors --learner lazy --sample 30000
      teamsight learn evaluate memory.safetensors --learner lazy --k 20 \\
          --discount 0.9 --runs 100 --save runs.parquet
      teamsight learn evaluate pursuit.safetensors --task pursuit \\
          --set prey=1 --runs 100
    """
    from teamsight import __version__
    from teamsight.analysis.learning import evaluation
    from teamsight.analysis.learning.learners import check_objective
    from teamsight.analysis.runs import files
    from teamsight.cli.show import working

    if settings.save:
        check_apart("save", settings.save, "memory", settings.memory)
    check = partial(check_objective, (settings.learner,), settings.reward, settings.k, discount=settings.discount)
    check()
    memory = _memory(settings)
    check(len(memory))
    task = learn_evaluate_task.task_given(settings, memory)
    about = settings.values(without=("save", "memory", "workers", "force", "task", "set"))
    about |= {"memory": memory.digest, "explored": dict(memory.settings)}
    if task is not None:
        _evaluate_task(settings, memory, task, about)
        return
    scenario = _scenario(settings, memory)
    about |= {"reward": _reward(settings), "robots": scenario.robots, "steps": scenario.steps}
    if settings.save:
        files.check_replaceable(settings.save, about, force=settings.force)
        files.prepare_folder(settings.save.parent)
    began = time.perf_counter()
    with when_stopped(lambda: "nothing was kept"):
        objective = _objective(settings)
        with learning(settings, memory, objective) as progress:
            policies = evaluation.contenders(settings.learner, memory, objective, progress)
        agent_steps = (scenario.robots + scenario.targets) * scenario.steps * scenario.runs * len(policies)
        with working(settings.workers, agent_steps) as (watch, pool):
            table = evaluation.evaluate(policies, scenario, pool, partial(watch, "simulating"))
    if settings.save:  # before anything is printed, since printing may fail
        files.write_table(settings.save, table, about | {"version": __version__}, force=settings.force)
    _print(table, settings, memory, scenario, time.perf_counter() - began)


def _evaluate_task(settings: EvaluateSettings, memory: LazyMemory, task: Task, about: dict[str, Any]) -> None:
    """Evaluate in the worlds of another task."""
    from teamsight.analysis.runs import files
    from teamsight.analysis.runs.files import check_results, write_results
    from teamsight.cli.show import say

    reward = settings.reward or (default_reward_of(settings) if settings.learner == "sheppard" else "interaction")
    scenario = learn_evaluate_task.scenario_of(settings, memory, task)
    unused = dict.fromkeys(learn_evaluate_task.OF_CMOMMT)
    about |= unused | {"task": task.name, "set": scenario, "reward": reward, "steps": settings.steps or task.steps}
    if settings.save:
        files.prepare_folder(settings.save.parent)
        check_results(settings.save.parent, [settings.save.name], about, force=settings.force)
    began = time.perf_counter()
    with when_stopped(lambda: "nothing was kept"):
        objective = _objective(settings, reward)
        progress = learning(settings, memory, objective)
        table = learn_evaluate_task.evaluated(settings, memory, task, scenario, objective, progress)
    if settings.save:
        write_results(settings.save.parent, {settings.save.name: table}, about, force=settings.force)
    say(f"{settings.learner} on {len(memory)} transitions, reward {reward}")
    learn_evaluate_task.print_result(table, settings, memory, task, scenario)
    say(f"{time.perf_counter() - began:.1f} s")
    if settings.save:
        say(f"every run in {settings.save}")


def default_reward_of(settings: EvaluateSettings) -> str:
    """Return the name of the default reward of the learner."""
    from teamsight.analysis.learning.learners import default_reward

    return default_reward(settings.learner)


def _reward(settings: EvaluateSettings) -> str:
    return settings.reward or default_reward_of(settings)


def _objective(settings: EvaluateSettings, reward: str | None = None) -> Objective:
    from teamsight.analysis.learning.learners import Objective
    from teamsight.analysis.learning.registry import REWARDS

    return Objective(REWARDS[reward or _reward(settings)], settings.k, settings.discount)


def _memory(settings: EvaluateSettings) -> LazyMemory:
    from teamsight.policies.memory import LazyMemory

    memory = LazyMemory.load(settings.memory)
    if settings.sample is None:
        return memory
    if settings.sample > len(memory):
        raise ValueError(
            f"sample={settings.sample}: the memory has only {len(memory)} transitions; give a smaller sample, or "
            "explore longer"
        )
    return memory.sample(settings.sample, settings.seed)


def _scenario(settings: EvaluateSettings, memory: LazyMemory) -> Scenario:
    """Return the worlds; team size, speeds and ranges are those of the exploration."""
    from teamsight.analysis.learning import evaluation
    from teamsight.core import checks

    explored = memory.settings.get("robots", 5)
    robots = settings.robots
    if robots is None:
        robots = checks.count("memory: robots", explored, most=limits.MOST_AGENTS)
    limits.check_worlds(robots, settings.targets, settings.radius, settings.length, settings.runs)
    evaluation.check_team(memory, robots)
    bodies = evaluation.bodies_of(memory)
    return evaluation.Scenario(
        robots, settings.targets, settings.radius, settings.runs, settings.length, settings.seed, bodies
    )


@contextlib.contextmanager
def learning(settings: EvaluateSettings, memory: LazyMemory, objective: Objective) -> Iterator[Progress]:
    """Show the progress of the learning in this context, and its warnings at the end; name what is too large."""
    from teamsight.analysis.learning.learners import search_seconds
    from teamsight.cli.show import Watch
    from teamsight.policies.eager import TooManyStatesError

    expected = search_seconds(settings.learner, memory, objective)
    try:
        with Watch() as watch, warnings.catch_warnings(record=True) as caught:
            if expected > _LONG:
                watch.emit(
                    f"learning from {len(memory)} transitions takes about {expected / 60:.0f} min, since each is "
                    "compared with all others; --sample 30000 takes seconds, and --discount 0 needs no comparison"
                )
            watch("learning", 0, 1)
            warnings.simplefilter("always")
            yield partial(watch, "learning")
            for note in dict.fromkeys(str(warning.message) for warning in caught):
                watch.emit(f"note: {note}")
    except TooManyStatesError as error:
        wrong = str(error).partition(";")[0]
        raise ValueError(
            f"learner={settings.learner}: {wrong}; give --learner regression or linear, or explore with a degree of "
            "awareness that adds fewer inputs"
        ) from error


def _print(
    table: pd.DataFrame, settings: EvaluateSettings, memory: LazyMemory, scenario: Scenario, seconds: float
) -> None:
    from teamsight.analysis.learning import evaluation
    from teamsight.analysis.learning.learners import default_of
    from teamsight.analysis.learning.provenance import differing
    from teamsight.cli.show import plural, say, wide_console

    for name, found in differing(memory).items():
        say(f"note: {name} differs between the explorations ({', '.join(map(str, found))}); the default is used here")
    discount = default_of(settings.learner, "discount") if settings.discount is None else settings.discount
    constants = f"reward {_reward(settings)}" + ("" if discount is None else f", discount {discount:g}")
    say(
        f"{settings.learner} on {plural(len(memory), 'transition')}, {constants}: "
        f"{plural(scenario.robots, 'robot')}, {plural(scenario.targets, 'target')}, R = {scenario.radius:g}, "
        f"{plural(scenario.runs, 'world')} of {plural(scenario.steps, 'step')}, "
        f"seed {scenario.seed}{_unusual(scenario)}"
    )
    wide_console().print(_summary_table(evaluation.summary(table)), highlight=False)
    say(f"{seconds:.1f} s")
    if settings.save:
        say(f"every run in {settings.save}")


def _unusual(scenario: Scenario) -> str:
    """Return the speeds and ranges of the exploration that are not the defaults."""
    from teamsight.agents.cmommt import DEFAULTS

    found = [f"{name} {value:g}" for name, value in scenario.bodies.items() if value != DEFAULTS[name]]
    return f"; as explored, {', '.join(found)}" if found else ""


def _summary_table(summary: pd.DataFrame) -> Any:
    from rich import box
    from rich.table import Table

    from teamsight.cli.show import interval

    table = Table(box=box.SIMPLE_HEAD)
    first = str(summary["policy"].iloc[0])
    table.add_column("policy")
    for name in ("observed targets", f"{first} minus this"):
        table.add_column(name, justify="right")
    for row in summary.to_dict("records"):
        more = ""
        if row["policy"] != first:
            more = f"{interval(row['more'], row['more_low'], row['more_high'], '+.1f')} points"
        # The interval of a few runs may exceed what a fraction can be; a single run has no interval.
        low = max(row["low"], 0.0) if math.isfinite(row["low"]) else row["low"]
        observed = interval(row["mean"], low, min(row["high"], 1.0), ".1f")
        table.add_row(str(row["policy"]), f"{observed} %", more)
    return table
