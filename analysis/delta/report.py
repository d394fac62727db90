"""The report on δ: the numbers and tables of a simulation or a record, what follows from them, and files of these."""

from __future__ import annotations

import io
import math
import os
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import pandas as pd

from teamsight.agents.awareness.registry import AWARENESS, awareness_named
from teamsight.analysis import search_space
from teamsight.analysis.delta import sector_occupancy
from teamsight.analysis.delta.closed_form import Prediction
from teamsight.analysis.delta.sector_occupancy import Bearings
from teamsight.analysis.plot import markdown
from teamsight.analysis.runs import files
from teamsight.analysis.stats import exceedance as statistics
from teamsight.core.card import card, shown, table
from teamsight.core.plain_text import text_table

if TYPE_CHECKING:
    from rich.console import Console, ConsoleOptions, RenderResult

_TABLES = ("exceedance", "maxima", "ring", "cost", "over_time", "groups", "group_maxima")
# Attributes that are stored with each table.
_STORED = (
    "source", "subject", "robots", "awareness_range", "risk", "confidence", "independent", "length", "trial",
    "cautions",
)  # fmt: skip
# The most rows of a table that is shown.
_MOST_ROWS = 14
# Fewer independent trials than this say nothing about how much trials differ.
_SEVERAL = 2.0

Section = tuple[str, list[str], list[list[str]]]


