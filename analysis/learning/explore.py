"""Explore many worlds, and gather the transitions in one lazy memory, which knows where they come from."""

from __future__ import annotations

import contextlib
import io
import zipfile
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np

from teamsight.agents.group import Group
from teamsight.agents.recording.explore import explore as explore_world
from teamsight.agents.recording.explore import memory_of, record_run, settings_of
from teamsight.agents.recording.transitions import FACTS, Transitions
from teamsight.agents.resolve import awareness_of
from teamsight.agents.teammates import of_team
from teamsight.agents.world import World
from teamsight.analysis.learning.plans import EXPLORED, Exploring
from teamsight.analysis.runs import limits
from teamsight.analysis.runs.checkpoint import Checkpoint, Codec
from teamsight.analysis.runs.executor import Executor
from teamsight.analysis.runs.run import Model, Run, task_run, task_seed
from teamsight.analysis.runs.seeds import run_seed
from teamsight.analysis.runs.simulate import Progress, run_all
from teamsight.core import checks
from teamsight.policies.handmade.random_walk import RandomWalk
from teamsight.policies.memory import LazyMemory
from teamsight.tasks.model import TaskModel
from teamsight.tasks.named import task_of
from teamsight.tasks.task import Task

#: Speeds and ranges of bodies, as they are named in settings and in `CMOMMT`.
BODIES = ("robot_speed", "target_speed", "sensing_range", "awareness_range")

# An exploration of more transitions is worth a checkpoint: it takes more than a second.
_LONG = 300_000
# Bytes of the transitions of an exploration; sorting them takes as much again.
_MOST_BYTES = 5e9


@dataclass(frozen=True, kw_only=True)
class Exploration(Exploring):
    """An exploration of a task; by default that of the paper, 600 transitions of CMOMMT.

    Parameters
    ----------
    task : Task or str, optional
        The task, whose team that explores acts. By default it is CMOMMT in the scenario of the paper, whose robots move
        in any direction by any distance up to a full step.
    world : mapping of str to object
        Parameters of the worlds: values of the scenario, and others in place of those of the team.

    Raises
    ------
    TypeError, ValueError
        If a number is outside its limits, the task has no team that explores or no such parameter, or the transitions
        do not fit in memory. The world checks the others.

    Notes
    -----
    *Source:* §8.2: 5 robots × 120 steps among 10 targets, all acting at random. *Departs:* the paper does not give
    the arena; here its radius is 3.
    """

    task: Task | str | None = None
    world: Mapping[str, Any] = field(default_factory=dict)

    def __post_init__(self) -> None:
        super().__post_init__()
        if "awareness" in self.world:
            raise ValueError("world: has 'awareness', which determines the situations; give it as awareness")
        added = awareness_of(self.awareness).width(self.robots).added
        numbers = 2 * (16 + added + 1) + len(FACTS)
        size = 4.0 * self.transitions * numbers
        if size > _MOST_BYTES:
            raise ValueError(
                f"robots={self.robots}, steps={self.steps}, runs={self.runs}: makes {self.transitions:.1e} transitions "
                f"of {numbers} numbers, {size / 1e9:.3g} GB, at most {_MOST_BYTES / 1e9:g} GB; reduce one of them, or "
                "give a degree of awareness that adds fewer inputs"
            )

    @cached_property
    def of(self) -> Task:
        """The task."""
        return task_of(self.task or "cmommt")

    @cached_property
    def parameters(self) -> dict[str, Any]:
        """Keyword parameters of its worlds."""
        usual = {} if self.task else {**EXPLORED, "policy": RandomWalk(turn_probability=1.0, random_distance=True)}
        return TaskModel(self.of, "explore").parameters({**usual, **self.world, "awareness": self.awareness})

    @property
    def scenario(self) -> dict[str, Any]:
        """The values of the scenario of its worlds."""
        return {name: self.parameters[name] for name in self.of.scenario}

    @property
    def robots(self) -> int:
        """N, the number of robots that explore each world."""
        return checks.count(self.of.size, self.parameters[self.of.size])

    @property
    def transitions(self) -> int:
        """Number of transitions in all."""
        return self.robots * self.steps * self.runs

    @property
    def is_long(self) -> bool:
        """Whether a checkpoint is worth its file."""
        return self.runs > 1 and self.transitions > _LONG

    @cached_property
    def all_runs(self) -> list[Run]:
        """The run of each world, which returns its transitions."""
        measure = TeamTransitions(self.of.team)
        return [
            task_run(self.of, self.parameters, self.run_seed(run), self.steps, measure) for run in range(self.runs)
        ]  # fmt: skip

    @property
    def keys(self) -> list[tuple[str, ...]]:
        """The keys of the runs in a checkpoint."""
        return [run.key for run in self.all_runs]

    def model(self, run: int) -> World:
        """Return one of its worlds, before its first step."""
        return self.of.world(**self.parameters, rng=self.run_seed(run))

    def run_seed(self, run: int) -> int:
        """Return the seed of one of its worlds.

        Replicates of experiments count from 0 upwards, those of explorations from −1 downwards: no world is both
        explored and evaluated.
        """
        return task_seed(self.of, self.seed, -1 - run, self.scenario)

    def settings(self) -> dict[str, Any]:
        """Return the settings that its memory stores."""
        with contextlib.closing(self.model(0)) as model:
            found = settings_of(model, TeamTransitions(self.of.team).group(model))
        found |= {"steps": self.steps, "runs": self.runs, "seed": self.seed}
        return found | ({"task": self.of.name, "scenario": self.scenario} if self.task else {})


