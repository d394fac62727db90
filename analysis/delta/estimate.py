"""An estimate of δ: the numbers and tables of a simulation or a record, and what follows from them."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
import pandas as pd

from teamsight.analysis import search_space
from teamsight.analysis.delta import by_group, sector_occupancy
from teamsight.analysis.delta.closed_form import Prediction
from teamsight.analysis.delta.cost import cost_table
from teamsight.analysis.delta.sector_occupancy import Bearings
from teamsight.analysis.stats import exceedance as statistics
from teamsight.core.card import card, shown, table

# The most rows of the curve on a card.
_MOST_ROWS = 12


@dataclass(frozen=True, eq=False, repr=False)
class DeltaEstimate:
    """δ for a stated risk, with the numbers and tables that support it.

    Parameters
    ----------
    source : str
        "simulation" or "trajectories".
    subject : str
        What was simulated or recorded, in one line.
    robots : int
        N.
    awareness_range : float or None
        Distance within which two robots are neighbours [length]; None where robots differ.
    risk : float
        Maximum probability that any robot has more than δ neighbours during a trial.
    confidence : float
        Confidence of each bound by itself.
    independent : float
        Effective number of independent trials.
    length : float
        Length of one trial, in `unit`; the median of whole runs or pieces of a record.
    unit : str
        "steps", or "time units" of the record.
    largest : int
        Largest number of neighbours found.
    maxima : DataFrame
        One row a trial: run and seed; or, for trajectories, window (its number), run, start, end, robots (present, on
        average) and mean_neighbours; max_neighbours.
    bearings : Bearings
        Samples of the bearings of neighbours.
    prediction : Prediction or None
        Closed form for one trial; None where it does not apply.
    over_time : DataFrame or None
        For trajectories, one row a frame: run, time, robots, mean_degree, max_degree; None for a simulation.
    trial : str
        What a trial is: "run"; for trajectories also "window", or "piece" between two gaps of a record.
    recorded : float or None
        For trajectories, the total time of the frames.
    shorter : float or None
        For trajectories whose trials cannot support the risk, the longest window that could.
    frame : float or None
        For trajectories, the time between frames.
    group_maxima : DataFrame or None
        For a simulation with several groups, one row a run and group: run, seed, group, team, robots (N of the team),
        max_neighbours.
    is_moving : bool
        Whether any robot moves.
    cautions : tuple of str
        For trajectories, why the unit of the range may not be that of the positions, the record not that of one team,
        or its samples not where and when the robots were; then no number is to be trusted.
    notes : tuple of str
        Further conditions that limit the result.
    """

    source: str
    subject: str
    robots: int
    awareness_range: float | None
    risk: float
    confidence: float
    independent: float
    length: float
    unit: str
    largest: int
    maxima: pd.DataFrame
    bearings: Bearings
    prediction: Prediction | None = None
    over_time: pd.DataFrame | None = None
    trial: str = "run"
    recorded: float | None = None
    shorter: float | None = None
    frame: float | None = None
    group_maxima: pd.DataFrame | None = None
    is_moving: bool = True
    cautions: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()

    @cached_property
    def exceedance(self) -> pd.DataFrame:
        """One row for each δ: delta, exceeding, probability, low, high, predicted (NaN without a prediction)."""
        found = statistics.curve(
            self.maxima["max_neighbours"], self.robots, independent=self.independent, confidence=self.confidence
        )
        foreseen = self.prediction
        predicted = [np.nan if foreseen is None else foreseen.exceedance(delta) for delta in found["delta"]]
        return found.assign(predicted=predicted)

    @cached_property
    def ring(self) -> pd.DataFrame:
        """Mean number of neighbours that rings of δ sectors show; see `sector_occupancy.ring_table`."""
        return sector_occupancy.ring_table(self.bearings, self._rings, self.largest)

    @cached_property
    def merging(self) -> pd.DataFrame:
        """Occupied sectors of the ring of `ring_size` sectors; see `sector_occupancy.merging_table`."""
        return sector_occupancy.merging_table(self.bearings, self.ring_size)

    @cached_property
    def groups(self) -> pd.DataFrame | None:
        """δ of each group and team with its risk; see `by_group.group_table`. None if there is a single group."""
        if self.group_maxima is None:
            return None
        return by_group.group_table(self.group_maxima, self.trials, self.risk, self.confidence)

    @cached_property
    def cost(self) -> pd.DataFrame:
        """Inputs and search space of each degree at this N; see `cost_table`."""
        return cost_table(self.robots, self._rings)

    @property
    def _rings(self) -> list[int]:
        return [max(1, self.delta), self.ring_size, search_space.DELTA]

    @property
    def trials(self) -> int:
        """Number of runs, or of windows or pieces of a record."""
        return len(self.maxima)

    @property
    def delta(self) -> int:
        """Point estimate: the smallest δ exceeded in at most a share `risk` of the trials."""
        return statistics.smallest_delta(self.exceedance, "probability", self.risk)

    @property
    def delta_low(self) -> int:
        """Smallest δ that the trials do not refute: for any smaller one the lower bound exceeds the risk."""
        return statistics.smallest_delta(self.exceedance, "low", self.risk)

    @property
    def delta_safe(self) -> int:
        """Smallest δ whose upper bound is within the risk; N − 1 if the trials cannot support the risk."""
        return statistics.smallest_delta(self.exceedance, "high", self.risk)

    @property
    def trials_needed(self) -> int:
        """Smallest number of independent trials that can support the risk."""
        return statistics.trials_needed(self.risk, self.confidence)

    @property
    def supported(self) -> bool:
        """Whether there are enough independent trials for the risk."""
        return statistics.supports(self.independent, self.risk, self.confidence)

    @property
    def supported_risk(self) -> float:
        """Smallest risk that this number of independent trials can support."""
        return statistics.supported_risk(self.independent, self.confidence)

    @property
    def supported_delta(self) -> int:
        """Smallest δ that no trial exceeded, which is the δ for `supported_risk`."""
        return int(self.maxima["max_neighbours"].max())

    @property
    def ring_size(self) -> int:
        """Number of sectors that `merging` describes: `delta_safe` if supported, otherwise `delta`; at least 1."""
        return max(1, self.delta_safe if self.supported else self.delta)

    @property
    def predicted_delta(self) -> int | None:
        """δ by the closed form."""
        return None if self.prediction is None else self.prediction.delta(self.risk)

    @property
    def predicted_maximum(self) -> float | None:
        """Expected largest degree of one trial by the closed form."""
        return None if self.prediction is None else self.prediction.expected_maximum

    def __repr__(self) -> str:
        return (
            f"<{type(self).__name__} from {self.source}: δ = {self.delta} for the risk {self.risk:g}, {self.trials} "
            f"{self.trial}s, {self.robots} robots>"
        )

    def _repr_html_(self) -> str | None:
        return shown(self._card)

    def _card(self) -> str:
        bound = f"{self.delta_safe}" if self.supported else f"{self.robots - 1}: too few {self.trial}s for this risk"
        bound = "unknown: see the caution" if self.cautions else bound
        rows = [
            ("subject", self.subject),
            ("δ for the risk", f"{self.delta} for {self.risk:g}"),
            (f"bound, confidence {self.confidence:.0%}", bound),
            (f"{self.trial}s", f"{self.trials}, each of {self.length:g} {self.unit}"),
            ("largest number of neighbours", self.largest),
        ]
        curve = self.exceedance[self.exceedance["delta"] <= self.largest]
        lines = [[f"{row.delta}", f"{row.probability:.4f}", f"{row.low:.4f} to {row.high:.4f}"] for row in _rows(curve)]
        cautions = [("caution", text) for text in self.cautions]
        chances = table(("δ", "P(max > δ)", "bounds"), lines[-_MOST_ROWS:])
        return card("How large δ must be", [*rows, *cautions], chances)


def _rows(found: pd.DataFrame) -> list[Any]:
    return list(found.itertuples(index=False))
