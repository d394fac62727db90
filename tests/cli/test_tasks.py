"""Commands that take a task: tasks, run, delta, sweep, watch, learn explore and gathering."""

from __future__ import annotations

import importlib
import shutil
import sys
from pathlib import Path

import pandas as pd
import pytest

from teamsight import TASKS, Study, open_study
from teamsight.analysis.delta import choose_delta
from teamsight.analysis.papers import PAPERS
from teamsight.analysis.papers.gathering import GatheringPlan
from teamsight.cli import main
from teamsight.cli.learn import ExploreSettings
from teamsight.cli.look import WatchSettings, watch
from teamsight.cli.options import InputError
from teamsight.cli.reproduce import command_of, plan_in


def call(capsys: pytest.CaptureFixture[str], *arguments: str) -> tuple[int, str, str]:
    with pytest.raises(SystemExit) as left:
        main(arguments)
    out, err = capsys.readouterr()
    return int(left.value.code or 0), out, err


def test_tasks_are_listed_and_checked(capsys: pytest.CaptureFixture[str]) -> None:
    assert call(capsys, "tasks", "cmommt", "--verify")[1].startswith("all keep their contracts\ncmommt  Cooperative")
    status, out, _ = call(capsys, "tasks")
    assert status == 0
    for name in TASKS:
        task = TASKS[name]
        assert name in out
        assert f"{task.objective.better} {task.objective.metric}" in out
    assert call(capsys, "tasks", "cmomt")[2].startswith("teamsight: names='cmomt': unknown; did you mean 'cmommt'")


def test_tasks_are_listed_in_80_columns_without_breaking_a_word(capsys: pytest.CaptureFixture[str]) -> None:
    _, out, _ = call(capsys, "tasks")
    words = set(out.replace(",", " ").split())
    for task in TASKS.values():
        assert words.issuperset(f"{name}={value}" for name, value in task.scenario.items())
        assert words.issuperset(task.title.replace(",", " ").split())
    assert max(map(len, out.splitlines())) <= 80


