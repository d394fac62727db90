"""A quantity against team size: a curve for each of some radii, with its confidence band."""

from __future__ import annotations

from typing import TYPE_CHECKING

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
        axes.plot(of["robots"], of["mean"], color=colour, linewidth=1.8, label=f"R = {radius:g}")
        known = of[np.isfinite(of["high"])]
        axes.fill_between(known["robots"], known["low"], known["high"], color=colour, alpha=0.22, linewidth=0)
    axes.set_xlabel(ROBOTS_LABEL)
    axes.set_ylabel(label)
    axes.tick_params(colors=FAINT)
    axes.legend(frameon=False, loc="center left", bbox_to_anchor=(1.0, 0.5))
