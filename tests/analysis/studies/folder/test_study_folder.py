"""The folder of a study: what is written is read back, each run once; what is not of it is refused."""

from __future__ import annotations

from pathlib import Path

import duckdb
import numpy as np
import polars
import pyarrow as pa
import pytest
from made_parts import CODE, content, failed_part, fill, names, part, prepared, runs_of, shards, study, table

from teamsight.analysis.studies.folder.study_folder import Manifest, StudyFolder
from teamsight.core.files import UnwritableError

pytestmark = pytest.mark.short


def test_what_is_written_is_done_and_read_back(tmp_path: Path) -> None:
    folder = prepared(tmp_path / "a")
    plan = folder.study.plan()
    assert (folder.done().size, folder.failed().size, folder.read("runs").num_rows) == (0, 0, 0)
    fill(folder, plan)
    assert set(folder.done().names()) == set(names(plan, runs_of(plan)))
    found = folder.read("runs").sort_by([("robots", "ascending"), ("replicate", "ascending")])
    assert found.equals(table(plan, runs_of(plan)))
    assert StudyFolder(folder.path).study == study()


def test_reading_columns_keeps_the_order_asked_for(tmp_path: Path) -> None:
    folder = prepared(tmp_path)
    fill(folder, folder.study.plan())
    assert folder.read("runs", ["observed_fraction", "setting"]).column_names == ["observed_fraction", "setting"]
    assert folder.read("runs", ["robots"]).num_rows == folder.done().size
    with pytest.raises(ValueError, match="kind='run': unknown; did you mean 'runs'"):
        folder.read("run")


def test_a_run_that_two_parts_have_is_read_once(tmp_path: Path) -> None:
    folder = prepared(tmp_path)
    plan = folder.study.plan()
    fill(folder, plan, 3, steps=True)
    once = {kind: folder.read(kind) for kind in ("runs", "steps")}
    fill(folder, plan, 5, steps=True)
    for kind, before in once.items():
        order = [("robots", "ascending"), ("replicate", "ascending")] + [("step", "ascending")] * (kind == "steps")
        assert folder.read(kind).sort_by(order).equals(before.sort_by(order))
    assert folder.done().size == plan.runs


def test_rows_within_a_part_that_stand_apart_are_all_kept(tmp_path: Path) -> None:
    folder = prepared(tmp_path)
    plan = folder.study.plan()
    rows = table(plan, [(0, 0), (0, 1)], 2).take([0, 2, 1, 3])
    folder.write({"steps": content(rows), "runs": part(plan, [(0, 0), (0, 1)])}, names(plan, [(0, 0), (0, 1)]))
    assert folder.read("steps").equals(rows)


def test_rows_of_a_shard_that_is_not_done_are_left_out(tmp_path: Path) -> None:
    folder = prepared(tmp_path)
    plan = folder.study.plan()
    folder.write({"steps": part(plan, [(0, 0)], 4)}, names(plan, [(0, 0)]))
    assert folder.read("steps").num_rows == folder.done().size == 0
    folder.write({"runs": part(plan, [(0, 0)])}, names(plan, [(0, 0)]))
    assert folder.read("steps").num_rows == 4


def test_a_failed_run_that_was_made_later_is_no_longer_failed(tmp_path: Path) -> None:
    folder = prepared(tmp_path)
    plan = folder.study.plan()
    two = [(0, 0), (1, 2)]
    folder.write({"failed": failed_part(plan, two)}, names(plan, two))
    assert folder.failed().names() == sorted(names(plan, two))
    folder.write({"runs": part(plan, two[:1])}, names(plan, two[:1]))
    assert folder.failed().names() == names(plan, two[1:])
    assert folder.read("failed", ["run"])["run"].to_pylist() == names(plan, two[1:])


def test_parts_with_columns_in_another_order_are_read_as_one_table(tmp_path: Path) -> None:
    folder = prepared(tmp_path)
    plan = folder.study.plan()
    turned = table(plan, [(0, 1)])
    folder.write({"runs": part(plan, [(0, 0)])}, ["a"])
    folder.write({"runs": content(turned.select(turned.column_names[::-1]))}, ["b"])
    assert sorted(folder.read("runs")["replicate"].to_pylist()) == [0, 1]


