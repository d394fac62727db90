"""Studies: ``teamsight sweep``, ``status``, ``plot``, ``rerun``, ``verify``, ``submit`` and ``schema``."""

from __future__ import annotations

import json
import shlex
import sys
import time
import traceback
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import click

from teamsight.analysis.runs.limits import Runs, Steps
from teamsight.analysis.studies.slurm import MOST_TASKS, USUAL_TASKS, JobArray, JobOptions
from teamsight.cli.options import WORKERS, File, Folder, Options, Shard, StudyFile, StudyFolder, Works, Writes, names_in
from teamsight.cli.world_settings import TaskOptions, listed
from teamsight.core.component import Allowed, Declared, Flag, Seed

if TYPE_CHECKING:
    from teamsight.analysis.studies.folder.study_folder import Verification
    from teamsight.analysis.studies.rerun import PlannedRun
    from teamsight.analysis.studies.standing import Status
    from teamsight.analysis.studies.study import Study
    from teamsight.analysis.studies.sweep import SweepSummary

# Seconds from one line of progress to the next where there is no terminal, as in the log of a cluster's job.
_PERIOD = 30.0
_OF_TASK = ("set", "replicates", "steps", "seed")
_NOT_TO_WARM_UP = ("engine", "scheduler", "workers", "on_error", "shard", "wait", "mixed_code", "retry_failed")
# How many damaged parts, failed runs and ids are printed.
_FEW, _FEW_IDS = 5, 20


@dataclass(frozen=True, kw_only=True)
class SweepSettings(TaskOptions, Works):
    """Options of ``teamsight sweep``.

    Parameters
    ----------
    study : Path, optional
        The study file.
    task : str, optional
        A study of this task in place of STUDY, or module:TASK.
    set : mapping of str to object
        A parameter of the task, or treatment; several values, with commas between them, are combined with the others.
        Those of the task's scenario are options of their own too.
    replicates : int
        Runs of each setting of a task.
    steps : int, optional
        Number of steps of each run of a task.
    seed : int
        Root seed of the runs of a task.
    out : Path
        Folder of the study; created if it does not exist.
    on_error : {"continue", "stop"}
        What to do after a run that fails.
    shard : (int, int), optional
        Make part i of n parts only, as in 1/8: for a job array.
    wait : bool
        Wait until another sweep of the folder has ended.
    mixed_code : bool
        Go on although runs in the folder were made by other code.
    retry_failed : bool
        Make the runs again that have failed.
    warm_up : bool
        Compile what the runs need and keep it, and make none: before a job array.
    """

    study: Annotated[StudyFile | None, Allowed(metavar="[STUDY]")] = None
    replicates: Runs = 1
    steps: Annotated[Steps | None, Allowed(shown="that of the task")] = None
    seed: Seed = 0
    out: Folder
    workers: Annotated[int | None, WORKERS, Allowed(shown="number of cores; 1 for a short study")] = None
    on_error: Literal["continue", "stop"] = "continue"
    shard: Shard = None
    wait: Flag = False
    mixed_code: Flag = False
    retry_failed: Flag = False
    warm_up: Flag = False

    @classmethod
    def brings(cls, arguments: Sequence[str]) -> Mapping[str, Declared]:
        """Return the options of the task that is named, each of which takes several values."""
        return {
            name: Declared(name, "list", (), replace(one.allowed, least=None, most=None), one.meaning, item=one)
            for name, one in super().brings(arguments).items()
        }

    def check(self) -> None:
        """Refuse a study and a task together, and what makes runs where none are made."""
        if (self.study is None) == (self.task is None):
            given = "both are given" if self.task else "is missing"
            raise ValueError(f"STUDY: {given}; give a study file, or --task NAME")
        self.check_task(_OF_TASK, components=True)
        if self.warm_up and (other := [name for name in _NOT_TO_WARM_UP if name in self.given]):
            raise ValueError(f"warm_up=True: makes no runs, so it does not go with {', '.join(other)}; leave one out")


