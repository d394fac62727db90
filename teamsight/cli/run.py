"""``teamsight run``: simulate one world."""

from __future__ import annotations

import math
import os
from dataclasses import dataclass
from itertools import combinations
from pathlib import Path
from time import perf_counter
from typing import TYPE_CHECKING, Annotated, Any

from teamsight.analysis.runs.limits import Steps
from teamsight.cli import limits
from teamsight.cli.options import Writes, flag
from teamsight.cli.values import File
from teamsight.cli.world_settings import WorldOptions
from teamsight.core.component import Allowed, Count, Flag

if TYPE_CHECKING:
    from teamsight.agents.world import World

# T where nothing else says it.
_STEPS = 600
# Number of parts of a long run, after each of which the progress is shown.
_PARTS = 50
# Events that are printed; --save-events writes all.
_MOST_EVENTS = 20


@dataclass(frozen=True, kw_only=True)
class RunSettings(WorldOptions, Writes):
    """Options of ``teamsight run``.

    Parameters
    ----------
    steps : int, optional
        Number of steps.
    evenness : bool
        Print how evenly targets are observed, and by how many robots.
    events : bool
        Print the event log: who did what when.
    save_events : Path, optional
        Write the event log, one row per event, to this Parquet file.
    record : Path, optional
        Record the run in this file: .html plays in any browser; or .gif, .mp4, .png.
    record_every : int
        Steps from one frame of the recording to the next.
    save : Path, optional
        Write the history, one row per step, to this Parquet file.
    """

    steps: Annotated[Steps | None, Allowed(shown="600, or that of the task")] = None
    evenness: Flag = False
    events: Flag = False  # type: ignore[assignment]  # those of the world are what it attaches
    save_events: File | None = None
    record: File | None = None
    record_every: Count = 1
    save: File | None = None

    def check(self) -> None:
        """Refuse settings that do not go together, and worlds that are too large."""
        from teamsight.agents.decisions import check_run

        limits.check_sectors(self)
        self.check_task(others=("failures", "repair", "evenness"))
        steps, robots, targets = self.length(), self.robots, self.targets
        if self.task:
            robots, targets = self.task_size(), 0
        limits.check_failures(self.failures, self.repair, robots * steps)
        if self.record:
            _check_record(self.record)
            limits.check_recording(self.record, robots + targets, steps, self.record_every)
        else:
            self.refuse(("record_every",), "has no effect without --record; give --record FILE")
        files = [name for name in ("record", "save", "save_events") if getattr(self, name)]
        for one, other in combinations(files, 2):
            if os.path.abspath(getattr(self, one)) == os.path.abspath(getattr(self, other)):
                raise ValueError(
                    f"{other}={getattr(self, other)}: is the file of --{flag(one)} too; give another place for one"
                )
        if isinstance(self.cycle, float) and self.cycle > 1.0:
            check_run(self.cycle, steps)
        limits.check_worlds(
            robots, targets, self.radius, steps, awareness_range=self.awareness_range, degrees=(str(self.awareness),)
        )

    def length(self) -> int:
        """Return the given number of steps, that of the task, or 600."""
        if self.steps is not None:
            return self.steps
        return self.task_given().steps if self.task else _STEPS


def run(settings: RunSettings) -> None:
    """Simulate one world and print how much its team observes, or achieves in another task.

    \b
    Examples:
      teamsight run --policy a-cmommt --robots 10 --radius 5
      teamsight run --policy centroid --awareness none --robots 30 \\
          --radius 3 --seed 7
      teamsight run --awareness ring --delta 8 --steps 2000 --save run.parquet
      teamsight run --failures 500 --repair 50 --events
      teamsight run --task cmommt --treatment explore --set robots=5
      teamsight run --record run.html
    """
    world, about = _task_world(settings) if settings.task else _cmommt(settings)
    _prepare(settings, about)
    if settings.evenness:
        world.count_observations()
    replay = None
    if settings.record:
        replay = world.record(settings.record, every=settings.record_every, force=settings.force)
    try:
        taken = _simulate(world, settings.length())
    except BaseException:
        # An interrupted command leaves no file.
        if replay is not None:
            replay.discard()
        raise
    # Before anything is printed, since printing may fail.
    if replay is not None:
        replay.stop()
    _write(world, settings, about)
    _print(world, settings, taken)


def _cmommt(settings: RunSettings) -> tuple[World, dict[str, Any]]:
    """Return CMOMMT with its own options, and the settings that files hold."""
    from teamsight.agents.cmommt import CMOMMT

    world = settings.world()
    # All of them, so that a file says what its run was.
    about = settings.values(settings.world_options()) | {"steps": settings.length()}
    about |= settings.values(("seed", "failures", "repair")) | dict(settings.brought)
    return CMOMMT(**world, events=settings.source_of_failures(), rng=settings.seed), about


