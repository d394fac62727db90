"""The ledger: every value of Tan beside ours, with both intervals and a verdict that follows from them."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
import pandas as pd
from scipy.special import stdtrit

from teamsight.analysis.pursuit.paper import LEVEL, RANDOM_TRIALS, RUNS, VALUES, PaperValue
from teamsight.analysis.stats.paired import interval_of

#: A difference is decided only if its 95 % interval is not wider than this share of Tan's value to either side.
WIDEST = 0.25

AGREES, DIFFERS, UNDECIDED = "agrees", "differs", "undecided"


class Row(NamedTuple):
    """A value of Tan, ours, and what follows.

    Attributes
    ----------
    value : PaperValue
        Tan's.
    mean : float
        Ours.
    half90, half95 : float
        Half the widths of our Student's intervals over the runs.
    difference, low, high : float
        Ours minus Tan's, with its 95 % interval.
    verdict : str
        `AGREES` if that interval contains 0 and reaches at most `WIDEST` of Tan's value to either side, `UNDECIDED` if
        it contains 0 and is wider, `DIFFERS` if it does not contain 0.
    """

    value: PaperValue
    mean: float
    half90: float
    half95: float
    difference: float
    low: float
    high: float
    verdict: str


def rows(table: pd.DataFrame) -> list[Row]:
    """Return a row for each value of Tan whose condition is in the table; one row for each run of a `Plan`."""
    have = set(table["condition"])
    return [_row(value, table[table["condition"] == value.condition]) for value in VALUES if value.condition in have]


def _row(value: PaperValue, runs: pd.DataFrame) -> Row:
    found = runs[value.phase].to_numpy(float)
    mean = float(found.mean())
    half90, half95 = (interval_of(found, level).high - mean for level in (LEVEL, 0.95))
    own = found.std(ddof=1) / math.sqrt(len(found)) if len(found) > 1 else math.inf
    his, his_freedom = _error(value)
    wide = _half_width(own, len(found) - 1, his, his_freedom)
    difference = mean - value.steps
    low, high = difference - wide, difference + wide
    is_narrow = wide <= WIDEST * value.steps
    verdict = DIFFERS if low > 0.0 or high < 0.0 else AGREES if is_narrow else UNDECIDED
    return Row(value, mean, half90, half95, difference, low, high, verdict)


def _error(value: PaperValue) -> tuple[float, float]:
    """Return the standard error of a value of Tan, and its degrees of freedom.

    Half a 90 % interval is Student's t times the error. Random hunters were averaged over 200 trials, whose lengths are
    spread about as much as their mean. Where he gives no interval the error is unknown, and counted as 0.
    """
    if value.half is not None:
        return value.half / float(stdtrit(RUNS - 1, 0.5 + LEVEL / 2)), RUNS - 1
    if "random" in value.condition:
        return value.steps / math.sqrt(RANDOM_TRIALS), RANDOM_TRIALS - 1
    return 0.0, math.inf


def _half_width(one: float, one_freedom: float, other: float, other_freedom: float) -> float:
    """Return half the width of Welch's 95 % interval of a difference of two means."""
    parts = np.array([one, other]) ** 2
    total = float(parts.sum())
    if not math.isfinite(total):
        return math.inf
    freedom = np.array([one_freedom, other_freedom])
    spread = float(np.sum(np.where(parts > 0, parts**2 / freedom, 0.0)))
    return float(stdtrit(total**2 / spread, 0.975)) * math.sqrt(total) if spread > 0 else 0.0


def frame(ledger: list[Row]) -> pd.DataFrame:
    """Return the ledger as a table, for a file."""
    return pd.DataFrame([_flat(row) for row in ledger])


def _flat(row: Row) -> dict[str, Any]:
    paper = row.value._asdict()
    return {**paper, "half": math.nan if row.value.half is None else row.value.half, **_ours(row)}


def _ours(row: Row) -> dict[str, Any]:
    return {name: value for name, value in row._asdict().items() if name != "value"}
