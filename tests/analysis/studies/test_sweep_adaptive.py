"""Adaptive studies: the same replicates however they are made."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

import pytest

from teamsight.analysis.studies import sharding
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
    monkeypatch.setattr(sharding, "_MOST_RUNS", 3)
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


def test_an_adaptive_study_of_what_is_not_measured(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match="until.measure='observed': is not measured; did you mean 'observed_fraction'"):
        sweep(small(until=Until(0.2, "observed")), tmp_path / "out")


def test_an_adaptive_study_of_a_text(tmp_path: Path) -> None:
    study = odd("cmommt", "numbers", fixed={"targets": 2}, until=Until(0.2, "word"))
    with pytest.raises(ValueError, match="until.measure='word': holds texts; give a measure that is a number"):
        sweep(study, tmp_path / "out")
