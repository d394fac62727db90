"""The xarray Dataset has the statistics of the summary on the axes of the study."""

from __future__ import annotations

import json
import sys
from pathlib import Path

import numpy as np
import pytest
from made_up_results import results

from teamsight.analysis.studies.study import Study

xarray = pytest.importorskip("xarray")

GRID = Study(axes={"robots": [4, 2, 8], "radius": [2.5, 4.0]}, replicates=3)


@pytest.mark.short
def test_a_grid_has_one_dimension_for_each_axis() -> None:
    found = results(GRID, share=0.7, failing=0.2)
    data = found.to_xarray()
    assert dict(data.sizes) == {"robots": 3, "radius": 2}
    assert data["robots"].values.tolist() == [4, 2, 8]
    for measure in found.measures:
        summary = found.summary(measure)
        for name, statistic in (("", "mean"), ("_low", "low"), ("_high", "high"), ("_maximum", "maximum"), ("_n", "n")):
            for _, row in summary.iterrows():
                value = data[measure + name].sel(robots=row["robots"], radius=row["radius"]).item()
                assert value == pytest.approx(row[statistic], nan_ok=True)
    assert int(data["failed"].sum()) == found.failed


@pytest.mark.short
def test_attributes_hold_the_study_and_what_is_missing() -> None:
    found = results(GRID, share=0.5)
    about = found.to_xarray().attrs
    assert Study.from_dict(json.loads(about["study"])) == GRID
    counts = (about["planned"], about["done"], about["failed"], about["missing"])
    assert counts == (18, found.done, 0, 18 - found.done)
    assert about["partial"] == found.warning


def test_settings_without_runs_are_nan() -> None:
    data = results(GRID, share=0.3, seed=3).to_xarray()
    absent = data["observed_fraction_n"] == 0
    assert absent.any()
    assert np.isnan(data["observed_fraction"].values[absent.values]).all()
    assert np.isfinite(data["observed_fraction"].values[~absent.values]).all()


def test_axes_that_advance_together_share_a_dimension() -> None:
    study = Study(axes={"robots": [2, 4], "targets": [5, 9], "radius": [2.0, 3.0, 4.0]}, zip=[["robots", "targets"]])
    data = results(study).to_xarray()
    assert dict(data.sizes) == {"robots": 2, "radius": 3}
    assert data["targets"].dims == ("robots",)
    assert data.sel(robots=4)["targets"].item() == 9


def test_points_have_the_dimension_setting() -> None:
    study = Study(
        points={"robots": [2, 9, 2], "radius": [2.0, 3.5, 1.0]}, axes={"policy": ["centroid", "evolved"]}, replicates=2
    )
    found = results(study)
    data = found.to_xarray()
    assert dict(data.sizes) == {"policy": 2, "setting": 3}
    assert data["robots"].values.tolist() == [2, 9, 2]
    one = data["observed_fraction"].sel(policy="evolved")[1].item()
    frame = found.frame
    assert one == pytest.approx(
        frame[(frame["policy"] == "evolved") & (frame["robots"] == 9)]["observed_fraction"].mean()
    )


def test_a_single_setting_has_no_dimensions() -> None:
    found = results(Study(fixed={"robots": 3}, replicates=5))
    data = found.to_xarray()
    assert dict(data.sizes) == {}
    assert data["observed_fraction"].item() == pytest.approx(found.frame["observed_fraction"].mean())


def test_components_are_coordinates_of_text() -> None:
    study = Study(axes={"policy": ["centroid", {"use": "a.b:Mine", "gain": 0.5}]}, replicates=2)
    values = results(study).to_xarray()["policy"].values.tolist()
    assert values[0] == "centroid"
    assert json.loads(values[1]) == {"use": "a.b:Mine", "gain": 0.5}


def test_without_xarray_the_error_names_the_extra(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "xarray", None)
    with pytest.raises(ModuleNotFoundError, match=r"pip install 'teamsight\[xarray\]'"):
        results(GRID).to_xarray()


def test_it_can_be_written_as_netcdf(tmp_path: Path) -> None:
    data = results(Study(axes={"policy": ["centroid", "evolved"]}, replicates=2)).to_xarray()
    try:
        data.to_netcdf(tmp_path / "study.nc", engine="scipy")
    except ValueError as error:
        if "engine" in str(error):
            pytest.skip(str(error))
        raise
    with xarray.open_dataset(tmp_path / "study.nc", engine="scipy") as read:
        assert read["observed_fraction"].values == pytest.approx(data["observed_fraction"].values)
