"""``teamsight learn explore``: a lazy memory from an exploration and from other memories."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

from teamsight.cli.errors import when_stopped
from teamsight.cli.learn_settings import ExploreSettings
from teamsight.cli.show import plural, say, watching

if TYPE_CHECKING:
    from teamsight.analysis.learning.explore import Exploration
    from teamsight.policies.memory import LazyMemory


def execute(**given: Any) -> None:
    """Explore, and write the memory."""
    settings = ExploreSettings(**given)
    from teamsight.analysis.learning import provenance
    from teamsight.analysis.learning.explore import forget_parts
    from teamsight.analysis.runs.files import check_folder, prepare_folder
    from teamsight.policies.memory import LazyMemory

    plan = plan_of(settings)
    parts = settings.out.with_name(settings.out.name + ".parts")
    if plan.is_long:
        check_folder(parts)
    sources = [LazyMemory.load(path) for path in settings.merge]
    held = _held(settings)
    prepare_folder(settings.out.parent)
    if held is not None:
        wanted = [plan.settings(), *(one for source in sources for one in provenance.explorations_of(source))]
        if all(one in provenance.explorations_of(held) for one in wanted):
            _tell(settings.out, held, "holds these pairs already: ")
            return
        if not settings.append:
            raise ValueError(
                f"out={settings.out}: holds {provenance.unlike(held, plan)}; give --append to add to it, --force to "
                "replace it, or another file"
            )
        sources.insert(0, held)
    sources = provenance.distinct(sources)
    provenance.check_alike(plan, sources)
    with when_stopped(lambda: _kept(plan, parts)):
        if not any(plan.settings() in provenance.explorations_of(source) for source in sources):
            sources.append(_explored(plan, settings.workers, parts))
        memory = sources[0].merge(*sources[1:])
        memory.save(settings.out, force=settings.force)
    if plan.is_long:
        forget_parts(plan, parts)
    _tell(settings.out, memory)
    for name, values in provenance.differing(memory).items():
        say(f"note: {name} was not the same in all explorations: {', '.join(map(str, values))}")


def plan_of(settings: ExploreSettings) -> Exploration:
    """Return the exploration that the settings ask for."""
    from teamsight.agents.awareness import AWARENESS, RingAwareness
    from teamsight.analysis.learning.explore import Exploration

    degree = AWARENESS[settings.awareness]
    return Exploration(
        robots=settings.robots,
        targets=settings.targets,
        radius=settings.radius,
        steps=settings.steps,
        runs=settings.runs,
        awareness=degree() if settings.delta is None else RingAwareness(settings.delta),
        policy=_explorer(settings),
        seed=settings.seed,
        world={"robot_speed": settings.robot_speed},
    )


def _explorer(settings: ExploreSettings) -> Any:
    from teamsight.policies.handmade.random_walk import RandomWalk

    if settings.policy == "random-walk":
        return RandomWalk(random_distance=settings.distance == "random")
    if settings.distance != "random":
        raise ValueError(
            f"distance={settings.distance}: is for random walkers, and {settings.policy} goes as far as it decides; "
            "leave it out"
        )
    return settings.policy


def _held(settings: ExploreSettings) -> LazyMemory | None:
    """Return the memory that stands where the new one goes, unless it is to be replaced; with both, it is added to."""
    from teamsight.core.files import check_place
    from teamsight.policies.memory import LazyMemory

    if settings.out.is_dir():
        raise ValueError(f"out={settings.out}: is a folder; give a file, such as {settings.out / 'pairs.safetensors'}")
    if not check_place(settings.out) or (settings.force and not settings.append):
        return None
    try:
        return LazyMemory.load(settings.out)
    except ValueError as error:
        if settings.force:
            return None
        # What is wrong with the file is told there, but the cure here is another.
        told = str(error).partition(";")[0]
        raise ValueError(f"{told}; give --force to replace it, or another file") from error


def _explored(plan: Exploration, workers: int, parts: Path) -> LazyMemory:
    from teamsight.analysis.learning.explore import explore
    from teamsight.analysis.runs.workers import WorkerPool

    with watching() as watch, WorkerPool(workers, ("teamsight.analysis.learning.explore",), watch.tell) as pool:
        return explore(
            plan,
            folder=parts if plan.is_long else None,
            pool=pool,
            progress=lambda done, total: watch("exploring", done, total),
        )


def _kept(plan: Exploration, parts: Path) -> str:
    """Tell what an interrupted exploration leaves behind."""
    from teamsight.analysis.learning.explore import forget_parts, kept_pairs

    kept = kept_pairs(plan, parts) if plan.is_long else 0
    if kept:
        return f"{kept} of {plan.pairs} pairs are kept in {parts}; the same command goes on from there"
    if plan.is_long:
        forget_parts(plan, parts)
    return "nothing was kept, since no part of the exploration was done"


def _tell(path: Path, memory: LazyMemory, before: str = "") -> None:
    size = path.stat().st_size / 1e6
    say(
        f"{path}: {before}{plural(len(memory), 'pair')}, {memory.own} + {memory.added} inputs, {size:.1f} MB, "
        f"digest {memory.digest}"
    )