def sweep(settings: SweepSettings) -> int:
    """Make the runs of a study that are missing in its folder, and only those.

    STUDY is a study file; see docs/studies.md. After Ctrl-C, a crash or a power cut the same command continues. With
    more replicates or settings in the file, it adds those. A run that fails becomes a row with its error, and is not
    made again unless --retry-failed is given; then the exit status is 1. With --task, no file is needed.

    \b
    Examples:
      teamsight sweep study.toml --out results
      teamsight sweep study.toml --out results --workers 8 --on-error stop
      teamsight sweep --task cmommt --robots 4,8,16 \\
          --set treatment=explore,skilled --replicates 20 --out results
      teamsight sweep study.toml --out results \\
          --engine dask --scheduler tcp://10.0.0.1:8786
    """
    from teamsight.analysis.studies.folder import study_folder
    from teamsight.analysis.studies.study import Study
    from teamsight.analysis.studies.sweep import sweep as make
    from teamsight.analysis.studies.sweep import warm_up_study
    from teamsight.cli.show import Watch, kept_in, plural, say, when_stopped
    from teamsight.core.status_line import seconds

    study, out = Study.from_file(settings.study) if settings.study else _of_task(settings), settings.out
    said, runs = time.monotonic(), 0
    if settings.warm_up:
        with when_stopped(lambda: "no run was made; the same command goes on with what is not compiled"):
            kinds = warm_up_study(study)
        say(f"compiled for {plural(kinds, 'kind')} of runs in {time.monotonic() - said:.0f} s")
        return 0

    def show(done: int, total: int, seconds_left: float | None) -> None:
        nonlocal said, runs
        runs = total
        watch("runs", done, total)
        if watch.disable and time.monotonic() > said + _PERIOD:
            said = time.monotonic()
            left = "" if seconds_left is None else f", {seconds(seconds_left)} left"
            watch.emit(f"{done} of {total} runs{left}")

    def kept() -> str:
        """Return what the folder has, which may be more than was reported."""
        folder = study_folder.StudyFolder(out)
        count = folder.done().size + folder.failed().size if runs else 0
        return kept_in(out, count and f"{count} of {runs}")

    with when_stopped(kept), Watch() as watch, settings.executor() as executor:
        summary = make(
            study, out, executor=executor, progress=show, emit=watch.emit,
            **settings.values(("workers", "on_error", "shard", "wait", "mixed_code", "retry_failed")),
        )  # fmt: skip
    return _show(settings, summary)


def _of_task(settings: SweepSettings) -> Study:
    """Return the study of a task: parameters with several values are its axes."""
    from teamsight.analysis.studies.definition.model import TASK_PREFIX
    from teamsight.analysis.studies.study import Study
    from teamsight.core.references import is_reference

    of_components = {name: value for name, value in settings.brought.items() if "." in name}
    several = {name: listed(value) for name, value in {**settings.parameters, **of_components}.items()}
    study = Study(
        # Where the module of a task of one's own is.
        path=Path.cwd() if is_reference(settings.task) else None,
        model=f"{TASK_PREFIX}{settings.task}",
        fixed={name: value[0] for name, value in several.items() if len(value) == 1},
        axes={name: value for name, value in several.items() if len(value) > 1},
        replicates=settings.replicates,
        steps=settings.steps or settings.task_given().steps,
        seed=settings.seed,
    )
    study.check()
    return study


