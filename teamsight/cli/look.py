"""``teamsight run``, ``watch``, ``tasks`` and ``plugins``: a look at one world, and at what there is."""

from __future__ import annotations

import math
import os
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from functools import partial
from itertools import combinations, zip_longest
from pathlib import Path
from pkgutil import resolve_name
from time import perf_counter
from typing import TYPE_CHECKING, Annotated, Any

from teamsight.analysis.runs.limits import Steps
from teamsight.cli.options import File, Options, Risk, TaskName, Writes, flag
from teamsight.cli.world_settings import WorldOptions, check_sectors
from teamsight.core import checks
from teamsight.core.component import Allowed, Count, Flag

if TYPE_CHECKING:
    from teamsight.agents.world import World
    from teamsight.core.plugins import PlugIn
    from teamsight.live import LivePage

_PAGE, _POSITIONS = Allowed(section="Page"), Allowed(section="Recorded positions")
# Number of parts of a long run, after each of which the progress is shown.
_PARTS = 50
# Events that are printed; --save-events writes all.
_MOST_EVENTS = 20
# Agents × frames of a recording: a page of about 200 MB. Frames of a film: hours of drawing.
_MOST_RECORDED, _MOST_FILMED = 20_000_000, 20_000
# Longest line of the list of tasks, as that of the help.
_WIDEST = 80
# Options of `watch` for recorded positions, of which the first two are those of a world too; and for any page.
_RECORDED = ("awareness_range", "range_shape", "risk", "window", "sort")
_SERVED = ("port", "host", "token", "no_browser")
# What each group of plug-ins has of ours: the registry, or the names.
_OWN: dict[str, str | tuple[str, ...]] = {
    "teamsight.policies": "teamsight.policies.registry:POLICIES",
    "teamsight.awareness": "teamsight.agents.awareness.registry:AWARENESS",
    "teamsight.rewards": "teamsight.analysis.learning.registry:REWARDS",
    "teamsight.tasks": "teamsight.tasks.registry:TASKS",
    "teamsight.contacts": "teamsight.world.registry:CONTACTS",
    "teamsight.drives": "teamsight.world.registry:DRIVES",
    "teamsight.models": ("cmommt",),
    "teamsight.measures": ("summary", "evenness"),
}


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

        self.check_task(others=("failures", "repair", "evenness"))
        check_sectors(self)
        steps = self.length()
        agents = self.check_world(steps)
        if self.record:
            _check_record(self.record, agents, steps, self.record_every)
        else:
            self.refuse(("record_every",), "has no effect without --record; give --record FILE")
        files = [(name, place) for name in ("record", "save", "save_events") if (place := getattr(self, name))]
        for (first, one), (name, other) in combinations(files, 2):
            if os.path.abspath(one) == os.path.abspath(other):
                raise ValueError(f"{name}={other}: is the file of --{flag(first)} too; give another place for one")
        if isinstance(self.cycle, float) and self.cycle > 1.0:
            check_run(self.cycle, steps)


def _check_record(place: Path, agents: int, steps: int, every: int) -> None:
    """Refuse a file of which it is unknown what it is to be, for which a package is missing, or that is too large."""
    from teamsight.view.animation import check_video
    from teamsight.view.replay import check_ending

    try:
        if check_ending(place) == ".mp4":
            check_video()
    except ImportError as error:
        raise ValueError(f"record={place}: {error}") from error
    frames, most = steps // every, _MOST_RECORDED // agents
    if place.suffix.lower() in (".gif", ".mp4"):
        most = min(most, _MOST_FILMED)
    if frames > most:
        raise ValueError(
            f"record={place}: would have {frames:,} frames of {agents:,} agents, at most {most:,}; give "
            f"--record-every {-(-steps // max(most, 1))}, or fewer steps"
        )


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
    from teamsight.analysis.runs import files
    from teamsight.analysis.runs.files import write_results
    from teamsight.view.page import check_replaceable

    world, about = _world(settings)
    if settings.record:
        files.prepare_folder(settings.record.parent)
        check_replaceable(settings.record, force=settings.force)
    for place in filter(None, (settings.save, settings.save_events)):
        files.check_replaceable(place, about, force=settings.force)
        files.prepare_folder(place.parent)
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
    tables = {settings.save: world.recording.history.reset_index(), settings.save_events: world.events}
    for file, table in tables.items():
        if file:
            write_results(file.parent, {file.name: table}, about, force=settings.force)
    _print(world, settings, taken)


