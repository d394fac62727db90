"""``teamsight learn explore``: record transitions of exploring robots in a lazy memory."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

from teamsight.analysis.runs.limits import Runs, Steps
from teamsight.cli import limits
from teamsight.cli.errors import when_stopped
from teamsight.cli.options import Works, Writes
from teamsight.cli.values import Agents, DegreeName, Delta, File, PolicyName
from teamsight.cli.world_settings import TaskOptions
from teamsight.core.component import Allowed, Declared, Flag, Seed
from teamsight.world.limits import Length

if TYPE_CHECKING:
    from teamsight.analysis.learning.explore import Exploration
    from teamsight.analysis.runs.checkpoint import Checkpoint
    from teamsight.policies.memory import LazyMemory


@dataclass(frozen=True, kw_only=True)
class ExploreSettings(TaskOptions, Works, Writes):
    """Options of ``teamsight learn explore``.

    Parameters
    ----------
    out : Path
        Where to write the memory.
    robots : int
        Number of robots in each world.
    targets : int
        Number of targets in each world.
    radius : float
        Radius of the arena, in sensing ranges.
    steps : int
        Number of steps in each world.
    runs : int
        Number of worlds; each gives robots × steps transitions.
    awareness : str
        Degree of awareness that determines the situations.
    delta : int
        Number δ of sectors of 'ring', or of teammates of 'nearest'.
    policy : str
        Policy of the robots during the exploration.
    distance : str
        Distance that random walkers move per step, as a fraction of their speed.
    robot_speed : float
        Maximum distance that a robot moves per step, in sensing ranges.
    seed : int
        Seed of the exploration.
    merge : sequence of Path
        Add the transitions of this memory; may be repeated.
    append : bool
        Add to the transitions that FILE holds.
    """

    out: File
    robots: Agents = 5
    targets: Agents = 10
    radius: Length = 3.0
    steps: Steps = 120
    runs: Runs = 1
    awareness: DegreeName = "ring"
    delta: Delta = 16
    policy: PolicyName = "random-walk"
    distance: Literal["random", "full"] = "random"
    robot_speed: Length = 0.1
    seed: Seed = 0
    merge: Annotated[tuple[File, ...], Allowed(is_repeated=True)] = ()
    append: Flag = False

    @classmethod
    def world_options(cls) -> frozenset[str]:
        """Return the options that may be parameters of a task; the degree is that of the situations."""
        return super().world_options() - {"awareness", "delta", "policy"}

    @classmethod
    def brings(cls, arguments: Sequence[str]) -> Mapping[str, Declared]:
        """Return the options of the task; the policy and the degree of an exploration have their defaults."""
        return {name: one for name, one in super().brings(arguments).items() if "." not in name}

    def check(self) -> None:
        """Refuse options that do not fit together, and explorations that are too large."""
        limits.check_sectors(self)
        self.check_task(others=("policy", "distance"))
        robots = self.task_size() if self.task else self.robots
        degrees = (self.awareness,)
        limits.check_worlds(robots, self.targets, self.radius, self.steps, self.runs, degrees=degrees)
        limits.check_transitions(robots, self.steps, self.runs, degrees, self.delta)
        if self.policy != "random-walk":
            self.refuse(("distance",), f"applies to the policy random-walk only, and policy={self.policy}")


def explore(settings: ExploreSettings) -> None:
    """Let robots explore, and record their transitions.

    A transition is a situation, the action taken and the next situation. The random walk turns in any direction and
    moves any distance within its speed, as in the paper. A long exploration that is interrupted keeps its finished
    parts beside FILE, and the same command continues from there. A memory of other settings in FILE is replaced only
    with --force.

    \b
    Examples:
      teamsight learn explore --out memory.safetensors
      teamsight learn explore --out many.safetensors --runs 1000 --workers 2
      teamsight learn explore --out memory.safetensors --seed 1 --append
      teamsight learn explore --task cmommt --set robots=8 --out eight.safetensors
      teamsight learn explore --out shared.safetensors --awareness shared \\
          --runs 16 --robots 8
    """
    from teamsight.analysis.learning import provenance
    from teamsight.analysis.learning.explore import TRANSITIONS, forget
    from teamsight.analysis.runs.checkpoint import Checkpoint
    from teamsight.analysis.runs.files import prepare_folder
    from teamsight.cli.show import say
    from teamsight.policies.memory import LazyMemory

    plan = plan_of(settings)
    checkpoint = Checkpoint(settings.out.with_name(settings.out.name + ".checkpoint"), TRANSITIONS)
    if plan.is_long:
        checkpoint.check()
    sources = [LazyMemory.load(path) for path in settings.merge]
    held = _held(settings)
    prepare_folder(settings.out.parent)
    if held is not None:
        if _holds_all(held, plan, sources):
            _describe(settings.out, held, "already holds these transitions: ")
            return
        if not settings.append:
            raise ValueError(
                f"out={settings.out}: holds {provenance.unlike(held, plan)}; give --append to add to it, --force to "
                "replace it, or another file"
            )
        sources.insert(0, held)
    sources = provenance.distinct(sources)
    provenance.check_alike(plan, sources)
    with when_stopped(lambda: _kept(plan, checkpoint)):
        if not any(plan.settings() in provenance.explorations_of(source) for source in sources):
            sources.append(_explored(plan, settings.workers, checkpoint))
        memory = sources[0].merge(*sources[1:])
        memory.save(settings.out, force=settings.force)
    if plan.is_long:
        forget(plan, checkpoint)
    _describe(settings.out, memory)
    for name, found in provenance.differing(memory).items():
        say(f"note: {name} differs between the explorations: {', '.join(map(str, found))}")


def plan_of(settings: ExploreSettings) -> Exploration:
    """Return the exploration that the settings describe."""
    from teamsight.agents.awareness.registry import awareness_named
    from teamsight.analysis.learning.explore import Exploration
    from teamsight.policies.handmade.random_walk import RandomWalk

    awareness = awareness_named(settings.awareness, {"delta": settings.delta})
    if settings.task:
        from teamsight.analysis.learning.task_exploration import TaskExploration

        given = settings.values(("task", "steps", "runs", "seed"))
        return TaskExploration(**given, scenario=settings.parameters, awareness=awareness)
    policy: Any = settings.policy
    if policy == "random-walk":
        policy = RandomWalk(random_distance=settings.distance == "random")
    return Exploration(
        **settings.values(("robots", "targets", "radius", "steps", "runs", "seed")),
        awareness=awareness,
        policy=policy,
        world={"robot_speed": settings.robot_speed},
    )


def _holds_all(held: LazyMemory, plan: Exploration, sources: list[LazyMemory]) -> bool:
    """Return whether a memory holds the transitions of an exploration and of other memories."""
    from teamsight.analysis.learning.provenance import explorations_of

    wanted = [plan.settings(), *(one for source in sources for one in explorations_of(source))]
    return all(one in explorations_of(held) for one in wanted)


def _held(settings: ExploreSettings) -> LazyMemory | None:
    """Return the memory that the output file holds, or None if there is none or it is to be replaced."""
    from teamsight.core.files import check_place
    from teamsight.policies.memory import LazyMemory

    if settings.out.is_dir():
        raise ValueError(f"out={settings.out}: is a folder; give a file, such as {settings.out / 'memory.safetensors'}")
    if not check_place(settings.out) or (settings.force and not settings.append):
        return None
    try:
        return LazyMemory.load(settings.out)
    except ValueError as error:
        if settings.force:
            return None
        # The message says what is wrong with the file, but here the cure is another.
        wrong = str(error).partition(";")[0]
        raise ValueError(f"{wrong}; give --force to replace it, or another file") from error


def _explored(plan: Exploration, workers: int | None, checkpoint: Checkpoint) -> LazyMemory:
    from teamsight.analysis.learning.explore import explore
    from teamsight.cli.show import working

    # A short exploration is made in this process.
    with working(workers if plan.is_long else 1) as (watch, pool):
        kept = checkpoint if plan.is_long else None
        return explore(plan, pool=pool, checkpoint=kept, progress=partial(watch, "exploring"))


def _kept(plan: Exploration, checkpoint: Checkpoint) -> str:
    from teamsight.analysis.learning.explore import kept_transitions

    kept = kept_transitions(plan, checkpoint) if plan.is_long else 0
    if kept:
        place = f"{kept} of {plan.transitions} transitions are kept in {checkpoint.path}"
        return f"{place}; the same command continues from there"
    return "nothing was kept, since no part of the exploration was finished"


def _describe(path: Path, memory: LazyMemory, before: str = "") -> None:
    from teamsight.cli.show import plural, say

    size = path.stat().st_size / 1e6
    say(
        f"{path}: {before}{plural(len(memory), 'transition')}, {memory.own} + {memory.added} inputs, {size:.1f} MB, "
        f"digest {memory.digest}"
    )
