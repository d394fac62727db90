"""`Plan`: all runs of a study as columns, without an object for each run."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from functools import cached_property
from typing import TYPE_CHECKING, Literal

import numpy as np
from numpy.typing import NDArray

from teamsight.analysis.runs.run import Run, task_seed
from teamsight.analysis.runs.seeds import seeds_of
from teamsight.analysis.studies.definition.model import CMOMMT_NAME, integers_of, task_named
from teamsight.analysis.studies.definition.values import Components, setting_ids, text_of, thawed

if TYPE_CHECKING:
    from teamsight.analysis.studies.study import Study
    from teamsight.tasks.task import Task

#: The type of a column: int64, double, bool or text; see `definition.values.stored`.
Kind = Literal["int", "number", "flag", "text"]

# Parameters of which worlds with different numbers cannot share arrays; see `Run.likeness`.
_SIZES = ("robots", "targets", "delta")


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

    def __init__(self, study: Study) -> None:
        self.study = study
        blocks = study.blocks
        self.swept: tuple[str, ...] = tuple(name for block in blocks for name in block.columns)
        self.names: tuple[str, ...] = (*study.fixed, *self.swept)
        sizes = [block.size for block in blocks]
        self.settings = math.prod(sizes)
        self.runs = self.settings * study.replicates
        # Of each parameter, how many settings follow each other with one value, and its values: one of a fixed one.
        self._strides = dict.fromkeys(study.fixed, self.settings)
        columns: dict[str, Sequence[object]] = {name: (value,) for name, value in study.fixed.items()}
        for index, block in enumerate(blocks):
            self._strides |= dict.fromkeys(block.columns, math.prod(sizes[index + 1 :]))
            columns |= block.columns
        self._values: dict[str, list[object]] = {name: thawed(tuple(column)) for name, column in columns.items()}
        self._components = Components()
        # Those of the last setting of which one was asked for: its runs follow each other.
        self._seeds: tuple[int, Callable[[int], int]] = -1, int

    @cached_property
    def ids(self) -> NDArray[np.uint64]:
        """Ids of the settings, (settings,); in texts they have 16 hexadecimal digits."""
        return setting_ids(self._values, self._strides, self.settings)

    @cached_property
    def types(self) -> dict[str, Kind]:
        """The type of each parameter's column. Imports the model, whose signature says which are integers."""
        integers = integers_of(self.study.model)
        found: dict[str, Kind] = {}
        for name, values in self._values.items():
            kinds = set(map(type, values))
            if not kinds <= {int, float}:
                found[name] = "flag" if kinds == {bool} else "text"
            else:
                is_whole = name in integers and all(float(value).is_integer() for value in values)  # type: ignore[arg-type]
                found[name] = "int" if is_whole else "number"
        return found

    @cached_property
    def _task(self) -> Task | None:
        """The task of which the scenario enters the seeds."""
        return task_named(self.study.model)

    def stride(self, name: str) -> int:
        """Return how many settings follow each other with one value of a parameter."""
        return self._strides[name]

    def places(self, name: str) -> NDArray[np.int64]:
        """Return where in `values` of a parameter the value of each setting is."""
        which = np.arange(self.settings)
        return which // self._strides[name] % len(self._values[name])

    def values(self, name: str) -> list[object]:
        """Return the values of a parameter, JSON-like: one for a fixed one; of points and samples one for each row."""
        return self._values[name]

    def parameters(self, k: int) -> dict[str, object]:
        """Return the values of setting `k`, JSON-like. Lists and tables in them must not be changed."""
        return {name: values[int(k) // self._strides[name] % len(values)] for name, values in self._values.items()}

    def components(self, k: int) -> dict[str, object]:
        """Return the keyword arguments of the model in setting `k`. Imports its components."""
        return self._components.resolved(self.parameters(k))

    def seed(self, k: int, replicate: int) -> int:
        """Return the seed of one replicate of setting `k`."""
        if k != self._seeds[0]:
            self._seeds = k, self._seeds_of(k)
        return self._seeds[1](replicate)

    def _seeds_of(self, k: int) -> Callable[[int], int]:
        study, given = self.study, self.parameters(k)
        if study.pairing == "none" or (task := self._task) is None:
            return seeds_of(study.seed, given, study.model == CMOMMT_NAME, study.pairing)
        scenario = {name: given[name] for name in task.scenario if name in given}
        return lambda replicate: task_seed(task, study.seed, replicate, scenario)

    def cost(self, k: int) -> float:
        """Return the expected work of a run of setting `k`; see `Run.cost`. Imports its components."""
        return Run(self.components(k), 0, self.study.steps).cost

    @cached_property
    def order(self) -> NDArray[np.int64]:
        """Settings ordered so that alike ones, which can share a built world, follow each other; see `Run.likeness`."""
        keys = []
        for name in sorted(self.swept, reverse=True):
            # Values of equal texts can share a world.
            texts = [
                text_of(value) if name in _SIZES or type(value) not in (int, float) else ""
                for value in self._values[name]
            ]
            numbers = {text: number for number, text in enumerate(dict.fromkeys(texts))}
            if len(numbers) > 1:
                keys.append(np.array([numbers[text] for text in texts])[self.places(name)])
        return np.lexsort(keys) if keys else np.arange(self.settings)

    def index_of(self, ids: NDArray[np.uint64]) -> NDArray[np.int64]:
        """Return the number of the setting with each id, −1 for one that is not planned."""
        order, known = self._sorted
        place = np.minimum(np.searchsorted(known, ids), len(known) - 1)
        return np.where(known[place] == ids, order[place], -1)

    @cached_property
    def _sorted(self) -> tuple[NDArray[np.int64], NDArray[np.uint64]]:
        order = np.argsort(self.ids, kind="stable")
        known = self.ids[order]
        if (known[1:] == known[:-1]).any():
            raise ValueError(
                f"axes: two of {self.settings:,} settings have one id by chance; give a parameter another value"
            )
        return order, known
