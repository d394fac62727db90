"""A temporal graph as a picture: durations, components over time, time since contact, and percolation."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from teamsight.analysis.plot.kinds import panels
from teamsight.analysis.plot.style import COLOURS, FAINT, INK, to_picture
from teamsight.analysis.stats.survival import kaplan_meier, median

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure as Canvas

    from teamsight.analysis.contacts.percolation import Percolation
    from teamsight.analysis.contacts.temporal_graph import TemporalGraph

_BLUE, _ORANGE, _GREEN = COLOURS[1:4]
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
    return to_picture(draw_on_canvas(graph, percolation, subject=subject), f"The neighbour graph over time; {subject}")


def draw_on_canvas(graph: TemporalGraph, percolation: Percolation | None = None, *, subject: str = "") -> Canvas:
    """Return the picture as a figure of matplotlib; see `draw`."""
    unit = f"  [{graph.unit}]" if graph.unit else ""
    components = graph.components["components"]
    names = [
        "Link durations and inter-contact times (Kaplan–Meier)",
        f"Components: {components.mean() if len(components) else np.nan:.1f} on average",
        "Time since a robot's last contact",
        *["Percolation"] * (percolation is not None),
    ]
    figure, axes = panels(
        "The neighbour graph over time",
        subject or f"{graph.robots} robots, {len(graph.time)} frames, {len(graph.contacts):,} contacts",
        names,
        y=["share that is longer", "share of the robots", f"time since last contact{unit}", "share of the robots"],
        columns=2,
        size=(6.2, 3.8),
    )
    axes[0].set_xlabel(f"duration{unit}")
    _draw_durations(axes[0], graph)
    every = max(1, -(-len(graph.time) // _MOST_FRAMES))
    for panel in axes[1:3]:
        panel.set_xlabel(f"time{unit}")
    _draw_components(axes[1], graph, every)
    _draw_since_contact(axes[2], graph, every)
    if percolation is not None:
        _draw_percolation(axes[3], percolation, graph.awareness_range)
    for panel in axes:
        if panel.lines:
            panel.legend(frameon=False, loc="best")
    return figure


def _draw_durations(axes: Axes, graph: TemporalGraph) -> None:
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
            label += f", median {middle:g}" if np.isfinite(middle) else ""
            label += f"  (n = {len(duration):,})"
            time = curve["duration"]
            axes.step(time, curve["survival"], where="post", color=colour, linewidth=1.8, label=label)
            axes.fill_between(time, curve["low"], curve["high"], step="post", color=colour, alpha=0.18, linewidth=0)
    axes.set_xscale("log")
    axes.set_ylim(0.0, 1.03)


def _draw_components(axes: Axes, graph: TemporalGraph, every: int) -> None:
    """Draw the share of the robots in the largest component, and of those without neighbours, over time."""
    table = graph.components.iloc[::every]
    axes.plot(table["time"], table["largest_share"], color=_BLUE, linewidth=1.4, label="largest component")
    share = table["isolated"] / table["robots"].where(table["robots"] > 0)
    axes.plot(table["time"], share, color=_GREEN, linewidth=1.0, label="without any neighbour")
    axes.set_ylim(0.0, 1.03)


def _draw_since_contact(axes: Axes, graph: TemporalGraph, every: int) -> None:
    """Draw quantiles over the robots of the time since their last contact, over time."""
    since, time = graph.time_since_contact()[::every], graph.time[::every]
    some = ~np.isnan(since).all(axis=1)
    quantiles = {"median robot": (0.5, _BLUE), "90 % of the robots": (0.9, _ORANGE), "longest": (1.0, _GREEN)}
    for label, (quantile, colour) in quantiles.items():
        values = np.full(len(time), np.nan)
        if some.any():
            values[some] = np.nanquantile(since[some], quantile, axis=1)
        axes.plot(time, values, color=colour, linewidth=1.3, label=label)
    # In a crowd the median is 0: the axis begins below, so that its line is seen.
    axes.set_ylim(bottom=-0.03 * axes.get_ylim()[1])


def _draw_percolation(axes: Axes, found: Percolation, awareness_range: float | None) -> None:
    """Draw the share of the robots in the largest component, and the mean degree, against the range; mark one range."""
    curve = found.curve
    if (curve["high"] - curve["low"]).max() < 1.0:
        axes.fill_between(curve["range"], curve["low"], curve["high"], color=_BLUE, alpha=0.18, linewidth=0)
    axes.plot(curve["range"], curve["share"], color=_BLUE, linewidth=1.8, label="largest component")
    for name, one, colour in (("half", found.critical, _ORANGE), ("all", found.connected, _GREEN)):
        if np.isfinite(one.mean):
            bounds = f" ({one.low:.2f} to {one.high:.2f})" if np.isfinite(one.low) else ""
            axes.axvline(one.mean, color=colour, linestyle="--", label=f"holds {name}: {one.mean:.2f}{bounds}")
            if bounds:
                axes.axvspan(one.low, one.high, color=colour, alpha=0.18, linewidth=0)
    if awareness_range is not None:
        axes.axvline(awareness_range, color=INK, linestyle="-.", label=f"awareness range: {awareness_range:g}")
    axes.set_ylim(0.0, 1.03)
    axes.set_xlim(left=0.0)
    axes.set_xlabel("range  [length]")
    beside = axes.twinx()
    beside.plot(curve["range"], curve["mean_degree"], color=FAINT, linewidth=1.0, linestyle=":")
    beside.set_ylabel("mean degree  (dotted)", color=FAINT)
    beside.set_ylim(bottom=0.0)
    beside.spines[["top"]].set_visible(False)
    beside.tick_params(colors=FAINT)
