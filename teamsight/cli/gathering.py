"""``teamsight gathering``: does random exploration show how many neighbours a team with skill has?"""

from __future__ import annotations

import time
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from teamsight.analysis.runs.limits import MOST_RUNS
from teamsight.cli import limits, task_options, values
from teamsight.cli.errors import when_stopped
from teamsight.cli.options import Settings

if TYPE_CHECKING:
    from teamsight.analysis.gathering.plan import Plan

# Team sizes of one command.
_MOST_SIZES = 20
_MOST_TRAININGS, _MOST_DELTAS = 1_000, 100
_DEGREES = values.registry("teamsight.analysis.gathering.plan", "DEGREES")


class GatheringSettings(Settings):
    """Settings of ``teamsight gathering``."""

    task: tuple[str, ...] = values.choices(
        ("cmommt",), "Tasks, with commas between them: {names}.", task_options.TASKS, "task"
    )
    set: dict[str, Any] = task_options.scenario(
        "A value of the scenario of all tasks, or of one, as in forage.side=64; or, with commas between them, one for "
        "each N. May be given several times.",
        dotted=True,
    )
    sizes: tuple[int, ...] = values.counts((4, 8, 16, 30), "N, the sizes of the team.", most=_MOST_SIZES, sort=False)
    runs: int = values.count(200, "Number of runs of each team and δ.", least=2, most=MOST_RUNS)
    steps: int | None = values.steps(None, shown="that of each task")
    risk: float = values.number(
        0.05,
        "Accepted probability that any robot has more than δ neighbours during a run.",
        least=limits.LEAST_RISK,
        most=1.0,
    )
    tolerance: float = values.number(
        0.02, "By which share of the objective a δ may fall short and be enough.", least=1e-9, most=1.0
    )
    degree: str = values.choice("nearest", "Degree of awareness with δ: {names}.", _DEGREES)
    deltas: tuple[int, ...] = values.counts(
        (1, 2, 3, 4, 6, 8, 12, 16, 24, 32, 48, 64),
        "δ at which the objective is measured, beside 0, N − 1 and those of both teams.",
        most=_MOST_DELTAS,
    )
    trainings: int = values.count(1, "How often a team that learns does so anew for each δ.", most=_MOST_TRAININGS)
    seed: int = values.seed(0, "Seed of all runs.")
    out: Path = values.folder(Path("results"), "Folder for the results.")
    format: tuple[str, ...] = values.choices(
        ("png",), "Formats of the picture, with commas between them: {names}.", values.FORMATS, "format"
    )
    workers: int | None = values.workers()
    force: bool = values.force()


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
    from teamsight.cli.show import say, working

    plan = plan_of(settings)
    folder = prepare_folder(settings.out)
    check_results(plan, folder, settings.format, force=settings.force)
    began = time.perf_counter()
    with when_stopped(lambda: _kept(folder)), working(settings.workers) as (watch, pool):
        found = make_results(plan, folder, pool, watch, settings.format, force=settings.force)
    _print(found.frame)
    for line in [*cautions(found.cells), *summary(found.verdicts)]:
        say(line)
    say(f"gathering index in {folder} after {time.perf_counter() - began:.0f} s")


def plan_of(settings: GatheringSettings) -> Plan:
    """Return the plan that the settings describe."""
    from teamsight.analysis.gathering.plan import Plan

    names = ("runs", "steps", "risk", "tolerance", "degree", "deltas", "trainings", "seed")
    sizes = sorted(settings.sizes)
    listed = {name: task_options.listed(value) for name, value in settings.set.items()}
    scenario = {
        name: value[0] if len(value) == 1 else _by_size(value, settings.sizes) for name, value in listed.items()
    }  # fmt: skip
    return Plan(tasks=settings.task, sizes=sizes, scenario=scenario, **settings.values(names))


def _by_size(given: Sequence[Any], sizes: Sequence[int]) -> tuple[Any, ...]:
    """Return values, one for each size as it was given, in the order of the sizes."""
    if len(given) != len(sizes):
        return tuple(given)
    return tuple(value for _, value in sorted(zip(sizes, given, strict=True), key=lambda both: both[0]))


def _print(cells: Any) -> None:
    from rich.table import Table

    from teamsight.cli.show import wide_console

    table = Table(box=None, pad_edge=False)
    for heading in ("task", "N", "better", "δ(explore)", "δ(skilled)", "index", "saturates at", "enough at δ(explore)"):
        table.add_column(heading, justify="left" if heading == "task" else "right")
    for row in cells.itertuples():
        table.add_row(
            row.task, f"{row.size}", row.has_skill, f"{row.explore_delta}", f"{row.skilled_delta}", f"{row.ratio:.2f}",
            f"{row.saturation_delta}", row.enough_at_explore,
        )  # fmt: skip
    wide_console().print(table, highlight=False)


def _kept(folder: Path) -> str:
    from teamsight.analysis.gathering.results import checkpoint_in

    kept = checkpoint_in(folder).count()
    return f"{kept} runs are kept in {folder}; the same command continues from there" if kept else "nothing was kept"
