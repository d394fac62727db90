"""``teamsight sweep``: make the runs of a study that are missing in its folder."""

from __future__ import annotations

import contextlib
import shlex
import time
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

from teamsight.analysis.runs.limits import MOST_RUNS
from teamsight.cli import task_options, values
from teamsight.cli.errors import when_stopped
from teamsight.cli.options import Settings

if TYPE_CHECKING:
    from teamsight.analysis.runs.executor import Executor
    from teamsight.analysis.studies.study import Study
    from teamsight.analysis.studies.sweep import SweepSummary

_ENGINES = ("local", "dask")
_ON_ERROR = ("continue", "stop")
# Seconds from one line of progress to the next where there is no terminal, as in the log of a cluster's job.
_PERIOD = 30.0
_OF_TASK = ("set", "replicates", "steps", "seed")
_NOT_TO_WARM_UP = ("engine", "scheduler", "workers", "on_error", "shard", "wait", "mixed_code", "retry_failed")
_OF_DASK = ("scheduler", "tls_ca", "tls_cert", "tls_key")


class SweepSettings(Settings):
    """Settings of ``teamsight sweep``."""

    study: Path | None = values.input_file("STUDY", required=False)
    task: str | None = task_options.task("A study of this task in place of STUDY: {names}, or module:TASK.")
    set: dict[str, Any] = task_options.scenario(
        "A parameter of the task, or treatment; several values, with commas between them, are combined with the others."
    )
    replicates: int = values.count(1, "Runs of each setting of a task.", most=MOST_RUNS)
    steps: int | None = values.steps(None, "Number of steps of each run of a task.", shown="that of the task")
    seed: int = values.seed(0, "Root seed of the runs of a task.")
    out: Path = values.folder(None, "Folder of the study; created if it does not exist.", required=True)
    workers: int | None = values.workers("number of cores; 1 for a short study")
    engine: Literal["local", "dask"] = values.choice("local", "What makes the runs: {names}.", lambda: _ENGINES)
    scheduler: str | None = values.text(
        "Address of a Dask scheduler, such as tcp://10.0.0.1:8786.", "a cluster on this machine", metavar="ADDRESS"
    )
    tls_ca: Path | None = values.file("Certificate authority of the Dask cluster.", shown="no TLS")
    tls_cert: Path | None = values.file("Certificate for the Dask cluster.", shown="no TLS")
    tls_key: Path | None = values.file("Private key of the certificate.", shown="no TLS")
    on_error: Literal["continue", "stop"] = values.choice(
        "continue", "What to do after a run that fails: {names}.", lambda: _ON_ERROR
    )
    shard: tuple[int, int] | None = values.shard("Make part i of n parts only, as in 1/8: for a job array.", "all")
    wait: bool = values.flag("Wait until another sweep of the folder has ended.")
    mixed_code: bool = values.flag("Go on although runs in the folder were made by other code.")
    retry_failed: bool = values.flag("Make the runs again that have failed.")
    warm_up: bool = values.flag("Compile what the runs need and keep it, and make none: before a job array.")

    def check(self) -> None:
        """Refuse a study and a task together, and options of Dask without it."""
        if (self.study is None) == (self.task is None):
            given = "both are given" if self.task else "is missing"
            raise ValueError(f"STUDY: {given}; give a study file, or --task NAME")
        task_options.check(self, (), _OF_TASK)
        for name in _OF_DASK:
            if self.engine != "dask" and name in self.given:
                flag = "--" + name.replace("_", "-")
                raise ValueError(f"{name}={getattr(self, name)}: is for Dask; give --engine dask, or leave out {flag}")
        if self.warm_up and (other := [name for name in _NOT_TO_WARM_UP if name in self.given]):
            raise ValueError(f"warm_up=True: makes no runs, so it does not go with {', '.join(other)}; leave one out")
        if "scheduler" in self.given and "workers" in self.given:
            raise ValueError(f"workers={self.workers}: the scheduler has its own workers; leave --workers out")


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

    listed = {name: task_options.listed(value) for name, value in settings.set.items()}
    study = Study(
        # Where the module of a task of one's own is.
        path=Path.cwd() if is_reference(settings.task) else None,
        model=f"{TASK_PREFIX}{settings.task}",
        fixed={name: value[0] for name, value in listed.items() if len(value) == 1},
        axes={name: value for name, value in listed.items() if len(value) > 1},
        replicates=settings.replicates,
        steps=settings.steps or task_options.task_of(settings).steps,
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
    from teamsight.analysis.runs.dask_executor import DaskExecutor
    from teamsight.analysis.runs.workers import cores

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
