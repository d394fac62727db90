"""Explore many worlds, and gather the transitions of all robots in one lazy memory."""

from __future__ import annotations

import contextlib
import io
import zipfile
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np

from teamsight.agents.awareness import Awareness, RingAwareness
from teamsight.agents.cmommt import CMOMMT
from teamsight.agents.group import Group
from teamsight.agents.recording.explore import memory_of, record_run, settings_of
from teamsight.agents.recording.transitions import FACTS, Transitions
from teamsight.agents.world import World
from teamsight.analysis.runs import limits
from teamsight.analysis.runs.checkpoint import Checkpoint, Codec
from teamsight.analysis.runs.processes import WorkerPool
from teamsight.analysis.runs.run import Run
from teamsight.analysis.runs.seeds import model_seed
from teamsight.analysis.runs.simulate import Progress, run_all
from teamsight.core.component import Component, Count, Index
from teamsight.policies.handmade.random_walk import RandomWalk
from teamsight.policies.memory import LazyMemory
from teamsight.world.limits import Length

#: Default policy of an exploration: any direction, any distance up to a full step (§8.2).
EXPLORER = RandomWalk(turn_probability=1.0, random_distance=True)

# An exploration of more transitions is worth a checkpoint: it takes more than a second.
_LONG = 300_000


@dataclass(frozen=True)
class Exploration(Component):
    """An exploration of CMOMMT; by default that of the paper, 600 transitions.

    Parameters
    ----------
    robots, targets : int
        Numbers of each in a world.
    radius : float
        Radius of the arena [sensing ranges].
    steps : int
        Steps of each run.
    runs : int
        Number of worlds.
    awareness : Awareness or str
        Degree of awareness, which determines the situations.
    policy : Policy or str
        Policy of the robots while they explore.
    seed : int
        Root seed, from which the seeds of the worlds derive.
    world : mapping
        Further keyword parameters of `CMOMMT`, such as speeds.

    Raises
    ------
    TypeError, ValueError
        If a number is not whole, too small, or makes more transitions than a memory can hold. `CMOMMT` checks the
        others.

    Notes
    -----
    *Source:* §8.2: 5 robots × 120 steps among 10 targets, all acting at random. *Departs:* the paper does not give
    the arena; here its radius is 3.
    """

    robots: Count = 5
    targets: Count = 10
    radius: Length = 3.0
    steps: limits.Steps = 120
    runs: limits.Runs = 1
    awareness: Awareness | str = field(default_factory=RingAwareness)
    policy: Any = EXPLORER
    seed: Index = 0
    world: Mapping[str, Any] = field(default_factory=dict)

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.transitions > limits.MOST_TRANSITIONS:
            raise ValueError(
                f"robots={self.robots}, steps={self.steps}, runs={self.runs}: makes {self.transitions:.1e} "
                f"transitions, at most {limits.MOST_TRANSITIONS:.0e} fit in memory; reduce one of them"
            )

    @property
    def transitions(self) -> int:
        """Number of transitions in all."""
        return self.robots * self.steps * self.runs

    @property
    def is_long(self) -> bool:
        """Whether a checkpoint is worth its file."""
        return self.runs > 1 and self.transitions > _LONG

    @property
    def parameters(self) -> dict[str, Any]:
        """Keyword parameters of its worlds."""
        own = {name: getattr(self, name) for name in ("robots", "targets", "radius", "awareness", "policy")}
        return own | dict(self.world)

    @cached_property
    def all_runs(self) -> list[Run]:
        """The run of each world, which returns its transitions."""
        parameters = self.parameters
        return [Run(parameters, self.run_seed(run), self.steps, transitions) for run in range(self.runs)]

    def model(self, run: int) -> World:
        """Return one of its worlds, before its first step."""
        return CMOMMT(**self.parameters, rng=self.run_seed(run))

    def group_of(self, world: World) -> Group:
        """Return the group of one of its worlds whose transitions are recorded."""
        return robots_of(world)

    def run_seed(self, run: int) -> int:
        """Return the seed of one of its worlds.

        Replicates of experiments count from 0 upwards, those of explorations from −1 downwards: no world is both
        explored and evaluated.
        """
        return model_seed(self.seed, -1 - run, self.robots, self.targets, self.radius)

    def settings(self) -> dict[str, Any]:
        """Return the settings that its memory stores."""
        with contextlib.closing(self.model(0)) as model:
            own = {"steps": self.steps, "runs": self.runs, "seed": self.seed}
            return settings_of(model, self.group_of(model)) | own


def transitions(world: World, steps: int) -> Transitions:
    """Run a world and return the transitions of its robots."""
    return record_run(world, robots_of(world), steps)


def robots_of(world: World) -> Group:
    """Return the robots of a `CMOMMT`."""
    assert isinstance(world, CMOMMT)
    return world.robots


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
        facts = {name.removeprefix("fact "): array for name, array in arrays.items() if name.startswith("fact ")}
        if not set(FACTS) <= facts.keys():
            raise KeyError("fact")
        return Transitions(arrays["situation"], arrays["action"], arrays["next_situation"], facts)
    except (OSError, ValueError, EOFError, TypeError, KeyError, zipfile.BadZipFile) as error:
        raise ValueError("not transitions") from error


#: Conversion of transitions for a checkpoint.
TRANSITIONS = Codec(_encode, _decode)


def explore(
    exploration: Exploration | None = None,
    *,
    pool: WorkerPool | None = None,
    checkpoint: Checkpoint | None = None,
    progress: Progress = lambda done, total: None,
) -> LazyMemory:
    """Explore and return all transitions as one memory, which depends on the exploration alone.

    Parameters
    ----------
    exploration : Exploration, optional
        By default the paper's. That of a task is a `TaskExploration`.
    pool : WorkerPool, optional
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
        return memory_of(found, plan.group_of(model), plan.settings())


def kept_transitions(plan: Exploration, checkpoint: Checkpoint) -> int:
    """Return how many transitions of an exploration a checkpoint holds."""
    return checkpoint.count(run.key for run in plan.all_runs) * plan.robots * plan.steps


def forget(plan: Exploration, checkpoint: Checkpoint) -> None:
    """Delete the transitions of an exploration from a checkpoint, and the file if nothing else is in it."""
    checkpoint.forget(run.key for run in plan.all_runs)