@dataclass(frozen=True, eq=False, repr=False)
class DeltaReport:
    """δ for a stated risk, with the numbers and tables that support it. It can be printed and saved.

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
    frame : float or None
        For trajectories, the time between frames.
    group_maxima : DataFrame or None
        For a simulation with several groups, one row a run and group: run, seed, group, team, robots (N of the team),
        max_neighbours.
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
    frame: float | None = None
    group_maxima: pd.DataFrame | None = None
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
    def groups(self) -> pd.DataFrame | None:
        """δ of each group, and of each team if there are several; None if there is a single group.

        One row each: kind ("group" or "team"), name, team, robots (N of the team), largest, delta, probability (of
        exceeding it), low, high (its bounds), delta_safe. The risk is that of any robot of it during a run.
        """
        maxima = self.group_maxima
        if maxima is None:
            return None
        found = []
        for kind in ["group"] + ["team"] * (maxima["team"].nunique() > 1):
            for name, rows in maxima.groupby(kind, sort=False):
                largest = rows.groupby("run")["max_neighbours"].max().reindex(range(self.trials), fill_value=0)
                robots = int(rows["robots"].max())
                curve = statistics.curve(largest, robots, confidence=self.confidence)
                delta, safe = (statistics.smallest_delta(curve, by, self.risk) for by in ("probability", "high"))
                chances = curve.iloc[delta][["probability", "low", "high"]].tolist()
                team, most = str(rows["team"].iloc[0]), int(largest.max())
                found.append((kind, str(name), team, robots, most, delta, *chances, safe))
        columns = ["kind", "name", "team", "robots", "largest", "delta", "probability", "low", "high", "delta_safe"]
        return pd.DataFrame(found, columns=columns)

    @cached_property
    def cost(self) -> pd.DataFrame:
        """What each degree of awareness costs at this N, those that have a δ once for each.

        degree, growth, formula (str); delta (Int64, missing where there is none), own, added, inputs (by the paper's
        formulas), log10_size (of p^d with p = 2 readings, the fewest that a sensor can have); added_here, what the
        arrays of a situation really add with N − 1 teammates.
        """
        rows = []
        for name, degree in AWARENESS.items():
            for delta in sorted(set(self._rings)) if "delta" in degree.options() else [None]:
                found = search_space.dimensions_table([self.robots], delta=delta or search_space.DELTA)
                row = dict[Any, Any](found[found["degree"] == name].iloc[0])
                here = awareness_named(name, {"delta": delta}).width(self.robots).added
                rows.append(row | {"delta": delta, "added_here": here})
        columns = ["degree", "growth", "formula", "delta", "own", "added", "inputs", "log10_size", "added_here"]
        return pd.DataFrame(rows)[columns].astype({"delta": "Int64"})

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
        """Number of sectors of a ring that suffices: `delta_safe` if supported, otherwise `delta`; at least 1."""
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
        said = [_answer(self)]
        said += [f"Largest number of neighbours: {self.largest}, in {_trials(self)} of {self.robots} robots."]
        said += self.advice
        if self.prediction is not None:
            said.append(
                f"Closed form, for robots placed uniformly and independently: δ = {self.predicted_delta}, "
                f"expected largest number of neighbours in a trial {self.predicted_maximum:.1f}."
            )
        return [*self.cautions, *said, *_about_the_ring(self), *self.notes]

    @property
    def advice(self) -> list[str]:
        """How many trials the stated risk needs, and how to get them; nothing if these support it."""
        return [] if self.supported else _advice(self)

    @property
    def time_needed(self) -> float | None:
        """For trajectories, the length of a record like this that supports the risk [time]; None if more is no cure."""
        if self.recorded is None:
            return None
        columns = self.maxima[["max_neighbours", "mean_neighbours"]]
        if self.independent == 1 and self.trials > 1 and (columns.nunique() == 1).all():
            return None
        return self.recorded * max(1.0, self.trials_needed / self.independent)

    def to_markdown(self) -> str:
        """Return the report as Markdown."""
        parts = [f"# δ for {self.subject}", "\n".join(f"- {sentence}" for sentence in self.sentences())]
        for title, columns, rows in _sections(self):
            parts += [f"## {title}", markdown.table(columns, rows, align="l" + "r" * (len(columns) - 1))]
        return markdown.page(*parts)

    def to_png(self) -> bytes:
        """Return a plot of the exceedance curve with its bounds and the prediction as PNG."""
        return _picture(self)

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
        about = {name: getattr(self, name) for name in _STORED} | {"settings": dict(settings or {})}
        check_report(place, about if settings is None else {"settings": settings}, force=force)
        *tables, picture, page = files_in(place)
        found = {path: getattr(self, name) for path, name in zip(tables, _TABLES, strict=True)}
        written = [path for path, content in found.items() if content is not None]
        for path in written:
            files.write_table(path, found[path], about, force=force)
        files.write_bytes(picture, self.to_png(), force=force)
        files.write_page(page, self.to_markdown(), force=force)
        return [*written, picture, page]

    def __rich_console__(self, console: Console, options: ConsoleOptions) -> RenderResult:
        from rich.text import Text

        for number, sentence in enumerate(self.sentences(), -len(self.cautions)):
            yield Text(sentence, style="bold red" if number < 0 else "bold" if number == 0 else "")
        yield Text(self.subject, style="dim")
        for title, columns, rows in _sections(self):
            if rows:
                # Of narrow tables the last columns say least.
                table = text_table(rows, columns, spare=range(len(columns) - 1, 2, -1), width=options.max_width)
                yield Text(f"\n{title}", style="bold")
                for lines, style in ((table.head, "bold"), (table.body, "")):
                    yield Text("\n".join(lines), style=style, no_wrap=True, overflow="ignore")
                if table.left_out:
                    yield Text(f"a wider terminal also shows {', '.join(table.left_out)}")

    def __str__(self) -> str:
        from rich.console import Console

        text = io.StringIO()
        Console(file=text, width=110, color_system=None).print(self)
        return text.getvalue().rstrip()

    def __repr__(self) -> str:
        return (
            f"<{type(self).__name__} from {self.source}: δ = {self.delta} for the risk {self.risk:g}, {self.trials} "
            f"{self.trial}s, {self.robots} robots>"
        )

    def _repr_html_(self) -> str | None:
        return shown(self._card)

    def _card(self) -> str:
        bound = f"{self.delta_safe}" if self.supported else f"{self.robots - 1}: too few {self.trial}s for this risk"
        rows = [
            ("subject", self.subject),
            ("δ for the risk", f"{self.delta} for {self.risk:g}"),
            (f"bound, confidence {self.confidence:.0%}", "unknown: see the caution" if self.cautions else bound),
            (f"{self.trial}s", f"{self.trials}, each of {self.length:g} {self.unit}"),
            ("largest number of neighbours", self.largest),
            *(("caution", text) for text in self.cautions),
        ]
        _, columns, lines = _curve(self)
        return card("How large δ must be", rows, table(columns, lines))


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
    for path in files_in(folder):
        files.check_replaceable(path, about if path.suffix == ".parquet" else None, force=force)


def files_in(folder: str | os.PathLike[str]) -> list[Path]:
    """Return the files that a report may write in a folder: the tables, the picture and the page."""
    names = [*(f"delta_{name}.parquet" for name in _TABLES), "delta_exceedance.png", "delta.md"]
    return [Path(folder) / name for name in names]


def _trials(report: DeltaReport) -> str:
    """Return the number of trials, and the number of independent ones if there are fewer of these."""
    text = f"{report.trials:,} {report.trial}{'s' * (report.trials != 1)}"
    if report.trial == "run":
        return text
    return f"{text} (equivalent to {report.independent:.1f} independent ones)"


def _one_trial(report: DeltaReport) -> str:
    if report.source == "simulation":
        return f"a run of {report.length:g} steps"
    if report.trial == "window":
        return f"a window of {report.length:g}"
    return f"a whole {report.trial} (of about {report.length:g})"


def _answer(report: DeltaReport) -> str:
    """Return the one δ that the trials support, and its risk."""
    trial, share = f"A trial is {_one_trial(report)}.", f"{100 * report.risk:g} %"
    if report.independent < _SEVERAL:
        what = "simulation" if report.recorded is None else "record"
        return (
            f"This {what} is one observation, {_trials(report)}: its largest number of neighbours is "
            f"{report.largest}, which says little about others."
        )
    if report.cautions:
        return (
            f"δ = {report.delta} (point estimate), if the record is right: exceeded in at most {share} of the trials. "
            f"{trial}"
        )
    sure = f"with {report.confidence:.0%} confidence"
    if not report.supported:
        return f"{_supported(report, sure)} {trial}"
    lower = f" The point estimate is δ = {report.delta}." * (report.delta != report.delta_safe)
    return f"δ = {report.delta_safe} {sure}: exceeded in at most {share} of the trials. {trial}{lower}"


def _supported(report: DeltaReport, sure: str) -> str:
    """Return the δ that too few trials support, with its risk: the largest number found, or one less than N − 1."""
    most, delta = report.robots - 1, report.supported_delta
    if most < 1:
        return "A single robot has no neighbours: δ = 0 cannot be exceeded."
    of_these = f"the smallest that so few {report.trial}s support {sure}"
    if delta < most:
        outside = f" Outside of them {report.largest} was found." * (report.largest > delta)
        return f"δ = {delta} for a risk of {rounded_up(report.supported_risk):g}, {of_these}.{outside}"
    row = report.exceedance.iloc[most - 1]
    met = f"in {int(row['exceeding']):,} of them some robot had all N − 1 = {most} teammates as neighbours"
    if report.delta_low == most:
        return f"δ = {most}, which cannot be exceeded: {met}, which is too often for δ = {most - 1}."
    return f"δ = {most - 1} for a risk of {rounded_up(row['high']):g}, {of_these}: {met}."


def _advice(report: DeltaReport) -> list[str]:
    """Return how many trials the stated risk needs, and how to get them."""
    if report.delta_low == report.robots - 1 > 0:
        return []
    needed = report.trials_needed
    what = "runs" if report.trial == "run" else f"independent {report.trial}s"
    lacks = (
        f"These {_trials(report)} cannot support a risk of {report.risk:g} with {report.confidence:.0%} confidence: it "
        f"needs {needed:,} {what}, none of which exceeds δ."
    )
    if report.recorded is None:
        return [lacks, f"Simulate at least {needed:,} runs, {needed - report.trials:,} more."]
    if report.time_needed is None:
        cure = "record while the robots move, or runs that start afresh, marked by a column run"
        return [lacks, f"All {report.trial}s are the same, so that they count as one: {cure}."]
    factor = needed / report.independent
    more = math.ceil(report.trials * (factor - 1))
    frames = "" if report.frame is None else f", about {report.recorded * (factor - 1) / report.frame:,.0f} more frames"
    return [
        lacks,
        f"At this rate the record must be {factor:.3g} times as long, {_long(report.time_needed)} instead of "
        f"{_long(report.recorded)}: {more:,} more {report.trial}s{frames}.",
    ]


def _long(time: float) -> str:
    """Return a time in four digits, and without an exponent if it is long."""
    return f"{time:,.0f}" if time >= 1e4 else f"{time:.4g}"


def rounded_up(value: float) -> float:
    """Return a positive number rounded up to three digits."""
    unit = 10.0 ** (math.floor(math.log10(value)) - 2)
    return float(f"{math.ceil(value / unit * (1 - 1e-12)) * unit:.3g}")


def _about_the_ring(report: DeltaReport) -> list[str]:
    if report.largest == 0:
        # A record in which no robots meet may have the wrong unit.
        enough = "" if report.cautions else ": NoAwareness() is sufficient"
        return [f"No robot had a neighbour at any time{enough}."]
    size, ring = report.ring_size, report.ring
    row = ring[(ring["sectors"] == size) & (ring["neighbours"] == min(size, report.largest))].iloc[0]
    measured = f", {row['shown']:.1f} as measured" if row["samples"] else ""
    said = [
        f"Teammates in the same sector merge: of {row['neighbours']:.0f} neighbours a ring of {size} sectors shows "
        f"{row['expected']:.1f} on average by the occupancy formula{measured}."
    ]
    listed = report.cost.loc[report.cost["degree"] == "pairwise", "added"].iloc[0]
    if size >= listed:
        said.append(f"A list of all teammates, Θ(N), needs no more inputs than this ring, Θ(1): {listed} and {size}.")
    return said


def _sections(report: DeltaReport) -> list[Section]:
    """Return the tables as texts, reduced to their most important rows: title, columns and rows."""
    found = [_curve(report)]
    if report.groups is not None:
        columns = ["group or team", "N", "largest", f"δ for {report.risk:g}", "P(max > δ)", _bounds(report),
                   "δ with confidence"]  # fmt: skip
        too_few = "" if report.supported else ": too few runs"
        rows = [
            [f"{'team ' * (row.kind == 'team')}{row.name}", f"{row.robots}", f"{row.largest}", f"{row.delta}",
             *_chances(row), f"{row.delta_safe}{too_few}"]
            for row in _rows(report.groups)
        ]  # fmt: skip
        found.append(("δ of each group", columns, rows))
    by_size = [(size, _rows(lines)) for size, lines in report.ring.groupby("sectors")]
    of_rings = (f"{size} sectors: {by}" for size, _ in by_size for by in ("formula", "measured"))
    columns = ["neighbours", "samples", *of_rings]
    rows = [
        [f"{lines[0].neighbours}", f"{lines[0].samples}",
         *(text for row in lines for text in (f"{row.expected:.2f}", f"{row.shown:.2f}" if row.samples else "–"))]
        for lines in zip(*(lines for _, lines in by_size), strict=True)
    ]  # fmt: skip
    kept = np.unique(np.linspace(0, len(rows) - 1, min(len(rows), _MOST_ROWS)).round().astype(int))
    found.append(("Mean number of neighbours that a ring shows", columns, [rows[place] for place in kept]))
    columns = ["degree", "", "inputs", "own", "added", "log10 of 2^d", f"added for {report.robots - 1} teammates"]
    rows = [
        [row.degree if pd.isna(row.delta) else f"{row.degree}, δ = {row.delta}", f"{row.growth}: {row.formula}",
         f"{row.inputs}", f"{row.own}", f"{row.added}", f"{row.log10_size:.1f}", f"{row.added_here}"]
        for row in _rows(report.cost)
    ]  # fmt: skip
    return [*found, (f"Inputs of each degree of awareness in a team of {report.robots}", columns, rows)]


def _curve(report: DeltaReport) -> Section:
    found = report.exceedance
    first = int((found["probability"] >= 1).sum())
    last = max(report.largest, report.delta_safe if report.supported else 0, report.predicted_delta or 0)
    columns = ["δ", "exceeded in", "P(max > δ)", _bounds(report)] + ["closed form"] * (report.prediction is not None)
    chosen = found[found["delta"].between(first - 1, last)].tail(_MOST_ROWS)
    rows = [[f"{row.delta}", f"{row.exceeding}", *_chances(row), _share(row.predicted)] for row in _rows(chosen)]
    return "How often δ is exceeded", columns, [row[: len(columns)] for row in rows]


def _bounds(report: DeltaReport) -> str:
    return f"bounds, {report.confidence:.0%} each"


def _chances(row: Any) -> tuple[str, str]:
    return _share(row.probability), f"{_share(row.low)} … {_share(row.high)}"


def _share(value: float) -> str:
    if pd.isna(value):
        return "–"
    return f"{value:.4f}" if value >= 5e-5 or value == 0 else f"{value:.0e}"


def _rows(found: pd.DataFrame) -> list[Any]:
    return list(found.itertuples(index=False))


def _picture(report: DeltaReport) -> bytes:
    """Return a PNG of P(largest degree > δ) against δ, its bounds, the prediction, the risk, and δ."""
    from matplotlib.ticker import MaxNLocator

    from teamsight.analysis.plot.kinds import draw_means, panels
    from teamsight.analysis.plot.style import COLOURS, FAINT, to_picture

    figure, (axes,) = panels(
        _answer(report),
        [report.subject, f"band: {_bounds(report)}"], [""], x="δ  (number of neighbours)",
        y=f"probability that in {_one_trial(report)}\nany robot has more than δ neighbours", size=(7.5, 4.4),
        warning="doubtful record, see the report" * bool(report.cautions),
    )  # fmt: skip
    found, floor = report.exceedance, min(report.risk, 1.0 / report.trials) / 10.0
    delta, curve = found["delta"].to_numpy(), found["probability"].to_numpy()
    bounds = np.column_stack([np.where(curve > 0, curve, np.nan), np.maximum(found["low"], floor), found["high"]])
    draw_means(axes, delta, bounds, COLOURS[1], f"share of {_trials(report)}", marker="o", markersize=5)
    if report.prediction is not None:
        axes.plot(delta, found["predicted"], "--", color=COLOURS[5], linewidth=1.8, label="closed form")
    axes.axhline(report.risk, color=COLOURS[2], linewidth=1.0, linestyle=":", label=f"risk {report.risk:g}")
    axes.axvline(report.delta, color=FAINT, linewidth=1.2, label=f"δ = {report.delta}")
    if report.supported and not report.cautions:
        label = f"δ = {report.delta_safe} with {report.confidence:.0%} confidence"
        axes.axvline(report.delta_safe, color=FAINT, linewidth=1.2, linestyle="-.", label=label)
    axes.set_yscale("log")
    axes.set_ylim(floor, 1.6)
    # Between the δ where the curve falls from certain to unseen, with some room.
    last = max(report.largest, report.delta_safe if report.supported else 0, report.predicted_delta or 0) + 2
    axes.set_xlim(max(int((curve >= 1).sum()) - 2, 0) - 0.5, min(last, report.robots - 1) + 0.5)
    axes.xaxis.set_major_locator(MaxNLocator(integer=True))
    axes.legend(loc="upper right", fontsize=9, framealpha=0.95)
    return to_picture(figure, report.subject)
