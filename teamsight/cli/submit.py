"""``teamsight submit``: write a SLURM job array that makes the runs of a study."""

from __future__ import annotations

import shlex
from pathlib import Path
from typing import TYPE_CHECKING

from teamsight.analysis.studies.slurm import MOST_TASKS, USUAL_TASKS
from teamsight.cli import values
from teamsight.cli.options import Option, Settings

if TYPE_CHECKING:
    from teamsight.analysis.studies.slurm import JobArray


class SubmitSettings(Settings):
    """Settings of ``teamsight submit``."""

    study: Path = values.input_file("STUDY")
    out: Path = values.folder(None, "Folder of the study, which all machines of the cluster see.", required=True)
    slurm: bool = values.flag("For a SLURM cluster, the only kind so far.")
    tasks: int = values.count(16, "Number of tasks; task i makes shard i of the runs.", most=MOST_TASKS)
    most_tasks: int = values.count(
        USUAL_TASKS, "Most tasks of an array that the cluster allows, its MaxArraySize less 1.", most=MOST_TASKS
    )
    at_once: int | None = values.count(
        None, "Tasks that run at one time, at most.", most=MOST_TASKS, shown="what the cluster allows"
    )
    cpus: int = values.count(1, "Processors of each task, which are its workers.", most=1024)
    memory: str | None = values.text("Memory of each task, such as 4G.", "that of the cluster", metavar="SIZE")
    time: str | None = values.text(
        "Longest time of a task, such as 02:00:00; the same job continues from there.", "that of the cluster",
        metavar="TIME",
    )  # fmt: skip
    partition: str | None = values.text("Partition of the cluster.", "that of the cluster", metavar="NAME")
    account: str | None = values.text("Account to charge.", "yours", metavar="NAME")
    setup: tuple[str, ...] = Option(
        lambda name, lines: tuple(lines), (), "Line of the shell before the sweep, such as 'module load python'.",
        "LINE", many=True,
    )  # type: ignore[assignment]  # fmt: skip
    output: Path | None = values.folder(None, "Folder for what the tasks print.", shown="OUT-log")
    script: Path | None = values.file("Where to write the script.", shown="STUDY.sbatch in this folder")
    dry_run: bool = values.flag("Print the script, and write nothing.")
    submit: bool = values.flag("Run the script, which calls sbatch.")
    force: bool = values.flag("Replace a script that teamsight did not write.")

    def check(self) -> None:
        """Refuse options that do not go together."""
        if not self.slurm:
            raise ValueError("slurm=False: say for which cluster; give --slurm, the only kind so far")
        if self.tasks > self.most_tasks:
            raise ValueError(
                f"tasks={self.tasks}: are more than the {self.most_tasks} of most_tasks; give fewer with more --cpus, "
                "or --most-tasks if the cluster allows more"
            )
        if self.dry_run and self.submit:
            raise ValueError("submit=True: does not go with --dry-run, which writes nothing; leave one out")


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

    array = _array(settings)
    study = Study.from_file(settings.study)
    study.check()
    plan = study.plan()
    # An adaptive study is divided by settings, another by runs.
    most, things = (plan.runs, "run") if study.until is None else (plan.settings, "setting")
    if settings.tasks > most:
        raise ValueError(f"tasks={settings.tasks}: are more than the {plural(most, things)} of the study; give fewer")
    if settings.dry_run:
        print(array.script(), end="")
        return
    path = settings.script or Path(f"{settings.study.stem}.sbatch")
    slurm.write_script(path, array, force=settings.force)
    say(f"{path}: {plural(plan.runs, 'run')} in {plural(settings.tasks, 'task')}")
    say(slurm.submit(path) if settings.submit else f"next: {slurm.command(path)}")
    say(f"then: teamsight status {shlex.quote(str(settings.out))}")


def _array(settings: SubmitSettings) -> JobArray:
    from teamsight.analysis.studies.slurm import JobArray

    options = settings.values(("tasks", "at_once", "cpus", "partition", "account", "time", "memory", "output"))
    return JobArray(settings.study, settings.out, setup=settings.setup, **options)