def _show(settings: SweepSettings, summary: SweepSummary) -> int:
    """Print what was made, and return the exit status."""
    from teamsight.cli.show import plural, say

    out = shlex.quote(str(settings.out))
    counts = [f"{summary.done} done"]
    counts += [f"{count} {what}" for what in ("failed", "missing") if (count := getattr(summary, what))]
    of = f" of shard {settings.shard[0]}/{settings.shard[1]}" if settings.shard else ""
    if summary.missing and summary.errors and settings.on_error == "stop":
        say("stopped after a run that failed, as --on-error stop says; the same command goes on with the others")
    say(
        f"{plural(summary.made, 'run')} made in {summary.seconds:.0f} s; {settings.out} has {', '.join(counts)} of "
        f"{plural(summary.planned, 'run')}{of}"
    )
    # The first one was printed when it failed.
    for run, error in summary.errors[1:]:
        say(f"run {run} failed: {error}")
    if summary.errors and (more := summary.failed - len(summary.errors)) > 0:
        say(f"and {more} more: teamsight status {out} --failed")
    for note in filter(None, (summary.wide, summary.not_finite)):
        say(note)
    command = f"plot {out} --out figure.png"
    if summary.failed or summary.missing:
        command = f"rerun {out} {summary.errors[0][0]}" if summary.errors else f"status {out}"
    say(f"next: teamsight {command}")
    return 1 if summary.failed else 0


@dataclass(frozen=True, kw_only=True)
class StatusSettings(Options):
    """Options of ``teamsight status``.

    Parameters
    ----------
    folder : Path
        The folder of the study.
    failed : bool
        List all failed runs, with their seeds and errors.
    json : bool
        Print JSON.
    """

    folder: StudyFolder
    failed: Flag = False
    json: Flag = False


def status(settings: StatusSettings) -> None:
    """Show how many runs of a study are done, running, failed and missing, and the time left.

    DIR is the folder of a study, which another process may be filling; nothing is written. The exit status is 0 also
    if runs are missing or have failed.

    \b
    Examples:
      teamsight status results
      teamsight status results --failed
      teamsight status results --json
    """
    from teamsight.analysis.studies.folder import study_folder
    from teamsight.analysis.studies.standing import status as find
    from teamsight.cli.show import plural, say, show_table
    from teamsight.core.status_line import seconds

    folder = settings.folder
    place, found = study_folder.StudyFolder(folder), find(folder)
    manifest = place.manifest
    failures: list[dict[str, Any]] = []
    if found.failed:
        failures = place.read("failed", ["run", "seed", "error"], skip_damaged=True).to_pylist()
        failures.sort(key=lambda row: str(row["run"]))
    if settings.json:
        # A line that is broken would be no JSON.
        click.echo(json.dumps(_as_json(place, found, failures)))
        return
    name = f"{manifest.study['name']!r} " if manifest.study["name"] else ""
    so_far = " so far, as many as the intervals need" if manifest.study["until"] else ""
    say(f"study {name}in {folder}: {found.planned:,} runs of {manifest.study['model']}{so_far}")
    rows = []
    for what in ("done", "failed", "missing"):
        count = getattr(found, what)
        running = f"of which {found.running:,} running" if found.running and what == "missing" else ""
        rows.append((what, f"{count:,}", _share(count, found.planned), running))
    show_table(rows, left=(0, 3))
    for note in _notes(place, found):
        say(note)
    if not found.sweeps:
        to_do = f"no sweep is running; to continue: teamsight sweep STUDY --out {folder}"
        say(to_do if found.missing else "no sweep is running, and nothing is left to do")
    for each in found.sweeps:
        how = each.progress
        say(f"running: {each.holder}" + (f" ({how.engine}, {plural(how.workers, 'worker')})" if how else ""))
    if found.sweeps and found.rate and found.seconds_left is not None:
        say(f"{found.rate:.3g} runs per second, {seconds(found.seconds_left)} left")
    for part in found.damaged[:_FEW]:
        say(f"damaged: {part.kind}/{part.name} {part.reason}")
    if found.damaged:
        say(f"to set damaged parts aside and repeat their runs: teamsight verify {folder}")
    shown = failures if settings.failed else failures[:_FEW]
    for row in shown:
        say(f"failed: run {row['run']}, seed {row['seed']}: {row['error']}")
    if len(failures) > len(shown):
        say(f"and {len(failures) - len(shown):,} more; --failed lists all")
    if failures:
        say(f"to repeat one alone: teamsight rerun {folder} {failures[0]['run']}")
    versions, commit = manifest.versions, manifest.commits.get("teamsight", {}).get("commit", "")
    mixed = "; runs of several versions of the code" if manifest.earlier else ""
    say(
        f"made with teamsight {versions.get('teamsight')}{f' ({commit[:12]})' if commit else ''}, Python "
        f"{versions.get('python')}; begun {manifest.created}, last changed {manifest.changed}{mixed}"
    )


