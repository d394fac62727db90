"""`draw`: the picture of a study, or of the difference of two."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from typing import TYPE_CHECKING

import numpy as np

from teamsight.analysis.studies.describe import conditions, what_is_missing
from teamsight.analysis.studies.figures.cells import Cells, cells_of, matching
from teamsight.analysis.studies.figures.choose import Choice, choose
from teamsight.analysis.studies.figures.difference import check_comparable, pair
from teamsight.analysis.studies.figures.page import Picture
from teamsight.analysis.studies.figures.quantity import Quantity

if TYPE_CHECKING:
    from matplotlib.figure import Figure as Canvas

    from teamsight.analysis.studies.results import StudyTables


def draw(
    results: StudyTables,
    *,
    kind: str = "auto",
    x: str | None = None,
    y: str | None = None,
    measure: str | None = None,
    minus: StudyTables | None = None,
    across: Collection[str] = (),
    where: Mapping[str, object] | None = None,
) -> Canvas:
    """Return a picture of a measure over the axes of a study.

    Parameters
    ----------
    results : StudyTables
        The study.
    minus : StudyTables, optional
        A study that is subtracted, run by run, where both have the same values of their common axes, the same
        replicate and the same seed; see `check_comparable`.
    kind, x, y, measure, across, where
        As in `StudyResults.plot`.

    Raises
    ------
    ValueError
        If there is nothing to draw, or the axes do not suit the kind of picture.
    """
    from matplotlib.text import Text

    name = results.measured(measure)
    if minus is not None:
        check_comparable(results, minus, across, where or {})
    picture = _picture(results, Quantity(name, minus is not None), minus, where or {})
    figure = _drawn(picture, choose(picture.cells, kind, x, y))
    for text in figure.findobj(Text):
        # Names and values are no formulas, even between two $.
        text.set_parse_math(False)
    return figure


def _drawn(picture: Picture, choice: Choice) -> Canvas:
    if choice.kind == "heat-map":
        from teamsight.analysis.studies.figures.heat_map import draw_heat_map

        return draw_heat_map(picture, choice)
    if choice.kind == "lines":
        from teamsight.analysis.studies.figures.lines import draw_lines

        return draw_lines(picture, choice)
    if choice.kind == "surface":
        from teamsight.analysis.studies.figures.surface import draw_surfaces

        return draw_surfaces(picture, choice)
    if choice.kind == "scatter":
        from teamsight.analysis.studies.figures.scatter import draw_scatter

        return draw_scatter(picture, choice)
    from teamsight.analysis.studies.figures.runs import draw_runs

    return draw_runs(picture)


def _picture(
    results: StudyTables, quantity: Quantity, minus: StudyTables | None, where: Mapping[str, object]
) -> Picture:
    frame, setting = results.frame, results.setting_numbers
    values = frame[quantity.name].to_numpy(float)
    quantity = quantity.of_size(values)
    values = values * quantity.factor
    source, warning = conditions(results), what_is_missing(results)
    # An axis of the study that is subtracted may be chosen, too.
    others = set(minus.axes if minus is not None else ()) - set(results.axes)
    own = {axis: value for axis, value in where.items() if axis not in others}
    chosen = matching(results.settings, own)
    if minus is not None:
        shared = [axis for axis in results.axes if axis in minus.axes]
        mask = matching(minus.settings, {axis: value for axis, value in where.items() if axis in minus.axes})
        kept, rest = chosen[setting], mask[minus.setting_numbers]
        minus.measured(quantity.name)
        pairs = pair(frame[kept], minus.frame[rest], shared, quantity.name)
        values, setting = pairs.values * quantity.factor, setting[kept][pairs.row]
        source = f"{source} minus {conditions(minus)}; {len(values):,} pairs of runs"
        missing = what_is_missing(minus)
        warning = "; ".join(text for text in (warning, missing and f"{minus.name}: {missing}") if text)
    # The difference of two flags is a number, and a flag named as a fraction is drawn in percent.
    are_flags = minus is None and not quantity.is_percent and results.is_flag(quantity.name)
    cells = cells_of(results.settings, results.groups, values, setting, are_flags=are_flags)
    if where:
        cells = cells.among(chosen, [f"{axis} = {value}" for axis, value in where.items()])
    return Picture(cells, _fitted(quantity, cells), source, warning)


def _fitted(quantity: Quantity, cells: Cells) -> Quantity:
    found = cells.statistics
    with np.errstate(invalid="ignore"):
        return quantity.fitted(found["mean"].to_numpy(), ((found["high"] - found["low"]) / 2).to_numpy())
