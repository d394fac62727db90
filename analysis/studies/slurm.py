"""A SLURM job array that makes the runs of a study: each task makes one shard of them, the first compiles for all."""

from __future__ import annotations

import re
import shlex
import sys
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

from teamsight.core import checks, files
from teamsight.core.component import Allowed, Component

#: The second line of each script, by which one is recognised.
MARK = "# Written by teamsight submit."
#: The most tasks of an array, and what SLURM allows where its MaxArraySize was not changed.
MOST_TASKS, USUAL_TASKS = 10_000, 1000
_Tasks = Annotated[int, Allowed(least=1, most=MOST_TASKS)]
_LONGEST = 1000

_TIMES = (
    r"\d+", r"\d+:\d\d", r"\d+:\d\d:\d\d", r"\d+-\d+", r"\d+-\d+:\d\d", r"\d+-\d+:\d\d:\d\d",
)  # fmt: skip
# What SLURM accepts for each option, and an example.
_FORMS = {
    "partition": (r"[\w.,+-]+", "short"),
    "account": (r"[\w.+-]+", "robots"),
    "time": ("|".join(_TIMES), "02:30:00 or 1-12:00:00"),
    "memory": (r"\d+[KMGT]?", "4G"),
    "name": (r"[\w.+-]+", "study"),
}


def _in_notation(option: str, value: str) -> str:
    form, example = _FORMS[option]
    if not re.fullmatch(form, value, re.ASCII):
        raise ValueError(f"{option}={checks.shown(value)}: is not in SLURM's notation; give, for example, {example}")
    return value


def _noted(metavar: str = "NAME", shown: str = "that of the cluster") -> Allowed:
    return Allowed(check=_in_notation, metavar=metavar, shown=shown)


def _lines(name: str, value: Iterable[str]) -> tuple[str, ...]:
    """Return lines of a shell, of which several may be alike."""
    return tuple(value)


@dataclass(frozen=True, kw_only=True)
class JobOptions(Component):
    """What each task of a job array may use.

    Parameters
    ----------
    tasks : int
        Number of tasks; task i makes shard i of the runs.
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
    name : str
        Name of the job.
    output : Path, optional
        Folder for what the tasks print, in files ``JOB_TASK.out``.
    """

    tasks: _Tasks = 16
    at_once: Annotated[_Tasks | None, Allowed(shown="what the cluster allows")] = None
    cpus: Annotated[int, Allowed(least=1, most=1024)] = 1
    memory: Annotated[str | None, _noted("SIZE")] = None
    time: Annotated[str | None, _noted("TIME")] = None
    partition: Annotated[str | None, _noted()] = None
    account: Annotated[str | None, _noted(shown="yours")] = None
    setup: Annotated[tuple[str, ...], Allowed(check=_lines, parse=tuple, metavar="LINE", is_repeated=True)] = ()
    name: Annotated[str, _noted(shown="")] = "teamsight"
    output: Path | None = None


@dataclass(frozen=True, kw_only=True)
class JobArray(JobOptions):
    """A job array and what each of its tasks may use.

    Parameters
    ----------
    study, out : Path
        The study file and the folder of the study, which every machine of the cluster must see under these paths.

    Raises
    ------
    ValueError
        If a value has a form that SLURM refuses, or a path cannot stand in a script.
    """

    study: Path
    out: Path

    def __post_init__(self) -> None:
        super().__post_init__()
        for option, text in (
            ("study", str(self.study)),
            ("out", str(self.out)),
            ("output", str(self.log)),
            *(("setup", line) for line in self.setup),
        ):
            if not text.isprintable() or len(text) > _LONGEST:
                raise ValueError(
                    f"{option}={checks.shown(text)}: must be one line of at most {_LONGEST} printable characters; "
                    "give another"
                )

        # SLURM replaces nothing in a pattern with a backslash.
        if "\\" in str(self.log):
            raise ValueError(f"output={checks.shown(str(self.log))}: has a backslash; give another folder")

    @property
    def log(self) -> Path:
        """The folder for what the tasks print."""
        folder = self.out.with_name(f"{self.out.name}-log") if self.output is None else self.output
        return folder.absolute()

    def script(self, python: str = sys.executable) -> str:
        """Return the script for ``sbatch``.

        Parameters
        ----------
        python : str
            The interpreter that runs the sweep.
        """
        pattern = str(self.log).replace("%", "%%").replace('"', '\\"')
        options = {
            "job-name": self.name, "array": f"1-{self.tasks}" + (f"%{self.at_once}" if self.at_once else ""),
            "output": f'"{pattern}/%A_%a.out"', "cpus-per-task": self.cpus, "partition": self.partition,
            "account": self.account, "time": self.time, "mem": self.memory,
        }  # fmt: skip
        asked = [f"#SBATCH --{option}={value}" for option, value in options.items() if value is not None]
        study, out, log = (shlex.quote(str(path.absolute())) for path in (self.study, self.out, self.log))
        return "\n".join([
            "#!/bin/bash",
            MARK,
            "# To submit: bash and this file. Task 0 comes first and compiles for all. Each other task makes one shard",
            "# of the runs, and only what is missing: any task may be repeated, at any time.",
            "# To repeat task 3: sbatch --array=3 and this file.",
            *asked,
            'if [ -z "${SLURM_ARRAY_TASK_ID:-}" ]; then',
            f"  mkdir -p {log} || exit",
            '  first=$(sbatch --parsable --array=0 "$0") || exit',
            '  exec sbatch --dependency="afterok:${first%%;*}" --kill-on-invalid-dep=yes "$0"',
            "fi",
            *self.setup,
            'if [ "$SLURM_ARRAY_TASK_ID" -eq 0 ]; then',
            "  set -- --warm-up",
            "else",
            f'  set -- --shard "$SLURM_ARRAY_TASK_ID/{self.tasks}" --workers "${{SLURM_CPUS_PER_TASK:-{self.cpus}}}"',
            "fi",
            f'exec {shlex.quote(python)} -m teamsight sweep {study} --out {out} "$@"',
            "",
        ])  # fmt: skip


def write_script(path: Path, array: JobArray, *, force: bool = False) -> None:
    """Write the script of a job array; one that was written by this function before is replaced.

    Parameters
    ----------
    path : Path
        Where to write it.
    array : JobArray
        The job array.
    force : bool
        Replace any file.

    Raises
    ------
    ValueError
        If there is another file at `path`, or it cannot be written.
    """
    if files.check_place(path) and not force:
        with files.open_regular(path) as file:
            lines = file.read(200).splitlines()
        if MARK.encode() not in lines[1:2]:
            raise ValueError(f"{path}: was not written by teamsight submit; give another --script, or --force")
    with files.complete(path) as file:
        file.write(array.script().encode())


def submit(path: Path) -> str:
    """Run a script, which submits itself by ``sbatch``; return what that prints, such as "Submitted batch job 1234".

    Raises
    ------
    ValueError
        If there is no sbatch on this machine, or it refuses the job.
    """
    import shutil
    import subprocess

    if shutil.which("sbatch") is None:
        raise ValueError(f"sbatch: is not on this machine; submit where SLURM is, with: {command(path)}")
    done = subprocess.run(["/bin/bash", str(path)], capture_output=True, text=True, check=False)
    said = " ".join((done.stdout + done.stderr).split())
    if done.returncode:
        raise ValueError(f"sbatch: refused {path} ({said[:200]}); change the options, or the script")
    return said


def command(path: Path) -> str:
    """Return the command that submits a script."""
    return f"bash {shlex.quote(str(path))}"
