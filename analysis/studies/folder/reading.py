"""Reading the parts of one kind as one table with each run once."""

from __future__ import annotations

import contextlib
from collections import Counter
from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from teamsight.analysis.studies.folder import parts
from teamsight.analysis.studies.folder.layout import DONE
from teamsight.analysis.studies.folder.parts import DamagedError, Part
from teamsight.analysis.studies.folder.run_set import IDENTITY, RunSet, joined, runs_in
from teamsight.core.checks import shown

if TYPE_CHECKING:
    import pyarrow as pa


def read_parts(
    folder: Path, kind: str, columns: Iterable[str] | None = None, without: RunSet | None = None, *,
    skip_damaged: bool = False,
) -> pa.Table:  # fmt: skip
    """Return the rows of all parts of a kind.

    A run that several parts have, as those of two machines, is taken from the part whose name comes first.

    Parameters
    ----------
    folder : Path
        The folder of the study.
    kind : str
        Which parts.
    columns : iterable of str, optional
        Names of columns, in the order wanted; all by default.
    without : RunSet, optional
        Runs to leave out.
    skip_damaged : bool
        Leave damaged parts out, in place of raising.

    Raises
    ------
    DamagedError
        If a part is damaged.
    """
    wanted = None if columns is None else list(columns)
    needed = None if wanted is None else [*wanted, *(name for name in IDENTITY if name not in wanted)]
    tables, keys = [], []
    for part in _counting(folder, kind):
        try:
            table = parts.rows(part, parts.load(part), needed)
            keys.append(_runs(part, table))
        except FileNotFoundError:
            # It was set aside meanwhile, and its runs are missing now.
            continue
        except DamagedError:
            if skip_damaged:
                continue
            raise
        tables.append(table)
    whole = _joined(folder / kind, tables, _kept(keys, without))
    return whole if wanted is None else whole.select([name for name in wanted if name in whole.column_names])


def _joined(place: Path, tables: list[pa.Table], kept: list[NDArray[np.bool_]]) -> pa.Table:
    """Return the rows of all parts that are kept as one table."""
    import pyarrow as pa

    if not tables:
        return pa.table({})
    chosen = [table if mask.all() else table.filter(pa.array(mask)) for table, mask in zip(tables, kept, strict=True)]
    try:
        try:
            whole = pa.concat_tables(chosen, promote_options="permissive")
        except (pa.ArrowInvalid, pa.ArrowTypeError):
            # A column without a value has the type of numbers, whatever it holds in other parts.
            whole = pa.concat_tables([_without_empty(table) for table in chosen], promote_options="permissive")
        return whole.replace_schema_metadata(None)
    except (pa.ArrowInvalid, pa.ArrowTypeError) as error:
        raise ValueError(
            f"{place}: its parts have columns of different types ({shown(str(error))}); give columns=[…] of the "
            "others, or read the parts one by one"
        ) from error


def _without_empty(table: pa.Table) -> pa.Table:
    """Return a table without the columns in which all is null."""
    names = zip(table.column_names, table.columns, strict=True)
    return table.select([name for name, column in names if column.null_count < table.num_rows])


def _counting(folder: Path, kind: str) -> list[Part]:
    """Return the parts that count: of kinds other than `DONE`, those that were written beside one of runs."""
    found = parts.listed(folder, kind)
    if kind in DONE:
        return found
    runs: dict[str, Part] = {}
    for part in parts.listed(folder, "runs"):
        runs.setdefault(part.shard, part)
    several = {shard for shard, count in Counter(part.shard for part in found).items() if count > 1}
    # Rarely are there several: a sweep was killed before it wrote the runs, and another version made them again.
    beside = {shard: _beside(runs[shard], kind) for shard in several.intersection(runs)}
    return [
        part for part in found if part.shard in runs and beside.get(part.shard, part.path.name) == part.path.name
    ]  # fmt: skip


def _beside(runs: Part, kind: str) -> str | None:
    """Return the name of the part of a kind that was written beside one of runs; None if none was."""
    with contextlib.suppress(FileNotFoundError, DamagedError):
        return parts.beside(runs, parts.load(runs)).get(kind)
    return None


def _runs(part: Part, table: pa.Table) -> RunSet:
    try:
        return runs_in(table)
    except ValueError as error:
        raise DamagedError(part, str(error)) from None


def _kept(keys: list[RunSet], without: RunSet | None) -> list[NDArray[np.bool_]]:
    """Return which rows of each part are kept: those of runs that no part before it has."""
    if not keys:
        return []
    # Runs have many rows each in some kinds: first come the runs of each part, then their rows.
    starts = [_starts(key) for key in keys]
    blocks = joined([RunSet(key.ids[start], key.replicates[start]) for key, start in zip(keys, starts, strict=True)])
    number = np.repeat(np.arange(len(keys)), [start.sum() for start in starts])
    kept = _first_part(blocks, number)
    if without is not None and without.size:
        left = blocks.without(without)
        kept &= ~joined((left, blocks)).firsts()[left.size :]
    ends = np.cumsum([start.sum() for start in starts])[:-1]
    per_part = np.split(kept, ends)
    return [
        chosen[np.cumsum(start) - 1] if len(start) else np.empty(0, bool)
        for chosen, start in zip(per_part, starts, strict=True)
    ]


def _starts(key: RunSet) -> NDArray[np.bool_]:
    """Return in which rows another run begins than that of the row before."""
    start = np.ones(key.size, bool)
    start[1:] = (key.ids[1:] != key.ids[:-1]) | (key.replicates[1:] != key.replicates[:-1])
    return start


def _first_part(blocks: RunSet, number: NDArray[np.int64]) -> NDArray[np.bool_]:
    """Return whether each block of rows is of the first part that has its run."""
    order, first = blocks.sorted_firsts()
    # The order is stable, so the first of equal blocks is of the first part.
    group = np.cumsum(first) - 1
    found = np.empty(blocks.size, bool)
    found[order] = number[order] == number[order[first]][group] if blocks.size else True
    return found
