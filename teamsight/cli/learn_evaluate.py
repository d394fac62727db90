"""``teamsight learn evaluate``: what robots observe that learned from a memory, beside what they are measured by."""

from __future__ import annotations

import math
import time
from typing import TYPE_CHECKING, Any

from teamsight.cli.errors import when_stopped
from teamsight.cli.learn_settings import EvaluateSettings
from teamsight.cli.paths import check_apart
from teamsight.cli.show import Watch, interval, plural, say, watching, wide_console

if TYPE_CHECKING:
    import pandas as pd

    from teamsight.analysis.learning.evaluation import Contenders, Stage
    from teamsight.policies.memory import LazyMemory

# Longer searches are announced [s].
_LONG = 30


def execute(**given: Any) -> None:
    """Learn, put to the test, and print what was observed."""
    settings = EvaluateSettings(**given)
    from teamsight import __version__
    from teamsight.analysis.learning import evaluation
    from teamsight.analysis.learning.learners import check_lesson
    from teamsight.analysis.learning.provenance import differing
    from teamsight.analysis.runs import files
    from teamsight.analysis.runs.simulate import IMPORTS
    from teamsight.analysis.runs.workers import WorkerPool

    if settings.save:
        check_apart("save", settings.save, "memory", settings.memory)
    check_lesson((settings.learner,), settings.reward, settings.k)
    memory = _memory(settings)
    check_lesson((settings.learner,), settings.reward, settings.k, len(memory))
    stage = _stage(settings, memory)
    about = settings.model_dump(mode="json", exclude={"save", "memory", "workers", "force"})
    about |= {"robots": stage.robots, "memory": memory.digest, "explored": dict(memory.settings)}
    if settings.save:
        files.check_replaceable(settings.save, about, force=settings.force)
        files.prepare_folder(settings.save.parent)
    began = time.perf_counter()
    with when_stopped(lambda: "nothing was kept"), watching() as watch:
        policies = _learned(settings, memory, watch)
        with WorkerPool(settings.workers, IMPORTS, watch.tell) as pool:
            table = evaluation.evaluate(policies, stage, pool, lambda done, total: watch("simulating", done, total))
    if settings.save:  # before anything is printed, which may fail
        files.write_table(settings.save, table, about | {"version": __version__}, force=settings.force)
    for name, values in differing(memory).items():
        say(
            f"note: {name} was not the same in all explorations ({', '.join(map(str, values))}); here it is the default"
        )
    say(
        f"{settings.learner} on {plural(len(memory), 'pair')}, reward {settings.reward}, "
        f"discount {settings.discount:g}: {plural(stage.robots, 'robot')}, "
        f"{plural(stage.targets, 'target')}, R = {stage.radius:g}, "
        f"{plural(stage.runs, 'world')} of {plural(stage.steps, 'step')}, seed {stage.seed}{_unusual(stage)}"
    )
    wide_console().print(_shown(evaluation.summary(table)), highlight=False)
    say(f"{time.perf_counter() - began:.1f} s")
    if settings.save:
        say(f"every run in {settings.save}")


def _memory(settings: EvaluateSettings) -> LazyMemory:
    """Return the pairs to learn from: all that the file holds, or as many of them as were asked for."""
    from teamsight.policies.memory import LazyMemory

    memory = LazyMemory.load(settings.memory)
    if settings.sample is None:
        return memory
    if settings.sample > len(memory):
        raise ValueError(
            f"sample={settings.sample}: the memory has {len(memory)} pairs; ask for fewer, or explore for longer"
        )
    return memory.sample(settings.sample, settings.seed)


def _stage(settings: EvaluateSettings, memory: LazyMemory) -> Stage:
    """Return the worlds, in which robots are as many, as fast and as far-sighted as they were when they explored."""
    from teamsight.analysis.learning import evaluation
    from teamsight.cli import limits
    from teamsight.core import checks

    explored = memory.settings.get("robots", 5)
    robots = settings.robots
    if robots is None:
        robots = checks.count("memory: robots", explored, most=limits.MOST_AGENTS)
    limits.check_work(robots, settings.targets, settings.steps, settings.runs)
    limits.check_sightings(robots, settings.targets, settings.radius, 1.0)
    evaluation.check_team(memory, robots)
    world = evaluation.bodies_of(memory)
    return evaluation.Stage(
        robots, settings.targets, settings.radius, settings.runs, settings.steps, settings.seed, world
    )


def _learned(settings: EvaluateSettings, memory: LazyMemory, watch: Watch) -> Contenders:
    from teamsight.analysis.learning import evaluation
    from teamsight.analysis.learning.learners import REWARDS, Lesson, search_seconds
    from teamsight.policies.eager.state_grid import TooManyStatesError

    lesson = Lesson(REWARDS[settings.reward], settings.k, settings.discount)
    expected = search_seconds(settings.learner, memory, lesson)
    if expected > _LONG:
        watch.tell(
            f"learning from {len(memory)} pairs takes about {expected / 60:.0f} min, since each is compared with all "
            "others; --sample 30000 takes seconds, and --discount 0 none"
        )
    watch("learning", 0, 1)
    try:
        return evaluation.contenders(
            settings.learner, memory, lesson, lambda done, total: watch("learning", done, total)
        )
    except TooManyStatesError as error:
        told = str(error).partition(". ")[0]
        raise ValueError(
            f"learner={settings.learner}: {told}; give --learner linear or lazy, or explore with a degree of awareness "
            "that adds fewer inputs"
        ) from error


def _unusual(stage: Stage) -> str:
    """Tell in what the robots of these worlds differ from those of others, as explored."""
    from teamsight.agents.cmommt import DEFAULTS

    told = [f"{name} {value:g}" for name, value in stage.bodies.items() if value != DEFAULTS[name]]
    return f"; as explored, {', '.join(told)}" if told else ""


def _shown(summary: pd.DataFrame) -> Any:
    from rich import box
    from rich.table import Table

    table = Table(box=box.SIMPLE_HEAD)
    first = str(summary["policy"].iloc[0])
    table.add_column("policy")
    for name in ("observed targets", f"{first} less this"):
        table.add_column(name, justify="right")
    for row in summary.to_dict("records"):
        more = ""
        if row["policy"] != first:
            more = f"{interval(row['more'], row['more_low'], row['more_high'], '+.1f')} points"
        # A share is never below 0 or above 1, whatever a few runs let one believe; one run tells no interval at all.
        low = max(row["low"], 0.0) if math.isfinite(row["low"]) else row["low"]
        observed = interval(row["mean"], low, min(row["high"], 1.0), ".1f")
        table.add_row(str(row["policy"]), f"{observed} %", more)
    return table
