"""``teamsight learn``: explore, evaluate, and draw learning curves."""

from __future__ import annotations

import time
from pathlib import Path
from typing import TYPE_CHECKING, Any

from teamsight.cli.learn_settings import EvaluateSettings, ExploreSettings, FigureSettings
from teamsight.cli.show import watching, wide_console

if TYPE_CHECKING:
    import pandas as pd

    from teamsight.analysis.explore import Exploration
    from teamsight.policies.lazy_memory import LazyMemory


def explore(**given: Any) -> None:
    """Explore, and write the memory."""
    settings = ExploreSettings(**given)
    from teamsight.analysis import explore as exploring
    from teamsight.analysis.crew import Crew
    from teamsight.analysis.store import prepare_folder
    from teamsight.policies.lazy_memory import LazyMemory

    plan = _exploration(settings)
    prepare_folder(settings.out.parent)
    sources = [LazyMemory.load(path) for path in settings.merge]
    held = LazyMemory.load(settings.out) if settings.out.exists() and not settings.force else None
    if held is not None:
        wanted = [plan.settings(), *(one for source in sources for one in exploring.explorations_of(source))]
        if all(one in exploring.explorations_of(held) for one in wanted):
            _tell(settings.out, held, "holds these pairs already: ")
            return
        if not settings.append:
            raise ValueError(
                f"out={settings.out}: holds {exploring.unlike(held, plan)}; give --append to add to it, --force to "
                "replace it, or another file"
            )
        sources.insert(0, held)
    sources = exploring.distinct(sources)
    parts = settings.out.with_name(settings.out.name + ".parts")
    if not any(plan.settings() in exploring.explorations_of(source) for source in sources):
        with watching() as watch, Crew(settings.workers, ("teamsight.analysis.explore",), watch.tell) as crew:
            made = exploring.explore(
                plan,
                folder=parts if plan.is_long else None,
                crew=crew,
                progress=lambda done, total: watch("exploring", done, total),
            )
        sources.append(made)
    memory = sources[0].merge(*sources[1:])
    memory.save(settings.out)
    exploring.forget_parts(parts)
    _tell(settings.out, memory)


def _exploration(settings: ExploreSettings) -> Exploration:
    from teamsight.agents.awareness import AWARENESS, RingAwareness
    from teamsight.analysis.explore import Exploration

    degree = AWARENESS[settings.awareness]
    return Exploration(
        robots=settings.robots,
        targets=settings.targets,
        radius=settings.radius,
        steps=settings.steps,
        runs=settings.runs,
        awareness=RingAwareness(settings.delta) if degree is RingAwareness else degree(),
        policy=_explorer(settings),
        seed=settings.seed,
        world={"robot_speed": settings.robot_speed},
    )


def _explorer(settings: ExploreSettings) -> Any:
    from teamsight.policies.random_walk import RandomWalk

    if settings.policy == "random-walk":
        return RandomWalk(random_distance=settings.distance == "random")
    if settings.distance != "random":
        raise ValueError(
            f"distance={settings.distance}: is for random walkers, and {settings.policy} goes as far as it decides; "
            "leave it out"
        )
    return settings.policy


def _tell(path: Path, memory: LazyMemory, before: str = "") -> None:
    size = path.stat().st_size / 1e6
    wide_console().print(
        f"{path}: {before}{len(memory)} pairs, {memory.own} + {memory.added} inputs, {size:.1f} MB, "
        f"digest {memory.digest}",
        highlight=False,
        soft_wrap=True,
    )


