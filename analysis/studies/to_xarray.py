"""A study's results as an xarray Dataset on its axes."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any

import numpy as np
import pandas as pd

from teamsight.analysis.studies import rows
from teamsight.analysis.studies.describe import what_is_missing
from teamsight.core.extras import extra
from teamsight.core.version import __version__

if TYPE_CHECKING:
    import xarray

    from teamsight.analysis.studies.study_tables import StudyTables

#: The dimension of settings that are listed or drawn one by one.
SETTING = "setting"
_KINDS = {"mean": ("", "mean"), "low": ("_low", "lower end of the 95 % interval of the mean"),
          "high": ("_high", "upper end of the 95 % interval of the mean"), "maximum": ("_maximum", "largest value"),
          "n": ("_n", "number of runs")}  # fmt: skip


def to_xarray(results: StudyTables) -> xarray.Dataset:
    """Return the statistics of all measures; see `StudyResults.to_xarray`.

    Raises
    ------
    ModuleNotFoundError
        If xarray is not installed.
    """
    module = extra("xarray", "to_xarray", "xarray")
    dimensions, coordinates = _dimensions(results)
    shape = tuple(dimensions.values())
    variables: dict[str, Any] = {}
    made = results.setting_numbers
    for measure in results.numeric:
        statistics = results.statistics(measure)
        for statistic, (suffix, words) in _KINDS.items():
            values = statistics[statistic].to_numpy().reshape(shape)
            about = {"long_name": f"{measure.replace('_', ' ')}: {words}"}
            variables[measure + suffix] = (tuple(dimensions), values, about)
    failed = results.frame["error"].notna().to_numpy()
    counts = np.bincount(made[failed], minlength=results.plan.settings).reshape(shape)
    variables["failed"] = (tuple(dimensions), counts, {"long_name": "number of failed runs"})
    found: xarray.Dataset = module.Dataset(variables, coordinates, _attributes(results))
    return found


def _dimensions(results: StudyTables) -> tuple[dict[str, int], dict[str, Any]]:
    """Return the size of each dimension, and the coordinates along them."""
    study = results.study
    listed = [block for block in study.blocks if not rows.is_of_axes(study, block.columns)]
    dimensions: dict[str, int] = {}
    coordinates: dict[str, Any] = {}
    for block in study.blocks:
        name = next(iter(block.columns))
        if block in listed:
            # Points crossed with a sample: two dimensions need two names.
            name = SETTING if len(listed) == 1 else block.where
        dimensions[name] = block.size
        for axis in block.columns:
            values = pd.Series(rows.scalars(results.plan.values(axis)), dtype=results.settings[axis].dtype)
            coordinates[axis] = (name, values.to_numpy())
    return dimensions, coordinates


def _attributes(results: StudyTables) -> dict[str, Any]:
    # Texts and numbers only, which netCDF can hold.
    return {
        "study": json.dumps(results.study.as_dict()), "teamsight": __version__, "planned": results.planned,
        "done": results.done, "failed": results.failed, "missing": results.missing,
        "partial": what_is_missing(results),
    }  # fmt: skip
