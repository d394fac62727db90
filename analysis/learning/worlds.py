"""Explore many worlds of one's own, and gather the transitions of one group in a lazy memory."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from teamsight.agents.recording.explore import explore
from teamsight.analysis.runs import limits
from teamsight.analysis.runs.processes import WorkerPool
from teamsight.analysis.runs.run import Model, Run
from teamsight.analysis.runs.seeds import run_seed
from teamsight.analysis.runs.simulate import Progress, run_all
from teamsight.core import checks
from teamsight.policies.memory import LazyMemory

if TYPE_CHECKING:
    from teamsight.agents.world import World


@dataclass(frozen=True)
class TransitionsOf:
    """Runs a world and returns the memory of a group.

    Parameters
    ----------
    group : str or None
        The name of the group; None for the first that is on a team.
    """

    group: str | None = None

    def __call__(self, world: World, steps: int) -> LazyMemory:
        """Run the world and return the memory."""
        if self.group is None:
            return explore(world, steps)
        for group in world.groups:
            if group.name == self.group:
                return explore(world, steps, group)
        known = ", ".join(repr(group.name) for group in world.groups) or "none"
        raise ValueError(f"group={checks.shown(self.group)}: the world has no such group; known are {known}")


def explore_worlds(
    model: Model,
    steps: int = 120,
    runs: int = 1,
    *,
    group: str | None = None,
    rng: int = 0,
    pool: WorkerPool | None = None,
    progress: Progress = lambda done, total: None,
) -> LazyMemory:
    """Explore several worlds and return the transitions of one group in all of them as one memory.

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
    pool : WorkerPool, optional
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
    measure = TransitionsOf(group)
    planned = [Run({}, run_seed(root, run), limits.steps(steps), measure, model) for run in range(count)]
    first, *others = run_all(planned, pool, progress=progress)
    found: LazyMemory = first.merge(*others) if others else first
    return found
