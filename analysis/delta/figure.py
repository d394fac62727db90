"""The exceedance curve as a picture."""

from __future__ import annotations

import io
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from teamsight.analysis.delta.advice import rounded_up, trial_phrase

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from teamsight.analysis.delta.estimate import DeltaEstimate

_BLUE, _ORANGE, _GREY, _RED = "#1f5fa8", "#c8641b", "#555555", "#b02a30"


def draw(report: DeltaEstimate) -> bytes:
    """Return a PNG of P(largest degree > δ) against δ, its bounds, the prediction, the risk, and δ."""
    figure = Figure(figsize=(7.5, 5.0), dpi=150, layout="constrained")
    FigureCanvasAgg(figure)
    axes: Axes = figure.add_subplot()
    floor = _floor(report)
    _draw_curve(axes, report, floor)
    _draw_choice(axes, report, floor)
    axes.set_yscale("log")
    axes.set_ylim(floor, 1.6)
    axes.set_xlim(*_limits(report))
    axes.xaxis.set_major_locator(MaxNLocator(integer=True))
    axes.set_xlabel("δ  (number of neighbours)")
    axes.set_ylabel(f"probability that in {trial_phrase(report)}\nany robot has more than δ neighbours")
    doubt = "doubtful record, see the report: " * bool(report.cautions)
    axes.set_title(doubt + report.subject, fontsize=10, wrap=True, color=_RED if doubt else "black")
    axes.grid(True, which="major", color="#dddddd", linewidth=0.6)
    axes.legend(loc="upper right", fontsize=9, framealpha=0.95)
    image = io.BytesIO()
    figure.savefig(image, format="png", metadata={"Software": "teamsight"})
    return image.getvalue()


def _draw_curve(axes: Axes, report: DeltaEstimate, floor: float) -> None:
    table = report.exceedance
    delta = table["delta"].to_numpy()
    probability = table["probability"].to_numpy()
    high, low = table["high"].to_numpy(), np.maximum(table["low"].to_numpy(), floor)
    uncertain = high > 0
    axes.fill_between(
        delta[uncertain], low[uncertain], high[uncertain], color=_BLUE, alpha=0.18, linewidth=0,
        label=f"bounds, {report.confidence:.0%} each",
    )  # fmt: skip
    seen = probability > 0
    what = f"{report.trials:,} {report.trial}{'s' * (report.trials != 1)}"
    axes.plot(delta[seen], probability[seen], "o-", color=_BLUE, markersize=5, label=f"share of {what}")
    if report.prediction is not None:
        foreseen = table["predicted"].to_numpy()
        drawn = foreseen > floor / 10
        axes.plot(delta[drawn], foreseen[drawn], "--", color=_ORANGE, linewidth=1.8, label="closed form")


def _draw_choice(axes: Axes, report: DeltaEstimate, floor: float) -> None:
    axes.axhline(report.risk, color=_RED, linewidth=1.0, linestyle=":", label=f"risk {report.risk:g}")
    sure = report.supported and not report.cautions
    same = sure and report.delta == report.delta_safe
    label = f"δ = {report.delta}" + (f", also with {report.confidence:.0%} confidence" if same else "")
    axes.axvline(report.delta, color=_GREY, linewidth=1.2, label=label)
    if sure and not same:
        label = f"δ = {report.delta_safe} with {report.confidence:.0%} confidence"
        axes.axvline(report.delta_safe, color=_GREY, linewidth=1.2, linestyle="-.", label=label)
    if not report.supported and report.delta_low < report.robots - 1:
        what = f"{'independent ' * (report.trial != 'run')}{report.trial}s"
        text = f"too few {what} for this risk: {report.trials_needed:,} needed"
        if report.supported_delta < report.robots - 1 and not report.cautions:
            text += f"\nthese support a risk of {rounded_up(report.supported_risk):g}, for δ = {report.supported_delta}"
        box = {"facecolor": "white", "alpha": 0.85, "edgecolor": "none", "pad": 2}
        axes.text(0.02, 0.03, text, transform=axes.transAxes, color=_RED, fontsize=9, bbox=box)


def _floor(report: DeltaEstimate) -> float:
    return min(report.risk, 1.0 / report.trials) / 10.0


def _limits(report: DeltaEstimate) -> tuple[float, float]:
    """Return the δ between which the curve falls from certain to unseen, with some room."""
    certain = int((report.exceedance["probability"] >= 1).sum())
    last = max(report.largest, report.delta_safe if report.supported else 0, report.predicted_delta or 0) + 2
    return max(certain - 2, 0) - 0.5, min(last, report.robots - 1) + 0.5
