"""Data collection: mesa's DataCollector, filled from the history when many steps were made at once."""

from __future__ import annotations

import mesa
import numpy as np

from teamsight.agents.history import Stretch

REPORTERS = {name: name for name in ("observed", "observed_fraction", "mean_neighbours", "max_neighbours")}


class HistoryCollector(mesa.DataCollector):  # type: ignore[misc]
    """A DataCollector whose model reporters are columns of the history, so that compiled runs can fill it.

    It reports ``observed`` and ``mean_neighbours`` of the present step, and ``observed_fraction`` and
    ``max_neighbours`` over all steps so far.
    """

    def __init__(self) -> None:
        super().__init__(model_reporters=REPORTERS)

    def collect_rows(self, tick: int, stretch: Stretch, first: int, before: tuple[float, int, int]) -> None:
        """Collect the rows of a stretch from row `first` on, as `collect` would have after each of these steps.

        Parameters
        ----------
        tick : int
            How many steps the model has made, the new ones included.
        stretch : Stretch
            Where the rows are.
        first : int
            The first new row.
        before : tuple of float, int, int
            Of earlier stretches the sum of the shares observed and the number of rows; and the largest degree so far.
        """
        share, rows, largest = before
        columns = stretch.columns(first)
        counts = stretch.observed_counts()
        new = stretch.rows - first
        observed = int(counts[:first].sum()) + np.cumsum(counts[first:])
        mean = share + observed / stretch.targets if stretch.targets else np.full(new, np.nan)
        self.model_vars["observed"].extend(columns["observed"].tolist())
        self.model_vars["observed_fraction"].extend((mean / (rows + first + np.arange(1, new + 1))).tolist())
        self.model_vars["mean_neighbours"].extend(columns["mean_neighbours"].tolist())
        most = np.maximum.accumulate(np.concatenate([[largest], columns["max_neighbours"]]))[1:]
        self.model_vars["max_neighbours"].extend(most.tolist())
        if hasattr(self, "_collection_steps"):
            self._collection_steps.extend(map(float, range(tick - new + 1, tick + 1)))
