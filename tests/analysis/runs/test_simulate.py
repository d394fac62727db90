"""Results do not depend on who makes a run; each run is made once, as the model makes it by hand."""

from __future__ import annotations

import warnings

import pandas as pd
import pytest

from teamsight import CMOMMT
from teamsight.agents.reused_worlds import ReusedWorlds
from teamsight.analysis.papers.touzet2000.experiments import experiments_of
from teamsight.analysis.runs import simulate
from teamsight.analysis.runs.executor import JobError
from teamsight.analysis.runs.experiment import Experiment, make_tables
from teamsight.analysis.runs.grid import Grid
from teamsight.analysis.runs.processes import WorkerPool
from teamsight.analysis.runs.run import Outcome, Run
from teamsight.analysis.runs.simulate import run_all
from teamsight.core.kernel import entry as kernel_entry

GRID = Grid((2, 6), (1.0, 3.0))
SETTING = {"robot_speed": 0.2, "policy_options": {"idle": "wander"}}


def requests(*names: str) -> list[tuple[dict[str, object], list[Experiment]]]:
    return [(SETTING, experiments_of(names))]


def made(workers: int, *names: str) -> dict[str, pd.DataFrame]:
    with WorkerPool(workers) as pool:
        return make_tables(requests(*names), pool, grid=GRID, root=5, runs=3, steps=30)[0]


@pytest.fixture
def runs(monkeypatch: pytest.MonkeyPatch) -> list[Run]:
    """The runs that are made, none of which simulates anything."""
    found: list[Run] = []

    def make(run: Run, worlds: ReusedWorlds) -> Outcome:
        found.append(run)
        return Outcome(float(run.seed), len(found))

    monkeypatch.setattr(Run, "make", make)
    return found


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


def test_treatments_of_one_scenario_share_its_seed() -> None:
    tables = made(1, "random-walk", "a-cmommt")
    assert tables["random-walk"]["seed"].tolist() == tables["a-cmommt"]["seed"].tolist()
    assert tables["a-cmommt"]["seed"].is_unique


def test_a_run_that_several_experiments_need_is_made_once(runs: list[Run]) -> None:
    one = Experiment("one", {"policy": "random-walk"}, GRID.cells)
    other = Experiment("other", {"policy": "random-walk"}, GRID.cells[:2])
    # A random walk has no rule for sharing targets: the same runs under both settings.
    asked = [
        ({"policy_options": {"weights": rule}}, experiments)
        for rule, experiments in (("none", [one, other]), ("shared", [one]))
    ]
    tables = make_tables(asked, root=1, runs=2, steps=10)
    assert len(runs) == len(GRID.cells) * 2
    assert [len(table) for found in tables for table in found.values()] == [8, 4, 8]


def test_like_follows_like_and_results_keep_the_order_of_the_runs(runs: list[Run]) -> None:
    mixed = [
        Run({"robots": robots, "targets": 3, "radius": float(seed), "policy": policy}, seed, 5)
        for seed in range(4)
        for robots in (2, 3)
        for policy in ("centroid", "stationary")
    ]
    assert [found.observed_fraction for found in run_all(mixed)] == [run.seed for run in mixed]
    order = [(run.parameters["policy"], run.parameters["robots"]) for run in runs]
    assert order == sorted(order)
    assert [run.seed for run in runs] == [0, 1, 2, 3] * 4


def test_a_small_batch_is_shared_among_all_workers(runs: list[Run]) -> None:
    few = [Run({"robots": 2, "targets": 2}, seed, 10) for seed in range(20)]
    entries = [(run.key, run) for run in few]
    costs = {run.key: run.cost for run in few}
    assert len(simulate._chunks(entries, costs, 1)) == 1
    chunks = simulate._chunks(entries, costs, 3)
    assert len(chunks) >= 9
    assert [entry for chunk in chunks for entry in chunk] == entries


@pytest.mark.parametrize("steps", [10, 10_000])
def test_the_last_chunks_are_small_so_that_workers_end_together(steps: int) -> None:
    entries = [((str(seed),), Run({"robots": 2, "targets": 2}, seed, steps)) for seed in range(1000)]
    costs = {key: run.cost for key, run in entries}
    sizes = [len(chunk) for chunk in simulate._chunks(entries, costs, 2)]
    assert sizes == sorted(sizes, reverse=True)
    # The last one is what is left.
    assert sizes[0] / 5 < sizes[-2] < sizes[0] / 3


def test_the_error_of_a_failing_run_contains_its_settings() -> None:
    wrong = Experiment("wrong", {"policy": "a-cmommt"}, ((3, 2.0),))
    settings = r"robot_speed=-1.*robots=3, targets=15, radius=2\.0.*rng=\d+"
    with pytest.raises(JobError, match=settings), WorkerPool(2) as pool:
        make_tables([({"robot_speed": -1.0}, [wrong])], pool, root=1, runs=2, steps=10)


def test_progress_grows_to_the_whole() -> None:
    seen: list[tuple[float, float]] = []
    make_tables(requests("centroid"), grid=GRID, root=1, runs=2, steps=10, progress=lambda done, total: seen.append((done, total)))
    assert seen[0][0] == 0
    assert seen == sorted(seen)
    assert seen[-1][0] == pytest.approx(seen[-1][1])


def test_compilation_is_announced_once(monkeypatch: pytest.MonkeyPatch) -> None:
    def compiles(run: Run, worlds: ReusedWorlds) -> Outcome:
        kernel_entry.announce("some entry")
        return Outcome(0.5, 1)

    monkeypatch.setattr(simulate, "_announced", False)
    monkeypatch.setattr(Run, "make", compiles)
    messages: list[str] = []
    with WorkerPool(1, on_message=messages.append) as pool:
        run_all([Run({"robots": 1}, seed, 1) for seed in range(3)], pool)
    assert len(messages) == 1
    assert "once per machine" in messages[0]


def test_each_kind_is_compiled_before_the_work_is_shared() -> None:
    asked = [run for experiment in requests("a-cmommt", "centroid", "ring-16")[0][1]
             for _, run in experiment.rows(SETTING, 1, 2, 50, GRID)]  # fmt: skip
    kinds = simulate._one_of_each_kind(asked)
    assert {(run.parameters["policy"], run.parameters["awareness"]) for run in kinds} == {
        ("a-cmommt", "pairwise"), ("centroid", "none"), ("a-cmommt", "ring"),
    }  # fmt: skip
    assert {run.steps for run in kinds} == {1}


def test_worlds_are_closed_also_when_a_run_fails() -> None:
    closed: list[int] = []

    class Model:
        def __init__(self, rng: int) -> None:
            self.seed = rng

        def close(self) -> None:
            closed.append(self.seed)

    def measure(world: Model, steps: int) -> int:
        if world.seed == 2:
            raise ValueError("wrong")
        return world.seed

    with pytest.raises(JobError, match=r"wrong \(in the run steps=1, rng=2\)"):
        run_all([Run({}, seed, 1, measure, Model) for seed in range(4)])  # type: ignore[arg-type]
    assert closed == [0, 1, 2]


def test_a_chunk_is_described_without_the_contents_of_its_policies() -> None:
    described = simulate._describe([Run({"robots": 2, "policy": "x" * 5000}, seed, 1) for seed in range(3)])
    assert described.startswith("3 jobs, the first of which is the run robots=2, policy=xxx")
    assert len(described) < 200


def test_the_short_runs_that_compile_warn_of_nothing() -> None:
    from teamsight import Cycle

    run = Run({"robots": 2, "cycle": Cycle(20, phase=8)}, 1, 40)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        simulate._compile(simulate._one_of_each_kind([run]))
