"""Tables and settings of memories that are made from other memories: merged, or a sample of one."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from teamsight.policies.memory.order import Table, sort_transitions


class Layout(NamedTuple):
    """What two memories must share to be merged."""

    awareness: Any
    degree: Any
    own: int
    added: int
    facts: tuple[str, ...]


def check_layouts(one: Layout, other: Layout) -> None:
    """Raise an error if the memories of these layouts cannot be merged.

    Raises
    ------
    ValueError
        If they have different degrees of awareness, or different facts.
    """
    if one[:4] != other[:4]:
        first, second = (f"{layout.awareness} with {layout.own} + {layout.added} inputs" for layout in (one, other))
        raise ValueError(
            f"merge: a memory of {first} and one of {second}; explore both under the same degree of awareness"
        )
    if one.facts != other.facts:
        raise ValueError(f"merge: facts {one.facts} and {other.facts}; explore both with the same facts recorded")


def merged_table(tables: Sequence[Table]) -> Table:
    """Return all columns of tables with the same rows, in canonical order."""
    table = np.empty((len(tables[0]), sum(part.shape[1] for part in tables)), np.float32)
    for row, *rows in zip(table, *tables, strict=True):
        np.concatenate(rows, out=row)
    sort_transitions(table)
    return table


def merged_settings(all_settings: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
    """Return the settings that all have in common and, under "merged", each different one."""
    each: list[dict[str, Any]] = []
    for settings in all_settings:
        merged = settings.get("merged")
        parts = merged if isinstance(merged, list) and "sample" not in settings else [dict(settings)]
        each += [one for one in parts if one not in each]
    if len(each) == 1:
        return each[0]
    common = {name: value for name, value in each[0].items() if all(name in one and one[name] == value for one in each)}
    return {**common, "merged": each}


def sampled_table(table: Table, count: int, seed: int) -> Table:
    """Return `count` columns of a table, drawn without replacement, in their order.

    Raises
    ------
    ValueError
        If there are fewer.
    """
    size = table.shape[1]
    if count > size:
        raise ValueError(f"count={count}: the memory has {size} transitions; give a smaller count, or explore longer")
    # Raw words of the generator are the same in all versions of NumPy, unlike numbers derived from them.
    lots = np.random.Philox(key=seed).random_raw(size)
    # Sorted, so that the canonical order is kept.
    chosen = np.sort(np.argsort(lots, kind="stable")[:count])
    sample = np.empty((len(table), count), np.float32)
    for row, whole in zip(sample, table, strict=True):
        np.take(whole, chosen, out=row)
    return sample