@dataclass(frozen=True)
class TeamTransitions:
    """Runs a world and returns the transitions of the first group of a team; of the first on any team for None."""

    team: str | None

    def __call__(self, world: World, steps: int) -> Transitions:
        """Run the world and return the transitions."""
        return record_run(world, self.group(world), steps)

    def group(self, world: World) -> Group:
        """Return the group."""
        return of_team(world.groups, self.team)[0]


def _encode(found: Transitions) -> bytes:
    arrays: dict[str, Any] = {
        "situation": found.situation, "action": found.action, "next_situation": found.next_situation,
    }  # fmt: skip
    arrays |= {f"fact {name}": values for name, values in found.facts.items()}
    buffer = io.BytesIO()
    np.savez(buffer, **arrays)
    return buffer.getvalue()


def _decode(content: bytes) -> Transitions:
    try:
        with np.load(io.BytesIO(content), allow_pickle=False) as file:
            arrays = dict(file)
        facts = {name: arrays[f"fact {name}"] for name in FACTS}
        return Transitions(arrays["situation"], arrays["action"], arrays["next_situation"], facts)
    except (OSError, ValueError, EOFError, TypeError, KeyError, zipfile.BadZipFile) as error:
        raise ValueError("not transitions") from error


#: Conversion of transitions for a checkpoint.
TRANSITIONS = Codec(_encode, _decode)


def explore(
    exploration: Exploration | None = None,
    *,
    pool: Executor | None = None,
    checkpoint: Checkpoint | None = None,
    progress: Progress = lambda done, total: None,
) -> LazyMemory:
    """Explore and return all transitions as one memory, which depends on the exploration alone.

    Parameters
    ----------
    exploration : Exploration, optional
        By default the paper's.
    pool : Executor, optional
        Processes that explore; by default this process.
    checkpoint : Checkpoint, optional
        File of the transitions of finished runs, with the codec `TRANSITIONS`.
    progress : callable
        Called with the transitions made and the transitions in all.

    Returns
    -------
    LazyMemory
    """
    plan = Exploration() if exploration is None else exploration

    def show(done: float, total: float) -> None:
        progress(round(done / total * plan.transitions), plan.transitions)

    found = run_all(plan.all_runs, pool, progress=show, checkpoint=checkpoint)
    with contextlib.closing(plan.model(0)) as model:
        return memory_of(found, TeamTransitions(plan.of.team).group(model), plan.settings())


@dataclass(frozen=True)
class _MemoryOf:
    """Runs a world and returns the memory of the group of a name; of the first that is on a team for None."""

    group: str | None = None

    def __call__(self, world: World, steps: int) -> LazyMemory:
        named = {group.name: group for group in world.groups}
        if self.group is not None and self.group not in named:
            known = ", ".join(map(repr, named)) or "none"
            raise ValueError(f"group={checks.shown(self.group)}: the world has no such group; known are {known}")
        return explore_world(world, steps, None if self.group is None else named[self.group])


