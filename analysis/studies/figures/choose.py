"""Which kind of picture suits a study, and which axis is drawn along which direction."""

from __future__ import annotations

import shlex
from itertools import product
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from teamsight.analysis.studies.figures import KINDS
from teamsight.analysis.studies.figures.cells import Cells, Dimension, text_of
from teamsight.core import checks

#: More panels, or more lines in one of them, cannot be read.
MOST_PANELS, MOST_LINES = 12, 10
# An axis with fewer numbers becomes lines beside each other rather than a side of a map.
_LEAST_SIDE = 3
# More combinations than settings by this factor are not drawn as a map unless they are few.
_MOST_EMPTY = 2500


class Choice(NamedTuple):
    """What is drawn along each direction."""

    kind: str
    x: Dimension | None = None
    y: Dimension | None = None
    panels: tuple[Dimension, ...] = ()


def choose(cells: Cells, kind: str = "auto", x: str | None = None, y: str | None = None) -> Choice:
    """Return what is drawn along each direction.

    Parameters
    ----------
    cells : Cells
        The settings.
    kind : str
        One of `KINDS`.
    x, y : str, optional
        The axes along the picture's two directions; lines have a line for each value of `y`.

    Raises
    ------
    ValueError
        If the axes do not suit the kind, or there would be too many panels or lines.
    """
    checks.choice("kind", kind, KINDS)
    given = [None if name is None else cells.named(option, name) for option, name in (("x", x), ("y", y))]
    if given[0] is not None and given[0] is given[1]:
        raise ValueError(f"y={y}: advances together with x={x}; give another axis")
    if kind == "auto":
        kind = _suitable(cells, given)
    if kind == "distribution":
        return _distribution(cells, given)
    if kind == "scatter":
        return Choice("scatter", given[0], given[1])
    return _on_a_grid(cells, kind, given)


def _suitable(cells: Cells, given: list[Dimension | None]) -> str:
    if not cells.dimensions:
        return "distribution"
    if not cells.is_grid:
        return "scatter"
    if len(cells.dimensions) == 1:
        return "lines"
    sides = _directions(cells, given)
    ordered = [one is not None and _is_side(one) for one in sides]
    few = sides[1] is not None and len(sides[1]) <= MOST_LINES
    # Two texts have no order in which a line could connect them.
    return "lines" if ordered == [True, False] and few else "heat-map"


def _directions(cells: Cells, given: list[Dimension | None]) -> tuple[Dimension, Dimension | None]:
    """Return x and y; those that are not given are the first axes that are left, those of many numbers first."""
    free = sorted((one for one in cells.dimensions if one not in given), key=lambda one: not _is_side(one))
    x = given[0] or free.pop(0)
    return x, given[1] or (free.pop(0) if free else None)


def _is_side(dimension: Dimension) -> bool:
    return dimension.numbers is not None and len(dimension) >= _LEAST_SIDE


def _distribution(cells: Cells, given: list[Dimension | None]) -> Choice:
    """Return the choice of one curve for each value of at most one axis."""
    if given[0] is not None:
        raise ValueError(f"x={given[0].names[0]}: a distribution has the measure along x; give --y")
    y = given[1] or next(iter(cells.dimensions), None)
    rest = tuple(one for one in cells.dimensions if one is not y)
    _check_panels(rest)
    if y is not None and len(y) > MOST_LINES:
        raise ValueError(f"y={y.names[0]}: has {len(y)} values, at most {MOST_LINES} curves; {_where((y,))}")
    return Choice("distribution", None, y, rest)


def _on_a_grid(cells: Cells, kind: str, given: list[Dimension | None]) -> Choice:
    if not cells.dimensions:
        raise ValueError(f"kind={kind}: needs an axis, but the study has one setting; give --kind distribution")
    x, y = _directions(cells, given)
    if kind != "lines" and y is None:
        raise ValueError(f"kind={kind}: needs two axes, but only {x.names[0]} varies; give --kind lines")
    rest = tuple(one for one in cells.dimensions if one is not x and one is not y)
    _check_panels(rest)
    combinations = np.prod([float(len(one)) for one in (x, y, *rest) if one is not None])
    if combinations > max(_MOST_EMPTY, 2 * len(cells.statistics)):
        raise ValueError(
            f"kind={kind}: the {len(cells.statistics):,} settings are no grid ({combinations:,.0f} combinations of "
            "their values); give --kind scatter"
        )
    if kind == "lines" and y is not None and len(y) > MOST_LINES:
        raise ValueError(
            f"y={y.names[0]}: has {len(y)} values, at most {MOST_LINES} lines; give another --y, {_where((y,))}, or "
            "--kind heat-map"
        )
    return Choice(kind, x, y, rest)


def _check_panels(rest: tuple[Dimension, ...]) -> None:
    panels = int(np.prod([float(len(one)) for one in rest]))
    if panels > MOST_PANELS:
        names = ", ".join(one.names[0] for one in rest)
        raise ValueError(f"{names}: {panels:,} panels, one for each combination, at most {MOST_PANELS}; {_where(rest)}")


def panels_of(choice: Choice, settings: int) -> list[tuple[str, NDArray[np.bool_]]]:
    """Return title and settings of each panel."""
    found = []
    for levels in product(*(range(len(one)) for one in choice.panels)):
        chosen = list(zip(choice.panels, levels, strict=True))
        title = ", ".join(f"{one.label} = {one.texts[level]}" for one, level in chosen)
        own = np.ones(settings, bool)
        for one, level in chosen:
            own &= one.levels == level
        found.append((title, own))
    return found


def _where(dimensions: tuple[Dimension, ...]) -> str:
    widest = max(dimensions, key=len)
    # The value alone: texts are shortened, and those of axes that advance together are joined.
    given = f"{widest.names[0]}={text_of(widest.values[0][0])}"
    return f"choose a value, as in --where {shlex.quote(given)}"
