"""Adaptive studies: the same replicates however they are made."""

from __future__ import annotations

import shutil
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pytest

from teamsight.analysis.studies import sweep as sweeping
from teamsight.analysis.studies.folder.parts import RunSet
from teamsight.analysis.studies.folder.study_folder import StudyFolder
from teamsight.analysis.studies.rerun import planned_run
from teamsight.analysis.studies.results import open_study
from teamsight.analysis.studies.shard import _parquet
from teamsight.analysis.studies.standing import status
from teamsight.analysis.studies.study import Until
from teamsight.analysis.studies.sweep import sweep
from tests.analysis.studies.folders import Engine, odd, rows, same_rows, small


@pytest.fixture(autouse=True)
def _path_as_before(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys, "path", list(sys.path))


@pytest.mark.parametrize("shard", [None, (1, 2)])
def test_adaptive_studies_are_the_same_however_they_are_made(
    shard: tuple[int, int] | None, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    study = small(replicates=4, until=Until(0.2, limit=60), steps=10)
    sweep(study, tmp_path / "whole")
    counts = rows(tmp_path / "whole").groupby("setting").size()
    assert counts.min() >= 4
    assert 4 < counts.max() <= 60
    monkeypatch.setattr(sweeping, "_MOST_RUNS", 3)
    if shard:
        for part in (1, 2, 1):
            sweep(study, tmp_path / "out", shard=(part, 2))
    else:
        with pytest.raises(KeyboardInterrupt):
            sweep(study, tmp_path / "out", progress=_interrupting_at(20))
        sweep(study, tmp_path / "out", executor=Engine())
    same_rows(tmp_path / "out", tmp_path / "whole")
    assert sweep(study, tmp_path / "out").made == 0


def _interrupting_at(number: int) -> Any:
    def interrupt(done: int, total: int, seconds_left: float | None) -> None:
        if done >= number:
            raise KeyboardInterrupt

    return interrupt


def test_a_study_that_grew_has_the_rows_of_one_that_began_so(tmp_path: Path) -> None:
    until = Until(0.15, limit=80)
    for replicates in (5, 45):
        sweep(small(replicates=replicates, until=until), tmp_path / "grown")
    made = sweep(small(replicates=45, until=until), tmp_path / "fresh")
    same_rows(tmp_path / "grown", tmp_path / "fresh")
    assert rows(tmp_path / "grown").groupby("setting").size().nunique() > 1
    counts = {(made.planned, made.done), status(tmp_path / "grown")[:2]}
    opened = open_study(tmp_path / "grown")
    assert counts == {(opened.planned, opened.done)} == {(made.done, made.done)}


def test_until_may_come_and_go(tmp_path: Path) -> None:
    """It decides how many replicates there are; those that are there stay, and all counts agree."""
    wide, narrow = Until(9.0, limit=60), Until(1e-6, limit=40)
    for until, planned in ((None, 12), (wide, 152), (narrow, 160), (None, 160), (wide, 160)):
        study = small(until=until)
        made = sweep(study, tmp_path)
        found, opened = status(tmp_path), open_study(tmp_path)
        for each in (made, found, opened):
            assert (each.planned, each.done, each.failed, each.missing) == (planned, planned, 0, 0)
    run = f"{int(small().plan().ids[0]):016x}"
    sweep(small(), tmp_path)
    assert planned_run(tmp_path, f"{run}-39").stored is not None
    with pytest.raises(ValueError, match="replicates are numbered from 0 to 2"):
        planned_run(tmp_path, f"{run}-40")


@pytest.mark.parametrize("shard", [None, (1, 2), (2, 2)])
def test_settings_that_reach_the_limit_with_wide_intervals_are_named(
    shard: tuple[int, int] | None, tmp_path: Path
) -> None:
    study = small(until=Until(1e-6, limit=4))
    made = sweep(study, tmp_path, shard=shard)
    reached = 4 if shard is None else 2
    text = f"{reached} of 4 settings reached until.limit=4 with an interval wider than 1e-06; raise until.limit"
    assert (made.wide, status(tmp_path).wide) == (text, reached)
    assert text in repr(open_study(tmp_path))
    assert sweep(small(until=Until(9.0, limit=4)), tmp_path / "narrow").wide == ""


def test_what_is_there_after_an_interruption_shows_all_settings(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(sweeping, "_MOST_RUNS", 1)
    with pytest.raises(KeyboardInterrupt):
        sweep(small(replicates=20), tmp_path, progress=_interrupting_at(8))
    assert rows(tmp_path).groupby("setting")["replicate"].apply(list).tolist() == [[0, 1]] * 4


def test_lost_runs_are_made_again_beyond_the_first_gap(tmp_path: Path) -> None:
    study = small(axes={"robots": [2]}, until=Until(1e-6, limit=60))
    sweep(study, tmp_path)
    folder = StudyFolder(tmp_path)
    lost = RunSet(np.repeat(study.plan().ids, 2), np.array([3, 50]))
    kept = folder.read("runs").to_pandas()
    shutil.rmtree(tmp_path / "runs")
    kept = kept[~kept["replicate"].isin(lost.replicates)]
    folder.write(
        {"runs": _parquet(pa.Table.from_pandas(kept))},
        [f"{one}-{k}" for one, k in zip(kept["setting"], kept["replicate"], strict=True)],
    )
    assert sweep(study, tmp_path, only=lost).made == 2
    assert status(tmp_path)[:4] == (60, 60, 0, 0)


def test_few_first_replicates_are_mentioned(tmp_path: Path) -> None:
    lines: list[str] = []
    sweep(small(until=Until(9.0)), tmp_path, emit=lines.append)
    assert "until: replicates=3 are only the first; each setting gets at least 38" in lines


def test_an_adaptive_study_of_what_is_not_measured(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match="until.measure='observed': is not measured; did you mean 'observed_fraction'"):
        sweep(small(until=Until(0.2, "observed")), tmp_path / "out")
    assert not (tmp_path / "out").exists()


def test_a_measure_that_is_misspelt_is_noticed_after_the_first_shard(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The annotation of this measure does not name its columns; the folder can be used after the correction."""
    monkeypatch.setattr(sweeping, "_MOST_RUNS", 2)
    with pytest.raises(ValueError, match="until.measure='nope': is not measured"):
        sweep(odd("cmommt", "plain", fixed={"targets": 2}, until=Until(9.0, "nope")), tmp_path)
    assert len(rows(tmp_path)) <= 2
    assert open_study(tmp_path).done == status(tmp_path).done <= 2
    corrected = odd("cmommt", "plain", fixed={"targets": 2}, until=Until(9.0, "is_even", 40))
    assert sweep(corrected, tmp_path).missing == 0


def test_an_adaptive_study_of_a_text(tmp_path: Path) -> None:
    study = odd("cmommt", "numbers", fixed={"targets": 2}, until=Until(0.2, "word"))
    with pytest.raises(ValueError, match="until.measure='word': holds texts; give a measure that is a number"):
        sweep(study, tmp_path / "out")