def explore_worlds(
    model: Model,
    steps: int = 120,
    runs: int = 1,
    *,
    group: str | None = None,
    rng: int = 0,
    pool: Executor | None = None,
    progress: Progress = lambda done, total: None,
) -> LazyMemory:
    """Explore several worlds of one's own and return the transitions of one group in all of them as one memory.

    Parameters
    ----------
    model : callable
        A class or function that is called as ``model(rng=seed)`` and returns a `World`.
    steps : int
        Steps of each run.
    runs : int
        Number of worlds.
    group : str, optional
        The name of the group that explores; by default the first group on a team.
    rng : int
        Root seed, from which the seeds of the worlds derive.
    pool : Executor, optional
        Processes that explore; by default this process. The memory does not depend on it.
    progress : callable
        Called with the work done and the work in all.

    Returns
    -------
    LazyMemory
        Its settings are those that all worlds have in common, and under "merged" those of each.

    Raises
    ------
    TypeError, ValueError
        If a number is outside its limits.
    JobError
        If a run fails: there is no such group, or what `explore` raises. The message contains the seed.
    """
    count, root = limits.runs(runs), checks.count("rng", rng, least=0)
    planned = [Run({}, run_seed(root, run), limits.steps(steps), _MemoryOf(group), model) for run in range(count)]
    first, *others = run_all(planned, pool, progress=progress)
    found: LazyMemory = first.merge(*others) if others else first
    return found


def explorations_of(memory: LazyMemory) -> list[dict[str, Any]]:
    """Return the settings of each exploration whose transitions a memory holds."""
    found = memory.settings.get("merged")
    # A user's settings may have any form; those of another form count as one exploration.
    if isinstance(found, list) and found and all(isinstance(one, dict) for one in found):
        return found
    return [dict(memory.settings)]


def distinct(memories: Iterable[LazyMemory]) -> list[LazyMemory]:
    """Return the memories without those whose explorations are all contained in earlier memories.

    Raises
    ------
    ValueError
        If only some are: the transitions of one exploration cannot be taken out of a memory.
    """
    kept: list[LazyMemory] = []
    have: list[dict[str, Any]] = []
    for memory in memories:
        stored = explorations_of(memory)
        new = [one for one in stored if one not in have]
        if new and len(new) < len(stored):
            raise ValueError(
                f"{memory!r}: holds {len(stored)} explorations, of which {len(stored) - len(new)} are also in another "
                "memory; merge the files that it was made from"
            )
        if new:
            kept.append(memory)
            have += new
    return kept


def unlike(memory: LazyMemory, plan: Exploration) -> str:
    """Return the differences between the settings of a memory and of an exploration, for an error."""
    wanted, held = plan.settings(), memory.settings
    if "merged" in held:
        return f"{len(held['merged'])} explorations, not this one alone"
    found = [f"{name}={held.get(name)} (here {value})" for name, value in wanted.items() if held.get(name) != value]
    return f"{len(memory)} transitions of " + (", ".join(found) or "more settings")


def check_alike(plan: Exploration, memories: Iterable[LazyMemory]) -> None:
    """Raise an error if one of the memories cannot be merged with the memory of an exploration.

    Raises
    ------
    ValueError
        If one has a different degree of awareness, or other facts.
    """
    awareness = awareness_of(plan.awareness)
    width = awareness.width(plan.robots)
    for memory in memories:
        held = memory.settings.get("awareness")
        if (held, memory.own, memory.added) != (repr(awareness), width.own, width.added):
            raise ValueError(
                f"merge: a memory of {held} with {memory.own} + {memory.added} inputs, and an exploration of "
                f"{awareness!r} with {width.own} + {width.added}; explore both under the same degree of awareness"
                f"{' and with teams of one size' if held == repr(awareness) else ''}"
            )
        if memory.facts != tuple(sorted(FACTS)):
            raise ValueError(
                f"merge: a memory of the facts {memory.facts}, and an exploration of {tuple(sorted(FACTS))}; explore "
                "both with the same facts recorded"
            )


def differing(memory: LazyMemory) -> dict[str, list[Any]]:
    """Return the speeds and ranges that differ between the explorations of a memory, with their values."""
    found: dict[str, list[Any]] = {}
    for name in BODIES:
        values: list[Any] = []
        for settings in explorations_of(memory):
            if settings.get(name) not in values:
                values.append(settings.get(name))
        if len(values) > 1:
            found[name] = values
    return found
