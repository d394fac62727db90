"""What is known of δ after a simulation or from a record, as numbers, tables, text and files."""

from __future__ import annotations

import io
import os
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import pandas as pd

from teamsight.agents.awareness.registry import AWARENESS, awareness_named
from teamsight.analysis import search_space
from teamsight.analysis.delta import sector_occupancy
from teamsight.analysis.delta.closed_form import Prediction
from teamsight.analysis.delta.sector_occupancy import Bearings
from teamsight.analysis.runs import files
from teamsight.analysis.stats import exceedance as statistics

if TYPE_CHECKING:
    from rich.console import Console, ConsoleOptions, RenderResult

_TABLES = ("exceedance", "maxima", "ring", "merging", "cost", "over_time")


@dataclass(frozen=True, eq=False)
class DeltaReport:
    """δ for a stated risk, and all that it rests on.

    Attributes
    ----------
    source : str
        "simulation" or "tracks".
    subject : str
        What was simulated or recorded, on one line.
    robots : int
        N.
    awareness_range : float or None
        Within which distance two robots are neighbours [length]; None when the model does not tell a single one.
    risk : float
        The accepted probability that in one trial any robot has more than δ neighbours.
    confidence : float
        Of each bound by itself.
    trials : int
        Number of runs, or of windows or pieces of a record.
    independent : float
        How many independent trials they amount to.
    length : float
        Length of one trial, in `unit`; the median of whole runs or pieces of a record.
    unit : str
        "steps", or "time units" of the record.
    largest : int
        The largest degree in all that was seen.
    maxima : DataFrame
        One row a trial: run and seed; or, for tracks, window (its number), run, start, end, robots (present, on
        average) and mean_neighbours; max_neighbours.
    exceedance : DataFrame
        One row for each δ: delta, exceeding, probability, low, high, predicted (NaN without a prediction).
    ring : DataFrame
        How many neighbours rings of δ sectors show; see `sector_occupancy.ring_table`.
    merging : DataFrame
        Distribution of the occupied sectors of the ring of `ring_size` sectors; see `sector_occupancy.merging_table`.
    cost : DataFrame
        Inputs and search space of each degree at this N; see `cost_table`.
    prediction : Prediction or None
        The closed form for one trial; None where it does not apply.
    over_time : DataFrame or None
        For tracks, one row a frame: run, time, robots, mean_degree, max_degree; None for a simulation.
    trial : str
        What a trial is: "run", or for tracks also "window", or "piece" of a record that gaps divide.
    recorded : float or None
        For tracks, the time that the frames cover in all.
    shorter : float or None
        For tracks whose trials cannot support the risk, the longest window that could.
    notes : tuple of str
        What else a reader must know to trust the numbers.
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
        """The point estimate: the smallest δ that no more than a share `risk` of the trials exceeded."""
        return statistics.smallest_delta(self.exceedance, "probability", self.risk)

    @property
    def delta_low(self) -> int:
        """The smallest δ that the trials do not refute: below it even the lower bound is above the risk."""
        return statistics.smallest_delta(self.exceedance, "low", self.risk)

    @property
    def delta_safe(self) -> int:
        """The smallest δ whose upper bound is within the risk; N − 1 when the trials cannot support the risk."""
        return statistics.smallest_delta(self.exceedance, "high", self.risk)

    @property
    def trials_needed(self) -> int:
        """The fewest independent trials that could support the risk."""
        return statistics.trials_needed(self.risk, self.confidence)

    @property
    def supported(self) -> bool:
        """Whether there are as many independent trials as the risk needs."""
        return statistics.supports(self.independent, self.risk, self.confidence)

    @property
    def supported_risk(self) -> float:
        """The smallest risk that so many independent trials can support, whatever they show."""
        return statistics.supported_risk(self.independent, self.confidence)

    @property
    def supported_delta(self) -> int:
        """The δ for `supported_risk`: the smallest that no trial exceeded."""
        return int(self.maxima["max_neighbours"].max())

    @property
    def ring_size(self) -> int:
        """The number of sectors that `merging` describes: `delta_safe` if supported, otherwise `delta`; at least 1."""
        return ring_size(self.exceedance, self.risk, self.supported)

    @property
    def predicted_delta(self) -> int | None:
        """δ by the closed form."""
        return None if self.prediction is None else self.prediction.delta(self.risk)

    @property
    def predicted_maximum(self) -> float | None:
        """The expected largest degree of one trial by the closed form."""
        return None if self.prediction is None else self.prediction.expected_maximum

    def sentences(self) -> list[str]:
        """Return what the report says, plainest first."""
        from teamsight.analysis.delta.report_text import sentences

        return sentences(self)

    def to_markdown(self) -> str:
        """Return the report as Markdown."""
        from teamsight.analysis.delta.report_text import markdown

        return markdown(self)

    def to_png(self) -> bytes:
        """Return a picture of the exceedance curve with its bounds and the prediction."""
        from teamsight.analysis.delta.figure import draw

        return draw(self)

    def save(
        self, folder: str | os.PathLike[str], *, force: bool = False, settings: Mapping[str, Any] | None = None
    ) -> list[Path]:
        """Write the tables as Parquet, the report as Markdown and the curve as PNG; return the files written.

        Parameters
        ----------
        folder : path
            Where to write; made if need be.
        force : bool
            Replace what stands there, whatever it is; otherwise only a report of the same settings.
        settings : mapping, optional
            What was asked for, fit for JSON; kept with the tables.

        Raises
        ------
        ValueError
            If the folder cannot be made or written, or a file in it must stay.
        """
        place = files.prepare_folder(folder)
        about = {
            name: getattr(self, name)
            for name in (
                "source",
                "subject",
                "robots",
                "awareness_range",
                "risk",
                "confidence",
                "independent",
                "length",
                "trial",
            )
        }
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
        from teamsight.analysis.delta.report_text import rich_parts

        yield from rich_parts(self)

    def __str__(self) -> str:
        from rich.console import Console

        text = io.StringIO()
        Console(file=text, width=110, color_system=None).print(self)
        return text.getvalue().rstrip()


def check_report(
    folder: str | os.PathLike[str], about: Mapping[str, Any] | None = None, *, force: bool = False
) -> None:
    """Refuse a folder in which another file, or a report that tells other settings, stands where a report goes.

    Parameters
    ----------
    folder : path
        Where a report is to be saved.
    about : mapping, optional
        What its tables will tell, fit for JSON; without it any report is replaced.
    force : bool
        Replace any regular file.

    Raises
    ------
    ValueError
        If what stands there must stay.
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


