"""Runs of a study on the live page, by their ids."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from teamsight.analysis.studies.results import open_study
from teamsight.analysis.studies.study import Study
from teamsight.cli.look import WatchSettings, _row_of
from teamsight.live.live_page import worlds_of


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    place = tmp_path_factory.mktemp("study") / "out"
    study = Study(
        fixed={"robots": 4, "targets": 3}, axes={"policy": ["a-cmommt", "centroid"], "awareness": ["none", "ring"]}, replicates=2,
        steps=30,
    )  # fmt: skip
    study.run(place)
    return place


def rows(folder: Path) -> list[dict[str, Any]]:
    return open_study(folder).frame.reset_index().to_dict("records")


def test_a_row_is_the_world_of_its_run(folder: Path) -> None:
    for row in rows(folder):
        worlds, _ = worlds_of(*_row_of(folder, row["run"]), None)
        (track,) = worlds.build(worlds.settings, worlds.seed)
        track.run(30)
        assert worlds.seed == row["seed"]
        assert track.world.observed_fraction == row["observed_fraction"]
        track.world.close()


@pytest.mark.parametrize("run", ["", "x", "../../etc/passwd", "os:system", "0123456789abcdef-0", "0" * 16 + "-99999999999"])
def test_what_is_no_run_is_refused(folder: Path, run: str) -> None:
    with pytest.raises(ValueError, match="run="):
        _row_of(folder, run)


def test_options_that_do_not_go_with_a_run() -> None:
    with pytest.raises(ValueError, match="--study FOLDER"):
        WatchSettings.read({"run": "0123456789abcdef-0"}, {})
    with pytest.raises(ValueError, match="does not go with --run"):
        WatchSettings.read({"run": "0123456789abcdef-0", "study": "x", "robots": "3"}, {})
