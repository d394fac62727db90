"""What can be charted of a world beside what frames hold: numbers of it, its groups, its events and its reporters."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable, Iterable, Mapping
from functools import partial
from types import MappingProxyType
from typing import Any

import numpy as np

from teamsight.agents.world import World

#: What a `World` measures over its whole run, by what a page calls it. Frames have the values of the moment.
SO_FAR = {
    "observed so far": "observed_fraction", "mean neighbours so far": "mean_neighbours",
    "max neighbours so far": "max_neighbours",
}  # fmt: skip
_EVENTS = "events "
_NUMBERS = ("int", "float", "bool", int, float, bool)


def _properties(model: type[World]) -> tuple[str, ...]:
    """Return the properties of a model, beyond those of any `World`, that say that they are numbers."""
    found = {
        name: getattr(model, name) for name in dir(model) if not name.startswith("_") and not hasattr(World, name)
    }
    return tuple(
        name for name, one in found.items()
        if isinstance(one, property) and getattr(one.fget, "__annotations__", {}).get("return") in _NUMBERS
    )  # fmt: skip


def _active(group: Any) -> int:
    return int(np.count_nonzero(group.active))


def _mean(column: Any) -> float:
    return float(np.mean(column.values)) if len(column.values) else math.nan


class Measures:
    """The measures of a world by name, as they are now.

    They follow from the world: what it measures so far; each property of its class whose annotation is a number; of
    each group how many are active, and the mean of each column of the user's; how many events of each kind there were;
    the model reporters of a mesa ``datacollector``; and the metrics of its task.

    Parameters
    ----------
    world : World
        The world.
    metrics : mapping of str to callable
        The metrics of its task.
    """

    def __init__(self, world: World, metrics: Mapping[str, Callable[[Any], Any]] = MappingProxyType({})) -> None:
        self._world, self._metrics = world, metrics
        self._counted, self._events = 0, Counter[str]()

    def all(self) -> dict[str, Callable[[], Any]]:
        """Return what reads each measure, by name."""
        world = self._world
        named = SO_FAR | {name.replace("_", " "): name for name in _properties(type(world))}
        found: dict[str, Callable[[], Any]] = {shown: partial(getattr, world, name) for shown, name in named.items()}
        found |= {
            name.replace("_", " "): partial(metric, world) for name, metric in self._metrics.items()
            if name not in SO_FAR.values()
        }  # fmt: skip
        for group in world.groups:
            found[f"{group.name} active"] = partial(_active, group)
            for name, column in group.columns.items():
                if column.values.ndim == 1 and column.values.dtype.kind in "biuf":
                    found[f"{group.name} {name}, mean"] = partial(_mean, column)
        found |= {f"{_EVENTS}{kind}": partial(int, count) for kind, count in self._count().items()}
        reporters = getattr(getattr(world, "datacollector", None), "model_reporters", {})
        for name, reporter in reporters.items():
            # Those of any world are there already.
            if hasattr(World, str(name)):
                continue
            if callable(reporter):
                found[str(name)] = partial(reporter, world)
            elif isinstance(reporter, str):
                found[str(name)] = partial(getattr, world, reporter)
        return found

    def read(self, names: Iterable[str]) -> list[float]:
        """Return the present values of measures; NaN of one that is not there, is no number, or has not ended yet."""
        known, found = self.all(), list[float]()
        for name in names:
            try:
                # A kind of event that has not happened in this run.
                value = 0.0 if name.startswith(_EVENTS) and name not in known else float(known[name]())
                found.append(value if math.isfinite(value) else math.nan)
            except Exception:  # whatever the code of a user raises: a chart has a gap there, and the run goes on
                found.append(math.nan)
        return found

    def _count(self) -> Counter[str]:
        rows = self._world._data.sources.events.rows
        if len(rows) < self._counted:
            self._counted, self._events = 0, Counter()
        self._events.update(row.what for row in rows[self._counted :])
        self._counted = len(rows)
        return self._events
