"""Explore many worlds, in parts that are kept as they are made, and put one lazy memory together from them."""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any, NamedTuple

from teamsight.agents.awareness import Awareness, RingAwareness
from teamsight.agents.cmommt import CMOMMT
from teamsight.agents.recording.explore import meet, memory_of, settings_of
from teamsight.agents.recording.transition_kernels import FACTS
from teamsight.agents.resolve import awareness_of
from teamsight.analysis.runs import limits
from teamsight.analysis.runs.files import forget, key_of, prepare_folder
from teamsight.analysis.runs.seeds import model_seed
from teamsight.analysis.runs.workers import WorkerPool
from teamsight.core import checks
from teamsight.policies.handmade.random_walk import RandomWalk
from teamsight.policies.memory import LazyMemory

#: How robots explore unless told otherwise: any direction, any distance within their reach (§8.2).
EXPLORER = RandomWalk(turn_probability=1.0, random_distance=True)

# Numbers of all pairs of a part together: about a second's work, 300 000 pairs of 32 inputs, and 90 MB.
_NUMBERS_A_PART = 22_500_000


@dataclass(frozen=True)
class Exploration:
    """An exploration of CMOMMT: which worlds, how many of them, for how long. By default the paper's: 600 pairs.

    Parameters
    ----------
    robots, targets : int
        How many of each there are in a world.
    radius : float
        Of the arena [sensing ranges].
    steps : int
        How long each world is explored.
    runs : int
        How many worlds.
    awareness : Awareness or str
        What the situations show of teammates.
    policy : Policy or str
        What the robots do meanwhile.
    seed : int
        Of the whole exploration; it gives each world its own.
    world : mapping
        Further keyword parameters of `CMOMMT`, such as speeds.

    Raises
    ------
    TypeError, ValueError
        If a number is no whole one, too small, or makes more than a memory can hold. `CMOMMT` checks the rest.

    Notes
    -----
    *Source:* §8.2: 5 robots × 120 steps among 10 targets, all acting at random. *Departs:* the paper does not tell the
    arena; here its radius is 3.
    """

    robots: int = 5
    targets: int = 10
    radius: float = 3.0
    steps: int = 120
    runs: int = 1
    awareness: Awareness | str = field(default_factory=RingAwareness)
    policy: Any = EXPLORER
    seed: int = 0
    world: Mapping[str, Any] = field(default_factory=dict)

    def __post_init__(self) -> None:
        for name in ("robots", "targets"):
            checks.count(name, getattr(self, name))
        limits.steps(self.steps)
        limits.runs(self.runs)
        if self.pairs > limits.MOST_PAIRS:
            raise ValueError(
                f"robots={self.robots}, steps={self.steps}, runs={self.runs}: makes {self.pairs:.1e} pairs, at most "
                f"{limits.MOST_PAIRS:.0e} fit in memory; give less of one"
            )
        checks.count("seed", self.seed, least=0)

    @property
    def pairs(self) -> int:
        """How many pairs it gives."""
        return self.robots * self.steps * self.runs

    @property
    def is_long(self) -> bool:
        """Whether it is made in several parts, which can be kept when it is interrupted."""
        return len(_parts(self, None)) > 1

    def model(self, run: int) -> CMOMMT:
        """Return one of its worlds, before its first step."""
        return CMOMMT(
            robots=self.robots, targets=self.targets, radius=self.radius, awareness=self.awareness,
            policy=self.policy, rng=self.run_seed(run), **self.world,
        )  # fmt: skip

    def run_seed(self, run: int) -> int:
        """Return the seed of one of its worlds; it depends on nothing but the stage.

        Replicates of studies count from 0 up, explorations from −1 down: no world is both explored and evaluated.
        """
        return model_seed(self.seed, -1 - run, self.robots, self.targets, self.radius)

    def settings(self) -> dict[str, Any]:
        """Return what its memory tells of where it came from."""
        model = self.model(0)
        told = settings_of(model, model.robots)
        model.close()
        return told | {"steps": self.steps, "runs": self.runs, "seed": self.seed}

    @cached_property
    def key(self) -> str:
        """What the names of its parts begin with, and those of no other exploration."""
        return key_of(self.settings())