def evaluate(**given: Any) -> None:
    """Learn, put to the test, and print what was observed."""
    settings = EvaluateSettings(**given)
    from teamsight import __version__, checks
    from teamsight.analysis import evaluation, store
    from teamsight.analysis.crew import Crew
    from teamsight.analysis.execute import IMPORTS
    from teamsight.analysis.learners import MATCHING, REWARDS, Lesson
    from teamsight.policies.lazy_memory import LazyMemory

    if settings.k is not None and settings.learner not in MATCHING:
        raise ValueError(f"k={settings.k}: {settings.learner} matches no fixed number of pairs; leave it out")
    memory = LazyMemory.load(settings.memory)
    if settings.save:
        store.prepare_folder(settings.save.parent)
    explored = memory.settings.get("robots", 5)
    robots = settings.robots if settings.robots is not None else checks.count("robots", explored)
    stage = evaluation.Stage(robots, settings.targets, settings.radius, settings.runs, settings.steps, settings.seed)
    lesson = Lesson(REWARDS[settings.reward], settings.k, settings.gamma)
    began = time.perf_counter()
    with watching() as watch:
        watch("learning", 0, 1)
        policies = evaluation.contenders(settings.learner, memory, lesson)
        watch("learning", 1, 1)
        with Crew(settings.workers, IMPORTS, watch.tell) as crew:
            table = evaluation.evaluate(policies, stage, crew, lambda done, total: watch("simulating", done, total))
    console = wide_console()
    console.print(
        f"{settings.learner} on {len(memory)} pairs, reward {settings.reward}, gamma {settings.gamma:g}: "
        f"{robots} robots, {settings.targets} targets, R = {settings.radius:g}, {settings.runs} worlds of "
        f"{settings.steps} steps, seed {settings.seed}",
        highlight=False, soft_wrap=True,
    )  # fmt: skip
    console.print(_shown(evaluation.summary(table)), highlight=False)
    console.print(f"{time.perf_counter() - began:.1f} s", highlight=False)
    if settings.save:
        about = settings.model_dump(mode="json", exclude={"save", "memory", "workers"})
        told = about | {"memory": memory.digest, "explored": dict(memory.settings), "version": __version__}
        store.write_table(settings.save, table, told)
        console.print(f"every run in {settings.save}", highlight=False, soft_wrap=True)


def _shown(summary: pd.DataFrame) -> Any:
    from rich import box
    from rich.table import Table

    table = Table(box=box.SIMPLE_HEAD)
    first = str(summary["policy"].iloc[0])
    for name, how in (("policy", "left"), ("observed targets", "right"), (f"{first} observes more", "right")):
        table.add_column(name, justify=how)  # type: ignore[arg-type]
    for row in summary.to_dict("records"):
        more = ""
        if row["policy"] != first:
            more = f"{_interval(row['more'], row['more_low'], row['more_high'], '+.1f')} points"
        table.add_row(str(row["policy"]), f"{_interval(row['mean'], row['low'], row['high'], '.1f')} %", more)
    return table


def _interval(middle: float, low: float, high: float, how: str) -> str:
    """Write a mean and its 95 % interval in percent; one run leaves the interval unknown."""
    if low == float("-inf"):
        return f"{100 * middle:{how}}"
    return f"{100 * middle:{how}} ({100 * low:{how}} to {100 * high:{how}})"


def figure(**given: Any) -> None:
    """Make the learning curves and draw them."""
    settings = FigureSettings(**given)
    from teamsight import __version__
    from teamsight.analysis import store
    from teamsight.analysis.crew import Crew, cores
    from teamsight.analysis.execute import IMPORTS
    from teamsight.analysis.explore import forget_parts
    from teamsight.analysis.learning_curves import SAMPLES, Curves, awareness_gains, curve_points, make_curves
    from teamsight.analysis.learning_figure import draw

    folder = store.prepare_folder(settings.out)
    given_curves = settings.model_dump(exclude={"out", "workers"}) | {"samples": settings.samples or SAMPLES}
    curves = Curves(**given_curves)
    parts = folder / "learning-curves.parts"
    began = time.perf_counter()
    with watching() as watch, Crew(settings.workers or cores(), IMPORTS, watch.tell) as crew:
        table = make_curves(curves, crew, folder=parts, progress=lambda done, total: watch("learning", done, total))
    points = curve_points(table)
    about = {"curves": curves.conditions(), "version": __version__}
    store.write_table(folder / "learning-curves.parquet", table, about)
    store.write_table(folder / "learning-curves-points.parquet", points, about)
    gains = awareness_gains(table)
    store.write_table(folder / "learning-curves-gains.parquet", gains, about)
    store.write_bytes(folder / "learning-curves.png", draw(points, table, curves))
    forget_parts(parts)
    _show_gains(gains[gains["pairs"] == max(curves.samples)])
    wide_console().print(
        f"learning curves in {folder} after {time.perf_counter() - began:.0f} s", highlight=False, soft_wrap=True
    )


def _show_gains(gains: pd.DataFrame) -> None:
    from teamsight.analysis.search_space import GROWTH

    console = wide_console()
    for row in gains.to_dict("records"):
        console.print(
            f"{row['learner']}, {GROWTH[str(row['degree'])]} less Θ(0), from {row['pairs']} pairs: "
            f"{_interval(row['mean'], row['low'], row['high'], '+.1f')} points",
            highlight=False, soft_wrap=True,
        )  # fmt: skip
