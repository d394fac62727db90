"""Memories made of memories: merged, or a part of one."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from teamsight.core import checks
from teamsight.policies.memory.order import sort_pairs

if TYPE_CHECKING:
    from teamsight.policies.memory.memory import LazyMemory


def merged(first: LazyMemory, *others: LazyMemory) -> LazyMemory:
    """Return the memory of all pairs of these memories.

    Raises
    ------
    TypeError, ValueError
        If one is no memory, or they are of different degrees of awareness, or hold different facts.
    """
    for other in others:
        if not isinstance(other, type(first)):
            cure = "them one by one, merge(*memories)" if isinstance(other, list | tuple) else "LazyMemory.load(path)"
            raise TypeError(f"merge: {other!r} is no LazyMemory; give {cure}")
        _check_alike(first, other)
    parts = [first, *others]
    table = np.empty((len(first.table), sum(len(part) for part in parts)), np.float32)
    for row, *rows in zip(table, *(part.table for part in parts), strict=True):
        np.concatenate(rows, out=row)
    sort_pairs(table)
    settings = merged_settings([dict(part.settings) for part in parts])
    return type(first)(table, first.own, first.added, first.facts, settings)


def merged_settings(all_settings: Sequence[dict[str, Any]]) -> dict[str, Any]:
    """Return what all settings agree in and, under "merged", each of them that is different."""
    each: list[dict[str, Any]] = []
    for settings in all_settings:
        merged = settings.get("merged")
        parts = merged if isinstance(merged, list) and "sample" not in settings else [settings]
        each += [one for one in parts if one not in each]
    if len(each) == 1:
        return each[0]
    common = {name: value for name, value in each[0].items() if all(name in one and one[name] == value for one in each)}
    return {**common, "merged": each}


def sampled(memory: LazyMemory, count: int, seed: int) -> LazyMemory:
    """Return a memory of `count` of the pairs, drawn by `seed` without putting back.

    Raises
    ------
    ValueError
        If there are fewer.
    """
    count, seed = checks.count("count", count), checks.count("seed", seed, least=0, most=2**128 - 1)
    if count > len(memory):
        raise ValueError(f"count={count}: the memory has {len(memory)} pairs; ask for fewer, or explore for longer")
    # The generator's raw words, unlike what is made of them, never change with the version of NumPy.
    lots = np.random.Philox(key=seed).random_raw(len(memory))
    # In the order of the memory, which is canonical.
    chosen = np.sort(np.argsort(lots, kind="stable")[:count])
    table = np.empty((len(memory.table), count), np.float32)
    for row, whole in zip(table, memory.table, strict=True):
        np.take(whole, chosen, out=row)
    settings = {**memory.settings, "sample": {"count": count, "seed": seed, "of": memory.digest}}
    return type(memory)(table, memory.own, memory.added, memory.facts, settings)


def _check_alike(one: LazyMemory, other: LazyMemory) -> None:
    degrees = [(m.settings.get("awareness"), m.settings.get("degree"), m.own, m.added) for m in (one, other)]
    if degrees[0] != degrees[1]:
        told = [f"{awareness} with {own} + {added} inputs" for awareness, _, own, added in degrees]
        raise ValueError(
            f"merge: a memory of {told[0]} and one of {told[1]}; explore both under the same degree of awareness"
        )
    if one.facts != other.facts:
        raise ValueError(f"merge: facts {one.facts} and {other.facts}; explore both with the same facts recorded")