def test_run_prints_the_metrics_of_a_task(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    place = tmp_path / "run.parquet"
    arguments = ("--task", "cmommt", "--treatment", "explore", "--set", "robots=4", "--steps", "20", "--seed", "3")
    status, out, _ = call(capsys, "run", *arguments, "--save", str(place))
    assert status == 0
    world = TASKS["cmommt"].build("explore", rng=3, robots=4)
    world.run(20)
    assert f"{world.observed_fraction:.4g}" in next(line for line in out.splitlines() if "observed fraction" in line)
    history = pd.read_parquet(place)
    assert len(history) == 20
    assert {"task": "cmommt", "treatment": "explore", "robots": 4, "seed": 3, "steps": 20}.items() <= history.attrs.items()


def test_delta_of_a_task_is_that_of_its_parameters(capsys: pytest.CaptureFixture[str]) -> None:
    common = ("--runs", "12", "--steps", "30", "--risk", "0.2", "--seed", "5", "--workers", "1")
    plain = call(capsys, "delta", "--robots", "6", "--policy", "random-walk", *common)[1]
    task = call(capsys, "delta", "--task", "cmommt", "--set", "robots=6", *common)[1]
    assert "task cmommt, explore, robots=6, 6 robots" in task
    numbers = [[line for line in one.splitlines() if not line.endswith("12 runs of 30 steps")] for one in (task, plain)]
    assert numbers[0] == numbers[1]
    skilled = call(capsys, "delta", "--task", "cmommt", "--set", "robots=6", "--treatment", "skilled", *common)[1]
    assert "task cmommt, skilled" in skilled


def test_sweep_of_a_task_needs_no_file(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    arguments = ("--set", "robots=3,5", "--set", "treatment=explore,skilled", "--set", "radius=2.5")
    status, out, _ = call(
        capsys, "sweep", "--task", "cmommt", *arguments, "--replicates", "2", "--steps", "10", "--workers", "1",
        "--out", str(tmp_path / "study"),
    )  # fmt: skip
    assert status == 0
    assert "8 runs made" in out
    frame = open_study(tmp_path / "study").frame
    assert sorted(frame["robots"].unique()) == [3, 5]
    assert set(frame["treatment"]) == {"explore", "skilled"}
    assert "observed_fraction" in frame


def test_explore_of_a_task(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    place = str(tmp_path / "memory.safetensors")
    status, out, err = call(capsys, "learn", "explore", "--task", "cmommt", "--set", "robots=3", "--steps", "5", "--out", place)
    assert (status, err) == (0, "")
    assert "15 transitions" in out
    # The same again is already there; another scenario is another exploration.
    assert "already holds" in call(capsys, "learn", "explore", "--task", "cmommt", "--set", "robots=3", "--steps", "5", "--out", place)[1]
    other = call(capsys, "learn", "explore", "--task", "cmommt", "--set", "robots=4", "--steps", "5", "--out", place)
    assert (other[0], "give --append" in other[2]) == (2, True)


def gathering_plan(**texts: object) -> GatheringPlan:
    plan: GatheringPlan = plan_in(command_of("gathering").settings.read({"out": "x", **texts}, {}), PAPERS["gathering"])
    return plan


def test_gathering_takes_values_for_one_task_and_for_each_size() -> None:
    plan = gathering_plan(task="cmommt,graze", sizes="4,8", set=("cmommt.radius=3,4.5", "graze.side=40"))
    assert plan.set == {"cmommt.radius": [3, 4.5], "graze.side": 40}


def test_values_for_each_size_follow_the_sizes_as_they_were_given() -> None:
    plan = gathering_plan(task="graze", sizes="16,8,4", set=("side=80,60,40",))
    assert plan.sizes == (4, 8, 16)
    assert plan.set == {"side": [40, 60, 80]}


WRONG = [
    (("run", "--task", "push", "--targets", "3"), "targets: is no parameter of the task push"),
    (("run", "--task", "cmommt", "--robots", "3", "--set", "robots=4"), "set=robots: is given as --robots too; leave one out"),
    (("run", "--treatment", "explore"), "--treatment: is for a task; give --task NAME too"),
    (("run", "--task", "cmommt", "--set", "robts=3"), "robts: is no parameter of the task cmommt; did you mean 'robots'"),
    (("run", "--task", "cmommt", "--evenness"), "evenness=True: does not go with --task; leave --evenness out"),
    (("delta", "--set", "robots=3"), "--set: is for a task"),
    (("delta", "--task", "cmommt", "--trajectories", "x.csv", "--awareness-range", "1"), "task=cmommt: cannot be combined with --traj"),
    (("sweep", "--out", "x"), "STUDY: is missing; give a study file, or --task NAME"),
    (("sweep", "s.toml", "--task", "cmommt", "--out", "x"), "STUDY: both are given"),
    (("sweep", "s.toml", "--replicates", "3", "--out", "x"), "--replicates: is for a task"),
    (("learn", "explore", "--out", "m", "--task", "pursuit", "--targets", "3"), "targets: is no parameter of the task pursuit"),
    (("reproduce", "gathering", "--sizes", "1,4"), "sizes=1: must be at least 2"),
    (("reproduce", "gathering", "--set", "graze.side=3"), "'graze.side' is of the task 'graze', which is not compared"),
    (("run", "--task", "cmommt", "--set", "cmommt.radius=3"), "cmommt.radius: is no parameter of the task"),
    (("reproduce", "gathering", "--set", "robots=3"), "robots is N, the size of the team; give it as sizes"),
]  # fmt: skip


@pytest.mark.parametrize(("arguments", "message"), WRONG, ids=map(str, range(len(WRONG))))
def test_what_does_not_go_together_is_refused(
    capsys: pytest.CaptureFixture[str], arguments: tuple[str, ...], message: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    status, out, err = call(capsys, *arguments)
    assert (status, out, err.count("\n")) == (2, "", 1)
    assert message in err


def test_watch_takes_a_task() -> None:
    given = {"task": "cmommt", "set": ("targets=3",), "robots": "4", "beside": ("treatment=explore",)}
    assert WatchSettings.read(given, {}).parameters == {"robots": 4, "targets": 3}
    with pytest.raises(InputError, match="unknown"):
        WatchSettings.read({"task": "cmomt"}, {})


def test_watch_shows_the_team_that_is_asked_for(monkeypatch: pytest.MonkeyPatch) -> None:
    from teamsight import live

    given = []

    class ShownError(Exception):
        pass

    def serve(model: object, parameters: dict[str, object], **more: object) -> None:
        given.append(parameters)
        raise ShownError

    monkeypatch.setattr(live, "watch", serve)
    with pytest.raises(ShownError):
        watch(WatchSettings.read({"task": "cmommt", "treatment": "explore", "robots": "4"}, {}))
    assert given == [{"robots": 4, "treatment": "explore", "rng": 0}]


OWN = "toy_tasks:GATHER"


def test_a_task_of_a_module_is_taken_by_reference(
    capsys: pytest.CaptureFixture[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Of a file in the folder in which the command runs, though Python does not search there."""
    shutil.copy(Path(__file__).parents[1] / "toy_tasks.py", tmp_path / "task_of_a_user.py")
    monkeypatch.setattr(sys, "path", list(sys.path))
    monkeypatch.chdir(tmp_path)
    given = ("--task", "task_of_a_user:GATHER", "--set", "walkers=3", "--steps", "3")
    assert call(capsys, "run", *given)[1].startswith("closeness ")
    assert "gather  Robots go to a beacon" in call(capsys, "tasks", "task_of_a_user:GATHER")[1]
    status, out, err = call(
        capsys, "sweep", *given, "--set", "treatment=explore,skilled", "--out", "out", "--workers", "1"
    )
    assert (status, err, out.split(" made")[0]) == (0, "", "2 runs")
    assert open_study("out").study.model == "task:task_of_a_user:GATHER"
    # Both teams meet the same noise.
    assert open_study("out").frame["seed"].nunique() == 1
    assert call(capsys, "verify", "out")[0] == 0
    for name, message in {
        "task_of_a_user:GATER": "module 'task_of_a_user' has no 'GATER'",
        "task_of_a_user:Beacon": "give a teamsight.Task",
        "task_of_nobody:TASK": "run this in the folder of its file",
    }.items():
        status, out, err = call(capsys, "run", "--task", name)
        assert (status, out, message in err, err.count("\n")) == (2, "", True, 1), err


def test_analyses_take_a_task_of_a_module() -> None:
    wanted = importlib.import_module("toy_tasks").GATHER
    assert gathering_plan(task=OWN, sizes="3,5").tasks == (wanted,)
    assert ExploreSettings.read({"task": OWN, "out": "x.safetensors", "steps": "2"}, {}).task_given() is wanted
    unreliable = PAPERS["unreliable"]
    assert plan_in(command_of("unreliable").settings.read({"task": OWN, "out": "x"}, {}), unreliable).task is wanted
    given = {"risk": 0.3, "runs": 10, "steps": 3, "rng": 1}
    assert str(choose_delta(OWN, **given)) == str(choose_delta(wanted, **given))


def test_a_study_takes_a_task_of_a_module_as_its_model(tmp_path: Path) -> None:
    own = {"replicates": 2, "steps": 3, "axes": {"treatment": ["explore", "skilled"]}}
    made = Study(model=OWN, **own).run(tmp_path / "one")
    assert made.frame.equals(Study(model=f"task:{OWN}", **own).run(tmp_path / "two").frame)
    assert {"closeness", "gathered_after"} <= set(made.measures)
    assert made.frame.groupby("replicate")["seed"].nunique().eq(1).all()
    with pytest.raises(ValueError, match="sied: is no parameter of toy_tasks:GATHER; did you mean 'side'"):
        Study(model=OWN, fixed={"sied": 3.0}).check()
    with pytest.raises(ValueError, match="model='foraging': unknown; did you mean 'task:forage'"):
        Study(model="foraging").check()