def _notes(place: Any, found: Status) -> Iterator[str]:
    """Yield what there is to say of the intervals of a study, and of measures that are not finite."""
    from teamsight.analysis.studies.standing import not_finite_note, wide_note

    study = place.study
    yield from filter(None, (wide_note(found.wide, study.settings, study.until), not_finite_note(found.not_finite)))


def _share(count: int, planned: int) -> str:
    """Return a share in percent; 100 % only if that is exact, and so 0 %."""
    share = 100 * count / planned if planned else 0.0
    text = f"{share:.1f} %"
    if text == "100.0 %" and count < planned:
        return "99.9 %"
    return "0.1 %" if text == "0.0 %" and count else text


def _as_json(place: Any, found: Status, failures: list[dict[str, Any]]) -> dict[str, object]:
    manifest = place.manifest
    counts = {name: getattr(found, name) for name in ("planned", "done", "failed", "missing", "running")}
    sweeps = [
        each.holder._asdict() | (each.progress._asdict() if each.progress else {}) for each in found.sweeps
    ]  # fmt: skip
    about = {name: getattr(manifest, name) for name in ("code", "versions", "commits", "machine", "created", "changed")}
    return {
        "folder": str(place.path), "name": manifest.study["name"], **counts, "rate": found.rate,
        "seconds_left": found.seconds_left, "sweeps": sweeps, "damaged": [each._asdict() for each in found.damaged],
        "failures": failures, "wide": found.wide, "not_finite": found.not_finite, **about,
    }  # fmt: skip


def _chosen(texts: tuple[str, ...]) -> dict[str, str]:
    """Return axes and their values, which were given as NAME=VALUE."""
    found: dict[str, str] = {}
    for text in texts:
        axis, sign, value = text.partition("=")
        if not sign or not axis or not value:
            raise ValueError(f"where={text}: must be NAME=VALUE, as in policy=a-cmommt")
        if axis in found:
            raise ValueError(f"where={text}: {axis} is given twice; leave one out")
        found[axis] = value
    return found


@dataclass(frozen=True, kw_only=True)
class PlotSettings(Writes):
    """Options of ``teamsight plot``.

    Parameters
    ----------
    folder : Path
        The folder of the study.
    out : Path, optional
        The picture, a PNG, SVG or PDF by its suffix.
    kind : str
        Kind of picture.
    measure : str, optional
        What is drawn.
    x : str, optional
        Axis along the horizontal direction.
    y : str, optional
        Axis along the vertical direction, or of which each value is a line.
    where : mapping of str to str
        Draw only settings with this value of an axis; may be repeated.
    minus : Path, optional
        Subtract this study, run by run, where both have the same noise.
    across : sequence of str
        With --minus: subtract runs although this parameter differs, or the 'model'; may be repeated.
    """

    folder: Annotated[Folder, Allowed(is_argument=True)]
    out: Annotated[File | None, Allowed(shown="name of the folder, with .png, in the current folder")] = None
    kind: Annotated[str, names_in("teamsight.analysis.studies.figures:KINDS")] = "auto"
    measure: Annotated[str | None, Allowed(metavar="NAME", shown="the first measure")] = None
    x: Annotated[str | None, Allowed(metavar="NAME", shown="the first that suits")] = None
    y: Annotated[str | None, Allowed(metavar="NAME", shown="the next")] = None
    where: Annotated[Mapping[str, str], Allowed(parse=_chosen)] = field(default_factory=dict)
    minus: Annotated[Folder | None, Allowed(shown="nothing")] = None
    across: Annotated[tuple[str, ...], Allowed(metavar="NAME", is_repeated=True)] = ()

    def check(self) -> None:
        """Refuse what only a difference has."""
        if self.minus is None:
            self.refuse(("across",), "has no effect without --minus")


