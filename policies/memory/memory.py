"""The lazy memory: the transitions of an exploration, kept for learners that search them on demand."""

from __future__ import annotations

import hashlib
import itertools
import json
import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Annotated, Any

import numpy as np
import numpy.typing as npt

from teamsight.core import checks
from teamsight.core.card import card, shown
from teamsight.core.component import Allowed, Component, Count, Index
from teamsight.policies.memory import file
from teamsight.policies.memory.nearest import nearest_columns
from teamsight.policies.memory.transitions import (
    ACTION,
    Table,
    check_layout,
    check_table,
    queries_of,
    sort_transitions,
    table_of,
)


def check_facts(facts: Any) -> None:
    """Raise an error if the names of facts are no text that UTF-8 can encode, or not distinct and in order."""
    if not all(isinstance(name, str) for name in facts):
        raise TypeError(f"facts={checks.shown(facts)}: the name of a fact must be a string")
    if any(one >= other for one, other in itertools.pairwise(facts)):
        raise ValueError(f"facts={checks.shown(facts)}: must be distinct and in alphabetical order")
    try:
        "".join(facts).encode()
    except UnicodeEncodeError:
        raise ValueError(f"facts={checks.shown(facts)}: must be strings that UTF-8 can encode") from None


def from_json(about: Mapping[str, Any]) -> tuple[int, int, tuple[str, ...], dict[str, Any]]:
    """Return own, added, facts and settings from the metadata of a file.

    Raises
    ------
    KeyError
        If one is missing.
    ValueError
        If there are others, or one has a wrong type.
    """
    names = ("own", "added", "facts", "settings")
    own, added, facts, settings = (about[name] for name in names)
    if others := sorted(set(about) - set(names)):
        raise ValueError(f"there are unknown entries, {checks.shown(others)}")
    if type(own) is not int or type(added) is not int:
        raise ValueError(f"own={checks.shown(own)}, added={checks.shown(added)}: must be whole numbers")
    if not isinstance(facts, list):
        raise ValueError(f"facts={checks.shown(facts)}: must be a list of strings")
    return own, added, tuple(facts), settings


def json_of(settings: Mapping[str, Any]) -> dict[str, Any]:
    """Return a copy of settings as JSON holds them.

    Raises
    ------
    ValueError
        If JSON cannot hold them.
    """
    try:
        text = json.dumps(dict(settings), ensure_ascii=False, allow_nan=False)
        text.encode()
        return dict(json.loads(text))
    except (TypeError, ValueError, RecursionError) as error:
        raise ValueError(f"settings: cannot be written as JSON ({error}); give numbers, strings and lists") from None


