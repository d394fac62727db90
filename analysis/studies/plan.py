"""`Plan`: all runs of a study as columns, without an object for each run."""

from __future__ import annotations

import inspect
from collections.abc import Mapping
from functools import cached_property
from typing import Literal, Protocol

import numpy as np
from numpy.typing import NDArray

from teamsight.analysis.runs.run import Run
from teamsight.analysis.runs.seeding import SCENARIO, Pairing, derived_seed
from teamsight.analysis.studies.definition.components import Components
from teamsight.analysis.studies.definition.grid import Block
from teamsight.analysis.studies.definition.identity import setting_ids
from teamsight.analysis.studies.definition.model import integers_of
from teamsight.analysis.studies.definition.values import text_of, thawed

#: The type of a column: int64, double, bool or text; see `definition.values.stored`.
Kind = Literal["int", "number", "flag", "text"]


class Definition(Protocol):
    """What a plan reads of a `Study`."""

    @property
    def model(self) -> str: ...
    @property
    def fixed(self) -> Mapping[str, object]: ...
    @property
    def blocks(self) -> tuple[Block, ...]: ...
    @property
    def replicates(self) -> int: ...
    @property
    def steps(self) -> int: ...
    @property
    def seed(self) -> int: ...
    @property
    def pairing(self) -> Pairing: ...


class Plan:
    """All runs of a study, as columns.

    Settings are numbered from 0 in the order of the study: axes in their order, then points, then the sample; the last
    varies fastest.

    Parameters
    ----------
    study : Study
        The study; its model and components are imported only where a method says so.

    Attributes
    ----------
    study : Study
        The study.
    names : tuple of str
        All given parameters: the fixed ones, then the swept ones.
    swept : tuple of str
        Parameters of axes, points and sample.
    settings, runs : int
        Their numbers; runs are settings times replicates.
    """

    def __init__(self, study: Definition) -> None:
        self.study = study
        blocks = study.blocks
        self.swept: tuple[str, ...] = tuple(name for block in blocks for name in block.columns)
        self.names: tuple[str, ...] = (*study.fixed, *self.swept)
        self._sizes = [block.size for block in blocks]
        self._strides = [int(np.prod(self._sizes[i + 1 :], dtype=object)) for i in range(len(blocks))]
        self.settings = int(np.prod(self._sizes, dtype=object))
        self.runs = self.settings * study.replicates
        # Of each parameter the block that it is in, −1 for fixed ones, and its values there.
        self._home = {name: -1 for name in study.fixed} | {
            name: index for index, block in enumerate(blocks) for name in block.columns
        }
        self._values: dict[str, list[object]] = {name: [thawed(value)] for name, value in study.fixed.items()}
        for block in blocks:
            self._values |= {name: [thawed(value) for value in column] for name, column in block.columns.items()}
        self._components = Components()
        self._seeds: dict[tuple[object, ...], int] = {}

    @cached_property
    def ids(self) -> NDArray[np.uint64]:
        """Ids of the settings, (settings,); in texts they have 16 hexadecimal digits."""
        texts = {name: [text_of(value) for value in values] for name, values in self._values.items()}
        return setting_ids(texts, self._home, self._sizes)

    @cached_property
    def types(self) -> dict[str, Kind]:
        """The type of each parameter's column. Imports the model, whose signature tells integers."""
        integers = integers_of(self.study.model)
        return {name: _kind(values, name in integers) for name, values in self._values.items()}

    def places(self, name: str, settings: NDArray[np.int64] | None = None) -> NDArray[np.int64]:
        """Return where in `values` of this parameter the value of each setting is; by default of all settings."""
        which = np.arange(self.settings) if settings is None else np.asarray(settings)
        home = self._home[name]
        return np.zeros(len(which), np.int64) if home < 0 else which // self._strides[home] % self._sizes[home]

    def values(self, name: str) -> list[object]:
        """Return the values of a parameter, JSON-like: one for a fixed one; of points and samples one for each row."""
        return self._values[name]

    def parameters(self, k: int) -> dict[str, object]:
        """Return the values of setting `k`, JSON-like. They must not be changed."""
        return {name: self._value(name, k) for name in self.names}

    def components(self, k: int) -> dict[str, object]:
        """Return the keyword arguments of the model in setting `k`. Imports its components."""
        return self._components.resolved(self.parameters(k))

    def seed(self, k: int, replicate: int) -> int:
        """Return the seed of one replicate of setting `k`."""
        study = self.study
        if study.pairing == "none":
            return derived_seed(study.seed, replicate, self.parameters(k), False, "none")
        is_cmommt = study.model == "cmommt"
        given = {name: self._value(name, k) for name in SCENARIO if name in self._home} if is_cmommt else {}
        key = (replicate, *map(repr, given.values()))
        if key not in self._seeds:
            self._seeds[key] = derived_seed(study.seed, replicate, given, is_cmommt)
        return self._seeds[key]

    def cost(self, k: int) -> float:
        """Return the expected work of a run of setting `k`; see `Run.cost`. Imports its components."""
        return Run(self.components(k), 0, self.study.steps).cost

    @cached_property
    def order(self) -> NDArray[np.int64]:
        """Settings ordered so that alike ones, which can share a built world, follow each other; see `Run.likeness`."""
        keys = [self._alike(name)[self.places(name)] for name in sorted(self.swept)]
        return np.lexsort(keys[::-1]) if keys else np.arange(self.settings)

    def index_of(self, ids: NDArray[np.uint64]) -> NDArray[np.int64]:
        """Return the number of the setting with each id, −1 for one that is not planned."""
        order, known = self._sorted
        place = np.minimum(np.searchsorted(known, ids), len(known) - 1)
        return np.where(known[place] == ids, order[place], -1)

    @cached_property
    def _sorted(self) -> tuple[NDArray[np.int64], NDArray[np.uint64]]:
        order = np.argsort(self.ids, kind="stable")
        return order, self.ids[order]

    def _value(self, name: str, k: int) -> object:
        home = self._home[name]
        return self._values[name][0 if home < 0 else k // self._strides[home] % self._sizes[home]]

    def _alike(self, name: str) -> NDArray[np.int64]:
        """Return one number for each value of a parameter; values of equal numbers can share a world."""
        matter = name in ("robots", "targets", "delta")
        texts = [text_of(value) if matter or not _is_number(value) else "" for value in self._values[name]]
        numbers = {text: number for number, text in enumerate(dict.fromkeys(texts))}
        return np.array([numbers[text] for text in texts])


def _is_number(value: object) -> bool:
    return isinstance(value, (int, float)) and not isinstance(value, bool)


def _kind(values: list[object], is_integer: bool) -> Kind:
    if all(isinstance(value, bool) for value in values):
        return "flag"
    if not all(map(_is_number, values)):
        return "text"
    return "int" if is_integer and all(value == int(value) for value in values) else "number"  # type: ignore[call-overload]