def plot(settings: PlotSettings) -> None:
    """Draw a study, or a table of runs: a heat map with intervals, lines, distributions or points.

    FOLDER is that of a study, or a Parquet file that teamsight reproduce wrote, such as results/pursuit.parquet.
    Further axes become panels. A study that is not complete is drawn and marked as partial. The difference of two
    studies is that of their runs under the same noise, so that its intervals are narrow; it needs studies of the same
    seed, steps and model. A parameter that one of them varies and that has another value in the other is refused,
    unless --where chooses a value or --across names it, as for a baseline.

    \b
    Examples:
      teamsight plot study --out study.png
      teamsight plot study --kind lines --x robots --y policy --where radius=3
      teamsight plot aware --minus unaware --out gain.svg
      teamsight plot policies --minus random --across policy --out gains.svg
    """
    from teamsight.analysis.studies.figures.draw import check_picture
    from teamsight.analysis.studies.results import open_study
    from teamsight.cli.show import say

    out = settings.out or Path(f"{settings.folder.resolve().name or 'study'}.png")
    check_picture(out, force=settings.force)
    results = open_study(settings.folder)
    results.plot(out, **settings.values(without=("folder", "out")))
    say(f"{out}: {results.warning or f'all {len(results.frame):,} runs'}")


@dataclass(frozen=True, kw_only=True)
class RerunSettings(Options):
    """Options of ``teamsight rerun``.

    Parameters
    ----------
    folder : Path
        The folder of the study.
    run : str
        The id of the run.
    pdb : bool
        Open the debugger where the run fails.
    """

    folder: StudyFolder
    run: Annotated[str, Allowed(metavar="RUN_ID", is_argument=True)]
    pdb: Flag = False


def rerun(settings: RerunSettings) -> int:
    """Repeat one run of a study in this process, and compare it with what is stored.

    Prints what was measured. The exit status is 1 if the run fails or differs from what is stored. With --pdb, Python's
    debugger opens where the run fails. The table of a study, and teamsight status, show the ids of runs.

    \b
    Examples:
      teamsight rerun results 0123456789abcdef-7
      teamsight rerun results 0123456789abcdef-7 --pdb
    """
    from teamsight.analysis.studies.rerun import planned_run
    from teamsight.cli.show import say

    planned = planned_run(settings.folder, settings.run)
    values_of = ", ".join(f"{name}={value}" for name, value in planned.parameters.items())
    say(f"run {planned.run}: {values_of}, steps={planned.study.steps}, rng={planned.seed}")
    for name in planned.changed:
        say(f"note: {name} has changed since the sweep")
    try:
        found = planned.make()
    except Exception as error:
        return _show_failure(planned, error, settings)
    stored = found.stored or {}
    if found.error is not None:
        say(f"it failed in the sweep: {found.error}")
    elif found.stored is None:
        say("nothing is stored of this run")
    else:
        say("differs from what is stored" if found.differing else "the same as what is stored, to the last bit")
    for name, value in found.measures.items():
        say(f"{name} = {value!r}" + (f"   stored: {stored.get(name)!r}" if name in found.differing else ""))
    for name in found.differing:
        if name not in found.measures:
            say(f"{name} is stored as {stored[name]!r} and was not measured now")
    return 1 if found.differing else 0


def _show_failure(planned: PlannedRun, error: Exception, settings: RerunSettings) -> int:
    from teamsight.analysis.studies.shard import failure_of
    from teamsight.cli.show import say

    traceback.print_exception(error)
    if settings.pdb:
        import pdb

        pdb.post_mortem(error.__traceback__)
        return 1
    text = failure_of(error).error
    stored = "is done in the folder" if planned.stored is not None else "is missing in the folder"
    if planned.error is not None:
        stored = "as it did in the sweep" if planned.error == text else f"in the sweep it failed with: {planned.error}"
    say(f"failed: {text}; {stored}")
    sys.stdout.flush()
    say(f"next: teamsight rerun {shlex.quote(str(settings.folder))} {planned.run} --pdb")
    return 1