def _task_world(settings: RunSettings) -> tuple[World, dict[str, Any]]:
    """Return a world of a task, and the settings that files hold."""
    model, given = settings.model_of(settings.treatment, settings.seed), settings.parameters
    about = {"task": settings.task, "treatment": model.treatment, **given}
    return model(rng=settings.seed, **given), about | {"steps": settings.length(), "seed": settings.seed}


def _simulate(world: World, steps: int) -> float:
    """Make the steps, show how many are made, and return how long that took [s], without compilation."""
    from teamsight.cli.show import Watch
    from teamsight.core.kernel.report import REPORT

    with Watch() as watch:
        # A clock that stands while kernels are compiled, or read from the cache: that happens once.
        began = perf_counter() - REPORT.taken
        part = -(-steps // _PARTS)
        for start in range(0, steps, part):
            # A task may end before; a world that has ended would warn of further steps.
            if world.running:
                world.run(min(part, steps - start))
            watch("running", world.tick, steps)
        return perf_counter() - REPORT.taken - began


def _check_record(place: Path) -> None:
    """Refuse a file of which it is unknown what it is to be, or for which a package is missing."""
    from teamsight.view.animation import check_video
    from teamsight.view.replay import check_ending

    try:
        if check_ending(place) == ".mp4":
            check_video()
    except ImportError as error:
        raise ValueError(f"record={place}: {error}") from error


def _prepare(settings: RunSettings, about: dict[str, Any]) -> None:
    """Refuse files that must not be replaced, before the work."""
    from teamsight.analysis.runs import files

    if settings.record:
        from teamsight.view.page import check_replaceable

        files.prepare_folder(settings.record.parent)
        check_replaceable(settings.record, force=settings.force)
    for place in filter(None, (settings.save, settings.save_events)):
        files.check_replaceable(place, about, force=settings.force)
        files.prepare_folder(place.parent)


def _write(world: World, settings: RunSettings, about: dict[str, Any]) -> None:
    from teamsight import __version__
    from teamsight.analysis.runs import files

    about = about | {"version": __version__}
    if settings.save:
        files.write_table(settings.save, world.recording.history.reset_index(), about, force=settings.force)
    if settings.save_events:
        files.write_table(settings.save_events, world.events, about, force=settings.force)


def _print(world: World, settings: RunSettings, taken: float) -> None:
    from rich.table import Table

    from teamsight.cli.show import say, wide_console

    history = world.recording.history
    table = Table(show_header=False, box=None, pad_edge=False)
    if settings.task:
        for name, value in settings.task_given().measure(world).items():
            table.add_row(name.replace("_", " "), f"{value:.4g}")
    else:
        table.add_row("observed targets, mean over the run", f"{100 * world.observed_fraction:.1f} %")
        table.add_row("observed targets, last step", f"{100 * history['observed'].iloc[-1]:.1f} %")
    if settings.evenness:
        counts = world.count_observations()
        table.add_row("spread of the targets' observed shares", f"{100 * counts.spread:.1f} %")
        table.add_row("entropy of observation, at most", f"{counts.entropy:.3f}, {math.log(settings.targets):.3f} nat")
        table.add_row("robots that sense an observed target", f"{counts.redundancy:.2f}")
    table.add_row("neighbours of a robot, mean", f"{history['mean_neighbours'].mean():.2f}")
    table.add_row("neighbours of a robot, maximum", f"{world.max_neighbours}")
    table.add_row("time", f"{taken:.3f} s for {world.tick} steps")
    wide_console().print(table, highlight=False)
    if settings.events:
        _print_events(world)
    if settings.record:
        say(f"recording in {settings.record}")
    if settings.save:
        say(f"history in {settings.save}")
    if settings.save_events:
        say(f"events in {settings.save_events}")


def _print_events(world: World) -> None:
    """Print the first events, one in a line, and how many there are."""
    from rich.table import Table

    from teamsight.cli.show import plural, say, wide_console

    log = world.events
    if len(log):
        table = Table(box=None, pad_edge=False)
        for name in log.columns:
            table.add_column(name, justify="right" if name in ("time", "tick", "agent") else "left", no_wrap=True)
        for row in log.head(_MOST_EVENTS).itertuples(index=False):
            table.add_row(*map(_text, row))
        wide_console().print(table, highlight=False)
    left = len(log) - _MOST_EVENTS
    say(plural(len(log), "event") + (f", of which the first {_MOST_EVENTS} are shown" if left > 0 else ""))


def _text(value: Any) -> str:
    import pandas as pd

    if pd.isna(value):
        return ""
    return f"{value:.2f}" if isinstance(value, float) else str(value)