@dataclass(frozen=True, eq=False, repr=False)
class LazyMemory(Component):
    """Transitions (situation, action, next situation) and the facts from which rewards are computed. Immutable.

    Make one with `LazyMemory.of` or `LazyMemory.load`; the constructor does not check the order of the table.

    Parameters
    ----------
    table : ndarray, shape (columns, transitions), float32
        One row per component, so that the components which a learner compares are contiguous: the situation (`inputs`
        rows), the action (rotation [rad], distance [share of the speed]), the next situation (`inputs` rows), and one
        row per fact. Columns are in canonical order: sorted by content.
    own : int
        Number of components that show targets.
    added : int
        Number of components that the degree of awareness adds.
    facts : tuple of str
        Names of the last rows, in alphabetical order.
    settings : mapping
        Settings of the exploration, JSON-serialisable; "degree" is the name of the degree of awareness,
        "rings" the numbers of sectors of the rings that it adds.
    """

    table: Table
    own: Count
    added: Index
    facts: tuple[str, ...]
    settings: Annotated[Mapping[str, Any], Allowed()] = field(default_factory=dict)

    def __post_init__(self) -> None:
        super().__post_init__()
        check_facts(self.facts)
        check_layout(self.table, self.inputs, len(self.facts))
        frozen = self.table.view(np.ndarray)
        frozen.flags.writeable = False
        object.__setattr__(self, "table", frozen)

    @classmethod
    def of(
        cls,
        situation: npt.ArrayLike,
        action: npt.ArrayLike,
        next_situation: npt.ArrayLike,
        facts: Mapping[str, npt.ArrayLike],
        own: int = 16,
        settings: Mapping[str, Any] | None = None,
    ) -> LazyMemory:
        """Return the memory of these transitions; their order does not matter.

        Parameters
        ----------
        situation, next_situation : array_like, shape (transitions, inputs)
            Readings as shares of their range, 1 where nothing is sensed.
        action : array_like, shape (transitions, 2)
            Rotation in [−π, π] [rad] and distance in [0, 1] [share of the robot's speed].
        facts : mapping of str to array_like, shape (transitions,)
            Facts from which rewards are computed, such as the number of targets gained.
        own : int
            Number of components that show targets; the degree of awareness adds the rest.
        settings : mapping, optional
            Settings of the exploration, JSON-serialisable.

        Raises
        ------
        TypeError, ValueError
            If shapes differ, there is no transition, or a number is not finite or outside its limits.
        """
        table = table_of(situation, action, next_situation, facts)
        inputs = (len(table) - len(ACTION) - len(facts)) // 2
        own = checks.count("own", own, most=inputs)
        return cls(table, own, inputs - own, tuple(sorted(facts)), json_of(settings or {}))

    @classmethod
    def load(cls, path: str | os.PathLike[str], *, verify: bool = True) -> LazyMemory:
        """Return the memory in a file; its table is memory-mapped.

        Parameters
        ----------
        path : path
            A file written by `save`. Do not modify it in place while the memory is in use; `save` replaces it.
        verify : bool
            Verify the checksum, limits and order of the transitions, which reads all of them. Give False only for
            files that no other user can write. The metadata is always verified.

        Raises
        ------
        MemoryFileError
            If it does not exist, is truncated or altered, has another schema, or has invalid content.
        """
        table, sha256, about = file.read(path, verify=verify)
        try:
            memory = cls(table, *from_json(about))
            if verify:
                check_table(table, memory.inputs)
        except (KeyError, TypeError, ValueError) as error:
            reason = f"{error} is missing" if isinstance(error, KeyError) else str(error)
            invalid = f"{path}: its content is invalid ({reason}); write it with LazyMemory.save"
            raise file.MemoryFileError(invalid) from None
        memory.__dict__["sha256"] = sha256
        return memory

    def save(self, path: str | os.PathLike[str], *, force: bool = False) -> None:
        """Write the memory to a file; an existing one is replaced only when the new one is complete.

        Parameters
        ----------
        path : path
            The file, in the open format safetensors: one tensor, `table`, and metadata in JSON.
        force : bool
            Replace any regular file; by default only another memory is replaced.

        Raises
        ------
        MemoryFileError
            If the file cannot be written, or an existing one is not a memory.
        """
        about = {**self._layout, "settings": json_of(self.settings)}
        file.write(path, self.table, self.sha256, about, force=force)

    @property
    def _layout(self) -> dict[str, Any]:
        return {"own": self.own, "added": self.added, "facts": self.facts}

    @cached_property
    def sha256(self) -> str:
        """The checksum of the table."""
        return file.checksum(self.table)

    @cached_property
    def digest(self) -> str:
        """A digest of the transitions and facts, 32 hexadecimal digits; settings have no influence."""
        return hashlib.sha256(f"{json.dumps(self._layout)} {self.sha256}".encode()).hexdigest()[:32]

    def __repr__(self) -> str:
        return f"LazyMemory({len(self)} transitions, {self.own} + {self.added} inputs, {self.digest[:8]})"

    def _repr_html_(self) -> str | None:
        return shown(self._card)

    def _card(self) -> str:
        # Without the digest, which would read the whole table.
        inputs = f"{self.own} for targets, {self.added} for teammates"
        rows = [("transitions", f"{len(self):,}"), ("inputs", inputs), ("facts", ", ".join(self.facts))]
        return card("LazyMemory", [*rows, *((name, value) for name, value in self.settings.items())])

    def __eq__(self, other: object) -> bool:
        return self.digest == other.digest if isinstance(other, LazyMemory) else NotImplemented

    def __hash__(self) -> int:
        return hash(self.digest)

    def __deepcopy__(self, memo: dict[int, Any]) -> LazyMemory:
        # Immutable, and possibly very large.
        return self

    def __reduce__(self) -> tuple[Any, ...]:
        return LazyMemory, (self.table, self.own, self.added, self.facts, self.settings)

    @property
    def inputs(self) -> int:
        """Number of components of a situation."""
        return self.own + self.added

    def __len__(self) -> int:
        return int(self.table.shape[1])

    @property
    def situation(self) -> Table:
        """The situations, shape (transitions, inputs): readings as shares of their range, 1 where nothing is sensed."""
        return self.table[: self.inputs].T

    @property
    def action(self) -> Table:
        """The actions, shape (transitions, 2): rotation [rad], distance [share of the speed]."""
        return self.table[self.inputs : self.inputs + len(ACTION)].T

    @property
    def next_situation(self) -> Table:
        """The next situations, shape (transitions, inputs)."""
        first = self.inputs + len(ACTION)
        return self.table[first : first + self.inputs].T

    def fact(self, name: str) -> Table:
        """Return a fact of each transition, shape (transitions,).

        Raises
        ------
        ValueError
            If the memory does not have the fact.
        """
        if not self.facts:
            raise ValueError(f"fact={name!r}: the memory has no facts; explore, or give facts to LazyMemory.of")
        place = self.facts.index(checks.choice("fact", name, self.facts))
        return np.asarray(self.table[2 * self.inputs + len(ACTION) + place])

    def append(
        self,
        situation: npt.ArrayLike,
        action: npt.ArrayLike,
        next_situation: npt.ArrayLike,
        facts: Mapping[str, npt.ArrayLike],
        settings: Mapping[str, Any] | None = None,
    ) -> LazyMemory:
        """Return a memory with further transitions; see `LazyMemory.of`. By default they have the same settings.

        Raises
        ------
        TypeError, ValueError
            If they are invalid, or of another layout.
        """
        settings = self.settings if settings is None else settings
        return self.merge(LazyMemory.of(situation, action, next_situation, facts, self.own, settings))

    def merge(self, *others: LazyMemory) -> LazyMemory:
        """Return the memory of all transitions of these memories; duplicates are kept.

        Raises
        ------
        TypeError, ValueError
            If one is not a memory, or they have different degrees of awareness or facts.
        """
        for other in others:
            if not isinstance(other, LazyMemory):
                raise TypeError(f"merge: {checks.shown(other)} is not a LazyMemory; give merge(*memories)")
            check_layouts(self, other)
        table = merged_table([self.table, *(one.table for one in others)])
        settings = merged_settings([self.settings, *(one.settings for one in others)])
        return LazyMemory(table, self.own, self.added, self.facts, settings)

    def sample(self, count: int, seed: int) -> LazyMemory:
        """Return a memory of some of the transitions, drawn without replacement.

        Parameters
        ----------
        count : int
            Number of transitions. With one seed, a smaller sample is a subset of a larger one.
        seed : int
            Determines the sample; the order in which transitions were recorded has no effect.

        Raises
        ------
        ValueError
            If there are fewer.
        """
        count, seed = checks.count("count", count), checks.count("seed", seed, least=0, most=2**128 - 1)
        table = sampled_table(self.table, count, seed)
        settings = {**self.settings, "sample": {"count": count, "seed": seed, "of": self.digest}}
        return LazyMemory(table, self.own, self.added, self.facts, settings)

    def nearest(
        self, queries: npt.ArrayLike, k: int, inputs: int | None = None
    ) -> tuple[npt.NDArray[np.int64], npt.NDArray[np.float32]]:
        """Return the k transitions whose situations are nearest to each query, by eq. 1; the nearest first.

        Parameters
        ----------
        queries : array_like, shape (q, inputs)
            Situations.
        k : int
            Number of transitions per query; at most the size of the memory.
        inputs : int, optional
            Number of components that are compared, from the first; all by default.

        Returns
        -------
        index : ndarray, shape (q, k), int64
            The transitions. Equal distances are in canonical order.
        distance : ndarray, shape (q, k), float32
            Sums of absolute differences, added in the order of the components.

        Notes
        -----
        *Source:* §8.1, eq. 1.
        """
        p = self.inputs if inputs is None else checks.count("inputs", inputs, most=self.inputs)
        count = checks.count("k", k)
        if count > len(self):
            raise ValueError(f"k={k}: the memory has {len(self)} transitions; give a smaller k, or explore longer")
        return nearest_columns(self.table, queries_of(queries, p, self.inputs), count)


def check_layouts(one: LazyMemory, other: LazyMemory) -> None:
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
