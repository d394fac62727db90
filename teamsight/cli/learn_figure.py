"""``teamsight learn figure``: learning curves, their tables and their picture."""

from __future__ import annotations

import time
from pathlib import Path
from typing import TYPE_CHECKING, Any

from teamsight.cli.errors import when_stopped
from teamsight.cli.learn_settings import FigureSettings
from teamsight.cli.show import interval, plural, say, watching

if TYPE_CHECKING:
    import pandas as pd

    from teamsight.analysis.learning.curves import Curves

_FILES = ("learning-curves.parquet", "learning-curves-points.parquet", "learning-curves-gains.parquet")
_PICTURE = "learning-curves.png"
# What --quick sets where nothing was given.
_QUICK: dict[str, Any] = {"samples": (150, 600, 2400), "memories": 3, "worlds": 2}
_FULL: dict[str, Any] = {"memories": 10, "worlds": 4}


def execute(**given: Any) -> None:
    """Make the learning curves and draw them."""
    settings = FigureSettings(**given)
    from teamsight import __version__
    from teamsight.analysis.learning.curve_figure import draw
    from teamsight.analysis.learning.curve_points import awareness_gains, curve_points
    from teamsight.analysis.learning.curves import forget_lectures, make_curves
    from teamsight.analysis.learning.learners import check_lesson
    from teamsight.analysis.runs import files
    from teamsight.analysis.runs.simulate import IMPORTS
    from teamsight.analysis.runs.workers import WorkerPool, cores

    curves = curves_of(settings)
    check_lesson(curves.learners, curves.reward, curves.k, min(curves.samples))
    folder = files.prepare_folder(settings.out)
    about = {"curves": curves.conditions()}
    for name in _FILES:
        files.check_replaceable(folder / name, about, force=settings.force)
    # The picture tells no settings; they are those of the tables beside it.
    files.check_replaceable(folder / _PICTURE, force=settings.force)
    parts = folder / "learning-curves.parts"
    files.check_folder(parts)
    began = time.perf_counter()
    with when_stopped(lambda: _kept(curves, parts)):
        with watching() as watch, WorkerPool(settings.workers or cores(), IMPORTS, watch.tell) as pool:
            table = make_curves(curves, pool, folder=parts, progress=lambda done, total: watch("learning", done, total))
        points, gains = curve_points(table), awareness_gains(table)
        for name, found in zip(_FILES, (table, points, gains), strict=True):
            files.write_table(folder / name, found, about | {"version": __version__}, force=settings.force)
        files.write_bytes(folder / _PICTURE, draw(points, table, curves), force=settings.force)
    forget_lectures(curves, parts)
    _show_gains(gains[gains["pairs"] == max(curves.samples)])
    say(f"learning curves in {folder} after {time.perf_counter() - began:.0f} s")


def curves_of(settings: FigureSettings) -> Curves:
    """Return the curves that the settings ask for."""
    from teamsight.analysis.learning.curves import Curves

    given: dict[str, Any] = settings.model_dump(exclude={"out", "workers", "force", "quick"})
    left_open = _QUICK if settings.quick else _FULL
    chosen = {name: left_open.get(name) if value is None else value for name, value in given.items()}
    return Curves(**{name: value for name, value in chosen.items() if value is not None})


def _kept(curves: Curves, parts: Path) -> str:
    """Tell what interrupted curves leave behind."""
    from teamsight.analysis.learning.curves import forget_lectures, kept_lectures

    kept, total = kept_lectures(curves, parts)
    if kept:
        return f"{kept} of {plural(total, 'part')} are kept in {parts}; the same command goes on from there"
    forget_lectures(curves, parts)
    return "nothing was kept, since no part of the curves was done"


def _show_gains(gains: pd.DataFrame) -> None:
    from teamsight.agents.awareness import AWARENESS

    for row in gains.to_dict("records"):
        say(
            f"{row['learner']}, {AWARENESS[str(row['degree'])].order} less Θ(0), from {plural(row['pairs'], 'pair')}: "
            f"{interval(row['mean'], row['low'], row['high'], '+.1f')} points"
        )
