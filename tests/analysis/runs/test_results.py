"""Planned runs as rows of a table, and the files of an analysis."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any, NamedTuple

import pandas as pd
import pytest

from teamsight.analysis.runs.checkpoint import Checkpoint
from teamsight.analysis.runs.files import check_results, write_results
from teamsight.analysis.runs.run import Run
from teamsight.analysis.runs.simulate import Planned, run_rows


class Ticks(NamedTuple):
    ticks: int


def ticks(world: Any, steps: int) -> Ticks:
    world.run(steps)
    return Ticks(world.tick)


def mapping(world: Any, steps: int) -> dict[str, int]:
    return ticks(world, steps)._asdict()


def plan(measure: Any, **columns: Any) -> list[Planned]:
    setting = {"robots": 2, "targets": 1, "radius": 1.0}
    return [({"number": number, **columns}, Run(setting, 7, number % 3, measure)) for number in (5, 1, 4)]


@pytest.mark.parametrize("measure", [ticks, mapping])
def test_rows_are_in_the_order_of_the_plan(measure: Any) -> None:
    table = run_rows(iter(plan(measure)))
    assert table.to_dict("list") == {"number": [5, 1, 4], "ticks": [2, 1, 1]}


def test_runs_that_are_kept_are_not_made_again(tmp_path: Path) -> None:
    checkpoint, seen = Checkpoint(tmp_path / "kept"), list[float]()
    first = run_rows(plan(mapping), checkpoint=checkpoint)
    second = run_rows(plan(mapping), checkpoint=checkpoint, progress=lambda done, total: seen.append(done / total))
    assert first.equals(second)
    assert seen == [1.0]


def test_a_measure_cannot_replace_a_column_of_the_plan() -> None:
    with pytest.raises(ValueError, match=r"'ticks'.*another name"):
        run_rows(plan(ticks, ticks=0))


def test_each_kind_of_content_is_written_as_its_file(tmp_path: Path) -> None:
    table = pd.DataFrame({"a": [1.5, 2.5]})
    picture = b"\x89PNG\r\n\x1a\n tEXtSoftware\0teamsight"
    contents = {"a.parquet": table, "a.png": picture, "a.md": "# A\n", "a.json": {"a": 1}}
    for _ in range(2):
        check_results(tmp_path, contents, {"study": 1})
        write_results(tmp_path, contents, {"study": 1})
    found = pd.read_parquet(tmp_path / "a.parquet")
    assert found.equals(table)
    assert found.attrs["study"] == 1
    assert (tmp_path / "a.png").read_bytes() == picture
    assert (tmp_path / "a.md").read_text(encoding="utf-8").endswith("# A\n")
    assert json.loads((tmp_path / "a.json").read_text(encoding="utf-8")) == {"software": "teamsight", "a": 1}


def test_tables_of_other_settings_and_files_of_others_are_kept(tmp_path: Path) -> None:
    write_results(tmp_path, {"a.parquet": pd.DataFrame({"a": [1]})}, {"study": 1})
    with pytest.raises(ValueError, match="other settings.*--force"):
        check_results(tmp_path, ["a.parquet"], {"study": 2})
    check_results(tmp_path, ["a.parquet"], {"study": 2}, force=True)
    check_results(tmp_path, ["a.parquet"])
    (tmp_path / "a.md").write_text("mine", encoding="utf-8")
    with pytest.raises(ValueError, match="something else.*--force"):
        check_results(tmp_path, ["a.md"])
    (tmp_path / "kept").write_text("mine", encoding="utf-8")
    with pytest.raises(ValueError, match="something else.*move it away"):
        check_results(tmp_path, [], checkpoint=Checkpoint(tmp_path / "kept"))
