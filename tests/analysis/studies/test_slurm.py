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

# Runs the tasks of an array one after the other, the last first and twice, once the job that it depends on has ended well.
SBATCH = """#!/bin/bash
here=$(dirname "$0")
echo "$@" >> "$here/arguments"
script="${!#}"
output=$(sed -n 's/^#SBATCH --output="\\(.*\\)"$/\\1/p' "$script" | sed 's/\\\\"/"/g')
cpus=$(sed -n 's/^#SBATCH --cpus-per-task=//p' "$script")
run() {
  SLURM_ARRAY_TASK_ID=$1 SLURM_CPUS_PER_TASK=$cpus bash "$script" > "$(echo "$output" | sed "s/%A/17/; s/%a/$1/")" 2>&1
}
case "$*" in
  *--parsable*--array=0*) run 0 || exit; touch "$here/warm"; echo "16;cluster" ;;
  *--dependency=afterok:16\\ --kill-on-invalid-dep=yes*)
    [ -e "$here/warm" ] || exit 3
    last=$(sed -n 's/^#SBATCH --array=1-\\([0-9]*\\).*/\\1/p' "$script")
    for task in $(seq "$last" -1 1) "$last"; do run "$task" || exit; done
    echo "Submitted batch job 17" ;;
  *) exit 4 ;;
esac
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
    assert (tools / "arguments").read_text().splitlines() == [
        "--parsable --array=0 my script.sbatch",
        "--dependency=afterok:16 --kill-on-invalid-dep=yes my script.sbatch",
    ]
    assert (tmp_path / "greetings").read_text() == "good morning\n" * 4
    log = tmp_path / 'the "out" folder-log'
    assert sorted(one.name for one in log.iterdir()) == ["17_0.out", "17_1.out", "17_2.out"]
    # Task 0 made no run.
    assert re.fullmatch(r"compiled for 1 kind of runs in \d+ s\n", (log / "17_0.out").read_text())

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
        cpus=8, partition="short", account="robots", time="1-12:00:00", memory="4G", setup=("module load python",),
        at_once=2, output=Path('/logs/50 % of "all"'),
    ).script("/opt/python")  # fmt: skip
    assert [line for line in script.splitlines() if line.startswith("#SBATCH")] == [
        "#SBATCH --job-name=teamsight", "#SBATCH --array=1-4%2",
        '#SBATCH --output="/logs/50 %% of \\"all\\"/%A_%a.out"', "#SBATCH --cpus-per-task=8",
        "#SBATCH --partition=short", "#SBATCH --account=robots", "#SBATCH --time=1-12:00:00", "#SBATCH --mem=4G",
    ]  # fmt: skip
    assert script.index("--mem=4G") < script.index("\nmodule load python\n") < script.index("\nexec /opt/python -m teamsight")
    asked = array().script()
    assert "#SBATCH --array=1-4\n" in asked
    assert f'#SBATCH --output="{Path.cwd()}/results-log/%A_%a.out"\n' in asked
    assert not re.search("--(?:partition|account|time|mem)=", asked)


@pytest.mark.short
@pytest.mark.parametrize("name", ["a b", "a'b", 'a"b', "a`b`$(c)$d", "ä%j", "-x", "#", "a;b&c"])
def test_paths_reach_the_sweep_as_they_are(tmp_path: Path, name: str) -> None:
    (tmp_path / "teamsight.sh").write_text('printf "%s\\n" "$@"\n')
    text = array(study=Path("/data") / name, out=Path("/results") / name).script("PYTHON")
    script = tmp_path / "script"
    # A function in place of the interpreter shows what it would be called with.
    script.write_text(text.replace("exec PYTHON", f"bash {tmp_path}/teamsight.sh"))
    assert subprocess.run(["bash", "-n", str(script)], check=False).returncode == 0
    for task, last in (("2", ["--shard", "2/4", "--workers", "6"]), ("0", ["--warm-up"])):
        done = subprocess.run(
            ["bash", str(script)], capture_output=True, text=True, check=True,
            env={"SLURM_ARRAY_TASK_ID": task, "SLURM_CPUS_PER_TASK": "6", "PATH": os.environ["PATH"]},
        )  # fmt: skip
        sweep = ["-m", "teamsight", "sweep", f"/data/{name}", "--out", f"/results/{name}"]
        assert (done.stdout.splitlines(), done.stderr) == ([*sweep, *last], "")


@pytest.mark.short
def test_what_does_not_compile_holds_the_array_back(tmp_path: Path) -> None:
    (tmp_path / "study.toml").write_text(STUDY.replace("targets = 2", "tragets = 2"))
    script = tmp_path / "script"
    script.write_text(array(study=tmp_path / "study.toml", out=tmp_path / "out").script())
    tools = program(tmp_path / "bin", SBATCH)
    done = subprocess.run(
        ["bash", str(script)], capture_output=True, text=True, check=False,
        env=dict(os.environ, PYTHONPATH=str(ROOT), PATH=f"{tools}{os.pathsep}{os.environ['PATH']}"),
    )  # fmt: skip
    assert done.returncode
    assert len((tools / "arguments").read_text().splitlines()) == 1
    assert "did you mean 'targets'?" in (tmp_path / "out-log" / "17_0.out").read_text()


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
        ({"at_once": 0}, "^at_once=0: must be at least 1"),
        ({"output": Path("a\\b")}, "^output=.*: has a backslash; give another folder"),
        ({"out": Path("a\\b")}, "^output=.*: has a backslash; give another folder"),
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
    assert "--array=1-5\n" in path.read_text()
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
    path.write_text(array(out=tmp_path / "out").script())
    path_before = os.environ["PATH"]
    monkeypatch.setenv("PATH", str(tmp_path))
    with pytest.raises(ValueError, match=r"^sbatch: is not on this machine; .*: bash '.*my study.sbatch'$"):
        slurm.submit(path)
    tools = program(tmp_path / "bin", "#!/bin/sh\necho no such partition >&2\nexit 1\n")
    monkeypatch.setenv("PATH", f"{tools}{os.pathsep}{path_before}")
    with pytest.raises(ValueError, match=r"^sbatch: refused .* \(no such partition\); change the options"):
        slurm.submit(path)
