"""A quantity against team size: a curve for each of some radii, with its confidence band."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
import pandas as pd

from teamsight.analysis.plot.style import FAINT, ROBOTS_LABEL, plain

if TYPE_CHECKING:
    from matplotlib.axes import Axes

# More bands hide each other.
_MOST_CURVES = 4
# From dark to light; without the lightest shades, which are faint on white.
_SHADES = 0.0, 0.86


def draw_curves(axes: Axes, cells: pd.DataFrame, label: str) -> None:
    """Draw mean and confidence band against team size, for the smallest radius, the largest and two between them.

    Parameters
    ----------
    axes : matplotlib Axes
        Where to draw.
    cells : DataFrame
        Columns robots, radius, mean, low, high; a cell with infinite limits has no band.
    label : str
        Name and unit of the quantity.
    """
    import matplotlib

    plain(axes)
    found = np.unique(cells["radius"])
    # Closer together among the small radii, where the quantities change most: of 1..9 these are 1, 2, 4 and 9.
    shown = found[np.unique(np.geomspace(1, len(found), _MOST_CURVES).round().astype(int)) - 1]
    shades = matplotlib.colormaps["viridis"](np.linspace(*_SHADES, len(shown)))
    for radius, colour in zip(shown, shades, strict=True):
        of = cells[cells["radius"] == radius].sort_values("robots")
        draw_band(axes, of["robots"], of, colour, f"R = {radius:g}")
    axes.set_xlabel(ROBOTS_LABEL)
    axes.set_ylabel(label)
    axes.tick_params(colors=FAINT)
    axes.legend(frameon=False, loc="center left", bbox_to_anchor=(1.0, 0.5))


def draw_band(axes: Axes, x: Any, cells: pd.DataFrame, colour: Any, label: str, **line: Any) -> None:
    """Draw a mean as a line with its confidence band.

    Parameters
    ----------
    axes : matplotlib Axes
        Where to draw.
    x : ndarray or Series, shape (n,)
        Places of the cells, ascending.
    cells : DataFrame
        Columns mean, low, high; a cell with infinite limits has no band.
    colour : colour of matplotlib
        Colour of line and band.
    label : str
        What the legend says.
    **line
        Further properties of the line.
    """
    axes.plot(x, cells["mean"], color=colour, label=label, **{"linewidth": 1.8} | line)
    bounded = np.isfinite(cells["high"].to_numpy())
    low, high = (cells[name].to_numpy() for name in ("low", "high"))
    axes.fill_between(x, low, high, where=bounded, color=colour, alpha=0.22, linewidth=0)
