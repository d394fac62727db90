"""Sets of runs as columns: a million runs are two arrays."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from teamsight.analysis.studies.definition.values import run_id

if TYPE_CHECKING:
    import pyarrow as pa

#: The columns that identify a run in every part.
IDENTITY = ("setting", "replicate")

_DIGITS = 16
# The value of each hexadecimal digit by its byte; 255 for other bytes.
_VALUES = np.full(256, 255, np.uint8)
_VALUES[np.frombuffer(b"0123456789abcdef", np.uint8)] = np.arange(16)


class RunSet(NamedTuple):
    """Runs by setting and replicate.

    Attributes
    ----------
    ids : ndarray, shape (N,), uint64
        Id of the setting of each run.
    replicates : ndarray, shape (N,), int64
        Number of each run of its setting.
    """

    ids: NDArray[np.uint64]
    replicates: NDArray[np.int64]

    @property
    def size(self) -> int:
        """The number of runs."""
        return len(self.ids)

    def distinct(self) -> RunSet:
        """Return each run once, in ascending order of setting and replicate."""
        order, first = self.sorted_firsts()
        chosen = order[first]
        return RunSet(self.ids[chosen], self.replicates[chosen])

    def without(self, others: RunSet) -> RunSet:
        """Return the distinct runs that are not among `others`, in order."""
        # The order is stable: of equal runs, that of `others` comes first.
        order, first = joined((others, self)).sorted_firsts()
        chosen = order[first & (order >= others.size)] - others.size
        return RunSet(self.ids[chosen], self.replicates[chosen])

    def firsts(self) -> NDArray[np.bool_]:
        """Return whether each run is the first of those that equal it, shape (N,)."""
        order, first = self.sorted_firsts()
        found = np.empty(self.size, bool)
        found[order] = first
        return found

    def sorted_firsts(self) -> tuple[NDArray[np.int64], NDArray[np.bool_]]:
        """Return the indices that sort the runs, and which of these come first among equal runs."""
        order = np.lexsort((self.replicates, self.ids))
        ids, replicates = self.ids[order], self.replicates[order]
        first = np.ones(self.size, bool)
        first[1:] = (ids[1:] != ids[:-1]) | (replicates[1:] != replicates[:-1])
        return order, first

    def names(self, most: int | None = None) -> list[str]:
        """Return the run ids, at most `most` of them."""
        rows = zip(self.ids[:most].tolist(), self.replicates[:most].tolist(), strict=True)
        return [run_id(setting, replicate) for setting, replicate in rows]


def joined(sets: tuple[RunSet, ...] | list[RunSet]) -> RunSet:
    """Return the runs of several sets one after the other, equal ones as often as they occur."""
    if not sets:
        return RunSet(np.empty(0, np.uint64), np.empty(0, np.int64))
    return RunSet(np.concatenate([each.ids for each in sets]), np.concatenate([each.replicates for each in sets]))


def runs_in(table: pa.Table) -> RunSet:
    """Return the run of each row of a table of parts.

    Raises
    ------
    ValueError
        If a column is missing, or a setting is not 16 hexadecimal digits.
    """
    import pyarrow as pa

    if not table.num_rows:
        return joined([])
    for name in IDENTITY:
        if name not in table.column_names:
            raise ValueError(f"has no column {name!r}")
        if table[name].null_count:
            raise ValueError(f"has rows without {name}")
    try:
        # A text of another length than 16 cannot be cast.
        settings = pa.concat_arrays(table["setting"].cast(pa.string()).cast(pa.binary(_DIGITS)).chunks)
        replicates = table["replicate"].cast(pa.int64()).to_numpy()
    except pa.ArrowException:
        raise ValueError("has another type of settings or replicates than a part") from None
    digits = np.frombuffer(settings.buffers()[1] or b"", np.uint8)[settings.offset * _DIGITS :]
    return RunSet(_ids(digits[: len(settings) * _DIGITS]), replicates.astype(np.int64, copy=False))


def _ids(texts: NDArray[np.uint8]) -> NDArray[np.uint64]:
    """Return the numbers that the bytes of consecutive texts of 16 hexadecimal digits spell."""
    digits = _VALUES[texts]
    if (digits == 255).any():
        raise ValueError("has a setting that is not 16 hexadecimal digits")
    return (digits[0::2] << 4 | digits[1::2]).view(">u8").astype(np.uint64)