class Part(NamedTuple):
    """Some of the worlds of an exploration, from `first` to before `last`, and where what they give is kept."""

    exploration: Exploration
    first: int
    last: int
    folder: Path | None

    @property
    def file(self) -> Path | None:
        """The part's own file."""
        name = f"{self.exploration.key}-{self.first}-{self.last}.safetensors"
        return self.folder / name if self.folder else None

    def settings(self) -> dict[str, Any]:
        """Return what tells the part from all others."""
        return self.exploration.settings() | {"first_run": self.first, "last_run": self.last}


def explore(
    exploration: Exploration | None = None,
    *,
    folder: Path | None = None,
    pool: WorkerPool | None = None,
    progress: Callable[[float, float], None] = lambda done, total: None,
) -> LazyMemory:
    """Explore and return all pairs as one memory. It depends on the exploration alone, not on parts or workers.

    Parameters
    ----------
    exploration : Exploration, optional
        By default the paper's.
    folder : Path, optional
        Where to keep the parts that are done. What is found there of the same exploration is not made again.
    pool : WorkerPool, optional
        Who explores; by default this process.
    progress : callable
        Called with the pairs made and the pairs in all.

    Returns
    -------
    LazyMemory
    """
    plan = Exploration() if exploration is None else exploration
    parts = _parts(plan, prepare_folder(folder, follow=False) if folder else None)
    done = 0
    progress(done, plan.pairs)

    def count(index: int) -> None:
        nonlocal done
        done += plan.pairs * (parts[index].last - parts[index].first) // plan.runs
        progress(done, plan.pairs)

    with contextlib.ExitStack() as stack:
        found = (pool or stack.enter_context(WorkerPool(1))).map(
            _explore_part, parts, count, lambda part: f"the worlds {part.first} to {part.last - 1} of an exploration"
        )
    memories = [_kept(part) or made for part, made in zip(parts, found, strict=True)]
    return _joined([memory for memory in memories if memory is not None], plan.settings())


def kept_pairs(plan: Exploration, folder: Path) -> int:
    """Return how many pairs of an exploration are in a folder, in the parts that are done."""
    runs = sum(part.last - part.first for part in _parts(plan, folder) if part.file is not None and part.file.exists())
    return runs * plan.pairs // plan.runs


def forget_parts(plan: Exploration, folder: Path) -> None:
    """Delete the parts of an exploration from a folder, and the folder if nothing else is in it."""
    forget(folder, plan.key)


def _parts(plan: Exploration, folder: Path | None) -> list[Part]:
    numbers = 2 * (sum(awareness_of(plan.awareness).width(plan.robots)) + 1) + len(FACTS)
    runs = max(_NUMBERS_A_PART // (numbers * plan.robots * plan.steps), 1)
    return [Part(plan, first, min(first + runs, plan.runs), folder) for first in range(0, plan.runs, runs)]


def _explore_part(part: Part) -> LazyMemory | None:
    """Explore the worlds of a part; what has a file is kept there instead of being returned."""
    if _kept(part) is not None:
        return None
    plan = part.exploration
    model = plan.model(part.first)
    met = []
    for run in range(part.first, part.last):
        model.reset(plan.run_seed(run))
        met.append(meet(model, model.robots, plan.steps))
    memory = memory_of(met, model.robots, part.settings())
    model.close()
    if part.file is None:
        return memory
    # A part that cannot be read is made again.
    memory.save(part.file, force=True)
    return None


def _kept(part: Part) -> LazyMemory | None:
    """Return a part that was kept, if it is whole and of this exploration."""
    if part.file is None or not part.file.exists():
        return None
    try:
        memory = LazyMemory.load(part.file)
    except ValueError:
        return None
    return memory if dict(memory.settings) == part.settings() else None


def _joined(memories: list[LazyMemory], settings: Mapping[str, Any]) -> LazyMemory:
    whole = memories[0] if len(memories) == 1 else memories[0].merge(*memories[1:])
    return LazyMemory(whole.table, whole.own, whole.added, whole.facts, settings)
