"""``teamsight sweep``: make the runs of a study that are missing in its folder."""

from __future__ import annotations

import contextlib
import shlex
import time
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

from teamsight.analysis.runs.limits import Runs, Steps
from teamsight.cli.errors import when_stopped
from teamsight.cli.options import WORKERS, Works
from teamsight.cli.values import File, Folder, Shard, StudyFile
from teamsight.cli.world_settings import TaskOptions, listed
from teamsight.core.component import Allowed, Declared, Flag, Seed

if TYPE_CHECKING:
    from teamsight.analysis.runs.executor import Executor
    from teamsight.analysis.studies.study import Study
    from teamsight.analysis.studies.sweep import SweepSummary

# Seconds from one line of progress to the next where there is no terminal, as in the log of a cluster's job.
_PERIOD = 30.0
_OF_TASK = ("set", "replicates", "steps", "seed")
_NOT_TO_WARM_UP = ("engine", "scheduler", "workers", "on_error", "shard", "wait", "mixed_code", "retry_failed")
_OF_DASK = ("scheduler", "tls_ca", "tls_cert", "tls_key")


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
    replicates : int
        Runs of each setting of a task.
    steps : int, optional
        Number of steps of each run of a task.
    seed : int
        Root seed of the runs of a task.
    out : Path
        Folder of the study; created if it does not exist.
    engine : {"local", "dask"}
        What makes the runs.
    scheduler : str, optional
        Address of a Dask scheduler, such as tcp://10.0.0.1:8786.
    tls_ca : Path, optional
        Certificate authority of the Dask cluster.
    tls_cert : Path, optional
        Certificate for the Dask cluster.
    tls_key : Path, optional
        Private key of the certificate.
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
    engine: Literal["local", "dask"] = "local"
    scheduler: Annotated[str | None, Allowed(metavar="ADDRESS", shown="a cluster on this machine")] = None
    tls_ca: Annotated[File | None, Allowed(shown="no TLS")] = None
    tls_cert: Annotated[File | None, Allowed(shown="no TLS")] = None
    tls_key: Annotated[File | None, Allowed(shown="no TLS")] = None
    on_error: Literal["continue", "stop"] = "continue"
    shard: Shard = None
    wait: Flag = False
    mixed_code: Flag = False
    retry_failed: Flag = False
    warm_up: Flag = False

    @classmethod
    def brings(cls, arguments: Sequence[str]) -> Mapping[str, Declared]:
        """Return none: the values of a task's parameters may be several, which --set takes."""
        return {}

    def check(self) -> None:
        """Refuse a study and a task together, and options of Dask without it."""
        if (self.study is None) == (self.task is None):
            given = "both are given" if self.task else "is missing"
            raise ValueError(f"STUDY: {given}; give a study file, or --task NAME")
        self.check_task(_OF_TASK)
        if self.engine != "dask":
            self.refuse(_OF_DASK, "is for Dask; give --engine dask")
        if self.warm_up and (other := [name for name in _NOT_TO_WARM_UP if name in self.given]):
            raise ValueError(f"warm_up=True: makes no runs, so it does not go with {', '.join(other)}; leave one out")
        if "scheduler" in self.given:
            self.refuse(("workers",), "the scheduler has its own workers")


def sweep(settings: SweepSettings) -> int:
    """Make the runs of a study that are missing in its folder, and only those.

    STUDY is a study file; see docs/studies.md. After Ctrl-C, a crash or a power cut the same command continues. With
    more replicates or settings in the file, it adds those. A run that fails becomes a row with its error, and is not
    made again unless --retry-failed is given; then the exit status is 1. With --task, no file is needed.

    \b
    Examples:
      teamsight sweep study.toml --out results
      teamsight sweep study.toml --out results --workers 8 --on-error stop
      teamsight sweep --task cmommt --set robots=4,8,16 \\
          --set treatment=explore,skilled --replicates 20 --out results
      teamsight sweep study.toml --out results \\
          --engine dask --scheduler tcp://10.0.0.1:8786
    """
    from teamsight.analysis.studies.study import Study
    from teamsight.analysis.studies.sweep import sweep as make
    from teamsight.cli.show import Watch
    from teamsight.core.status_line import seconds

    study = Study.from_file(settings.study) if settings.study else _of_task(settings)
    if settings.warm_up:
        return _warm_up(study)
    runs = 0
    with when_stopped(lambda: _kept(settings, runs)), Watch() as watch:

        said = time.monotonic()

        def show(done: int, total: int, seconds_left: float | None) -> None:
            nonlocal said, runs
            runs = total
            watch("runs", done, total)
            if not watch.console.is_terminal and time.monotonic() > said + _PERIOD:
                said = time.monotonic()
                left = "" if seconds_left is None else f", {seconds(seconds_left)} left"
                watch.emit(f"{done} of {total} runs{left}")

        with _engine(settings) as executor:
            summary = make(
                study, settings.out, executor=executor, workers=settings.workers, on_error=settings.on_error,
                shard=settings.shard, wait=settings.wait, mixed_code=settings.mixed_code,
                retry_failed=settings.retry_failed, progress=show, emit=watch.emit,
            )  # fmt: skip
    return _show(settings, summary)


