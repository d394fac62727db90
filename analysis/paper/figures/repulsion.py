"""Fig. 9: the repulsive force between robots against their distance."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import pandas as pd

from teamsight.analysis.paper.figures.interface import Conditions, Figure, Tables
from teamsight.analysis.plot.style import DEGREE, FAINT, INK, canvas, head, plain

if TYPE_CHECKING:
    from matplotlib.figure import Figure as Canvas

_LOOKS = {"sensing": (DEGREE["ring"], "-"), "awareness": (DEGREE["pairwise"], "--")}


def _tabulate(tables: Tables, conditions: Conditions) -> dict[str, pd.DataFrame]:
    from teamsight.policies import ACmommt
    from teamsight.policies.handmade.forces import repulsion

    distance = np.round(np.linspace(0.0, 1.2, 601), 6)
    parts = []
    # The two scalings of Fig. 10 at an awareness range of half the sensing range.
    for scaling, scale in (("sensing", 1.0), ("awareness", 0.5)):
        d1, d2 = ACmommt().dr1 * scale, ACmommt().dr2 * scale
        magnitude = repulsion(distance, d1, d2)
        parts.append(pd.DataFrame({"scaling": scaling, "d1": d1, "d2": d2, "distance": distance, "force": magnitude}))
    return {"": pd.concat(parts, ignore_index=True)}


def _draw(tables: Tables, conditions: Conditions) -> Canvas:
    figure = canvas(9.6, 6.2)
    head(
        figure,
        "Fig. 9   Repulsive force from a nearby robot",
        "in closed form; constants in common use (1250 and 2000 for a sensing range of 2600): the paper prints none",
    )
    axes = figure.add_axes((0.1, 0.12, 0.85, 0.7))
    plain(axes)
    labels = {
        "sensing": "scaled with the sensing range 1, the default",
        "awareness": "scaled with an awareness range of 0.5, an option in Fig. 10",
    }
    for scaling, rows in tables[""].groupby("scaling", sort=False):
        colour, dashes = _LOOKS[str(scaling)]
        axes.plot(rows["distance"], rows["force"], dashes, color=colour, linewidth=2.6, label=labels[str(scaling)])
        if scaling == "sensing":
            for name, symbol, bottom in (("d1", "d₁", -1.0), ("d2", "d₂", 0.0)):
                value = rows[name].iloc[0]
                axes.vlines(value, bottom, 0.11, color=FAINT, linewidth=0.9, linestyle=":")
                axes.annotate(
                    f"{symbol} = {value:g}", (value, 0.07), (5, 0), textcoords="offset points", color=INK, va="center"
                )
    axes.set(xlim=(0, 1.2), ylim=(-1.12, 0.14), xlabel="distance between the robots  [sensing ranges]")
    axes.set_ylabel("force along the line between them  [of the largest]")
    axes.legend(frameon=False, loc="lower right")
    return figure


FIGURE = Figure("9", "Repulsive force from a nearby robot", (), _tabulate, _draw)
