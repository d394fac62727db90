"""``teamsight submit``: write a SLURM job array that makes the runs of a study."""

from __future__ import annotations

import shlex
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from teamsight.analysis.studies.slurm import MOST_TASKS, USUAL_TASKS
from teamsight.cli.options import Writes
from teamsight.cli.values import File, Folder, StudyFile
from teamsight.core.component import Allowed, Flag

if TYPE_CHECKING:
    from teamsight.analysis.studies.slurm import JobArray


@dataclass(frozen=True, kw_only=True)
class SubmitSettings(Writes):
    """Options of ``teamsight submit``.

    Parameters
    ----------
    study : Path
        The study file.
    out : Path
        Folder of the study, which all machines of the cluster see.
    slurm : bool
        For a SLURM cluster, the only kind so far.
    tasks : int
        Number of tasks; task i makes shard i of the runs.
    most_tasks : int
        Most tasks of an array that the cluster allows, its MaxArraySize less 1.
    at_once : int, optional
        Tasks that run at one time, at most.
    cpus : int
        Processors of each task, which are its workers.
    memory : str, optional
        Memory of each task, such as 4G.
    time : str, optional
        Longest time of a task, such as 02:00:00; the same job continues from there.
    partition : str, optional
        Partition of the cluster.
    account : str, optional
        Account to charge.
    setup : sequence of str
        Line of the shell before the sweep, such as 'module load python'.
    output : Path, optional
        Folder for what the tasks print.
    script : Path, optional
        Where to write the script.
    dry_run : bool
        Print the script, and write nothing.
    submit : bool
        Run the script, which calls sbatch.
    """

    study: StudyFile
    out: Folder
    slurm: Flag = False
    tasks: Annotated[int, Allowed(least=1, most=MOST_TASKS)] = 16
    most_tasks: Annotated[int, Allowed(least=1, most=MOST_TASKS)] = USUAL_TASKS
    at_once: Annotated[int | None, Allowed(least=1, most=MOST_TASKS, shown="what the cluster allows")] = None
    cpus: Annotated[int, Allowed(least=1, most=1024)] = 1
    memory: Annotated[str | None, Allowed(metavar="SIZE", shown="that of the cluster")] = None
    time: Annotated[str | None, Allowed(metavar="TIME", shown="that of the cluster")] = None
    partition: Annotated[str | None, Allowed(metavar="NAME", shown="that of the cluster")] = None
    account: Annotated[str | None, Allowed(metavar="NAME", shown="yours")] = None
    setup: Annotated[tuple[str, ...], Allowed(metavar="LINE", is_repeated=True)] = ()
    output: Annotated[Folder | None, Allowed(shown="OUT-log")] = None
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
