"""Tables do not depend on who made them; runs are the model's own, each made once."""

from __future__ import annotations

import pandas as pd
import pytest

from teamsight import CMOMMT
from teamsight.analysis.paper.experiments import chosen
from teamsight.analysis.runs import simulate as runner
from teamsight.analysis.runs.experiment import Experiment, Grid, Run
from teamsight.analysis.runs.simulate import Outcome, Request, make_tables
from teamsight.analysis.runs.workers import JobError, WorkerPool
from teamsight.core.kernel import entry as kernel_entry

GRID = Grid((2, 6), (1.0, 3.0))
SETTING = {"robot_speed": 0.2, "policy_options": {"idle": "wander"}}


def requests(*names: str) -> list[Request]:
    return [Request(SETTING, chosen(names, GRID, SETTING))]


def made(workers: int, *names: str) -> dict[str, pd.DataFrame]:
    with WorkerPool(workers, runner.IMPORTS) as pool:
        return make_tables(pool, requests(*names), root=5, runs=3, steps=30)[0]


def test_tables_do_not_depend_on_the_number_of_workers() -> None:
    names = ("a-cmommt", "centroid", "half-range-scaled", "evasive")
    alone, together = made(1, *names), made(3, *names)
    assert list(alone) == list(together)
    for name in alone:
        pd.testing.assert_frame_equal(alone[name], together[name])


def test_a_run_is_what_the_model_gives_by_hand() -> None:
    row = made(1, "a-cmommt")["a-cmommt"].iloc[-1]
    model = CMOMMT(robots=6, radius=3.0, robot_speed=0.2, policy_options={"idle": "wander"}, rng=int(row["seed"]))
    model.run(30)
    assert (row["robots"], row["radius"], row["replicate"]) == (6, 3.0, 2)
    assert (row["observed_fraction"], row["max_neighbours"]) == (model.observed_fraction, model.max_neighbours)


def test_treatments_of_one_stage_share_its_seed() -> None:
    tables = made(1, "random-walk", "a-cmommt")
    assert tables["random-walk"]["seed"].tolist() == tables["a-cmommt"]["seed"].tolist()
    assert tables["a-cmommt"]["seed"].is_unique


def test_a_run_that_several_need_is_made_once(monkeypatch: pytest.MonkeyPatch) -> None:
    made_runs: list[Run] = []

    def count(run: Run) -> Outcome:
        made_runs.append(run)
        return Outcome(0.5, 1)

    monkeypatch.setattr(runner, "simulate", count)
    one = Experiment("one", {"policy": "random-walk"}, GRID.cells)
    other = Experiment("other", {"policy": "random-walk"}, GRID.cells[:2])
    with WorkerPool(1) as pool:
        # The rule for sharing targets is nothing to a random walk: the same runs under both settings.
        asked = [Request({"policy_options": {"weights": rule}}, made) for rule, made in (("none", [one, other]), ("shared", [one]))]
        tables = make_tables(pool, asked, root=1, runs=2, steps=10)
    assert len([run for run in made_runs if run.steps == 10]) == len(GRID.cells) * 2
    assert [len(table) for found in tables for table in found.values()] == [8, 4, 8]


def test_a_failing_run_tells_its_settings() -> None:
    wrong = Experiment("wrong", {"policy": "a-cmommt"}, ((3, 2.0),))
    with pytest.raises(JobError, match=r"robot_speed=-1.*robots=3, targets=15, radius=2\.0.*rng=\d+"), WorkerPool(2) as pool:
        make_tables(pool, [Request({"robot_speed": -1.0}, [wrong])], root=1, runs=2, steps=10)


def test_progress_grows_to_the_whole() -> None:
    seen: list[tuple[float, float]] = []
    with WorkerPool(1) as pool:
        make_tables(
            pool,
            requests("centroid"),
            root=1,
            runs=2,
            steps=10,
            progress=lambda done, total: seen.append((done, total)),
        )
    assert seen[0][0] == 0
    assert seen == sorted(seen)
    assert seen[-1][0] == pytest.approx(seen[-1][1])


def test_compiling_is_announced_once_and_by_one_worker(monkeypatch: pytest.MonkeyPatch) -> None:
    def compiles(run: Run) -> Outcome:
        kernel_entry.announce("some entry")
        return Outcome(0.5, 1)

    monkeypatch.setattr(runner, "simulate", compiles)
    told: list[str] = []
    with WorkerPool(1, told=told.append) as pool:
        pool.map(runner.compile_kinds, [[Run({"robots": 1}, 0, 1, 1)] * 3])
    assert len(told) == 1
    assert "once per machine" in told[0]


def test_each_kind_is_compiled_before_the_work_is_shared() -> None:
    runs = [run for experiment in requests("a-cmommt", "centroid", "ring-16")[0].experiments
            for _, run in experiment.rows(SETTING, 1, 2, 50)]  # fmt: skip
    kinds = runner._one_of_each_kind(runs)
    assert {(run.parameters["policy"], run.parameters["awareness"]) for run in kinds} == {
        ("a-cmommt", "pairwise"), ("centroid", "none"), ("a-cmommt", "ring"),
    }  # fmt: skip
    assert {run.steps for run in kinds} == {1}