def _world(settings: RunSettings) -> tuple[World, dict[str, Any]]:
    """Return the world, and the settings that files hold: all of them, so that a file says what its run was."""
    common = {"steps": settings.length(), "seed": settings.seed}
    if settings.task:
        model, given = settings.model_of(settings.treatment, settings.seed), settings.parameters
        about = {"task": settings.task, "treatment": model.treatment, **given, **common}
        return model(rng=settings.seed, **given), about
    from teamsight.agents.cmommt import CMOMMT

    about = settings.values({*settings.world_options(), "failures", "repair"}) | common | dict(settings.brought)
    return CMOMMT(**settings.world(), events=settings.source_of_failures(), rng=settings.seed), about


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


def _print(world: World, settings: RunSettings, taken: float) -> None:
    from teamsight.cli.show import plural, say, show_table

    history = world.recording.history
    rows: dict[str, str] = {
        "observed targets, mean over the run": f"{100 * world.observed_fraction:.1f} %",
        "observed targets, last step": f"{100 * history['observed'].iloc[-1]:.1f} %",
    }
    if settings.task:
        measured = settings.task_given().measure(world)
        rows = {name.replace("_", " "): f"{value:.4g}" for name, value in measured.items()}
    if settings.evenness:
        counts = world.count_observations()
        rows["spread of the targets' observed shares"] = f"{100 * counts.spread:.1f} %"
        rows["entropy of observation, at most"] = f"{counts.entropy:.3f}, {math.log(settings.targets):.3f} nat"
        rows["robots that sense an observed target"] = f"{counts.redundancy:.2f}"
    rows["neighbours of a robot, mean"] = f"{history['mean_neighbours'].mean():.2f}"
    rows["neighbours of a robot, maximum"] = f"{world.max_neighbours}"
    rows["time"] = f"{taken:.3f} s for {world.tick} steps"
    show_table(rows.items(), left=(0, 1))
    if settings.events:
        log = world.events
        numbers = [place for place, name in enumerate(log.columns) if name in ("time", "tick", "agent")]
        if len(log):
            shown = log.head(_MOST_EVENTS).astype(object).where(log.notna(), "").itertuples(index=False)
            cells = [[f"{cell:.2f}" if isinstance(cell, float) else cell for cell in row] for row in shown]
            show_table(cells, list(log.columns), set(range(len(log.columns))).difference(numbers))
        left = f", of which the first {_MOST_EVENTS} are shown" if len(log) > _MOST_EVENTS else ""
        say(plural(len(log), "event") + left)
    for what, place in {"recording": settings.record, "history": settings.save, "events": settings.save_events}.items():
        if place:
            say(f"{what} in {place}")


@dataclass(frozen=True, kw_only=True)
class WatchSettings(WorldOptions):
    """Options of ``teamsight watch``.

    Parameters
    ----------
    model : str, optional
        A class or function of your own that builds a world. Its numbers, truth values and choices become controls.
    set : mapping of str to object
        A parameter of the task, or of the model. May be given several times.
    beside : mapping of str to object
        A parameter in which a second world differs, which runs beside the first with the same seed. May be given
        several times.
    study : Path, optional
        The folder of a study. Its runs can be shown by their ids, on the page too.
    run : str, optional
        The id of a run of the study, such as 0123456789abcdef-7, to begin with.
    rate : float
        Steps a second; the page can change it.
    every : int
        Steps from one drawn frame to the next, at least.
    paused : bool
        Wait for Run.
    port : int
        Port; 0 for any that is free.
    host : str
        Address at which to listen. Others than loopback need --token.
    token : str, optional
        A word that the address of the page must carry; an empty one ('') for a new one.
    no_browser : bool
        Do not open the page in a browser; print its address only.
    trajectories : Path, optional
        Show recorded positions of robots instead, and δ for a risk: CSV or Parquet with the columns time, robot, x, y
        and, for several recordings, run. With --awareness-range, --range-shape, --risk, --window and --sort.
    risk : float
        Of recorded positions: maximum probability that any robot has more than δ neighbours.
    window : float, optional
        Of recorded positions: duration for which the risk is stated, in the unit of the time column.
    sort : bool
        Of recorded positions: sort those whose times are out of order.
    """

    model: Annotated[str | None, Allowed(metavar="MODULE:NAME", shown="CMOMMT")] = None
    beside: Mapping[str, Any] = field(default_factory=dict)
    study: Path | None = None
    run: Annotated[str | None, Allowed(metavar="ID", shown="none")] = None
    rate: Annotated[float, _PAGE, Allowed(least=0.1, most=10_000)] = 30.0
    every: Annotated[int, _PAGE, Allowed(least=1, most=10_000)] = 1
    paused: Annotated[Flag, _PAGE] = False
    port: Annotated[int, _PAGE, Allowed(least=0, most=65_535)] = 8713
    host: Annotated[str, _PAGE] = "127.0.0.1"
    token: Annotated[str | None, _PAGE, Allowed(shown="none")] = None
    no_browser: Annotated[Flag, _PAGE] = False
    trajectories: Annotated[File | None, _POSITIONS] = None
    risk: Annotated[Risk, _POSITIONS] = 0.01
    window: Annotated[float | None, _POSITIONS, Allowed(above=0, shown="as teamsight delta")] = None
    sort: Annotated[Flag, _POSITIONS] = False

    def check(self) -> None:
        """Refuse settings that do not go together, and worlds that are too large."""
        if self.trajectories:
            self.refuse(
                self.given - {"trajectories", *_RECORDED, *_SERVED}, "has no effect on recorded positions"
            )
            return
        self.refuse(_RECORDED[2:], "is for recorded positions, and needs --trajectories")
        if self.run is not None and self.study is None:
            raise ValueError(f"run={self.run}: is an id of a study; give its folder too: --study FOLDER")
        if self.run is not None:
            taken = ("task", "model", "set", "seed", "beside", "treatment", "failures", "repair", *self.world_options())
            self.refuse(taken, "does not go with --run, which has its own settings")
        # Of a model of one's own, --set gives the parameters.
        self.check_task(("treatment",), others=("model", "failures", "repair"))
        if not self.beside:
            check_sectors(self)
        self.check_world(1)
        if self.model or self.task:
            return
        for name in self.set:
            if name in self.options():
                raise ValueError(f"set={name}=…: is an option of its own; give --{flag(name)}")
        _check_limits({name: getattr(self, name) for name in self.given & self.world_options()} | dict(self.set))
        _check_limits(self.beside)


