"""Data collection: mesa's DataCollector, filled from the history when many steps were made at once."""

from __future__ import annotations

import copy
from dataclasses import dataclass
from typing import Any

import mesa
import numpy as np

from teamsight.agents.recording.history import Stretch, Totals, shares

REPORTERS = {
    name: name for name in ("observed", "observed_fraction", "mean_neighbours", "max_neighbours", "seed_used")
}


@dataclass(slots=True)
class Rows:
    """Rows of a stretch that are still to be collected, and the sums over all rows before them.

    Attributes
    ----------
    stretch : Stretch
        Where the rows are.
    first, last : int
        Which.
    tick : int
        The step of the last.
    observed, largest : int
        The targets observed in earlier rows of the stretch, and the largest degree so far.
    earlier : Totals
        What was observed in earlier stretches.
    """

    stretch: Stretch
    first: int
    last: int
    tick: int
    observed: int
    largest: int
    earlier: Totals


class HistoryCollector(mesa.DataCollector):  # type: ignore[misc]
    """A DataCollector whose model reporters are columns of the history, so that compiled runs can fill it.

    It reports ``observed`` and ``mean_neighbours`` of the present step, and ``observed_fraction`` and
    ``max_neighbours`` over all steps so far; and ``seed_used``, so that a run of a batch can be made again.
    """

    def __init__(self) -> None:
        self._pending: list[Rows] = []
        super().__init__(model_reporters=REPORTERS)

    def emptied(self) -> HistoryCollector:
        """Return a collector that has collected nothing, without the checks of a new one."""
        other = copy.copy(self)
        other._pending = []
        other._model_vars = {name: [] for name in REPORTERS}
        if hasattr(self, "_steps"):
            other._steps = []
        return other

    @property
    def model_vars(self) -> dict[str, list[Any]]:
        """What was collected; rows of compiled runs are worked out when somebody reads them."""
        pending, self._pending = self._pending, []
        for rows in pending:
            self._fill(rows)
        return self._model_vars

    @model_vars.setter
    def model_vars(self, value: dict[str, list[Any]]) -> None:
        self._model_vars = value

    def collect(self, model: Any) -> None:
        """Collect the present values; mesa's own way takes several times as long."""
        for name, values in self.model_vars.items():
            values.append(getattr(model, name))
        if hasattr(self, "_steps"):
            self._steps.append(float(model.time))

    @property
    def has_begun(self) -> bool:
        """Whether anything was collected."""
        return bool(self._pending or self._model_vars["observed"])

    @property
    def _collection_steps(self) -> list[float]:
        """The steps that mesa 3.5 asks for; mesa 3.3 has no such list and does not read it."""
        return self._steps if self.model_vars else []

    @_collection_steps.setter
    def _collection_steps(self, value: list[float]) -> None:
        self._steps = value

    def collect_rows(self, rows: Rows) -> None:
        """Collect rows of the history, as `collect` would have after each of these steps."""
        last = self._pending[-1] if self._pending else None
        if last is not None and last.stretch is rows.stretch and last.last == rows.first:
            last.last, last.tick = rows.last, rows.tick
        else:
            self._pending.append(rows)

    def _fill(self, new: Rows) -> None:
        columns = new.stretch.columns(new.first, new.last)
        count = new.last - new.first
        observed: dict[int, Any] = dict(new.earlier.observed)
        rows: Any = new.earlier.rows
        if targets := new.stretch.targets:
            so_far = new.observed + np.cumsum(new.stretch.observed_counts(new.first, new.last))
            observed[targets] = observed.get(targets, 0) + so_far
            rows = rows + new.first + np.arange(1, count + 1)
        mean = np.broadcast_to(shares(observed) / rows if targets or rows else np.nan, count)
        self._model_vars["observed"].extend(columns["observed"].tolist())
        self._model_vars["observed_fraction"].extend(mean.tolist())
        self._model_vars["mean_neighbours"].extend(columns["mean_neighbours"].tolist())
        most = np.maximum.accumulate(np.concatenate([[new.largest], columns["max_neighbours"]]))[1:]
        self._model_vars["max_neighbours"].extend(most.tolist())
        # The seed of a model does not change while it runs.
        self._model_vars["seed_used"].extend(self._model_vars["seed_used"][-1:] * count)
        if hasattr(self, "_steps"):
            self._steps.extend(map(float, range(new.tick - count + 1, new.tick + 1)))
