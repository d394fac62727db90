"""``teamsight gathering``: does random exploration show how many neighbours a team with skill has?"""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from teamsight.analysis.gathering.plan import DEGREES, DELTAS, SIZES
from teamsight.analysis.runs.limits import MOST_RUNS, Steps
from teamsight.cli.options import Folder, Format, Risk, TaskName, Works, Writes
from teamsight.cli.world_settings import listed
from teamsight.core.component import Allowed, Count, Seed

if TYPE_CHECKING:
    from teamsight.analysis.gathering.plan import Plan

@dataclass(frozen=True, kw_only=True)
class GatheringSettings(Works, Writes):
    """Options of ``teamsight gathering``.

    Parameters
    ----------
    task : sequence of str
        Tasks, with commas between them.
    set : mapping of str to object
        A value of the scenario of all tasks, or of one, as in forage.side=64; or, with commas between them, one for
        each N. May be given several times.
    sizes : sequence of int
        N, the sizes of the team.
    runs : int
        Number of runs of each team and δ.
    steps : int, optional
        Number of steps of each run.
    risk : float
        Accepted probability that any robot has more than δ neighbours during a run.
    tolerance : float
        By which share of the objective a δ may fall short and be enough.
    degree : str
        Degree of awareness with δ.
    deltas : sequence of int
        δ at which the objective is measured, beside 0, N − 1 and those of both teams.
    trainings : int
        How often a team that learns does so anew for each δ.
    seed : int
        Seed of all runs.
    out : Path
        Folder for the results.
    format : sequence of str
        Formats of the picture, with commas between them.
    """

    task: Annotated[tuple[TaskName, ...], Allowed()] = ("cmommt",)
    set: Mapping[str, Any] = field(default_factory=dict)
    sizes: Annotated[tuple[Count, ...], Allowed(most=20)] = SIZES
    runs: Annotated[int, Allowed(least=2, most=MOST_RUNS)] = 200
    steps: Annotated[Steps | None, Allowed(shown="that of each task")] = None
    risk: Risk = 0.05
    tolerance: Annotated[float, Allowed(least=1e-9, most=1)] = 0.02
    degree: Annotated[str, Allowed(choices=DEGREES)] = "nearest"
    deltas: Annotated[tuple[Count, ...], Allowed(most=100, is_sorted=True)] = DELTAS
    trainings: Annotated[int, Allowed(least=1, most=1_000)] = 1
    seed: Seed = 0
    out: Folder = Path("results")
    format: Annotated[tuple[Format, ...], Allowed()] = ("png",)


def gathering(settings: GatheringSettings) -> None:
    """Compare δ by exploration with δ of a team with skill, for any task.

    For each task and team size N: δ by random exploration, δ of the team with skill, their ratio (the gathering index),
    and where the objective saturates against δ. Judges whether exploration may be trusted (claims G1 to G4). Writes a
    page, a picture, a table of all runs with their seeds, and one of the index. docs/tasks/gathering.md is about the
    result. After an interruption the same command continues from there.

    \b
    Examples:
      teamsight gathering --task cmommt --out gathering
      teamsight gathering --task cmommt --sizes 4,8 --set radius=3 --runs 100
    """
    from teamsight.analysis.gathering.page import cautions, summary
    from teamsight.analysis.gathering.results import check_results, make_results
    from teamsight.analysis.runs.files import prepare_folder
    from teamsight.cli.show import say, show_table, working

    plan = plan_of(settings)
    folder = prepare_folder(settings.out)
    check_results(plan, folder, settings.format, force=settings.force)
    began = time.perf_counter()
    with working(settings.workers, lambda: _kept(folder)) as (watch, pool):
        found = make_results(plan, folder, pool, watch, settings.format, force=settings.force)
    rows = [
        (
            row.task, row.size, row.has_skill, row.explore_delta, row.skilled_delta, f"{row.ratio:.2f}",
            row.saturation_delta, row.enough_at_explore,
        )
        for row in found.frame.itertuples()
    ]  # fmt: skip
    show_table(
        rows, ("task", "N", "better", "δ(explore)", "δ(skilled)", "index", "saturates at", "enough at δ(explore)")
    )
    for line in [*cautions(found.cells), *summary(found.verdicts)]:
        say(line)
    say(f"gathering index in {folder} after {time.perf_counter() - began:.0f} s")


def plan_of(settings: GatheringSettings) -> Plan:
    """Return the plan that the settings describe."""
    from teamsight.analysis.gathering.plan import Plan

    names = ("runs", "steps", "risk", "tolerance", "degree", "deltas", "trainings", "seed")
    sizes = sorted(settings.sizes)
    several = {name: listed(value) for name, value in settings.set.items()}
    scenario = {
        name: value[0] if len(value) == 1 else _by_size(value, settings.sizes) for name, value in several.items()
    }  # fmt: skip
    return Plan(tasks=settings.task, sizes=sizes, scenario=scenario, **settings.values(names))


def _by_size(given: Sequence[Any], sizes: Sequence[int]) -> tuple[Any, ...]:
    """Return values, one for each size as it was given, in the order of the sizes."""
    if len(given) != len(sizes):
        return tuple(given)
    return tuple(value for _, value in sorted(zip(sizes, given, strict=True), key=lambda both: both[0]))


def _kept(folder: Path) -> str:
    from teamsight.analysis.gathering.results import checkpoint_in
    from teamsight.cli.show import kept_in

    return kept_in(folder, checkpoint_in(folder).count())
