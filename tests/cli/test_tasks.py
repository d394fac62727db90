"""Commands that take a task: tasks, run, delta, sweep, watch, learn explore, gathering and reproduce."""

from __future__ import annotations

import importlib
import shutil
import sys
from pathlib import Path

import pandas as pd
import pytest

from teamsight import TASKS, Study, open_study
from teamsight.analysis.delta import choose_delta
from teamsight.cli import main
from teamsight.cli.gathering import GatheringSettings
from teamsight.cli.gathering import plan_of as gathering_plan
from teamsight.cli.learn import ExploreSettings
from teamsight.cli.look import WatchSettings, watch
from teamsight.cli.options import InputError
from teamsight.cli.unreliable import UnreliableSettings
from teamsight.cli.unreliable import plan_of as unreliable_plan


def call(capsys: pytest.CaptureFixture[str], *arguments: str) -> tuple[int, str, str]:
    with pytest.raises(SystemExit) as left:
        main(arguments)
    out, err = capsys.readouterr()
    return int(left.value.code or 0), out, err


def test_tasks_are_listed_and_checked(capsys: pytest.CaptureFixture[str]) -> None:
    status, out, _ = call(capsys, "tasks", "--verify")
    assert status == 0
    for name in TASKS:
        task = TASKS[name]
        assert name in out
        assert f"{task.objective.better} {task.objective.metric}" in out
    assert "all keep their contracts" in out
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
    assert task.splitlines()[1:] == plain.splitlines()[1:]
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


def test_gathering_writes_its_results(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    arguments = ("--sizes", "3", "--runs", "6", "--steps", "10", "--set", "radius=2", "--out", str(tmp_path), "--workers", "1")
    status, out, _ = call(capsys, "gathering", "--task", "cmommt", *arguments, "--format", "svg")
    assert status == 0
    assert "gathering index in" in out
    assert {path.name for path in tmp_path.iterdir()} == {
        "gathering.md", "gathering.svg", "gathering.parquet", "gathering-index.parquet", "gathering-rounds.parquet",
    }  # fmt: skip
    assert "radius=2" in (tmp_path / "gathering.md").read_text(encoding="utf-8")
    assert call(capsys, "gathering", "--seed", "3", *arguments)[0] == 2


def test_gathering_takes_values_for_one_task_and_for_each_size() -> None:
    from teamsight.cli.gathering import GatheringSettings, plan_of

    settings = GatheringSettings.read({"task": "cmommt,graze", "sizes": "4,8", "set": ("cmommt.radius=3,4.5", "graze.side=40")}, {})
    assert plan_of(settings).scenario == {"cmommt.radius": (3, 4.5), "graze.side": 40}


def test_values_for_each_size_follow_the_sizes_as_they_were_given() -> None:
    from teamsight.cli.gathering import GatheringSettings, plan_of

    plan = plan_of(GatheringSettings.read({"task": "graze", "sizes": "16,8,4", "set": ("side=80,60,40",)}, {}))
    assert plan.sizes == (4, 8, 16)
    assert plan.scenario == {"side": (40, 60, 80)}


def test_reproduce_of_a_task_calls_its_reproduction(
    capsys: pytest.CaptureFixture[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    from teamsight.analysis import reproductions
    from teamsight.analysis.reproduction import Request

    given = []

    def reproduce(request: Request, pool: object, watch: object) -> list[str]:
        given.append(request)
        return ["two of three hold"]

    monkeypatch.setattr(reproductions, "_made_for_a_test", reproduce, raising=False)
    monkeypatch.setitem(
        reproductions.REPRODUCTIONS._homes, "gather", "teamsight.analysis.reproductions:_made_for_a_test"  # type: ignore[arg-type, index]
    )
    status, out, _ = call(
        capsys, "reproduce", "--task", "gather", "--out", str(tmp_path), "--quick", "--seed", "7", "--workers", "1"
    )
    assert status == 0
    assert "two of three hold" in out
    assert given == [Request(tmp_path, seed=7, quick=True)]
    refused = call(capsys, "reproduce", "3", "--task", "gather", "--out", str(tmp_path))
    assert (refused[0], "is for the task cmommt; leave --figures out" in refused[2]) == (2, True)


WRONG = [
    (("run", "--task", "push", "--targets", "3"), "targets: is no parameter of the task push"),
    (("run", "--task", "cmommt", "--robots", "3", "--set", "robots=4"), "set=robots: is given as --robots too; leave one out"),
    (("run", "--treatment", "explore"), "--treatment: is for a task; give --task NAME too"),
    (("run", "--task", "cmommt", "--set", "robts=3"), "robts: is no parameter of the task cmommt; did you mean 'robots'"),
    (("run", "--task", "cmommt", "--evenness"), "evenness=True: is for CMOMMT, not for the task cmommt; leave --evenness out"),
    (("delta", "--set", "robots=3"), "--set: is for a task"),
    (("delta", "--task", "cmommt", "--trajectories", "x.csv", "--awareness-range", "1"), "task=cmommt: cannot be combined with --traj"),
    (("sweep", "--out", "x"), "STUDY: is missing; give a study file, or --task NAME"),
    (("sweep", "s.toml", "--task", "cmommt", "--out", "x"), "STUDY: both are given"),
    (("sweep", "s.toml", "--replicates", "3", "--out", "x"), "--replicates: is for a task"),
    (("learn", "explore", "--out", "m", "--task", "pursuit", "--targets", "3"), "targets: is no parameter of the task pursuit"),
    (("gathering", "--sizes", "1,4"), "sizes=1: must be at least 2"),
    (("gathering", "--set", "graze.side=3"), "'graze.side' is of the task 'graze', which is not compared"),
    (("run", "--task", "cmommt", "--set", "cmommt.radius=3"), "cmommt.radius: is no parameter of the task"),
    (("gathering", "--set", "robots=3"), "robots is N, the size of the team; give it as sizes"),
    (("reproduce", "--task", "forage2"), "task='forage2': unknown"),
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
    assert gathering_plan(GatheringSettings.read({"task": OWN, "sizes": "3,5", "out": "x"}, {})).all_tasks == (wanted,)
    assert ExploreSettings.read({"task": OWN, "out": "x.safetensors", "steps": "2"}, {}).task_given() is wanted
    assert unreliable_plan(UnreliableSettings.read({"task": OWN, "out": "x"}, {})).subject.task is wanted
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
