"""A job array makes the same runs as one sweep, whatever its tasks' order, and its script is safe for a shell."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from pathlib import Path

import pandas as pd
import pytest

from teamsight.analysis.studies import slurm
from teamsight.analysis.studies.folder.study_folder import StudyFolder
from teamsight.analysis.studies.slurm import JobArray
from teamsight.analysis.studies.study import Study
from teamsight.analysis.studies.sweep import sweep

ROOT = Path(__file__).parents[3]

STUDY = """
model = "cmommt"
replicates = 3
steps = 10
seed = 4
[fixed]
targets = 2
[axes]
robots = [2, 3]
radius = [1.5, 2.0]
"""

# Runs the tasks of an array one after the other, the last first and twice.
SBATCH = """#!/bin/bash
echo "$@" > "$(dirname "$0")/arguments"
last=$(sed -n 's/^#SBATCH --array=1-//p' "$1")
cpus=$(sed -n 's/^#SBATCH --cpus-per-task=//p' "$1")
for task in $(seq "$last" -1 1) "$last"; do
  SLURM_ARRAY_TASK_ID=$task SLURM_CPUS_PER_TASK=$cpus bash "$1" > /dev/null || exit
done
echo "Submitted batch job 17"
"""


def program(folder: Path, content: str) -> Path:
    """Write a program called sbatch, and return its folder."""
    folder.mkdir()
    path = folder / "sbatch"
    path.write_text(content)
    path.chmod(0o755)
    return folder


def rows(folder: Path) -> pd.DataFrame:
    """Return the runs in a folder, in an order of their own."""
    frame: pd.DataFrame = StudyFolder(folder).read("runs").to_pandas()
    return frame.sort_values(["setting", "replicate"], ignore_index=True)


def test_the_tasks_of_an_array_make_what_one_sweep_makes(tmp_path: Path) -> None:
    # Names that a shell would take apart.
    study, out = tmp_path / "it's a $(study).toml", tmp_path / 'the "out" folder'
    study.write_text(STUDY)
    tools = program(tmp_path / "bin", SBATCH)
    done = subprocess.run(
        [
            sys.executable, "-m", "teamsight", "submit", study.name, "--out", out.name, "--slurm", "--tasks", "2",
            "--setup", "export GREETING='good morning'", "--setup", "echo $GREETING >> greetings",
            "--script", "my script.sbatch", "--submit",
        ],
        cwd=tmp_path, capture_output=True, text=True, check=True,
        env=dict(os.environ, PYTHONPATH=str(ROOT), PATH=f"{tools}{os.pathsep}{os.environ['PATH']}"),
    )  # fmt: skip
    assert re.search(r"^my script.sbatch: 12 runs in 2 tasks\nSubmitted batch job 17\n", done.stdout)
    assert (tools / "arguments").read_text() == "my script.sbatch\n"
    assert (tmp_path / "greetings").read_text() == "good morning\n" * 3

    sweep(Study.from_file(study), tmp_path / "one")
    assert len(rows(out)) == 12
    pd.testing.assert_frame_equal(rows(out), rows(tmp_path / "one"))
    # A repeated task made nothing.
    assert len(list((out / "runs").iterdir())) == 2


def array(**options: object) -> JobArray:
    return JobArray(**{"study": Path("study.toml"), "out": Path("results"), "tasks": 4, **options})  # type: ignore[arg-type]


@pytest.mark.short
def test_the_script_asks_for_what_is_given() -> None:
    script = array(
        cpus=8, partition="short", account="robots", time="1-12:00:00", memory="4G", setup=("module load python",)
    ).script("/opt/python")
    assert [line for line in script.splitlines() if line.startswith("#SBATCH")] == [
        "#SBATCH --job-name=teamsight", "#SBATCH --array=1-4", "#SBATCH --cpus-per-task=8",
        "#SBATCH --partition=short", "#SBATCH --account=robots", "#SBATCH --time=1-12:00:00", "#SBATCH --mem=4G",
    ]  # fmt: skip
    assert script.index("--mem=4G") < script.index("\nmodule load python\nexec /opt/python -m teamsight sweep /")
    asked = array().script()
    assert not re.search("--(?:partition|account|time|mem)=", asked)


@pytest.mark.short
@pytest.mark.parametrize("name", ["a b", "a'b", 'a"b', "a`b`$(c)$d", "a\\b", "ä%j", "-x", "#", "a;b&c"])
def test_paths_reach_the_sweep_as_they_are(tmp_path: Path, name: str) -> None:
    (tmp_path / "teamsight.sh").write_text('printf "%s\\n" "$@"\n')
    text = array(study=Path("/data") / name, out=Path("/results") / name).script("PYTHON")
    script = tmp_path / "script"
    # A function in place of the interpreter shows what it would be called with.
    script.write_text(text.replace("exec PYTHON", f"bash {tmp_path}/teamsight.sh"))
    assert subprocess.run(["bash", "-n", str(script)], check=False).returncode == 0
    done = subprocess.run(
        ["bash", str(script)], capture_output=True, text=True, check=True,
        env={"SLURM_ARRAY_TASK_ID": "2", "SLURM_CPUS_PER_TASK": "6", "PATH": os.environ["PATH"]},
    )  # fmt: skip
    assert done.stdout.splitlines() == [
        "-m", "teamsight", "sweep", f"/data/{name}", "--out", f"/results/{name}", "--shard", "2/4", "--workers", "6",
    ]  # fmt: skip
    assert done.stderr == ""


@pytest.mark.short
def test_a_script_that_no_array_runs_says_so(tmp_path: Path) -> None:
    script = tmp_path / "script"
    script.write_text(array().script())
    done = subprocess.run(
        ["bash", str(script)], capture_output=True, text=True, env={}, check=False, executable="/bin/bash"
    )
    assert done.returncode
    assert "run this file by sbatch" in done.stderr


@pytest.mark.short
@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"tasks": 0}, "^tasks=0: must be at least 1"),
        ({"tasks": 10_001}, "^tasks=10001: must be at most 10000"),
        ({"cpus": 0}, "^cpus=0: must be at least 1"),
        ({"time": "two hours"}, "^time='two hours': is not in SLURM's notation; give, for example, 02:30:00"),
        ({"memory": "4 GB"}, "^memory='4 GB': .*, 4G$"),
        ({"partition": "a\n#SBATCH --uid=0"}, "^partition='a.n#SBATCH --uid=0': is not"),
        ({"account": "a b"}, "^account='a b': is not"),
        ({"study": Path("a\nb.toml")}, "^study='a.nb.toml': must be one line"),
        ({"out": Path("a\tb")}, "^out='a.tb': must be one line"),
        ({"setup": ("module load a\nrm -r b",)}, "^setup=.*: must be one line"),
    ],
    ids=lambda value: next(iter(value)) if isinstance(value, dict) else "",
)
def test_what_cannot_stand_in_a_script_is_refused(options: dict[str, object], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        array(**options)


@pytest.mark.short
def test_only_scripts_of_this_command_are_replaced(tmp_path: Path) -> None:
    path = tmp_path / "study.sbatch"
    slurm.write_script(path, array())
    slurm.write_script(path, array(tasks=5))
    assert "--array=1-5" in path.read_text()
    path.write_text("#!/bin/bash\necho mine\n")
    with pytest.raises(ValueError, match=r"study.sbatch: was not written by teamsight submit; .* --script, or --force"):
        slurm.write_script(path, array())
    assert path.read_text() == "#!/bin/bash\necho mine\n"
    slurm.write_script(path, array(), force=True)
    assert "--array=1-4" in path.read_text()


@pytest.mark.short
def test_without_sbatch_or_when_it_refuses_the_error_says_what_to_do(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "my study.sbatch"
    path.write_text(array().script())
    monkeypatch.setenv("PATH", str(tmp_path))
    with pytest.raises(ValueError, match=r"^sbatch: is not on this machine; .*: sbatch '.*my study.sbatch'$"):
        slurm.submit(path)
    monkeypatch.setenv("PATH", str(program(tmp_path / "bin", "#!/bin/sh\necho no such partition >&2\nexit 1\n")))
    with pytest.raises(ValueError, match=r"^sbatch: refused .* \(no such partition\); change the options"):
        slurm.submit(path)
