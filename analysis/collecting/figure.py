"""The figure: rows learned right against time for each scheme, and what more than one bit adds to the pucks."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pandas as pd
from matplotlib.axes import Axes

from teamsight.analysis.collecting.claims import difference
from teamsight.analysis.collecting.plan import SCHEMES, Plan
from teamsight.analysis.plot.style import COLOURS, FAINT, canvas, head, plain, to_picture
from teamsight.analysis.stats.paired import Interval, interval_of

_TITLE = "Learning to collect pucks"
_DASHED = ("events + H", "events + I")


def draw(table: pd.DataFrame, plan: Plan, kind: str = "png") -> bytes:
    """Return the figure.

    Parameters
    ----------
    table : DataFrame
        That of the runs of `plan`.
    plan : Plan
        What was simulated.
    kind : str
        A format in `teamsight.analysis.plot.style.FORMATS`.
    """
    figure = canvas(11.0, 4.4)
    head(figure, _TITLE, f"{plan.runs} learning runs of each condition; 95 % confidence intervals; seed {plan.seed}")
    _draw_curves(figure.add_axes((0.07, 0.14, 0.44, 0.62)), table, plan)
    _draw_codings(figure.add_axes((0.62, 0.14, 0.35, 0.62)), table, plan)
    return to_picture(figure, _TITLE, kind)


def _draw_curves(axes: Axes, table: pd.DataFrame, plan: Plan) -> None:
    plain(axes)
    axes.set_title(f"clear rows learned right, N = {plan.sizes[0]}", loc="left", size=10)
    part = table[table["robots"] == plan.sizes[0]]
    for colour, condition in zip(COLOURS, SCHEMES, strict=False):
        curves = 100.0 * np.array(part[part["condition"] == condition]["curve"].tolist())
        found = [interval_of(curves[:, at]) for at in range(len(plan.times))]
        axes.errorbar(
            plan.times, [one.mean for one in found], _wide(found), color=colour, label=condition, marker="o",
            markersize=4, linewidth=1.4, capsize=2, linestyle="--" if condition in _DASHED else "-",
        )  # fmt: skip
    axes.set_xscale("log")
    axes.set_xticks(plan.times, [f"{time:,}" for time in plan.times])
    axes.minorticks_off()
    axes.set_ylim(0, 100)
    axes.set_xlabel("steps of learning")
    axes.set_ylabel("share of rows [%]")
    axes.legend(frameon=False, ncol=2, fontsize=8)


def _draw_codings(axes: Axes, table: pd.DataFrame, plan: Plan) -> None:
    plain(axes)
    axes.set_title("pucks beyond those with one bit", loc="left", size=10)
    axes.axhline(0.0, color=FAINT, linewidth=0.8)
    times = {"delivered_early": plan.judged, "delivered": plan.times[-1]}
    labels = []
    for place, (size, coding) in enumerate((n, c) for n in plan.sizes for c in ("count", "ring")):
        labels.append(f"{coding}\nN = {size}")
        for number, (column, time) in enumerate(times.items()):
            found = difference(table, coding, "progress", column, size)
            axes.errorbar(
                [place + 0.16 * (2 * number - 1)], [found.mean], _wide([found]), color=COLOURS[1 + number], marker="o",
                capsize=2, label=f"after {time:,} steps" if not place else None,
            )  # fmt: skip
    axes.set_xticks(range(len(labels)), labels)
    axes.set_ylabel("pucks delivered")
    axes.legend(frameon=False, fontsize=8)


def _wide(found: Sequence[Interval]) -> list[float]:
    """Return half the widths of intervals; none where a single run gives none."""
    return [max(one.high - one.mean, 0.0) if np.isfinite(one.high) else 0.0 for one in found]
