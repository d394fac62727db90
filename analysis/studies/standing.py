"""How far a study is: the runs that are there, how many its settings need by them, and what is missing.

One rule for a sweep, for `status` and for `open_study`: planned are the runs that are there, and those that a setting
still needs.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from teamsight.analysis.studies.definition.model import Until
from teamsight.analysis.studies.folder.run_set import IDENTITY, RunSet, joined, runs_in

if TYPE_CHECKING:
    from collections.abc import Mapping

    import pyarrow as pa

    from teamsight.analysis.studies.folder.study_folder import StudyFolder
    from teamsight.analysis.studies.plan import Plan
    from teamsight.analysis.studies.study import Study


class Present(NamedTuple):
    """Distinct runs of the settings of a plan that are done or have failed.

    Attributes
    ----------
    setting, replicate : array of int
        The number of the setting in the plan, and that of the replicate.
    has_failed : array of bool
        Whether the run has failed.
    value : array of float
        What `Until.measure` names; NaN for failed runs, and in studies that are not adaptive.
    is_flag : bool
        Whether that is True or False.
    """

    setting: NDArray[np.int64]
    replicate: NDArray[np.int64]
    has_failed: NDArray[np.bool_]
    value: NDArray[np.float64]
    is_flag: bool

    def without(self, lost: RunSet, plan: Plan) -> Present:
        """Return what is left without the runs of which a part is lost: a sweep makes them again."""
        runs = RunSet(plan.ids[self.setting], self.replicate)
        kept = joined((lost, runs)).firsts()[lost.size :] | self.has_failed
        return Present(
            self.setting[kept], self.replicate[kept], self.has_failed[kept], self.value[kept], self.is_flag
        )


class Standing(NamedTuple):
    """How far a study is.

    Attributes
    ----------
    needed : array of int
        Replicates that each setting needs, as far as its runs show.
    is_wide : array of bool
        Whether a setting has reached the limit of `Until` with a wider interval than wanted.
    planned, done, failed, missing : int
        Numbers of runs.
    """

    needed: NDArray[np.int64]
    is_wide: NDArray[np.bool_]
    planned: int
    done: int
    failed: int
    missing: int


def standing(study: Study, plan: Plan, present: Present) -> Standing:
    """Return how far a study is by the runs that are there."""
    needed = np.full(plan.settings, study.replicates, np.int64)
    is_wide = np.zeros(plan.settings, bool)
    if study.until is not None:
        from teamsight.analysis.studies.adaptive import all_needed

        needed, is_wide = all_needed(
            study.until, study.replicates, present.setting, present.replicate, present.value, plan.settings,
            is_flag=present.is_flag,
        )  # fmt: skip
    total = len(present.setting)
    missing = int(needed.sum()) - int((present.replicate < needed[present.setting]).sum())
    failed = int(present.has_failed.sum())
    return Standing(needed, is_wide, total + missing, total - failed, failed, missing)


def present_in(folder: StudyFolder, study: Study, plan: Plan, *, skip_damaged: bool = False) -> Present:
    """Return the runs of a folder; parts are read only if the study is adaptive.

    Raises
    ------
    DamagedError
        If a part is damaged and is not to be skipped.
    """
    failed = folder.failed()
    if study.until is None:
        done, values, is_flag = folder.done(), None, False
    else:
        table = folder.read("runs", [*IDENTITY, study.until.measure], skip_damaged=skip_damaged)
        done, (values, is_flag) = runs_in(table), values_of(table, study.until.measure)
    # One that was made in the meantime is done.
    failed = failed.without(done)
    runs = joined([done, failed])
    value = np.full(runs.size, np.nan)
    if values is not None:
        value[: done.size] = values
    setting = plan.index_of(runs.ids) if runs.size else np.empty(0, np.int64)
    is_planned = setting >= 0
    has_failed = np.arange(runs.size) >= done.size
    present = Present(
        setting[is_planned], runs.replicates[is_planned], has_failed[is_planned], value[is_planned], is_flag
    )
    # In studies that are not adaptive, they are left out of `done` already.
    return present if values is None else present.without(folder.lost(), plan)


def values_of(table: pa.Table, measure: str) -> tuple[NDArray[np.float64], bool]:
    """Return a measure as numbers, and whether it is True or False; NaN where it has no value or is a text."""
    import pyarrow as pa

    if measure in table.column_names and not pa.types.is_string(table[measure].type):
        column = table[measure]
        return column.cast(pa.float64()).to_numpy(), bool(pa.types.is_boolean(column.type))
    return np.full(table.num_rows, np.nan), False


def not_finite_note(counts: Mapping[str, int]) -> str:
    """Return in words in how many runs measures are NaN or infinite; empty for none."""
    if not counts:
        return ""
    each = (f"{name} in {count:,} {'run' if count == 1 else 'runs'}" for name, count in counts.items())
    return f"NaN or infinite: {', '.join(each)}; these runs count as done"


def wide_note(count: int, settings: int, until: Until | None) -> str:
    """Return in words how many settings reached the limit with a wider interval than wanted; empty for none."""
    if until is None or not count:
        return ""
    return (
        f"{count:,} of {settings:,} settings reached until.limit={until.limit} with an interval wider than "
        f"{until.interval:g}; raise until.limit"
    )