def _check_limits(parameters: Mapping[str, Any]) -> None:
    """Refuse numbers that the page refuses too."""
    from teamsight.agents.cmommt import CMOMMT
    from teamsight.live.controls import controls_of

    for control in controls_of(CMOMMT, {}):
        value = parameters.get(control.name)
        if control.kind in ("integer", "number") and isinstance(value, (int, float)):
            try:
                control.checked(value)
            except ValueError as error:
                raise ValueError(f"{error}, as on the page; teamsight run takes others and draws nothing") from None


def watch(settings: WatchSettings) -> None:
    """Show a running world in the browser, with controls; or recorded robots, with their δ.

    \b
    Examples:
      teamsight watch
      teamsight watch --robots 30 --awareness ring --delta 8
      teamsight watch --policy a-cmommt --beside policy=centroid
      teamsight watch --failures 500 --repair 50
      teamsight watch --model my_package.my_module:MyWorld --set hives=3
      teamsight watch --task cmommt --beside treatment=explore
      teamsight watch --trajectories trajectories.csv --awareness-range 1.0
      teamsight watch --study results --run 0123456789abcdef-7
      teamsight watch --port 0 --no-browser
    """
    from teamsight.cli.show import say
    from teamsight.core import browsers

    # From the first line on Ctrl-C is the usual way to end it.
    with _served(settings) as page, suppress(KeyboardInterrupt):
        say(page.url)
        is_open = not settings.no_browser and browsers.show(page.url)
        say("open in the browser; Ctrl-C ends" if is_open else "open this address in a browser; Ctrl-C ends")
        page.wait()


def _served(settings: WatchSettings) -> LivePage:
    """Return the page of a world, or of recorded robots."""
    from teamsight.agents.cmommt import CMOMMT
    from teamsight.cli.show import Watch
    from teamsight.core import references
    from teamsight.live import watch as serve
    from teamsight.live import watch_trajectories

    address: Any = settings.values(("host", "port", "token"))
    if settings.trajectories:
        reach = settings.awareness_range if "awareness_range" in settings.given else None
        with Watch() as progress:
            return watch_trajectories(
                settings.trajectories, reach, **settings.values(_RECORDED[1:]), **address,
                browser=False, wait=False, progress=progress,
            )  # fmt: skip
    parameters = settings.parameters if settings.task else {**settings.world(), **settings.set}
    if settings.treatment is not None:
        parameters["treatment"] = settings.treatment
    if (failures := settings.source_of_failures()) is not None:
        parameters["events"] = failures
    model: Any = settings.task or CMOMMT
    if settings.model:
        references.search_in([os.getcwd()])
        model = references.load(settings.model, "model", place="start in the folder of its file")
        if not callable(model):
            raise TypeError(f"model={settings.model!r}: is {checks.shown(model)}; give a class or a function")
    # A model of one's own may have no seed.
    if not settings.model or "seed" in settings.given:
        parameters["rng" if settings.task else "seed"] = settings.seed
    row = None
    if settings.study is not None:
        row = partial(_row_of, settings.study)
        if settings.run is not None:
            model, parameters = row(settings.run)
        else:
            # A folder that is none is refused at once.
            from teamsight.analysis.studies.folder.study_folder import StudyFolder

            StudyFolder(settings.study).study  # noqa: B018
    return serve(
        model, parameters,
        beside=settings.beside or None, rate=settings.rate, every=settings.every, running=not settings.paused,
        **address, browser=False, wait=False, row=row,
    )  # fmt: skip