def ring_size(exceedance: pd.DataFrame, risk: float, supported: bool) -> int:
    """Return the number of sectors that a user would take from this curve."""
    return max(1, statistics.smallest_delta(exceedance, "high" if supported else "probability", risk))


def cost_table(team_size: int, deltas: list[int]) -> pd.DataFrame:
    """Return what each degree costs at this team size, the ring once for each δ.

    Returns
    -------
    DataFrame
        degree, growth, formula (str); delta (Int64, missing but for rings), own, added, inputs (by the paper's
        formulas), log10_size (of p^d with p = 2 readings, the fewest that a sensor can have); added_here, what the
        arrays of a situation really add with N − 1 teammates.
    """
    rows = []
    for name, degree in AWARENESS.items():
        for delta in sorted(set(deltas)) if "delta" in degree.options() else [None]:
            table = search_space.dimensions_table([team_size], delta=delta or search_space.DELTA)
            row = dict[Any, Any](table[table["degree"] == name].iloc[0])
            here = awareness_named(name, {"delta": delta}).width(team_size).added
            rows.append(row | {"delta": delta, "added_here": here})
    columns = ["degree", "growth", "formula", "delta", "own", "added", "inputs", "log10_size", "added_here"]
    return pd.DataFrame(rows)[columns].astype({"delta": "Int64"})


def build(
    maxima: pd.DataFrame,
    bearings: Bearings,
    *,
    robots: int,
    risk: float,
    confidence: float,
    independent: float,
    largest: int,
    prediction: Prediction | None,
    **told: Any,
) -> DeltaReport:
    """Return the report on these trials; `told` are the fields that it only passes on."""
    curve = statistics.curve(maxima["max_neighbours"], robots, independent=independent, confidence=confidence)
    foreseen = [np.nan if prediction is None else prediction.exceedance(delta) for delta in curve["delta"]]
    curve = curve.assign(predicted=foreseen)
    chosen = ring_size(curve, risk, statistics.supports(independent, risk, confidence))
    point = max(1, statistics.smallest_delta(curve, "probability", risk))
    rings = [point, chosen, search_space.DELTA]
    return DeltaReport(
        robots=robots,
        risk=risk,
        confidence=confidence,
        trials=len(maxima),
        independent=independent,
        largest=largest,
        maxima=maxima,
        exceedance=curve,
        ring=sector_occupancy.ring_table(bearings, rings, largest),
        merging=sector_occupancy.merging_table(bearings, chosen),
        cost=cost_table(robots, rings),
        prediction=prediction,
        **told,
    )
