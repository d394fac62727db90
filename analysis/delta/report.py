"""The report on δ: the numbers and tables of a simulation or a record, what follows from them, and its files."""

from __future__ import annotations

import io
import os
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import pandas as pd

from teamsight.analysis import search_space
from teamsight.analysis.delta import report_text, sector_occupancy
from teamsight.analysis.delta.closed_form import Prediction
from teamsight.analysis.delta.cost import cost_table
from teamsight.analysis.delta.sector_occupancy import Bearings
from teamsight.analysis.runs import files
from teamsight.analysis.stats import exceedance as statistics

if TYPE_CHECKING:
    from rich.console import Console, ConsoleOptions, RenderResult

_TABLES = ("exceedance", "maxima", "ring", "merging", "cost", "over_time")
# Attributes that are stored with each table.
_STORED = (
    "source", "subject", "robots", "awareness_range", "risk", "confidence", "independent", "length", "trial",
)  # fmt: skip


@dataclass(frozen=True, eq=False)
class DeltaReport:
    """δ for a stated risk, with the numbers and tables that support it; it can be printed and saved.

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

    def sentences(self) -> list[str]:
        """Return the conclusions, the most important first."""
        return report_text.sentences(self)

    def to_markdown(self) -> str:
        """Return the report as Markdown."""
        return report_text.markdown(self)

    def to_png(self) -> bytes:
        """Return a plot of the exceedance curve with its bounds and the prediction as PNG."""
        from teamsight.analysis.delta.figure import draw

        return draw(self)

    def save(
        self, folder: str | os.PathLike[str], *, force: bool = False, settings: Mapping[str, Any] | None = None
    ) -> list[Path]:
        """Write the tables as Parquet, the report as Markdown and the curve as PNG; return the paths.

        Parameters
        ----------
        folder : path
            Folder of the files; created if it does not exist.
        force : bool
            Replace any files; otherwise only a report of the same settings is replaced.
        settings : mapping, optional
            Settings of the command, as JSON values; stored with the tables.

        Raises
        ------
        ValueError
            If the folder cannot be made or written, or a file in it must stay.
        """
        place = files.prepare_folder(folder)
        about = {name: getattr(self, name) for name in _STORED}
        tables = {name: getattr(self, name) for name in _TABLES}
        about |= {"settings": dict(settings or {})}
        check_report(place, about if settings is None else {"settings": settings}, force=force)
        written = []
        for name, table in tables.items():
            if table is not None:
                written.append(place / f"delta_{name}.parquet")
                files.write_table(written[-1], table, about, force=force)
        written += [place / "delta_exceedance.png", place / "delta.md"]
        files.write_bytes(written[-2], self.to_png(), force=force)
        files.write_page(written[-1], self.to_markdown(), force=force)
        return written

    def __rich_console__(self, console: Console, options: ConsoleOptions) -> RenderResult:
        yield from report_text.rich_parts(self)

    def __str__(self) -> str:
        from rich.console import Console

        text = io.StringIO()
        Console(file=text, width=110, color_system=None).print(self)
        return text.getvalue().rstrip()


def check_report(
    folder: str | os.PathLike[str], about: Mapping[str, Any] | None = None, *, force: bool = False
) -> None:
    """Raise an error if a file that must not be replaced stands where a report is to be saved.

    Parameters
    ----------
    folder : path
        Folder of the report.
    about : mapping, optional
        Settings that its tables will store, as JSON values; without them any report may be replaced.
    force : bool
        Replace any regular file.

    Raises
    ------
    ValueError
        If a file is not a report, or a report of other settings.
    """
    *tables, picture, page = files_in(folder)
    for table in tables:
        files.check_replaceable(table, about, force=force)
    files.check_replaceable(picture, force=force)
    files.check_replaceable(page, force=force)


def files_in(folder: str | os.PathLike[str]) -> list[Path]:
    """Return the files that a report may write in a folder: the tables, the picture and the page."""
    names = [*(f"delta_{name}.parquet" for name in _TABLES), "delta_exceedance.png", "delta.md"]
    return [Path(folder) / name for name in names]
