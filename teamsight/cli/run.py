"""``teamsight run``: simulate one world."""

from __future__ import annotations

import time
from pathlib import Path
from typing import TYPE_CHECKING

from teamsight.cli import limits, values
from teamsight.cli.options import Settings

if TYPE_CHECKING:
    from teamsight.agents.cmommt import CMOMMT

# Number of parts of a long run, after each of which the progress is shown.
_PARTS = 50


class RunSettings(Settings):
    """Settings of ``teamsight run``."""

    robots: int = values.agents(10, "Number of robots.")
    targets: int = values.agents(15, "Number of targets.")
    radius: float = values.length(5.0, "Radius of the arena, in sensing ranges.")
    policy: str = values.choice("a-cmommt", "Policy of the robots: {names}.", values.POLICIES)
    awareness: str = values.choice("pairwise", "Degree of awareness: {names}.", values.DEGREES)
    delta: int = values.sectors(16)
    awareness_range: float = values.length(1.0, "Distance within which two robots are neighbours, in sensing ranges.")
    cycle: float = values.period(1.0, "Steps from one decision of a robot to the next.")
    steps: int = values.steps(600, "Number of steps.")
    seed: int = values.seed(0, "Seed of the world.")
    preset: str | None = values.preset()
    save: Path | None = values.file("Write the history, one row per step, to this Parquet file.")
    force: bool = values.force()

    def check(self) -> None:
        """Refuse a number of sectors without a ring, a period longer than the run, and worlds that are too large."""
        from teamsight.agents.cycle import check_run

        limits.check_sectors(self)
        if self.cycle > 1.0:
            check_run(self.cycle, self.steps)
        limits.check_worlds(
            self.robots, self.targets, self.radius, self.steps,
            awareness_range=self.awareness_range, degrees=(self.awareness,),
        )  # fmt: skip


def run(settings: RunSettings) -> None:
    """Simulate one world and print how much its team observes.

    \b
    Examples:
      teamsight run --policy a-cmommt --robots 10 --radius 5
      teamsight run --policy centroid --awareness none --robots 30 --radius 3 --seed 7
      teamsight run --awareness ring --delta 8 --steps 2000 --save run.parquet
    """
    from teamsight import __version__
    from teamsight.agents.awareness.registry import with_option
    from teamsight.agents.cmommt import CMOMMT
    from teamsight.analysis.runs import files
    from teamsight.cli.show import Watch

    parameters = settings.values(without=("steps", "seed", "save", "force"))
    if settings.awareness not in with_option("delta"):
        del parameters["delta"]
    about = parameters | {"steps": settings.steps, "seed": settings.seed}
    world = CMOMMT(**parameters, rng=settings.seed)
    if settings.save:
        files.check_replaceable(settings.save, about, force=settings.force)
        files.prepare_folder(settings.save.parent)
    began = time.perf_counter()
    with Watch() as watch:
        part = -(-settings.steps // _PARTS)
        for start in range(0, settings.steps, part):
            world.run(min(part, settings.steps - start))
            watch("running", world.tick, settings.steps)
    taken = time.perf_counter() - began
    if settings.save:  # before anything is printed, since printing may fail
        table = world.recording.history.reset_index()
        files.write_table(settings.save, table, about | {"version": __version__}, force=settings.force)
    _print(world, settings, taken)


def _print(world: CMOMMT, settings: RunSettings, taken: float) -> None:
    from rich.table import Table

    from teamsight.cli.show import say, wide_console

    history = world.recording.history
    table = Table(show_header=False, box=None, pad_edge=False)
    table.add_row("observed targets, mean over the run", f"{100 * world.observed_fraction:.1f} %")
    table.add_row("observed targets, last step", f"{100 * history['observed'].iloc[-1]:.1f} %")
    table.add_row("neighbours of a robot, mean", f"{history['mean_neighbours'].mean():.2f}")
    table.add_row("neighbours of a robot, maximum", f"{world.max_neighbours}")
    table.add_row("time", f"{taken:.2f} s for {settings.steps} steps")
    wide_console().print(table, highlight=False)
    if settings.save:
        say(f"history in {settings.save}")