def _row_of(folder: Path, run: str) -> tuple[Callable[..., World], dict[str, Any]]:
    """Return the model of a run of a study, and its parameters."""
    from teamsight.analysis.studies.rerun import planned_run
    from teamsight.live.controls import seed_name

    planned = planned_run(folder, run)
    model, parameters = planned.recipe()
    return model, {**parameters, seed_name(model) or "rng": planned.seed}


@dataclass(frozen=True, kw_only=True)
class TasksSettings(Options):
    """Options of ``teamsight tasks``.

    Parameters
    ----------
    names : sequence of str
        Which tasks.
    verify : bool
        Run both teams of each task, and check that it keeps its contract.
    """

    names: Annotated[tuple[TaskName, ...], Allowed(metavar="[TASK]...", is_argument=True, is_repeated=True)] = ()
    verify: Flag = False


def tasks(settings: TasksSettings) -> None:
    """List the tasks: what each is, its objective and its scenario.

    TASK is the name of a task; by default all are listed, plug-ins too. Other commands take a task by --task, and its
    parameters by --set NAME=VALUE; see docs/tasks.

    \b
    Examples:
      teamsight tasks
      teamsight tasks cmommt --verify
    """
    from textwrap import wrap

    from teamsight.cli.exits import printable
    from teamsight.cli.show import Watch, say, wide_console
    from teamsight.tasks.check import check_task
    from teamsight.tasks.named import task_of
    from teamsight.tasks.registry import TASKS

    listed = [task_of(name) for name in settings.names or (*TASKS, *TASKS.plug_ins())]
    if settings.verify:
        with Watch() as watch:
            for done, task in enumerate(listed):
                watch("checking", done, len(listed))
                check_task(task)
        say("all keep their contracts")
    column = max(len(task.name) for task in listed) + 2
    width = max(min(wide_console().width, _WIDEST) - column, 1)
    for task in listed:
        gathers = {True: "gathers", False: "does not gather", None: "not known whether it gathers"}[task.gathers]
        about = (
            task.title, f"{task.objective.better} {task.objective.metric}; {task.steps} steps; {gathers}",
            ", ".join(f"{name}={value}" for name, value in task.scenario.items()),
        )  # fmt: skip
        # Lines are broken between words only.
        shown = [
            line
            for text in about
            for line in wrap(printable(text), width, break_long_words=False, break_on_hyphens=False)
        ]
        for name, line in zip_longest((task.name,), shown, fillvalue=""):
            say(f"{name:<{column}}{line}")


def plugins(settings: Options) -> int:
    """List the plug-ins that are installed, and whether each loads.

    A plug-in is a policy, model, sensor, reward, measure, degree of awareness or task of another distribution, which
    names it as an entry point; see docs/studies.md. The exit status is 1 if one of them does not load.
    """
    from teamsight.cli.show import plural, say, show_table
    from teamsight.core.plugins import GROUPS, plug_ins

    found = plug_ins()
    if not found:
        say(f"no plug-ins are installed; their groups of entry points are {', '.join(GROUPS)}")
        return 0
    states = [_state(one, found) for one in found]
    rows = [(*one, state or "loads") for one, state in zip(found, states, strict=True)]
    show_table(rows, ("group", "name", "object", "distribution", "state"), range(5))
    wrong = sum(bool(state) for state in states)
    say(f"{plural(len(found), 'plug-in')}, of which {wrong or 'none'} cannot be used" if wrong else "all load")
    return 1 if wrong else 0


def _state(one: PlugIn, others: Sequence[PlugIn]) -> str:
    """Return why a plug-in cannot be used; empty if it can."""
    own = _OWN.get(one.group, ())
    if one.name in tuple(resolve_name(own) if isinstance(own, str) else own):
        return f"is never used: {one.name!r} is a name of teamsight; rename the entry point"
    rivals = [other for other in others if other[:2] == one[:2] and other.reference != one.reference]
    if rivals:
        return f"{rivals[0].distribution} has one of this name too; uninstall one of them"
    try:
        one.load()
    except ValueError as error:
        return str(error).partition(" does not load: ")[2] or str(error)
    return ""
