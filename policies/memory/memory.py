"""The lazy memory: what robots met while they explored, kept for learners that ask only when they need an answer."""

from __future__ import annotations

import hashlib
import json
import os
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np
import numpy.typing as npt

from teamsight.core import checks
from teamsight.policies.memory import batch, combine, file
from teamsight.policies.memory.about import check_about, from_json, json_of
from teamsight.policies.memory.order import Table
from teamsight.policies.memory.transitions import ACTION, MOST, check_table, table_of, two_dimensional

__all__ = ["ACTION", "LazyMemory", "Table"]


@dataclass(frozen=True, eq=False, repr=False)
class LazyMemory:
    """Pairs of situation and action, what followed them, and the facts that rewards are made of.

    Make one with `LazyMemory.of` or `LazyMemory.load`; this constructor trusts the order of the table.

    Parameters
    ----------
    table : ndarray, shape (columns, pairs), float32
        One row a component, so that the components which a learner compares lie together: the situation (`inputs`
        rows), the action (rotation [rad], distance [share of the robot's speed]), the next situation (`inputs` rows),
        and one row for each fact. Pairs stand in the order of their content, so that a place says nothing.
    own, added : int
        How many components of a situation show targets, and how many the degree of awareness adds.
    facts : tuple of str
        The names of the last rows, in alphabetical order.
    settings : mapping
        What made the pairs, fit for JSON; "awareness" names the degree.
    """

    table: Table
    own: int
    added: int
    facts: tuple[str, ...]
    settings: Mapping[str, Any] = field(default_factory=dict)

    def __post_init__(self) -> None:
        check_about(self.own, self.added, self.facts, self.settings)
        table = self.table
        columns = 2 * self.inputs + len(ACTION) + len(self.facts)
        if table.dtype != np.float32 or table.ndim != 2 or len(table) != columns or not table.flags.c_contiguous:
            raise ValueError(
                f"table: is {table.dtype} of shape {table.shape}; for {self.inputs} inputs and {len(self.facts)} facts "
                f"it must be dense float32 of shape ({columns}, pairs); use LazyMemory.of"
            )
        frozen = table.view(np.ndarray)
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
        """Return the memory of these pairs, in whichever order they are given.

        Parameters
        ----------
        situation, next_situation : array_like, shape (pairs, inputs)
            Before and after: readings over their range, 1 for nothing.
        action : array_like, shape (pairs, 2)
            Rotation [rad] in −π..π and distance [share of the robot's speed] in 0..1.
        facts : mapping of str to array_like, shape (pairs,)
            What rewards are made of, such as the number of targets gained.
        own : int
            How many components show targets; the rest is what the degree of awareness adds.
        settings : mapping, optional
            What made the pairs, fit for JSON.

        Raises
        ------
        TypeError, ValueError
            If shapes do not fit, there is no pair, or a number is not finite or outside its limits.
        """
        table = table_of(situation, action, next_situation, facts)
        inputs = (len(table) - len(ACTION) - len(facts)) // 2
        own = checks.count("own", own, most=inputs)
        return cls(table, own, inputs - own, tuple(sorted(facts)), json_of(settings or {}))

    @classmethod
    def load(cls, path: str | os.PathLike[str], *, verify: bool = True) -> LazyMemory:
        """Return the memory that a file holds; its table is mapped, not read.

        Parameters
        ----------
        path : path
            A file that `save` wrote. It must not be written into while the memory is in use; `save` replaces it.
        verify : bool
            Compare the pairs with their checksum, and check their numbers and their order, which reads all of them;
            otherwise none is read, and they, their checksum and the digest are taken as they are. Give False only for
            files that nobody else can write. The rest is always verified.

        Raises
        ------
        MemoryFileError
            If it is not there, cut off, altered, of another schema, or nothing that `of` and `save` could have made.
        """
        table, sha256, about = file.read(path, verify=verify)
        try:
            memory = cls(table, *from_json(about))
            if verify:
                check_table(table, memory.inputs)
        except (KeyError, TypeError, ValueError) as error:
            told = f"nothing of its {error}" if isinstance(error, KeyError) else str(error)
            raise file.MemoryFileError(f"{path}: does not say what it holds ({told}); write it with save") from None
        memory.__dict__["sha256"] = sha256
        return memory

    def save(self, path: str | os.PathLike[str], *, force: bool = False) -> None:
        """Write the memory to one file; whatever stood there stays until all is written.

        Parameters
        ----------
        path : path
            Where to; another memory is replaced. The file is in the open format safetensors: one tensor, `table`, and
            metadata in JSON.
        force : bool
            Replace any regular file, not only a memory.

        Raises
        ------
        MemoryFileError
            If the file cannot be written, or what stands there is no memory.
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
        """A name for what the memory holds, 32 hexadecimal digits; where it came from does not matter."""
        return hashlib.sha256(f"{json.dumps(self._layout)} {self.sha256}".encode()).hexdigest()[:32]

    def __repr__(self) -> str:
        return f"LazyMemory({len(self)} pairs, {self.own} + {self.added} inputs, {self.digest[:8]})"

    def __eq__(self, other: object) -> bool:
        return self.digest == other.digest if isinstance(other, LazyMemory) else NotImplemented

    def __hash__(self) -> int:
        return hash(self.digest)

    def __deepcopy__(self, memo: dict[int, Any]) -> LazyMemory:
        # Nothing in it changes, and it may be the largest thing on the machine.
        return self

    def __reduce__(self) -> tuple[Any, ...]:
        return LazyMemory, (self.table, self.own, self.added, self.facts, self.settings)

    @property
    def inputs(self) -> int:
        """How many components a situation has."""
        return self.own + self.added

    def __len__(self) -> int:
        return int(self.table.shape[1])

    @property
    def situation(self) -> Table:
        """Where the robot was, shape (pairs, inputs); readings over their range, 1 for nothing."""
        return self.table[: self.inputs].T

    @property
    def action(self) -> Table:
        """What it did, shape (pairs, 2): rotation [rad], distance [share of its speed]."""
        return self.table[self.inputs : self.inputs + len(ACTION)].T

    @property
    def next_situation(self) -> Table:
        """Where that led, shape (pairs, inputs)."""
        first = self.inputs + len(ACTION)
        return self.table[first : first + self.inputs].T

    def fact(self, name: str) -> Table:
        """Return a fact of every pair, shape (pairs,).

        Raises
        ------
        ValueError
            If the memory has no such fact.
        """
        if not self.facts:
            raise ValueError(
                f"fact={name!r}: the memory holds none; explore with teamsight, or give LazyMemory.of its facts"
            )
        place = self.facts.index(checks.choice("fact", name, self.facts))
        fact: Table = self.table[2 * self.inputs + len(ACTION) + place]
        return fact

    def append(
        self,
        situation: npt.ArrayLike,
        action: npt.ArrayLike,
        next_situation: npt.ArrayLike,
        facts: Mapping[str, npt.ArrayLike],
        settings: Mapping[str, Any] | None = None,
    ) -> LazyMemory:
        """Return a memory of these pairs too; see `LazyMemory.of`. By default the same settings made them.

        Raises
        ------
        TypeError, ValueError
            If they cannot be a memory, or one of another kind.
        """
        made_by = self.settings if settings is None else settings
        return self.merge(LazyMemory.of(situation, action, next_situation, facts, self.own, made_by))

    def merge(self, *others: LazyMemory) -> LazyMemory:
        """Return the memory of all pairs of these memories; what is in two of them is in it twice.

        Raises
        ------
        ValueError
            If they are of different degrees of awareness, or hold different facts.
        """
        return combine.merged(self, *others)

    def sample(self, count: int, seed: int) -> LazyMemory:
        """Return a memory of some of the pairs, drawn without putting back.

        Parameters
        ----------
        count : int
            How many. With one seed, fewer are a part of more.
        seed : int
            Together with the pairs it decides which; the order in which they were recorded does not.

        Raises
        ------
        ValueError
            If there are fewer.
        """
        return combine.sampled(self, count, seed)

    def nearest(
        self, queries: npt.ArrayLike, k: int, inputs: int | None = None
    ) -> tuple[npt.NDArray[np.int64], npt.NDArray[np.float32]]:
        """Return the k pairs whose situations are most similar to each query, by eq. 1; the nearest first.

        Parameters
        ----------
        queries : array_like, shape (q, inputs)
            Situations.
        k : int
            How many pairs for each; at most as many as there are.
        inputs : int, optional
            Compare the first so many components only; by default all.

        Returns
        -------
        index : ndarray, shape (q, k), int64
            The pairs. Among equal distances those come first whose content is smaller.
        distance : ndarray, shape (q, k), float32
            How far their situations are: the sum of absolute differences, in the order of the components.

        Notes
        -----
        *Source:* section 8.1, eq. 1.
        """
        p = self.inputs if inputs is None else checks.count("inputs", inputs, most=self.inputs)
        count = checks.count("k", k)
        if count > len(self):
            raise ValueError(f"k={k}: the memory has {len(self)} pairs; ask for fewer, or explore for longer")
        asked = two_dimensional("queries", queries)
        if asked.shape[1] not in (p, self.inputs):
            raise ValueError(f"queries: have {asked.shape[1]} components; {p} of the memory's are compared: give {p}")
        asked = np.ascontiguousarray(asked[:, :p], np.float32)
        if not (np.abs(asked) <= MOST).all():
            raise ValueError(f"queries: hold NaN or more than {MOST:g}; a situation's readings are finite")
        return batch.nearest(self.table, asked, count)
