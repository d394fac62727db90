"""``teamsight learn diagnose``: what do learners make of a single target, and why?"""

from __future__ import annotations

import time
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from teamsight.analysis.runs.limits import Runs
from teamsight.cli import limits
from teamsight.cli.errors import when_stopped
from teamsight.cli.options import Works, Writes
from teamsight.cli.values import File, Folder, Learner, Matches, Reward
from teamsight.core.component import Allowed, Count, Probability, Seed

if TYPE_CHECKING:
    import pandas as pd

    from teamsight.analysis.learning.diagnosis import Diagnosis
    from teamsight.analysis.runs.checkpoint import Checkpoint
    from teamsight.policies.memory import LazyMemory

_TABLE, _PAGE, _PICTURE = "diagnosis.parquet", "diagnosis.md", "diagnosis.png"
_SAMPLES = (600, 2400, 9600, 38400)
# Robots and steps of each explored world, as in the paper.
_ROBOTS, _STEPS = 5, 120


@dataclass(frozen=True, kw_only=True)
class DiagnoseSettings(Works, Writes):
    """Options of ``teamsight learn diagnose``.

    Parameters
    ----------
    memory : Path, optional
        Memory to diagnose.
    out : Path
        Folder for the results.
    learners : sequence of str
        Learners, separated by commas.
    samples : sequence of int
        Numbers of transitions to learn from, separated by commas.
    memories : int
        Number of explorations, if no MEMORY is given.
    reward : str
        Reward of a transition. See docs/learning.md.
    k : int, optional
        Number k of nearest transitions that a learner uses.
    discount : float
        Discount factor γ, in [0, 1].
    seed : int
        Seed of the first exploration; the others follow. Or of the samples of MEMORY.
    """

    memory: Annotated[File | None, Allowed(metavar="[MEMORY]", is_argument=True)] = None
    out: Folder = Path("results")
    learners: Annotated[tuple[Learner, ...], Allowed()] = ("lazy", "regression")
    samples: Annotated[tuple[Count, ...], Allowed(most=20, is_sorted=True)] = _SAMPLES
    memories: Runs = 24
    reward: Reward = "own"
    k: Matches = None
    discount: Probability = 0.7
    seed: Seed = 0

    def check(self) -> None:
        """Refuse options that do not fit together, and explorations that are too large."""
        if self.memory is None:
            limits.check_transitions(_ROBOTS, _STEPS, -(-max(self.samples) // (_ROBOTS * _STEPS)), ("ring",), 16)
        else:
            self.refuse(("memories",), "with MEMORY nothing is explored")


def diagnose(settings: DiagnoseSettings) -> None:
    """Show why learners do or do not learn to follow a target.

    For situations that show a single target, against its distance: the effect of the action on the reward; what eq. 1
    matches, as the lazy learners do; and whether the moves that are learned approach the target. Explores as the paper
    does, or takes samples of MEMORY. Writes diagnosis.png, diagnosis.parquet with every measurement, and diagnosis.md
    with tables. docs/lazy-q.md is about the result. An interrupted command keeps what is finished in FOLDER, and the
    same command continues from there. It takes about two minutes on two cores.

    \b
    Examples:
      teamsight learn diagnose --out diagnosis
      teamsight learn diagnose --samples 600 --reward keep \\
          --learners lazy,pessimistic,linear
      teamsight learn diagnose memory.safetensors --out diagnosis
    """
    from teamsight import __version__
    from teamsight.analysis.learning import diagnosis_figure, diagnosis_page
    from teamsight.analysis.learning.diagnosis import diagnosis_jobs, diagnosis_points
    from teamsight.analysis.learning.learners import check_objective
    from teamsight.analysis.runs import files
    from teamsight.analysis.runs.checkpoint import Checkpoint
    from teamsight.cli.show import say

    memory = None if settings.memory is None else _memory(settings.memory)
    diagnosis = diagnosis_of(settings, memory)
    given = settings.discount if "discount" in settings.given else None
    check_objective(diagnosis.learners, diagnosis.reward, diagnosis.k, min(diagnosis.samples), discount=given)
    about = diagnosis.conditions() | ({} if memory is None else {"memory": memory.digest})
    folder = files.prepare_folder(settings.out)
    files.check_replaceable(folder / _TABLE, {"diagnosis": about}, force=settings.force)
    for name in (_PAGE, _PICTURE):
        files.check_replaceable(folder / name, force=settings.force)
    checkpoint = Checkpoint(folder / "diagnosis.checkpoint")
    checkpoint.check()
    began = time.perf_counter()
    table = _table(settings, diagnosis, memory, checkpoint)
    points, conditions = diagnosis_points(table), diagnosis.in_words(memory)
    files.write_table(folder / _TABLE, table, {"diagnosis": about, "version": __version__}, force=settings.force)
    files.write_page(folder / _PAGE, diagnosis_page.page(points, conditions), force=settings.force)
    files.write_bytes(folder / _PICTURE, diagnosis_figure.draw(points, conditions), force=settings.force)
    checkpoint.forget(job.key for job in diagnosis_jobs(diagnosis))
    _show(points)
    say(f"diagnosis in {folder} after {time.perf_counter() - began:.0f} s")


def diagnosis_of(settings: DiagnoseSettings, memory: LazyMemory | None) -> Diagnosis:
    """Return the diagnosis that the settings describe; of a memory, with samples that it can give."""
    from teamsight.analysis.learning.diagnosis import Diagnosis

    chosen = settings.values(without=("memory", "out", "workers", "force"))
    if memory is not None:
        chosen["memories"] = 1
        if "samples" not in settings.given:
            chosen["samples"] = tuple(size for size in _SAMPLES if size <= len(memory)) or (len(memory),)
        elif max(settings.samples) > len(memory):
            raise ValueError(
                f"samples={max(settings.samples)}: the memory has only {len(memory)} transitions; give smaller "
                "samples, or explore longer"
            )
    return Diagnosis(**chosen)


def _memory(path: Path) -> LazyMemory:
    from teamsight.policies.memory import LazyMemory

    return LazyMemory.load(path)


def _table(
    settings: DiagnoseSettings, diagnosis: Diagnosis, memory: LazyMemory | None, checkpoint: Checkpoint
) -> pd.DataFrame:
    from teamsight.analysis.learning.diagnosis import diagnose_explorations, diagnose_memory, diagnosis_jobs
    from teamsight.cli.show import working

    if memory is not None:
        with when_stopped(lambda: "nothing was kept"):
            return diagnose_memory(diagnosis, memory)
    jobs = diagnosis_jobs(diagnosis)
    stopped = when_stopped(lambda: _kept(checkpoint.count(job.key for job in jobs), len(jobs), checkpoint))
    with stopped, working(settings.workers) as (watch, pool):
        return diagnose_explorations(diagnosis, pool, checkpoint=checkpoint, progress=partial(watch, "learning"))


def _kept(count: int, total: int, checkpoint: Checkpoint) -> str:
    if count:
        return f"{count} of {total} explorations are kept in {checkpoint.path}; the same command continues from there"
    return "nothing was kept, since no exploration was finished"


def _show(points: pd.DataFrame) -> None:
    from teamsight.analysis.learning.diagnosis_measures import DISTANCES
    from teamsight.cli.show import say

    rim = points[points["distance"] == DISTANCES[-2]]
    for row in rim[rim["quantity"] == "approach"].to_dict("records"):
        say(
            f"{row['learner']}, {row['inputs']} inputs, from {row['transitions']} transitions: approaches a target at "
            f"{row['distance']:.3f} by {row['mean']:+.2f} steps{_interval(row)}"
        )


def _interval(row: dict[Any, Any]) -> str:
    return "" if row["low"] == float("-inf") else f" ({row['low']:+.2f} to {row['high']:+.2f})"