@dataclass(frozen=True, kw_only=True)
class VerifySettings(Works):
    """Options of ``teamsight verify``.

    Parameters
    ----------
    folder : Path
        The folder of the study.
    dry_run : bool
        Change nothing: only say what is damaged.
    no_rerun : bool
        Set damaged parts aside, but do not repeat their runs.
    mixed_code : bool
        Repeat runs although the others were made by other code.
    """

    folder: StudyFolder
    dry_run: Flag = False
    no_rerun: Flag = False
    mixed_code: Flag = False

    def check(self) -> None:
        """Refuse options of repeating runs where none are repeated."""
        if self.dry_run or self.no_rerun:
            option = "--dry-run" if self.dry_run else "--no-rerun"
            self.refuse(("workers", "engine", "mixed_code"), f"{option} repeats no runs")


def verify(settings: VerifySettings) -> int:
    """Find damaged parts of a study, set them aside, and repeat their runs.

    Reads every part in DIR, the folder of a study, and compares it with the digest in its name and with the study. What
    is damaged or belongs to another study is moved to DIR/damaged together with the other parts of its shard; nothing
    is deleted. Their runs are made again, and no others. The exit status is 0 if all parts are whole, otherwise 1.

    \b
    Examples:
      teamsight verify results --dry-run
      teamsight verify results
      teamsight verify results --no-rerun
    """
    from teamsight.analysis.studies.folder.study_folder import verify as examine
    from teamsight.cli.show import plural, say

    found = examine(settings.folder, repair=not settings.dry_run)
    for each in found.damaged:
        say(f"damaged: {each.kind}/{each.name} {each.reason}")
    for name in found.foreign[:_FEW_IDS]:
        say(f"{name}: is no part of this study; move it away, because other programs read all of the folder")
    if not found.damaged:
        say(f"{plural(found.parts, 'part')} in {settings.folder}: all whole")
        return 0
    say(f"{plural(found.parts, 'part')} in {settings.folder}: {len(found.damaged)} damaged")
    if found.runs:
        more = f" and {len(found.runs) - _FEW_IDS} more" if len(found.runs) > _FEW_IDS else ""
        say(f"runs in them: {', '.join(found.runs[:_FEW_IDS])}{more}")
    if found.unnamed:
        say(f"shards whose runs are not all known: {found.unnamed}")
    if settings.dry_run:
        say(f"nothing was changed; to set them aside and repeat their runs: teamsight verify {settings.folder}")
    else:
        say(f"{plural(len(found.aside), 'part')} set aside in {settings.folder / 'damaged'}")
        _repeat(settings, found)
    return 1


def _repeat(settings: VerifySettings, found: Verification) -> None:
    """Make the runs of the damaged parts again, as far as it is known which they are."""
    from teamsight.analysis.runs.processes import cores
    from teamsight.analysis.studies.folder.study_folder import StudyFolder, runs_to_repeat
    from teamsight.analysis.studies.sweep import sweep as make
    from teamsight.cli.show import Watch, plural, say, when_stopped

    rest = f"teamsight sweep STUDY --out {settings.folder}"
    lost = runs_to_repeat(settings.folder, found)
    if settings.no_rerun or (lost is not None and not lost.size):
        say(f"to make the missing runs: {rest}")
        return
    with when_stopped(lambda: f"to make the missing runs: {rest}"), Watch() as watch, settings.executor() as executor:
        made = make(
            StudyFolder(settings.folder).study, settings.folder, workers=settings.workers or cores(), only=lost,
            mixed_code=settings.mixed_code, progress=lambda done, total, left: watch("runs", done, total),
            emit=watch.emit, executor=executor,
        )  # fmt: skip
    say(f"{plural(made.made, 'run')} made again")
    if found.unnamed and lost is not None:
        say(f"others may be missing; to make all that are: {rest}")


