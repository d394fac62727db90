"""`open_study` reads the table of runs that a paper wrote, and says what other files are."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from teamsight import open_study
from teamsight.analysis.papers import PAPERS
from teamsight.analysis.runs.files import write_table
from teamsight.analysis.runs.grid import QUICK
from teamsight.analysis.studies.results import TableResults


@pytest.fixture(scope="module")
def foraging(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return the table of a tiny reproduction."""
    folder, paper = tmp_path_factory.mktemp("results"), PAPERS["balch_arkin1994"]
    paper.reproduce(paper.plan(runs=2, steps=20, robots=(1, 3), attractors=(1,)), folder, formats=())
    return folder / f"{paper.name}.parquet"


def test_the_table_of_a_paper_is_read_summarised_and_drawn(foraging: Path, tmp_path: Path) -> None:
    found = open_study(foraging)
    assert isinstance(found, TableResults)
    stored = pd.read_parquet(foraging)
    pd.testing.assert_frame_equal(found.frame, stored, check_like=False)
    assert found.about[foraging.stem] == stored.attrs[foraging.stem]
    assert found.about[foraging.stem]["steps"] == 20
    # Each run is of one setting, and these are the combinations that occur.
    assert {"robots", "task"} <= set(found.axes)
    assert not set(found.axes) & {"replicate", "seed", *found.measures}
    assert found.settings.iloc[found.setting_numbers].reset_index(drop=True).equals(stored[list(found.axes)])
    assert not found.settings.duplicated().any()
    measure = found.numeric[0]
    summary = found.summary(measure)
    means = stored.groupby(list(found.axes), sort=False, dropna=False)[measure].mean()
    np.testing.assert_allclose(summary["mean"], means, rtol=1e-12)
    assert summary["n"].sum() == len(stored)
    found.plot(tmp_path / "picture.svg", measure=measure, where={"robots": 3})
    assert (tmp_path / "picture.svg").stat().st_size
    for text in (repr(found), found._repr_html_()):
        assert foraging.stem in text
        assert measure in text


def test_the_folder_of_a_paper_is_refused_with_the_name_of_its_table(foraging: Path, tmp_path: Path) -> None:
    pd.DataFrame({"x": [1]}).to_parquet(tmp_path / "other.parquet")
    with pytest.raises(ValueError, match="is not the folder of a study .it has no"):
        open_study(tmp_path)
    (tmp_path / foraging.name).write_bytes(foraging.read_bytes())
    with pytest.raises(ValueError, match=r"is not the folder of a study; give a table of runs that it holds: foraging\.parquet$"):
        open_study(tmp_path)


def test_axes_that_go_together_are_one_group(tmp_path: Path) -> None:
    table = pd.DataFrame({"robots": [1, 1, 2, 2], "team": ["a", "a", "b", "b"], "replicate": [0, 1, 0, 1], "seed": range(4)})
    table["share"], table["curve"] = [0.1, 0.2, 0.3, 0.4], [[1.0, 2.0]] * 4
    write_table(tmp_path / "runs.parquet", table, {"settings": {"runs": 2}, "measures": ["share", "curve"]})
    found = open_study(tmp_path / "runs.parquet")
    assert (found.axes, found.measures, found.numeric) == (("robots", "team"), ("share", "curve"), ("share",))
    # The team follows from the number of robots.
    assert found.groups == (("robots", "team"),)
    assert found.summary()["mean"].tolist() == pytest.approx([0.15, 0.35])


@pytest.mark.short
def test_other_files_are_refused_with_the_cure(tmp_path: Path) -> None:
    pd.DataFrame({"seed": [1]}).to_parquet(tmp_path / "other.parquet")
    (tmp_path / "text.parquet").write_text("mine")
    for name in ("other.parquet", "text.parquet"):
        with pytest.raises(ValueError, match=f"{name}: is no table that a command of teamsight wrote; give the folder"):
            open_study(tmp_path / name)
    write_table(tmp_path / "maxima.parquet", pd.DataFrame({"maximum": [1]}), {"settings": {}})
    # A table whose treatments stand behind the seed would be averaged over them.
    write_table(tmp_path / "unknown.parquet", pd.DataFrame({"seed": [1], "delta": [8], "share": [0.5]}), {"settings": {}})
    for name in ("maxima.parquet", "unknown.parquet"):
        with pytest.raises(ValueError, match=f"{name}: is no table of runs that says .*pandas.read_parquet"):
            open_study(tmp_path / name)
    with pytest.raises(ValueError, match=r"nowhere.parquet: does not exist; give"):
        open_study(tmp_path / "nowhere.parquet")
    (tmp_path / "study.toml").write_text("")
    with pytest.raises(ValueError, match=r"study.toml: is a study file; make its runs with teamsight sweep"):
        open_study(tmp_path / "study.toml")


def test_the_tables_of_the_first_paper_keep_their_treatments_apart(tmp_path: Path) -> None:
    paper = PAPERS["touzet2000"]
    paper.reproduce(paper.plan(figures=("10", "delta"), runs=1, steps=5, grid=QUICK), tmp_path, formats=())
    delta, pairs = open_study(tmp_path / "figure-delta.parquet"), open_study(tmp_path / "figure-10.parquet")
    assert set(delta.axes) == {"robots", "radius", "awareness", "delta"}
    assert delta.measures == ("observed_fraction", "max_neighbours")
    assert set(pairs.axes) == {"robots", "radius", "variant"}
    assert pairs.measures[0] == "difference"


def test_only_studies_are_subtracted(foraging: Path) -> None:
    found = open_study(foraging)
    with pytest.raises(ValueError, match="minus: needs two studies"):
        found.plot(minus=found)