def _of_task(settings: SweepSettings) -> Study:
    """Return the study of a task: parameters with several values are its axes."""
    from teamsight.analysis.studies.definition.model import TASK_PREFIX
    from teamsight.analysis.studies.study import Study
    from teamsight.core.references import is_reference

    several = {name: listed(value) for name, value in settings.set.items()}
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


def _warm_up(study: Study) -> int:
    """Compile what the runs of a study need."""
    from teamsight.analysis.studies.sweep import warm_up_study
    from teamsight.cli.show import plural, say

    began = time.monotonic()
    with when_stopped(lambda: "no run was made; the same command goes on with what is not compiled"):
        kinds = warm_up_study(study)
    say(f"compiled for {plural(kinds, 'kind')} of runs in {time.monotonic() - began:.0f} s")
    return 0


@contextlib.contextmanager
def _engine(settings: SweepSettings) -> Iterator[Executor | None]:
    """Start what makes the runs; workers of this machine are left to `sweep`, which knows whether there is work."""
    if settings.engine == "local":
        yield None
        return
    from teamsight.analysis.runs.dask import DaskExecutor
    from teamsight.analysis.runs.processes import cores

    tls = {name: str(path) for name, path in settings.values(("tls_ca", "tls_cert", "tls_key")).items()}
    with DaskExecutor(settings.scheduler, settings.workers or cores(), **tls) as executor:
        yield executor


def _kept(settings: SweepSettings, total: int) -> str:
    """Return what the folder has, which may be more than was reported."""
    from teamsight.analysis.studies.folder.study_folder import StudyFolder

    folder = StudyFolder(settings.out)
    kept = folder.done().size + folder.failed().size if total else 0
    if not kept:
        return "nothing was kept"
    return f"{kept} of {total} runs are kept in {settings.out}; the same command continues from there"


def _show(settings: SweepSettings, summary: SweepSummary) -> int:
    """Print what was made, and return the exit status."""
    from teamsight.cli.show import plural, say

    # The first one was printed when it failed.
    for run, error in summary.errors[1:]:
        say(f"run {run} failed: {error}")
    if summary.errors and (more := summary.failed - len(summary.errors)) > 0:
        say(f"and {more} more: teamsight status {_quoted(settings.out)} --failed")
    counts = [f"{summary.done} done"]
    if summary.failed:
        counts.append(f"{summary.failed} failed")
    if summary.missing:
        counts.append(f"{summary.missing} missing")
    of = f" of shard {settings.shard[0]}/{settings.shard[1]}" if settings.shard else ""
    if summary.missing and summary.errors and settings.on_error == "stop":
        say("stopped after a run that failed, as --on-error stop says; the same command goes on with the others")
    say(
        f"{plural(summary.made, 'run')} made in {summary.seconds:.0f} s; {settings.out} has {', '.join(counts)} of "
        f"{plural(summary.planned, 'run')}{of}"
    )
    for note in filter(None, (summary.wide, summary.not_finite)):
        say(note)
    say(f"next: {_next(settings, summary)}")
    return 1 if summary.failed else 0


def _next(settings: SweepSettings, summary: SweepSummary) -> str:
    if summary.errors:
        return f"teamsight rerun {_quoted(settings.out)} {summary.errors[0][0]}"
    if summary.failed or summary.missing:
        return f"teamsight status {_quoted(settings.out)}"
    return f"teamsight plot {_quoted(settings.out)} --out figure.png"


def _quoted(path: Path) -> str:
    """Return a path as a shell takes it."""
    return shlex.quote(str(path))
