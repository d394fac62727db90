"""The report on δ as sentences and tables, for a terminal and as Markdown."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Any, NamedTuple

import pandas as pd

from teamsight.analysis.delta.advice import advice, answer, trials_phrase
from teamsight.analysis.plot.markdown import page
from teamsight.analysis.plot.markdown import table as markdown_table

if TYPE_CHECKING:
    from teamsight.analysis.delta.estimate import DeltaEstimate

_MOST_ROWS = 14


class Section(NamedTuple):
    """A table of texts."""

    title: str
    columns: list[str]
    rows: list[list[str]]


def sentences(report: DeltaEstimate) -> list[str]:
    """Return the conclusions, the most important first."""
    said = [answer(report)]
    said += [f"Largest number of neighbours: {report.largest}, in {trials_phrase(report)} of {report.robots} robots."]
    if not report.supported:
        said += advice(report)
    if report.prediction is not None:
        said.append(
            f"Closed form, for robots placed uniformly and independently: δ = {report.predicted_delta}, "
            f"expected largest number of neighbours in a trial {report.predicted_maximum:.1f}."
        )
    said += _about_the_ring(report)
    return [*report.cautions, *said, *report.notes]


def _about_the_ring(report: DeltaEstimate) -> list[str]:
    if report.largest == 0:
        # A record in which no robots meet may have the wrong unit.
        enough = "" if report.cautions else ": NoAwareness() is sufficient"
        return [f"No robot had a neighbour at any time{enough}."]
    said = []
    size = report.ring_size
    row = report.ring[(report.ring["sectors"] == size) & (report.ring["neighbours"] == min(size, report.largest))].iloc[
        0
    ]
    measured = f", {row['shown']:.1f} as measured" if row["samples"] else ""
    said.append(
        f"Teammates in the same sector merge: of {row['neighbours']:.0f} neighbours a ring of {size} sectors shows "
        f"{row['expected']:.1f} on average by the occupancy formula{measured}."
    )
    listed = report.cost.loc[report.cost["degree"] == "pairwise", "added"].iloc[0]
    if size >= listed:
        said.append(f"A list of all teammates, Θ(N), needs no more inputs than this ring, Θ(1): {listed} and {size}.")
    return said


def sections(report: DeltaEstimate) -> list[Section]:
    """Return the tables, reduced to their most important rows."""
    return [_curve(report), *_groups(report), _ring(report), _cost(report)]


def _curve(report: DeltaEstimate) -> Section:
    table = report.exceedance
    first = int((table["probability"] >= 1).sum())
    last = max(report.largest, report.delta_safe if report.supported else 0, report.predicted_delta or 0)
    shown = table[(table["delta"] >= first - 1) & (table["delta"] <= last)]
    shown = shown.tail(_MOST_ROWS)
    columns = ["δ", "exceeded in", "P(max > δ)", f"bounds, {report.confidence:.0%} each"]
    rows = [
        [f"{row.delta}", f"{row.exceeding}", _share(row.probability), f"{_share(row.low)} … {_share(row.high)}"]
        for row in _rows(shown)
    ]
    if report.prediction is not None:
        columns.append("closed form")
        rows = [[*row, _share(value)] for row, value in zip(rows, shown["predicted"], strict=True)]
    return Section("How often δ is exceeded", columns, rows)


def _groups(report: DeltaEstimate) -> list[Section]:
    if report.groups is None:
        return []
    bounds = f"bounds, {report.confidence:.0%} each"
    columns = ["group or team", "N", "largest", f"δ for {report.risk:g}", "P(max > δ)", bounds, "δ with confidence"]
    rows = []
    for row in _rows(report.groups):
        bounds = f"{_share(row.low)} … {_share(row.high)}"
        safe = f"{row.delta_safe}" if report.supported else f"{row.delta_safe}: too few runs"
        name = f"team {row.name}" if row.kind == "team" else str(row.name)
        chance = _share(row.probability)
        rows.append([name, f"{row.robots}", f"{row.largest}", f"{row.delta}", chance, bounds, safe])
    return [Section("δ of each group", columns, rows)]


def _ring(report: DeltaEstimate) -> Section:
    columns, tables = ["neighbours", "samples"], list[list[Any]]()
    for sectors, table in report.ring.groupby("sectors"):
        columns += [f"{sectors} sectors: formula", "measured"]
        tables.append(_rows(table))
    rows = []
    for lines in zip(*tables, strict=True):
        row = [f"{lines[0].neighbours}", f"{lines[0].samples}"]
        for line in lines:
            row += [f"{line.expected:.2f}", f"{line.shown:.2f}" if line.samples else "–"]
        rows.append(row)
    return Section("Mean number of neighbours that a ring shows", columns, _thinned(rows))


def _cost(report: DeltaEstimate) -> Section:
    columns = ["degree", "", "inputs", "own", "added", "log10 of 2^d", f"added for {report.robots - 1} teammates"]
    rows = []
    for row in _rows(report.cost):
        name = str(row.degree) if pd.isna(row.delta) else f"{row.degree}, δ = {row.delta}"
        counts = [f"{number}" for number in (row.inputs, row.own, row.added)]
        rows.append([name, f"{row.growth}: {row.formula}", *counts, f"{row.log10_size:.1f}", f"{row.added_here}"])
    return Section(f"Inputs of each degree of awareness in a team of {report.robots}", columns, rows)


def _rows(table: pd.DataFrame) -> list[Any]:
    return list(table.itertuples(index=False))


def _thinned(rows: list[list[str]]) -> list[list[str]]:
    """Return at most `_MOST_ROWS` rows, evenly spread, with the first and the last."""
    if len(rows) <= _MOST_ROWS:
        return rows
    return [rows[round(place * (len(rows) - 1) / (_MOST_ROWS - 1))] for place in range(_MOST_ROWS)]


def _share(value: float) -> str:
    if pd.isna(value):
        return "–"
    return f"{value:.4f}" if value >= 5e-5 or value == 0 else f"{value:.0e}"


def markdown(report: DeltaEstimate) -> str:
    """Return the report as Markdown."""
    parts = [f"# δ for {report.subject}", "\n".join(f"- {sentence}" for sentence in sentences(report))]
    for title, columns, rows in sections(report):
        parts += [f"## {title}", markdown_table(columns, rows, align="l" + "r" * (len(columns) - 1))]
    return page(*parts)


def rich_parts(report: DeltaEstimate) -> Iterator[Any]:
    """Yield the parts of the report for rich."""
    from rich.table import Table
    from rich.text import Text

    yield Text(report.subject, style="dim")
    cautions = len(report.cautions)
    for number, sentence in enumerate(sentences(report)):
        yield Text(sentence, style="bold red" if number < cautions else "bold" if number == cautions else "")
    for title, columns, rows in sections(report):
        if not rows:
            continue
        table = Table(title=title, title_justify="left", title_style="bold")
        for number, column in enumerate(columns):
            table.add_column(column, justify="right" if number else "left")
        for row in rows:
            table.add_row(*row)
        yield Text()
        yield table