@dataclass(frozen=True, kw_only=True)
class SubmitSettings(JobOptions, Writes):
    """Options of ``teamsight submit``.

    Parameters
    ----------
    study : Path
        The study file.
    out : Path
        Folder of the study, which all machines of the cluster see.
    slurm : bool
        For a SLURM cluster, the only kind so far.
    most_tasks : int
        Most tasks of an array that the cluster allows, its MaxArraySize less 1.
    output : Path, optional
        Folder for what the tasks print.
    script : Path, optional
        Where to write the script.
    dry_run : bool
        Print the script and write nothing.
    submit : bool
        Run the script, which calls sbatch.
    """

    study: StudyFile
    out: Folder
    output: Annotated[Folder | None, Allowed(shown="OUT-log")] = None
    slurm: Flag = False
    most_tasks: Annotated[int, Allowed(least=1, most=MOST_TASKS)] = USUAL_TASKS
    script: Annotated[File | None, Allowed(shown="STUDY.sbatch in this folder")] = None
    dry_run: Flag = False
    submit: Flag = False

    def check(self) -> None:
        """Refuse options that do not go together."""
        if not self.slurm:
            raise ValueError("slurm=False: say for which cluster; give --slurm, the only kind so far")
        if self.tasks > self.most_tasks:
            raise ValueError(
                f"tasks={self.tasks}: are more than the {self.most_tasks} of most_tasks; give fewer with more --cpus, "
                "or --most-tasks if the cluster allows more"
            )
        if self.dry_run:
            self.refuse(("submit",), "does not go with --dry-run, which writes nothing")


def submit(settings: SubmitSettings) -> None:
    """Write a script by which a cluster makes the runs of a study, and print how to submit it.

    STUDY is a study file; see docs/studies.md. The script submits a SLURM job array. Each of its tasks makes one shard
    of the runs and writes it to the folder of the study, and may be repeated at any time: it makes what is missing.
    Task 0 comes first: it compiles the kernels, which are kept for all machines that share the home folder.

    \b
    Examples:
      teamsight submit study.toml --out results --slurm --tasks 32 --time 02:00:00
      teamsight submit study.toml --out results --slurm --cpus 8 \\
          --setup "module load python" --submit
      teamsight submit study.toml --out results --slurm --dry-run
    """
    from teamsight.analysis.studies import slurm
    from teamsight.analysis.studies.study import Study
    from teamsight.cli.show import plural, say

    array = settings.part(JobArray)
    study = Study.from_file(settings.study)
    study.check()
    plan = study.plan()
    # An adaptive study is divided by settings, another by runs.
    most, things = (plan.runs, "run") if study.until is None else (plan.settings, "setting")
    if settings.tasks > most and "tasks" in settings.given:
        raise ValueError(f"tasks={settings.tasks}: are more than the {plural(most, things)} of the study; give fewer")
    array = replace(array, tasks=min(array.tasks, most))
    if settings.dry_run:
        print(array.script(), end="")
        return
    path = settings.script or Path(f"{settings.study.stem}.sbatch")
    slurm.write_script(path, array, force=settings.force)
    say(f"{path}: {plural(plan.runs, 'run')} in {plural(array.tasks, 'task')}")
    say(slurm.submit(path) if settings.submit else f"next: {slurm.command(path)}")
    say(f"then: teamsight status {shlex.quote(str(settings.out))}")


def schema(settings: Options) -> None:
    """Print the JSON Schema of study files, by which an editor completes and checks them.

    It has all keys with what they mean. An editor uses it for a study file whose first line is "#:schema FILE".

    \b
    Example:
      teamsight schema > study.schema.json
    """
    from importlib.resources import files

    # As it ships: making it anew would import the model.
    place = files("teamsight.analysis.studies.definition").joinpath("study.schema.json")
    click.echo(place.read_text(encoding="utf-8"), nl=False)
