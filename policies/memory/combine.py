"""Tables and settings of memories that are made from other memories: merged, or a sample of one."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, Protocol

import numpy as np

from teamsight.policies.memory.order import Table, sort_transitions


class Described(Protocol):
    """The part of `LazyMemory` that decides whether two can be merged; memories import this file."""

    @property
    def own(self) -> int: ...
    @property
    def added(self) -> int: ...
    @property
    def facts(self) -> tuple[str, ...]: ...
    @property
    def settings(self) -> Mapping[str, Any]: ...


def check_layouts(one: Described, other: Described) -> None:
    """Raise an error if two memories cannot be merged.

    Raises
    ------
    ValueError
        If they have different degrees of awareness, or different facts.
    """
    layouts = [(m.settings.get("awareness"), m.settings.get("degree"), m.own, m.added) for m in (one, other)]
    if layouts[0] != layouts[1]:
        first, second = (f"{awareness} with {own} + {added} inputs" for awareness, _, own, added in layouts)
        raise ValueError(
            f"merge: a memory of {first} and one of {second}; explore both under the same degree of awareness"
        )
    if one.facts != other.facts:
        raise ValueError(f"merge: facts {one.facts} and {other.facts}; explore both with the same facts recorded")


def merged_table(tables: Sequence[Table]) -> Table:
    """Return all columns of tables with the same rows, in canonical order."""
    table = np.concatenate(tables, axis=1)
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
    return np.take(table, chosen, axis=1)
