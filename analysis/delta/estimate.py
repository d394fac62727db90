"""An estimate of δ: the numbers and tables of a simulation or a record, and what follows from them."""

from __future__ import annotations

from dataclasses import dataclass

import pandas as pd

from teamsight.analysis.delta.closed_form import Prediction
from teamsight.analysis.stats import exceedance as statistics


@dataclass(frozen=True, eq=False)
class DeltaEstimate:
    """δ for a stated risk, with the numbers and tables that support it.

    Attributes
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
    trials : int
        Number of runs, or of windows or pieces of a record.
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
    exceedance : DataFrame
        One row for each δ: delta, exceeding, probability, low, high, predicted (NaN without a prediction).
    ring : DataFrame
        Mean number of neighbours that rings of δ sectors show; see `sector_occupancy.ring_table`.
    merging : DataFrame
        Distribution of the occupied sectors of the ring of `ring_size` sectors; see `sector_occupancy.merging_table`.
    cost : DataFrame
        Inputs and search space of each degree at this N; see `cost_table`.
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
    notes : tuple of str
        Further conditions that limit the result.
    """

    source: str
    subject: str
    robots: int
    awareness_range: float | None
    risk: float
    confidence: float
    trials: int
    independent: float
    length: float
    unit: str
    largest: int
    maxima: pd.DataFrame
    exceedance: pd.DataFrame
    ring: pd.DataFrame
    merging: pd.DataFrame
    cost: pd.DataFrame
    prediction: Prediction | None = None
    over_time: pd.DataFrame | None = None
    trial: str = "run"
    recorded: float | None = None
    shorter: float | None = None
    notes: tuple[str, ...] = ()

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
        return ring_size(self.exceedance, self.risk, self.supported)

    @property
    def predicted_delta(self) -> int | None:
        """δ by the closed form."""
        return None if self.prediction is None else self.prediction.delta(self.risk)

    @property
    def predicted_maximum(self) -> float | None:
        """Expected largest degree of one trial by the closed form."""
        return None if self.prediction is None else self.prediction.expected_maximum


def ring_size(exceedance: pd.DataFrame, risk: float, supported: bool) -> int:
    """Return the number of sectors that this curve suggests; see `DeltaEstimate.ring_size`."""
    return max(1, statistics.smallest_delta(exceedance, "high" if supported else "probability", risk))
