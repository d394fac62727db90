"""``teamsight run``: one world."""

from __future__ import annotations

import time
from typing import Any

from teamsight.cli.settings import RunSettings
from teamsight.cli.show import say, watching, wide_console

# Stretches in which a long run reports its progress.
_STRETCHES = 50


def execute(**given: Any) -> None:
    """Run the world, print what it observed, and store its history if asked to."""
    settings = RunSettings(**given)
    from rich.table import Table

    from teamsight import __version__
    from teamsight.agents.cmommt import CMOMMT
    from teamsight.analysis.runs import files

    world = settings.model_dump(exclude={"steps", "seed", "save", "force"}, exclude_none=True)
    about = world | {"steps": settings.steps, "seed": settings.seed}
    model = CMOMMT(**world, rng=settings.seed)
    if settings.save:
        files.check_replaceable(settings.save, about, force=settings.force)
        files.prepare_folder(settings.save.parent)
    began = time.perf_counter()
    with watching() as watch:
        stretch = -(-settings.steps // _STRETCHES)
        for start in range(0, settings.steps, stretch):
            model.run(min(stretch, settings.steps - start))
            watch("running", model.tick, settings.steps)
    taken = time.perf_counter() - began
    history = model.recording.history
    if settings.save:  # before anything is printed, which may fail
        told = about | {"version": __version__}
        files.write_table(settings.save, history.reset_index(), told, force=settings.force)
    table = Table(show_header=False, box=None, pad_edge=False)
    table.add_row("observed targets, mean over the run", f"{100 * model.observed_fraction:.1f} %")
    table.add_row("observed targets, last step", f"{100 * history['observed'].iloc[-1]:.1f} %")
    table.add_row("neighbours of a robot, mean", f"{history['mean_neighbours'].mean():.2f}")
    table.add_row("neighbours of a robot, largest", f"{model.max_neighbours}")
    table.add_row("time", f"{taken:.2f} s for {settings.steps} steps")
    wide_console().print(table, highlight=False)
    if settings.save:
        say(f"history in {settings.save}")
