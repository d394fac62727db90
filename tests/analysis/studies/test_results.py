"""Results of a study: all runs in the order of the plan, and what is missing."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pandas as pd
import pyarrow as pa
import pytest
from made_up_results import filled, results, row_of

from teamsight.analysis.studies.folder.study_folder import StudyFolder
from teamsight.analysis.studies.results import open_study
from teamsight.analysis.studies.study import Study
from tests.analysis.studies.folders import odd
from tests.analysis.studies.test_adaptive import replicates_needed

GRID = Study(fixed={"policy": "a-cmommt"}, axes={"robots": [2, 4, 8], "radius": [2.5, 4.0]}, replicates=4, seed=7)


def ids_in_plan(study: Study) -> list[str]:
    plan = study.plan()
    return [f"{int(plan.ids[k]):016x}-{r}" for k in range(plan.settings) for r in range(study.replicates)]


@pytest.mark.short
def test_a_complete_study_has_one_row_a_run_in_the_order_of_the_plan(tmp_path: Path) -> None:
    found = filled(tmp_path / "s", GRID)
    frame = found.frame
    assert frame.index.name == "run"
    assert frame.index.tolist() == ids_in_plan(GRID)
    own = ["policy", "robots", "radius", "replicate", "seed", "steps"]
    assert list(frame.columns) == [*own, "observed_fraction", "max_neighbours", "error"]
    plan = GRID.plan()
    wanted = [plan.seed(k, r) for k in range(plan.settings) for r in range(4)]
    assert frame["seed"].tolist() == wanted
    assert frame["robots"].tolist() == [plan.parameters(k)["robots"] for k in range(plan.settings) for _ in range(4)]
    assert frame["error"].tolist() == [None] * 24
    assert frame["max_neighbours"].dtype == np.int64
    assert (found.planned, found.done, found.failed, found.missing) == (24, 24, 0, 0)
    assert found.is_complete
    assert found.warning == ""


@pytest.mark.short
def test_failed_runs_are_rows_with_their_error(tmp_path: Path) -> None:
    found = filled(tmp_path / "s", GRID, failing=0.5)
    failed = found.frame[found.frame["error"].notna()]
    assert 0 < len(failed) == found.failed < 24
    assert found.is_complete
    assert set(failed["error"]) == {"ValueError: made up"}
    assert failed["observed_fraction"].isna().all()
    assert failed["seed"].notna().all()
    assert found.frame.loc[found.frame["error"].isna(), "observed_fraction"].notna().all()
    assert found.failures.index.equals(failed.index)
    assert "traceback" in found.failures.columns
    assert found.warning == f"{found.failed} of 24 runs failed"


@pytest.mark.short
def test_an_incomplete_study_says_what_is_missing(tmp_path: Path) -> None:
    found = filled(tmp_path / "s", GRID, share=0.5, failing=0.3)
    assert found.missing == 24 - found.done - found.failed > 0
    assert not found.is_complete
    text = f"{found.done} of 24 done, {found.failed} failed, {found.missing} missing"
    assert text in repr(found)
    assert text in found._repr_html_()
    assert found.warning == f"partial: {found.done} of 24 runs, {found.failed} failed"


def test_results_stay_those_of_their_folder_when_the_current_folder_changes(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    study = Study(axes={"robots": [2, 4]}, steps=4, record={"steps": True})
    study.run("made")
    found = open_study("made")
    (tmp_path / "elsewhere").mkdir()
    monkeypatch.chdir(tmp_path / "elsewhere")
    assert len(found.steps) == 8
    again = open_study(tmp_path / "made")
    (tmp_path / "made").rename(tmp_path / "moved")
    with pytest.raises(ValueError, match="made: is not the folder of a study"):
        _ = again.steps


def test_a_measure_that_changes_the_current_folder_ends_no_sweep(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(sys, "path", list(sys.path))
    monkeypatch.chdir(tmp_path)
    found = odd("cmommt", "wandering", axes={"robots": [1, 2]}).run("made")
    assert (found.done, found.folder) == (2, tmp_path / "made")


def test_the_repr_says_whether_a_sweep_is_running(tmp_path: Path) -> None:
    found = filled(tmp_path / "s", GRID, share=0.5)
    running, idle = "12 missing: a sweep is running: open the study again", "12 missing: teamsight sweep continues"
    with StudyFolder(tmp_path / "s").lock():
        assert running in repr(found)
        assert running in found._repr_html_()
    assert idle in repr(found)


def test_a_study_without_runs_opens_empty(tmp_path: Path) -> None:
    found = filled(tmp_path / "s", GRID, share=0.0)
    assert (found.done, found.missing, len(found.frame), found.measures) == (0, 24, 0, ())
    with pytest.raises(ValueError, match=r"no run is done yet; run teamsight sweep"):
        found.summary()


def test_a_study_of_failed_runs_only_has_no_measures(tmp_path: Path) -> None:
    found = filled(tmp_path / "s", GRID, failing=1.0)
    assert (found.done, found.failed, found.measures) == (0, 24, ())
    assert found.frame["error"].notna().all()


def test_a_run_that_failed_and_was_made_later_is_done() -> None:
    found = results(GRID, failing=0.4)
    table = found._folder.read("failed")
    again = [{**row, "observed_fraction": 0.5, "max_neighbours": 1} for row in table.to_pylist()]
    runs = pa.concat_tables([found._folder.read("runs"), pa.Table.from_pylist(again)], promote_options="default")
    later = type(found)(found._folder, GRID, runs, table)
    assert (later.done, later.failed) == (24, 0)
    assert later.frame["error"].isna().all()


def test_runs_that_are_made_meanwhile_are_there_when_the_study_is_opened_again(tmp_path: Path) -> None:
    first = filled(tmp_path / "s", GRID, share=0.4)
    assert not first.is_complete
    second = filled(tmp_path / "s", GRID)
    assert second.is_complete
    assert len(first.frame) == first.done
    pd.testing.assert_frame_equal(second.frame.loc[first.frame.index], first.frame)


def test_a_study_that_grew_has_its_old_rows(tmp_path: Path) -> None:
    small = filled(tmp_path / "a", GRID).frame
    grown = Study(
        axes={"policy": ["a-cmommt", "centroid"], "robots": [2, 4, 8], "radius": [2.5, 4.0]}, replicates=5, seed=7
    )
    large = filled(tmp_path / "b", grown).frame
    pd.testing.assert_frame_equal(large.loc[small.index], small)


def test_a_damaged_part_is_named_with_the_cure(tmp_path: Path) -> None:
    filled(tmp_path / "s", GRID)
    part = sorted((tmp_path / "s" / "runs").iterdir())[0]
    content = bytearray(part.read_bytes())
    content[len(content) // 2] ^= 1
    part.write_bytes(content)
    with pytest.raises(ValueError, match=r"damaged.*teamsight verify") as error:
        open_study(tmp_path / "s")
    assert part.name in str(error.value)
    assert "\n" not in str(error.value)


def test_another_folder_is_refused(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match="s: "):
        open_study(tmp_path / "s")


@pytest.mark.short
def test_the_summary_has_a_row_for_each_setting(tmp_path: Path) -> None:
    found = filled(tmp_path / "s", GRID, share=0.6, failing=0.2)
    summary = found.summary("observed_fraction")
    assert list(summary.columns) == ["robots", "radius", "n", "mean", "low", "high", "maximum"]
    assert summary.index.tolist() == [f"{int(one):016x}" for one in GRID.plan().ids]
    grouped = found.frame.groupby(["robots", "radius"])["observed_fraction"].agg(["count", "mean", "max"])
    wanted = grouped.reindex(pd.MultiIndex.from_frame(summary[["robots", "radius"]]))
    assert summary["n"].tolist() == wanted["count"].fillna(0).tolist()
    assert summary["mean"].to_numpy() == pytest.approx(wanted["mean"].to_numpy(), nan_ok=True)
    assert np.array_equal(summary["maximum"], wanted["max"], equal_nan=True)
    pd.testing.assert_frame_equal(found.summary(), summary)


def test_a_wrong_measure_is_refused_with_the_known_ones(tmp_path: Path) -> None:
    found = filled(tmp_path / "s", GRID)
    with pytest.raises(ValueError, match=r"measure='observed': .*observed_fraction"):
        found.summary("observed")


def test_texts_are_no_measures_to_average() -> None:
    plan = GRID.plan()
    rows = [{**row_of(plan, k, 0), "colour": "red", "loss": 1.5, "flag": k > 2} for k in range(plan.settings)]
    made = results(GRID)
    found = type(made)(made._folder, GRID, pa.Table.from_pylist(rows), pa.table({}))
    assert found.measures == ("colour", "loss", "flag")
    assert found.summary().equals(found.summary("loss"))
    assert found.summary("flag")["mean"].tolist() == [0, 0, 0, 1, 1, 1]
    rates = found.summary("flag")[["low", "high"]].to_numpy()
    # One run does not make a rate certain.
    assert rates[0] == pytest.approx([0.0, 0.793], abs=1e-3)
    assert rates[5] == pytest.approx([0.207, 1.0], abs=1e-3)
    with pytest.raises(ValueError, match=r"measure=colour: is a text; give one of numbers: loss, flag"):
        found.summary("colour")


def test_recorded_tables_are_in_the_order_of_the_plan() -> None:
    study = Study(axes={"robots": [2, 4]}, replicates=2, record={"steps": True})
    found = results(study)
    plan = study.plan()
    identity = [row_of(plan, k, r) for r in (1, 0) for k in (1, 0)]
    rows = [
        {"setting": one["setting"], "replicate": one["replicate"], "step": s, "observed": 3 - s}
        for one in identity
        for s in (1, 2)
    ]
    found._folder.tables["steps"] = pa.Table.from_pylist(rows)  # type: ignore[attr-defined]
    steps = found.steps
    assert steps.index.unique().tolist() == ids_in_plan(study)
    assert steps["step"].tolist() == [1, 2] * 4
    joined = steps.join(found.frame[["robots"]])
    assert joined["robots"].tolist() == [2] * 4 + [4] * 4


def test_what_was_not_recorded_is_refused_with_the_cure() -> None:
    with pytest.raises(ValueError, match=r"trajectories: were not recorded; set trajectories"):
        results(GRID).trajectories  # noqa: B018


def test_points_and_fixed_components_are_columns() -> None:
    policy = {"use": "examples.policy:Mine", "gain": 0.5}
    study = Study(fixed={"policy": policy}, points={"robots": [2, 9, 4], "radius": [2.0, 3.5, 1.0]}, replicates=2)
    found = results(study)
    assert found.axes == ("robots", "radius")
    assert found.frame["robots"].tolist() == [2, 2, 9, 9, 4, 4]
    assert found.summary()["radius"].tolist() == [2.0, 3.5, 1.0]


@pytest.mark.parametrize("engine", ["duckdb", "polars"])
def test_other_tools_read_the_parts_as_they_are(tmp_path: Path, engine: str) -> None:
    found = filled(tmp_path / "s", GRID, failing=0.3)
    frame = found.frame
    runs, failed = (str(tmp_path / "s" / kind / "*.parquet") for kind in ("runs", "failed"))
    if engine == "duckdb":
        duckdb = pytest.importorskip("duckdb")
        query = f"SELECT robots, count(*), avg(observed_fraction) FROM '{runs}' GROUP BY robots ORDER BY robots"
        rows = duckdb.sql(query).fetchall()
        both = f"SELECT count(*) FROM (SELECT * FROM '{runs}' UNION ALL BY NAME SELECT * FROM '{failed}')"
        assert duckdb.sql(both).fetchall() == [(24,)]
        errors = duckdb.sql(f"SELECT run, error FROM '{failed}' ORDER BY run").fetchall()
    else:
        polars = pytest.importorskip("polars")
        column = polars.col("observed_fraction")
        table = (
            polars.scan_parquet(runs).group_by("robots").agg(column.count().alias("n"), column.mean()).sort("robots")
        )
        rows = table.collect().rows()
        whole = polars.concat([polars.read_parquet(runs), polars.read_parquet(failed)], how="diagonal")
        assert len(whole) == 24
        errors = polars.read_parquet(failed).sort("run").select("run", "error").rows()
    wanted = frame.dropna(subset="observed_fraction").groupby("robots")["observed_fraction"].agg(["count", "mean"])
    assert [row[:2] for row in rows] == [(robots, one["count"]) for robots, one in wanted.iterrows()]
    assert [row[2] for row in rows] == pytest.approx(wanted["mean"].tolist())
    assert dict(errors) == frame["error"].dropna().to_dict()


def test_an_adaptive_study_plans_what_its_intervals_need() -> None:
    study = Study(axes={"robots": [2, 4]}, replicates=3, until={"interval": 1e-6, "limit": 8})
    found = results(study)
    # The interval of neither setting is narrow enough: both go on to the limit.
    assert (found.planned, found.done, found.missing) == (16, 6, 10)
    wide = Study(axes={"robots": [2, 4]}, replicates=40, until={"interval": 10.0, "limit": 100})
    assert wide.until is not None
    enough = results(wide)
    values = [rows["observed_fraction"].tolist() for _, rows in enough.frame.groupby("robots")]
    needed = [replicates_needed(wide.until, 40, one) for one in values]
    assert enough.planned == sum(needed) < 200
    assert enough.missing == enough.planned - 80