def test_no_id_is_lost_on_the_way_through_texts() -> None:
    from teamsight.analysis.studies.folder.parts import runs_in

    ids = np.array([0, 1, 2**64 - 1, 0x0123456789ABCDEF, 2**63], np.uint64)
    rows = pa.table({"setting": [f"{one:016x}" for one in ids.tolist()], "replicate": np.arange(5, dtype=np.int32)})
    assert runs_in(rows.slice(1)).ids.tolist() == ids[1:].tolist()
    chunks = pa.concat_tables([rows.slice(0, 2), rows.slice(2)])
    assert runs_in(chunks).ids.tolist() == ids.tolist()
    for wrong in ("0123456789abcdeF", "123", "0123456789abcde\N{LATIN SMALL LETTER E WITH ACUTE}"):
        with pytest.raises(ValueError, match="setting"):
            runs_in(pa.table({"setting": [wrong], "replicate": [0]}))


def test_duckdb_and_polars_read_the_parts_as_they_are(tmp_path: Path) -> None:
    folder = prepared(tmp_path)
    plan = folder.study.plan()
    fill(folder, plan)
    pattern = f"{folder.path}/runs/*.parquet"
    assert duckdb.sql(f"SELECT count(*), max(robots) FROM '{pattern}'").fetchall() == [(plan.runs, 4)]
    assert polars.read_parquet(pattern).height == plan.runs


def test_a_study_may_grow_and_nothing_else(tmp_path: Path) -> None:
    folder = prepared(tmp_path)
    fill(folder, folder.study.plan())
    before = {path: path.read_bytes() for path in folder.path.glob("runs/*")}
    larger = study(replicates=6, robots=(2, 3, 4, 5))
    folder.prepare(larger, larger.plan(), code=CODE, sources={})
    assert folder.study == larger
    assert {path: path.read_bytes() for path in folder.path.glob("runs/*")} == before
    manifest = (folder.path / "manifest.json").read_bytes()
    other = study(steps=800)
    with pytest.raises(ValueError, match="another study .*steps.*9.*800.*give another folder"):
        folder.prepare(other, other.plan(), code=CODE, sources={})
    assert (folder.path / "manifest.json").read_bytes() == manifest


def test_preparing_again_writes_nothing(tmp_path: Path) -> None:
    folder = prepared(tmp_path)
    before = (folder.path / "manifest.json").stat()
    prepared(tmp_path)
    assert (folder.path / "manifest.json").stat().st_ino == before.st_ino


@pytest.mark.parametrize(
    ("code", "sources", "words"),
    [("fedcba9876543210", {"mine": "1"}, "version of teamsight"), (CODE, {"mine": "2"}, "version of module 'mine'")],
)
def test_other_code_is_refused_unless_allowed(
    tmp_path: Path, code: str, sources: dict[str, str], words: str
) -> None:
    folder, one = StudyFolder(tmp_path), study()
    folder.prepare(one, one.plan(), code=CODE, sources={"mine": "1"})
    with pytest.raises(ValueError, match=rf"{words} .*--mixed-code"):
        folder.prepare(one, one.plan(), code=code, sources=sources)
    found = folder.prepare(one, one.plan(), code=code, sources=sources, mixed_code=True)
    assert [dict(each)["code"] for each in found.earlier] == [CODE]
    assert folder.prepare(one, one.plan(), code=code, sources=sources) == found


@pytest.mark.parametrize("name", ["thesis.tex", "Runs", "data.parquet"])
def test_the_folder_of_somebody_else_is_refused_and_not_touched(tmp_path: Path, name: str) -> None:
    (tmp_path / name).write_text("mine")
    folder, one = StudyFolder(tmp_path), study()
    with pytest.raises(UnwritableError, match=rf"holds something else \({name}\); give"):
        folder.prepare(one, one.plan(), code=CODE, sources={})
    with pytest.raises(UnwritableError, match="something else"), folder.lock():
        pass
    assert [path.name for path in tmp_path.iterdir()] == [name]


