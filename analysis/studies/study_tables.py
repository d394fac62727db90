"""`StudyTables`: the runs of a study that are there, in the order of its plan, and how many are missing."""

from __future__ import annotations

from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from teamsight.analysis.studies import rows
from teamsight.analysis.studies.standing import standing
from teamsight.analysis.studies.summary import summarise
from teamsight.core import checks

if TYPE_CHECKING:
    import pyarrow as pa

    from teamsight.analysis.studies.folder.run_set import RunSet
    from teamsight.analysis.studies.folder.study_folder import StudyFolder
    from teamsight.analysis.studies.plan import Plan
    from teamsight.analysis.studies.study import Study


class StudyTables:
    """What a study has found so far, as tables; `StudyResults` explains the attributes.

    Parameters
    ----------
    folder : StudyFolder
        Where it is.
    study : Study
        What was asked.
    runs, failed : pyarrow.Table
        Rows of the runs that are done, and of those that have failed.
    lost : RunSet, optional
        Those of the runs that are done of which a part beside them is lost.
    """

    def __init__(
        self, folder: StudyFolder, study: Study, runs: pa.Table, failed: pa.Table, lost: RunSet | None = None
    ) -> None:
        self._folder = folder
        self.study: Study = study
        self.folder: Path = folder.path
        self.plan: Plan = study.plan()
        self.axes: tuple[str, ...] = self.plan.swept
        self.measures: tuple[str, ...] = rows.measures_of(runs, self.plan.names)
        self._made = rows.together(runs, failed, self.plan)
        there = rows.present_of(study, self._made)
        present = there if lost is None else there.without(lost, self.plan)
        found = standing(study, self.plan, present)
        self.planned: int = found.planned
        self.done: int = found.done
        self.failed: int = found.failed
        self.missing: int = found.missing
        self.lost: int = len(there.setting) - len(present.setting)
        self.wide: int = int(found.is_wide.sum())

    @property
    def is_complete(self) -> bool:
        """Whether each planned run is done or has failed."""
        return not self.missing

    @property
    def name(self) -> str:
        """The name of the study, or else of its folder."""
        return self.study.name or self.folder.resolve().name

    @cached_property
    def frame(self) -> pd.DataFrame:
        """One row for each run that is done or has failed, in the order of the plan; the index is the run id.

        Columns: the parameters, replicate, seed, steps, the measures, and error, which is None for runs that are done.
        The measures of a failed run are NaN.
        """
        return rows.frame_of(self._made, self.plan.names, self.measures)

    @cached_property
    def settings(self) -> pd.DataFrame:
        """One row for each setting, with or without runs, in the order of the plan: its axes; the index is its id."""
        return rows.settings_of(self.plan, rows.real_columns(self._made.table))

    @property
    def setting_numbers(self) -> NDArray[np.int64]:
        """The row of `settings` of each row of `frame`, (runs,)."""
        return self._made.setting

    @property
    def groups(self) -> tuple[tuple[str, ...], ...]:
        """The axes; those that advance together in one group."""
        return rows.groups_of(self.study)

    @property
    def numeric(self) -> tuple[str, ...]:
        """The measures that are numbers or truth values."""
        return rows.numeric_measures(self._made.table, self.measures)

    def measured(self, measure: str | None = None) -> str:
        """Return the name of a measure of numbers; the first by default.

        Raises
        ------
        ValueError
            If there is no such measure, or it is a text.
        """
        if not self.measures:
            raise ValueError(f"{self.folder}: no run is done yet; run teamsight sweep, or wait")
        if measure is None and self.numeric:
            return self.numeric[0]
        name = checks.choice("measure", measure or self.measures[0], self.measures)
        if name not in self.numeric:
            raise ValueError(f"measure={name}: is a text; give one of numbers: {', '.join(self.numeric) or 'none'}")
        return name

    def statistics(self, measure: str) -> pd.DataFrame:
        """Return n, mean, low, high and maximum of a measure for each row of `settings`."""
        values = rows.numbers(self._made.table, measure)
        return summarise(values, self._made.setting, self.plan.settings, are_flags=self.is_flag(measure))

    def is_flag(self, measure: str) -> bool:
        """Whether a measure is True or False for each run."""
        return rows.is_flag(self._made.table, measure)
