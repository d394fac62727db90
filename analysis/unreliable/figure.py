"""The two figures: what is observed, the gain from awareness, and δ, against the failure rate or the sensing period."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
import pandas as pd
from matplotlib.ticker import MaxNLocator

from teamsight.analysis.plot.style import DEGREE, FAINT, INK, canvas, head, plain, to_png
from teamsight.analysis.unreliable.plan import Plan, time_to_failure
from teamsight.analysis.unreliable.points import CONFIDENCE, RISK
from teamsight.analysis.unreliable.subject import TARGETS, CmommtSubject, Subject

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure as Canvas

_TITLES = {
    "failures": "Robots that fail: what awareness adds, and how large δ must be",
    "periods": "Robots that sense rarely: what awareness adds, and how large δ must be",
}
_LABELS = {"failures": "failures in 1,000 ticks of work\n(availability)", "periods": "sensing period  [ticks]"}
_ROWS_OF_CMOMMT = ("observed targets  [%]", "gain from awareness  [points]", "δ")
# Inches: the figure, a panel, the space between panels, and what is above them.
_WIDTH, _HEIGHT, _PANEL, _BETWEEN, _HEAD = 13.4, 11.5, 2.6, 0.5, 1.25
# By this share of the axis the points of a policy stand beside those of the one before, so that both are seen.
_BESIDE = 0.02


def draw(points: pd.DataFrame, sweep: str, plan: Plan) -> bytes:
    """Return the figure of a sweep as PNG.

    Parameters
    ----------
    points : DataFrame
        From `points.points`.
    sweep : str
        "failures" or "periods".
    plan : Plan
        What was simulated.
    """
    return to_png(draw_on_canvas(points, sweep, plan), _TITLES[sweep])


def draw_on_canvas(points: pd.DataFrame, sweep: str, plan: Plan) -> Canvas:
    """Return the figure; see `draw`."""
    figure, rows, subject = canvas(_WIDTH, _HEIGHT), _rows(plan.subject), plan.subject
    policies = points["policy"].unique().tolist()
    fixed = f"mean time to repair {plan.repair:g} ticks; " if sweep == "failures" else "phases at random; "
    head(
        figure,
        _TITLES[sweep],
        f"{plan.runs} runs of {plan.steps} steps, {_about(plan)}; {fixed}95 % confidence bands; "
        f"gain over {subject.name(policies[0], False)}; δ for a risk of {RISK:g} with its bounds, {CONFIDENCE:.0%} "
        f"each; seed {plan.seed}",
    )
    of = points[points["sweep"] == sweep].assign(x=lambda rows: _places(rows["value"], sweep, plan))
    columns = len(subject.scenarios)
    axes = np.empty((len(rows), columns), object)
    for row in range(len(rows)):
        for column, scenario in enumerate(subject.scenarios):
            left, width = 0.065 + column * 0.93 / columns, 0.8 / columns
            bottom = 1 - (_HEAD + row * (_PANEL + _BETWEEN) + _PANEL) / _HEIGHT
            shared: dict[str, Any] = {"sharex": axes[0, column]} if row else {}
            shared |= {"sharey": axes[row, 0]} if column else {}
            panel = axes[row, column] = figure.add_axes((left, bottom, width, _PANEL / _HEIGHT), **shared)
            plain(panel)
            panel.tick_params(colors=FAINT)
            chosen = of[np.logical_and.reduce([of[name] == scenario[name] for name in subject.columns])]
            (_draw_observed, _draw_gain, _draw_delta)[row](panel, chosen, subject)
            _scale(panel, of, sweep)
            if row == 0:
                panel.set_title(subject.title(scenario), loc="left", size=11, color=INK)
            if row == len(rows) - 1:
                panel.set_xlabel(_LABELS[sweep])
            if column == 0:
                panel.set_ylabel(rows[row])
    # One axis for all panels of a row: teams are compared across them.
    axes[-1, 0].set_ylim(0.0, max(1, of["delta_safe"].where(of["supported"], of["delta"]).max()) + 0.6)
    handles, labels = axes[0, 0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="lower center", ncols=4, frameon=False, bbox_to_anchor=(0.5, 0.005))
    return figure


def _rows(subject: Subject) -> tuple[str, str, str]:
    """Return what the panels of each row show."""
    if isinstance(subject, CmommtSubject):
        return _ROWS_OF_CMOMMT
    return subject.observed, "gain from awareness", "δ"


def _about(plan: Plan) -> str:
    """Return in a few words what was simulated."""
    return f"{TARGETS} targets" if isinstance(plan.subject, CmommtSubject) else plan.subject.about


def _places(value: pd.Series[float], sweep: str, plan: Plan) -> pd.Series[float]:
    """Return the values of the horizontal axis: failures in 1,000 ticks, or the period."""
    if sweep == "periods":
        return value
    return value.map(lambda one: 0.0 if one == 1.0 else 1000.0 / time_to_failure(one, plan.repair))


def _scale(axes: Axes, of: pd.DataFrame, sweep: str) -> None:
    ticks = of.drop_duplicates("x").sort_values("x")
    if sweep == "periods":
        axes.set_xscale("log")
        axes.set_xticks(ticks["x"], [f"{period:g}" for period in ticks["x"]])
    else:
        names = [f"{x:.2g}\n({value:g})" for x, value in zip(ticks["x"], ticks["value"], strict=True)]
        axes.set_xticks(ticks["x"], names)
    axes.minorticks_off()


def _draw_observed(axes: Axes, of: pd.DataFrame, subject: Subject) -> None:
    for policy, rows in of.groupby("policy", sort=False):
        given, missing = (subject.name(str(policy), aware) for aware in (True, False))
        _band(axes, rows, "aware", DEGREE[subject.degree(str(policy), True)], given, "-")
        if missing not in axes.get_legend_handles_labels()[1]:
            _band(axes, rows, "unaware", DEGREE[subject.degree(str(policy), False)], missing, "--")


def _draw_gain(axes: Axes, of: pd.DataFrame, subject: Subject) -> None:
    axes.axhline(0.0, color=FAINT, linewidth=1.0)
    for policy, rows in of.groupby("policy", sort=False):
        _band(axes, rows, "gain", DEGREE[subject.degree(str(policy), True)], "", "-")


def _draw_delta(axes: Axes, of: pd.DataFrame, subject: Subject) -> None:
    logarithmic = bool(of["x"].min() > 0)
    for number, (policy, rows) in enumerate(of.groupby("policy", sort=False)):
        rows = rows.sort_values("x")
        aside = number * _BESIDE * float(np.ptp(np.log(rows["x"]) if logarithmic else rows["x"]))
        place = rows["x"] * np.exp(aside) if logarithmic else rows["x"] + aside
        high = rows["delta_safe"].where(rows["supported"], rows["delta"])
        reach = np.array([rows["delta"] - rows["delta_low"], high - rows["delta"]])
        style: dict[str, Any] = {
            "color": DEGREE[subject.degree(str(policy), True)],
            "marker": "o",
            "markersize": 4.5,
            "linewidth": 1.6,
            "capsize": 3,
        }
        axes.errorbar(place, rows["delta"], reach, **style)
    axes.yaxis.set_major_locator(MaxNLocator(integer=True))


def _band(axes: Axes, rows: pd.DataFrame, name: str, colour: str, label: str, dashes: str) -> None:
    rows = rows.sort_values("x")
    style: dict[str, Any] = {"color": colour, "marker": "o", "markersize": 4, "linewidth": 1.6, "linestyle": dashes}
    axes.plot(rows["x"], rows[name], label=label, **style)
    known = rows[np.isfinite(rows[f"{name}_low"])]
    axes.fill_between(known["x"], known[f"{name}_low"], known[f"{name}_high"], color=colour, alpha=0.18, linewidth=0)