def test_a_folder_of_runs_of_another_program_is_refused(tmp_path: Path) -> None:
    (tmp_path / "runs").mkdir()
    (tmp_path / "runs" / "2024.csv").write_text("mine")
    with pytest.raises(UnwritableError, match=r"holds something else \(runs/2024.csv\)"):
        prepared(tmp_path)
    assert [path.name for path in tmp_path.rglob("*")] == ["runs", "2024.csv"]


def test_columns_of_types_that_do_not_fit_are_named(tmp_path: Path) -> None:
    folder = prepared(tmp_path)
    plan = folder.study.plan()
    for number, value in enumerate((0.5, "text")):
        rows = table(plan, [(0, number)]).append_column("detail", [[value]])
        folder.write({"events": content(rows), "runs": part(plan, [(0, number)])}, [str(number)])
    with pytest.raises(ValueError, match="events: its parts have columns of different types .*; give columns"):
        folder.read("events")
    assert folder.read("events", ["robots"]).num_rows == 2


def test_a_file_or_an_empty_name_is_no_folder(tmp_path: Path) -> None:
    one = study()
    (tmp_path / "file").write_text("mine")
    for path, words in ((tmp_path / "file", "is a file; give a folder"), ("~/x", "is not expanded")):
        with pytest.raises(UnwritableError, match=words):
            StudyFolder(path).prepare(one, one.plan(), code=CODE, sources={})


def test_what_is_no_study_says_so(tmp_path: Path) -> None:
    for path in (tmp_path, tmp_path / "none"):
        assert not StudyFolder(path).is_prepared
        with pytest.raises(ValueError, match=r"is not the folder of a study \(it has no manifest.json\); give"):
            _ = StudyFolder(path).study


def test_the_manifest_says_where_the_runs_come_from(tmp_path: Path) -> None:
    found = prepared(tmp_path).manifest
    assert isinstance(found, Manifest)
    assert {"python", "teamsight", "numpy", "numba", "pyarrow"} <= set(found.versions)
    assert {"host", "system", "processor", "cores"} <= set(found.machine)
    assert found.types == {"targets": "int", "robots": "int"}
    assert found.code == CODE


def test_a_lost_manifest_is_written_anew_if_all_parts_fit(tmp_path: Path) -> None:
    folder = prepared(tmp_path)
    fill(folder, folder.study.plan())
    (tmp_path / "manifest.json").unlink()
    for wrong, words in ((study(steps=8), "runs of 9 steps, not 8"), (study(robots=(2, 3)), "not planned"), (study(seed=1), "seed")):
        with pytest.raises(UnwritableError, match=f"belongs to another study .*{words}"):
            folder.prepare(wrong, wrong.plan(), code=CODE, sources={})
    assert not folder.is_prepared
    assert prepared(tmp_path).done().size == 12


def test_the_code_of_a_lost_manifest_is_known(tmp_path: Path) -> None:
    folder, one = prepared(tmp_path), study()
    with folder.recorded(engine="test", workers=1, code=CODE):
        fill(folder, folder.study.plan())
    (tmp_path / "manifest.json").unlink()
    with pytest.raises(ValueError, match=f"another version of teamsight \\({CODE}, now f"):
        folder.prepare(one, one.plan(), code="f" * 16, sources={})
    assert not folder.is_prepared
    assert folder.prepare(one, one.plan(), code="f" * 16, sources={}, mixed_code=True).code == "f" * 16


def test_parts_may_be_added_while_others_read(tmp_path: Path) -> None:
    folder = prepared(tmp_path)
    plan, reader = folder.study.plan(), StudyFolder(tmp_path)
    for count, runs in enumerate(shards(plan), 1):
        folder.write({"runs": part(plan, runs)}, names(plan, runs))
        assert reader.done().size == 3 * count == reader.read("runs").num_rows
