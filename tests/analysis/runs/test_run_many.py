"""`run_many`: one row for each run, equal to what the model gives alone."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest

from teamsight import CMOMMT, Disc, Robot, World, run_many
from teamsight.analysis.runs.executor import JobError
from teamsight.analysis.runs.seeds import model_seed, run_seed
from teamsight.policies import RandomWalk


def alone(row: Any, settings: dict[str, Any]) -> tuple[float, int, float]:
    model = CMOMMT(**settings, rng=int(row.seed))
    model.run(int(row.steps))
    history = model.recording.history
    return model.observed_fraction, model.max_neighbours, history["mean_neighbours"].mean()


def test_each_row_is_what_the_model_gives_alone() -> None:
    table = run_many(
        {"robots": [4, 7], "radius": [2.0, 3.5], "awareness": ("none", "ring"), "targets": 5},
        steps=30, replicates=2, rng=4,
    )  # fmt: skip
    assert list(table.columns) == [
        "robots", "radius", "awareness", "targets", "replicate", "seed", "steps", "observed_fraction",
        "max_neighbours", "mean_neighbours",
    ]  # fmt: skip
    assert len(table) == 2 * 2 * 2 * 2
    assert not table[["robots", "radius", "awareness", "replicate"]].duplicated().any()
    for row in table.itertuples():
        settings = {name: getattr(row, name) for name in ("robots", "radius", "awareness", "targets")}
        observed, largest, mean = alone(row, settings)
        assert (row.observed_fraction, row.max_neighbours) == (observed, largest)
        assert row.mean_neighbours == pytest.approx(mean, rel=1e-12)
        assert row.seed == model_seed(4, row.replicate, row.robots, 5, row.radius)


def test_settings_can_be_given_in_three_ways() -> None:
    listed = [{"robots": 3, "radius": 2.0}, {"robots": 3, "radius": 3.0}]
    tables = [
        run_many(settings, steps=10, seeds=[5, 6])
        for settings in (listed, {"robots": 3, "radius": [2.0, 3.0]}, pd.DataFrame(listed), iter(listed))
    ]
    for table in tables[1:]:
        pd.testing.assert_frame_equal(table, tables[0])
    assert tables[0]["seed"].tolist() == [5, 6, 5, 6]
    assert tables[0]["radius"].tolist() == [2.0, 2.0, 3.0, 3.0]


def test_workers_and_progress_change_nothing() -> None:
    settings = {"robots": [3, 5], "policy": ["a-cmommt", "centroid"], "policy_options": {"idle": "wander"}}
    seen: list[tuple[float, float]] = []
    one = run_many(settings, steps=20, replicates=3, rng=1, progress=lambda done, total: seen.append((done, total)))
    two = run_many(settings, steps=20, replicates=3, rng=1, workers=2)
    pd.testing.assert_frame_equal(one, two)
    assert seen[0][0] == pytest.approx(0, abs=1e-6)
    assert seen[-1][0] == pytest.approx(seen[-1][1])


def test_treatments_are_paired_and_roots_differ() -> None:
    table = run_many({"policy": ["a-cmommt", "random-walk"]}, steps=1, replicates=2, rng=3)
    seeds = table.pivot(index="replicate", columns="policy", values="seed")
    assert (seeds["a-cmommt"] == seeds["random-walk"]).all()
    assert seeds["a-cmommt"].nunique() == 2
    assert not set(table["seed"]) & set(run_many({}, steps=1, replicates=2, rng=4)["seed"])
    assert not set(run_many({}, steps=1)["seed"]) & set(run_many({}, steps=1)["seed"])


def disc(size: int, rng: int) -> World:
    world = World(Disc(2.0), rng=rng)
    world.add(Robot, size, policy="random-walk")
    return world


def positions(world: World, steps: int) -> dict[str, float]:
    world.run(steps)
    return {"x": float(world.groups[0].position[0, 0])}


def test_any_model_and_any_measure() -> None:
    table = run_many({"size": [1, 2]}, steps=5, replicates=2, rng=7, model=disc, measure=positions)
    assert list(table.columns) == ["size", "replicate", "seed", "steps", "x"]
    assert table["seed"].tolist() == [run_seed(7, 0), run_seed(7, 1)] * 2
    world = disc(2, table["seed"].iloc[3].item())
    assert positions(world, 5)["x"] == table["x"].iloc[3]


def nothing(world: World, steps: int) -> None:
    pass


@pytest.mark.parametrize(("settings", "named", "error", "message"), [
    ({"rng": [1, 2]}, {}, ValueError, r"settings: 'rng' is not a setting; give it as seeds=\[…\]"),
    ({"seed": 1}, {}, ValueError, r"'seed' is not a setting; give it as seeds=\[…\]"),
    ({"steps": 1}, {}, ValueError, r"'steps' is not a setting; give it as an argument"),
    ([], {}, ValueError, r"settings: there are none to run; give at least one"),
    ({"radius": []}, {}, ValueError, r"settings: there are none"),
    ("robots", {}, TypeError, r"settings='robots': must be a mapping of parameters"),
    ([3], {}, TypeError, r"settings=3: must be a mapping"),
    ({}, {"seeds": [1], "rng": 2}, ValueError, r"seeds: cannot be combined with replicates or rng"),
    ({}, {"seeds": [-1]}, ValueError, r"seeds=-1: must be at least 0"),
    ({}, {"seeds": []}, ValueError, r"seeds: there are none; give at least one"),
    ({}, {"seeds": 3}, TypeError, r"seeds=3: must be several whole numbers, such as \[1, 2\]"),
    ({}, {"replicates": 0}, ValueError, r"replicates=0: must be at least 1$"),
    ({}, {"replicates": 10**7}, ValueError, r"replicates=10000000: must be at most 1000000; give fewer"),
    ({"robots": range(10**10)}, {}, ValueError, r"runs=10000000000: must be at most 1000000; give fewer"),
    ({"robots": range(10**4)}, {"replicates": 10**4}, ValueError, r"runs=100000000: must be at most 1000000"),
    ({}, {"steps": 0}, ValueError, r"steps=0: must be at least 1$"),
    ({}, {"measure": 3}, TypeError, r"measure=3: must be a function that is called as measure\(world, steps\)"),
    ({}, {"model": "CMOMMT"}, TypeError, r"model='CMOMMT': must be a function that is called as model"),
    ({}, {"progress": None}, TypeError, r"progress=None: must be a function"),
    ({3: 4}, {}, TypeError, r"settings: the name 3 must be a text"),
    (pd.DataFrame([[1, 2]], columns=["robots", "robots"]), {}, ValueError, r"the column 'robots' twice; keep one"),
    ({"robots": "five"}, {}, JobError, r"robots='five': must be a whole number of at least 1 \(in the run robots=five"),
    ({"robots": float("inf")}, {}, JobError, r"robots=inf: must be a whole number"),
    ({"robots": None}, {}, JobError, r"robots=None: must be a whole number"),
    ({"targets": 10**400}, {}, JobError, r"targets=.*must be at most 10000000"),
    ({}, {"steps": 0.5}, TypeError, r"steps=0.5"),
    ({}, {"workers": 10_000}, ValueError, r"workers=10000: must be at most"),
    ({"radius": -1}, {}, JobError, r"radius=-1.*in the run radius=-1"),
    ({"colour": "red"}, {}, JobError, r"colour"),
    ({}, {"measure": nothing}, JobError, r"measure returned NoneType: must be a NamedTuple or a mapping.*in the run"),
    ({}, {"measure": lambda world, steps: {"seed": 1}}, JobError, r"measure returned 'seed'.*take another name"),
    ({}, {"measure": lambda world, steps: {}["key"]}, JobError, r"^KeyError: 'key' \(in the run"),
    ({}, {"measure": lambda world, steps: {"world": world}}, JobError, r"a World .* cannot be copied; use state\(\)"),
])  # fmt: skip
def test_what_is_wrong_is_named(settings: Any, named: dict[str, Any], error: type[Exception], message: str) -> None:
    with pytest.raises(error, match=message):
        run_many(settings, **({"steps": 1} | named))


def test_it_is_imported_when_it_is_used() -> None:
    code = "import sys, teamsight; print('numpy' in sys.modules); teamsight.run_many; print('pandas' in sys.modules)"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.split() == ["False", "True"]


def test_an_array_of_values_is_swept() -> None:
    table = run_many({"radius": np.array([1.0, 2.0])}, steps=1, seeds=[0])
    assert table["radius"].tolist() == [1.0, 2.0]


def places(world: World, steps: int) -> dict[str, Any]:
    world.run(steps)
    return {"position": world.groups[0].position, "percept": world.groups[0].percept}


def test_what_a_run_returns_stays_when_the_next_reuses_its_world() -> None:
    table = run_many({"robots": 4, "radius": [2.0, 3.0]}, steps=9, seeds=[1, 2], measure=places)
    for row in table.itertuples():
        model = CMOMMT(robots=4, radius=row.radius, rng=row.seed)
        model.run(9)
        assert row.position.tobytes() == model.robots.position.tobytes()
        assert row.percept.targets.distance.tobytes() == model.robots.percept.targets.distance.tobytes()


class Quiet(RandomWalk):
    """A policy whose repr hides its constants."""

    def __repr__(self) -> str:
        return "Quiet()"


def test_settings_that_look_alike_are_run_each() -> None:
    settings: list[dict[str, Any]] = [{"robots": 3, "policy": Quiet(rate)} for rate in (0.0, 1.0)]
    table = run_many(settings, steps=40, seeds=[1])
    for observed, setting in zip(table["observed_fraction"], settings, strict=True):
        model = CMOMMT(**setting, rng=1)
        model.run(40)
        assert observed == model.observed_fraction
    assert table["observed_fraction"].nunique() == 2


def total(start: Any, rng: int) -> World:
    world = disc(1, rng)
    world.total = start.sum()  # type: ignore[attr-defined]
    return world


def test_long_arrays_that_are_shown_alike_are_run_each() -> None:
    starts = [np.zeros(5000), np.eye(1, 5000, 2500)[0]]
    assert repr(starts[0]) == repr(starts[1])
    table = run_many([{"start": start} for start in starts], steps=1, model=total, measure=lambda world, steps: {
        "total": world.total,  # type: ignore[attr-defined]
    })  # fmt: skip
    assert table["total"].tolist() == [0.0, 1.0]


def test_a_failure_keeps_the_traceback_of_the_function_that_failed() -> None:
    def broken(world: World, steps: int) -> dict[str, float]:
        return {"share": 1 / 0}

    with pytest.raises(JobError, match="ZeroDivisionError: division by zero") as failure:
        run_many({}, steps=1, measure=broken)
    assert "in broken" in str(failure.value.__cause__)


def fragile(robots: int, rng: int) -> World:
    """A model that cannot have three robots."""
    if robots == 3:
        raise KeyError("three")
    return CMOMMT(robots=robots, targets=2, rng=rng)


def breaks(world: World, steps: int) -> dict[str, float]:
    """Fail in the middle of a run, which leaves its world half used."""
    world.run(steps - 1)
    if len(world.robots) == 4:
        raise RuntimeError("the fourth")
    return {"x": float(world.robots.position[0, 0])}


@pytest.mark.parametrize("workers", [1, 2])
def test_a_run_that_fails_is_a_row_and_changes_no_other(workers: int) -> None:
    how: Any = {"steps": 5, "replicates": 2, "rng": 3, "model": fragile, "measure": breaks, "workers": workers}
    table = run_many({"robots": [2, 3, 4, 5]}, **how, on_error="continue")
    assert table["error"].tolist() == [None, None, *["KeyError: 'three'"] * 2, *["RuntimeError: the fourth"] * 2, None, None]
    assert table.loc[2:5, "x"].isna().all()
    whole = run_many({"robots": [2, 5]}, **how)
    assert table.drop(range(2, 6))["x"].tolist() == whole["x"].tolist()
    with pytest.raises(JobError, match="KeyError: 'three'"):
        run_many({"robots": [2, 3]}, **how)


def test_a_measure_has_no_column_for_errors_of_its_own() -> None:
    def measured(world: World, steps: int) -> dict[str, int]:
        return {"error": 3}

    (error,) = run_many({}, steps=2, rng=1, measure=measured, on_error="continue")["error"]
    assert error == "measure returned 'error': the table has this column; take another name"
    assert run_many({}, steps=2, rng=1, measure=measured)["error"].tolist() == [3]


def answer(world: World, steps: int) -> dict[str, Any]:
    return {"answer": lambda: 1}


@pytest.mark.parametrize("measure", [answer, lambda world, steps: {}], ids=["result", "function"])
def test_what_cannot_reach_a_worker_is_named_with_the_cure(measure: Any) -> None:
    with pytest.raises(JobError, match="pickle.*lambda.*define functions in a module, or give workers=1"):
        run_many({}, steps=1, workers=2, measure=measure)


SCRIPT = """
from teamsight import run_many
def mine(world, steps):
    return {"a": 1}
run_many({}, steps=1, workers=2, measure=mine)
"""


@pytest.mark.parametrize(("is_file", "message"), [
    (False, "Can't get attribute 'mine'.*define functions in a module, or give workers=1"),
    (True, r"Error: a worker ended with exit code 1 before its first job.*a file and do so under if __name__ == \"__main__\":"),
], ids=["as in a notebook", "without a guard"])  # fmt: skip
def test_a_program_that_workers_cannot_import_gets_the_cure(tmp_path: Path, is_file: bool, message: str) -> None:
    script = tmp_path / "script.py"
    script.write_text(SCRIPT)
    # With -c, as in a notebook, __main__ has no file.
    command = [sys.executable, str(script)] if is_file else [sys.executable, "-c", SCRIPT]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert re.search(message, done.stderr.splitlines()[-1]), done
