"""``teamsight learn figure``: learning curves, their tables and their figure."""

from __future__ import annotations

import time
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from teamsight.cli import limits, values
from teamsight.cli.errors import when_stopped
from teamsight.cli.options import Option, Settings
from teamsight.core import checks

if TYPE_CHECKING:
    import pandas as pd

    from teamsight.analysis.learning.curves import Curves
    from teamsight.analysis.runs.checkpoint import Checkpoint

_FILES = ("learning-curves.parquet", "learning-curves-points.parquet", "learning-curves-gains.parquet")
_PICTURE = "learning-curves.png"
# What --quick sets where the option is not given.
_QUICK: dict[str, Any] = {"samples": (150, 600, 2400), "memories": 3, "worlds": 2}
# Numbers of samples of one figure.
_MOST_SAMPLES = 100
# Rows of the table of tests.
_MOST_ROWS = 2e6
# Steps of each explored world, as in the paper.
_EXPLORED_STEPS = 120


def _samples(name: str, text: str) -> tuple[int, ...]:
    found = set()
    for part in text.split(","):
        try:
            found.add(checks.count(name, values.number_in(part)))
        except TypeError:
            raise ValueError(f"{name}={checks.shown(text)}: must be whole numbers, as in 150,600") from None
    if len(found) > _MOST_SAMPLES:
        raise ValueError(f"{name}: are {len(found)} numbers, at most {_MOST_SAMPLES}; leave some out")
    return tuple(sorted(found))


class FigureSettings(Settings):
    """Settings of ``teamsight learn figure``."""

    out: Path = values.folder(Path("results"), "Folder for the results.")
    learners: tuple[str, ...] = values.choices(
        ("lazy", "tabular", "linear"), "Learners, separated by commas: {names}.", values.LEARNERS, "learner"
    )
    samples: tuple[int, ...] = Option(
        _samples, (150, 300, 600, 1200, 2400, 4800, 9600, 19200, 38400),
        "Numbers of transitions to learn from, separated by commas.", "NUMBERS",
        "150,300,600,… doubled up to 38400",
    )  # type: ignore[assignment]  # fmt: skip
    memories: int = values.runs(10, "Number of explorations over which each curve is averaged.")
    worlds: int = values.runs(4, "Number of worlds in which each learner is tested, for each exploration.")
    reward: str = values.reward("own")
    k: int | None = values.matches()
    discount: float = values.discount(0.7)
    robots: int = values.agents(5, "Number of robots, when exploring and when tested.")
    targets: int = values.agents(15, "Number of targets.")
    radius: float = values.length(3.0, "Radius of the arena, in sensing ranges.")
    steps: int = values.steps(600, "Number of steps of each test.")
    seed: int = values.seed(0, "Seed of all explorations and tests.")
    workers: int | None = values.workers()
    quick: bool = values.flag("Use --samples 150,600,2400 --memories 3 --worlds 2 where these are not given.")
    force: bool = values.flag("Replace curves of other settings, and files that teamsight did not write.")

    def check(self) -> None:
        """Set what ``--quick`` sets, and refuse curves that are too much work."""
        if self.quick:
            for name, value in _QUICK.items():
                if name not in self.given:
                    setattr(self, name, value)
        explored = -(-max(self.samples) // (self.robots * _EXPLORED_STEPS))
        degrees = tuple(values.DEGREES())
        limits.check_transitions(self.robots, _EXPLORED_STEPS, explored, degrees, 16)
        tests = float(self.memories) * self.worlds * (len(degrees) * len(self.learners) * len(self.samples) + 2)
        if tests > _MOST_ROWS:
            raise ValueError(
                f"memories={self.memories}, worlds={self.worlds}, {len(self.samples)} samples: makes {tests:.1e} rows, "
                f"at most {_MOST_ROWS:g}; reduce one of them"
            )
        limits.check_worlds(self.robots, self.targets, self.radius, self.steps, int(tests), degrees=degrees)


def figure(settings: FigureSettings) -> None:
    """Draw learning curves: each learner under each degree of awareness.

    Each learner learns from equal numbers of transitions under every degree. Writes learning-curves.png and three
    tables: every test, the points of the curves, and the gain from awareness. An interrupted command keeps what is
    finished in FOLDER, and the same command continues from there. It takes about four minutes on two cores; with
    --quick, seconds. Figure 11 of the paper is `teamsight reproduce 11`.

    \b
    Examples:
      teamsight learn figure
      teamsight learn figure --quick --out quick
      teamsight learn figure --learners lazy,pessimistic,linear --reward team --robots 8
    """
    from teamsight import __version__
    from teamsight.analysis.learning.curve_figure import draw
    from teamsight.analysis.learning.curve_points import awareness_gains, curve_points
    from teamsight.analysis.learning.curves import curve_jobs, make_curves
    from teamsight.analysis.learning.learners import check_objective
    from teamsight.analysis.runs import files
    from teamsight.analysis.runs.checkpoint import Checkpoint
    from teamsight.cli.show import say, working

    curves = curves_of(settings)
    check_objective(curves.learners, curves.reward, curves.k, min(curves.samples))
    folder = files.prepare_folder(settings.out)
    about = {"curves": curves.conditions()}
    for name in _FILES:
        files.check_replaceable(folder / name, about, force=settings.force)
    # The figure has no settings; they are those of the tables beside it.
    files.check_replaceable(folder / _PICTURE, force=settings.force)
    checkpoint = Checkpoint(folder / "learning-curves.checkpoint")
    checkpoint.check()
    began = time.perf_counter()
    with when_stopped(lambda: _kept(curves, checkpoint)):
        with working(settings.workers) as (watch, pool):
            table = make_curves(curves, pool, checkpoint=checkpoint, progress=partial(watch, "learning"))
        points, gains = curve_points(table), awareness_gains(table)
        for name, found in zip(_FILES, (table, points, gains), strict=True):
            files.write_table(folder / name, found, about | {"version": __version__}, force=settings.force)
        files.write_bytes(folder / _PICTURE, draw(points, table, curves), force=settings.force)
    checkpoint.forget(job.key for job in curve_jobs(curves))
    _show_gains(gains[gains["transitions"] == max(curves.samples)])
    say(f"learning curves in {folder} after {time.perf_counter() - began:.0f} s")


def curves_of(settings: FigureSettings) -> Curves:
    """Return the curves that the settings describe."""
    from teamsight.analysis.learning.curves import Curves

    return Curves(**settings.values(without=("out", "workers", "force", "quick")))


def _kept(curves: Curves, checkpoint: Checkpoint) -> str:
    from teamsight.analysis.learning.curves import curve_jobs
    from teamsight.cli.show import plural

    jobs = curve_jobs(curves)
    if kept := checkpoint.count(job.key for job in jobs):
        place = f"{kept} of {plural(len(jobs), 'part')} are kept in {checkpoint.path}"
        return f"{place}; the same command continues from there"
    return "nothing was kept, since no part of the curves was finished"


def _show_gains(gains: pd.DataFrame) -> None:
    from teamsight.agents.awareness import AWARENESS
    from teamsight.cli.show import interval, plural, say

    for row in gains.to_dict("records"):
        order = AWARENESS[str(row["degree"])].order
        say(
            f"{row['learner']}, {order} minus Θ(0), from {plural(row['transitions'], 'transition')}: "
            f"{interval(row['mean'], row['low'], row['high'], '+.1f')} points"
        )
