"""A temporal graph as a picture: durations, components over time, time since contact, and percolation."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import pandas as pd

from teamsight.analysis.plot.style import DEGREE, FAINT, INK, canvas, head, plain, to_png
from teamsight.analysis.stats.survival import kaplan_meier, median

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure as Canvas

    from teamsight.analysis.contacts.percolation import Percolation
    from teamsight.analysis.contacts.temporal_graph import TemporalGraph

_BLUE, _ORANGE, _GREEN = DEGREE["ring"], DEGREE["pairwise"], DEGREE["shared"]
_TITLE = "The neighbour graph over time"
# More frames than a picture has dots are thinned.
_MOST_FRAMES = 2_000


def draw(graph: TemporalGraph, percolation: Percolation | None = None, *, subject: str = "") -> bytes:
    """Return a picture of a temporal graph as PNG.

    Parameters
    ----------
    graph : TemporalGraph
        The graph.
    percolation : Percolation, optional
        Adds a panel with the largest component against the range.
    subject : str
        What was recorded, in a line.
    """
    return to_png(draw_on_canvas(graph, percolation, subject=subject), f"{_TITLE}; {subject}")


def draw_on_canvas(graph: TemporalGraph, percolation: Percolation | None = None, *, subject: str = "") -> Canvas:
    """Return the picture as a figure of matplotlib; see `draw`."""
    figure = canvas(12.4, 8.6)
    contacts = graph.contacts
    head(figure, _TITLE, subject or f"{graph.robots} robots, {len(graph.time)} frames, {len(contacts):,} contacts")
    panels = [
        figure.add_axes((0.065 + 0.49 * column, 0.56 - 0.48 * row, 0.39, 0.32)) for row in (0, 1) for column in (0, 1)
    ]
    for axes in panels:
        plain(axes)
        axes.tick_params(colors=FAINT)
    draw_durations(panels[0], graph)
    draw_components(panels[1], graph)
    draw_since_contact(panels[2], graph)
    if percolation is not None:
        draw_percolation(panels[3], percolation, graph.awareness_range)
    else:
        panels[3].set_visible(False)
    return figure


def draw_durations(axes: Axes, graph: TemporalGraph) -> None:
    """Draw the share of contacts, and of the times between contacts, that are longer than a time."""
    contacts, gaps = graph.contacts, graph.gaps
    known = contacts[contacts["began_by"] != "record"]
    between = gaps[~gaps["left_censored"]]
    parts = (
        ("contact", known["duration"], known["ended_by"] == "record", _BLUE),
        ("between contacts", between["duration"], between["right_censored"], _ORANGE),
    )
    for label, duration, censored, colour in parts:
        curve = kaplan_meier(duration, censored)
        if len(curve):
            middle = median(curve)
            text = f"{label}, median {middle:g}" if np.isfinite(middle) else label
            _steps(axes, curve, colour, f"{text}  (n = {len(duration):,})")
    axes.set_xscale("log")
    axes.set_ylim(0.0, 1.03)
    axes.set_xlabel(_with_unit("duration", graph))
    axes.set_ylabel("share that is longer")
    axes.set_title("Link durations and inter-contact times (Kaplan–Meier)", loc="left", size=11, color=INK)
    if axes.lines:
        axes.legend(frameon=False, loc="upper right")


def _steps(axes: Axes, curve: pd.DataFrame, colour: str, label: str) -> None:
    axes.step(curve["duration"], curve["survival"], where="post", color=colour, linewidth=1.8, label=label)
    axes.fill_between(
        curve["duration"], curve["low"], curve["high"], step="post", color=colour, alpha=0.18, linewidth=0
    )


def draw_components(axes: Axes, graph: TemporalGraph) -> None:
    """Draw the share of the robots in the largest component, and the number of components, over time."""
    table = graph.components.iloc[:: max(1, -(-len(graph.time) // _MOST_FRAMES))]
    axes.plot(table["time"], table["largest_share"], color=_BLUE, linewidth=1.4, label="largest component")
    share = table["isolated"] / table["robots"].where(table["robots"] > 0)
    axes.plot(table["time"], share, color=_GREEN, linewidth=1.0, label="without any neighbour")
    axes.set_ylim(0.0, 1.03)
    axes.set_xlabel(_with_unit("time", graph))
    axes.set_ylabel("share of the robots")
    middle = table["components"].mean() if len(table) else np.nan
    axes.set_title(f"Components: {middle:.1f} on average", loc="left", size=11, color=INK)
    axes.legend(frameon=False, loc="best")


def draw_since_contact(axes: Axes, graph: TemporalGraph) -> None:
    """Draw quantiles over the robots of the time since their last contact, over time."""
    thin = max(1, -(-len(graph.time) // _MOST_FRAMES))
    since = graph.time_since_contact()[::thin]
    time = graph.time[::thin]
    some = ~np.isnan(since).all(axis=1)
    for quantile, colour in ((0.5, _BLUE), (0.9, _ORANGE), (1.0, _GREEN)):
        values = np.full(len(time), np.nan)
        if some.any():
            values[some] = np.nanquantile(since[some], quantile, axis=1)
        label = {0.5: "median robot", 0.9: "90 % of the robots", 1.0: "longest"}[quantile]
        axes.plot(time, values, color=colour, linewidth=1.3, label=label)
    # In a crowd the median is 0: the axis begins below, so that its line is seen.
    axes.set_ylim(bottom=-0.03 * axes.get_ylim()[1])
    axes.set_xlabel(_with_unit("time", graph))
    axes.set_ylabel(_with_unit("time since last contact", graph))
    axes.set_title("Time since a robot's last contact", loc="left", size=11, color=INK)
    axes.legend(frameon=False, loc="best")


def _with_unit(name: str, graph: TemporalGraph) -> str:
    return f"{name}  [{graph.unit}]" if graph.unit else name


def draw_percolation(axes: Axes, found: Percolation, awareness_range: float | None = None) -> None:
    """Draw the share of the robots in the largest component, and the mean degree, against the range; mark one range."""
    curve = found.curve
    if (curve["high"] - curve["low"]).max() < 1.0:
        axes.fill_between(curve["range"], curve["low"], curve["high"], color=_BLUE, alpha=0.18, linewidth=0)
    axes.plot(curve["range"], curve["share"], color=_BLUE, linewidth=1.8, label="largest component")
    for name, one, colour in (("half", found.critical, _ORANGE), ("all", found.connected, _GREEN)):
        if not np.isfinite(one.mean):
            continue
        bounds = f" ({one.low:.2f} to {one.high:.2f})" if np.isfinite(one.low) else ""
        axes.axvline(
            one.mean, color=colour, linewidth=1.2, linestyle="--", label=f"holds {name}: {one.mean:.2f}{bounds}"
        )
        if np.isfinite(one.low):
            axes.axvspan(one.low, one.high, color=colour, alpha=0.18, linewidth=0)
    if awareness_range is not None:
        axes.axvline(
            awareness_range, color=INK, linewidth=1.2, linestyle="-.", label=f"awareness range: {awareness_range:g}"
        )
    axes.set_ylim(0.0, 1.03)
    axes.set_xlim(left=0.0)
    axes.set_xlabel("range  [length]")
    axes.set_ylabel("share of the robots")
    beside = axes.twinx()
    beside.plot(curve["range"], curve["mean_degree"], color=FAINT, linewidth=1.0, linestyle=":")
    beside.set_ylabel("mean degree  (dotted)", color=FAINT)
    beside.set_ylim(bottom=0.0)
    beside.spines[["top"]].set_visible(False)
    beside.tick_params(colors=FAINT)
    axes.set_title("Percolation", loc="left", size=11, color=INK)
    axes.legend(frameon=False, loc="lower right")
