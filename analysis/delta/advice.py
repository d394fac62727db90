"""What can be said, and done, when there are too few trials for the risk."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from teamsight.analysis.delta.estimate import DeltaEstimate


def trials_phrase(report: DeltaEstimate) -> str:
    """Return how many trials there are, and how many independent ones they are worth if these are fewer."""
    said = f"{report.trials:,} {report.trial}{'s' * (report.trials != 1)}"
    if report.trial == "run":
        return said
    return f"{said} (worth {report.independent:.1f} independent ones)"


def advice(report: DeltaEstimate) -> list[str]:
    """Return what the trials support, and what it takes to support the risk."""
    most = report.robots - 1
    if report.delta_low == most > 0:
        row = report.exceedance.iloc[most - 1]
        return [
            f"In {int(row['exceeding']):,} of them some robot had all N − 1 = {most} teammates as neighbours, too "
            f"often for δ = {most - 1}: δ = {most} is needed, and certain without a trial."
        ]
    return [
        f"These {trials_phrase(report)} cannot support a risk of {report.risk:g} with {report.confidence:.0%} "
        f"confidence: that takes at least {report.trials_needed:,} independent ones, all within δ.",
        _supported(report),
        _cure(report),
    ]


def _supported(report: DeltaEstimate) -> str:
    most, delta = report.robots - 1, report.supported_delta
    stated = rounded_up(report.supported_risk)
    if delta < most:
        outside = f"; outside of them even {report.largest} was seen" * (report.largest > delta)
        return (
            f"What they support is a risk of {stated:g}, for δ = {delta}, the most neighbours in any of "
            f"them{outside}. Only δ = N − 1 = {most} is certain without a trial."
        )
    if most < 1:
        return "A robot alone has no neighbours: δ = 0 is certain."
    row = report.exceedance.iloc[most - 1]
    return (
        f"In {int(row['exceeding']):,} of them some robot had all N − 1 = {most} teammates as neighbours; "
        f"what they support for δ = {most - 1} is a risk of {rounded_up(row['high']):g}."
    )


def _cure(report: DeltaEstimate) -> str:
    needed = report.trials_needed
    if report.recorded is None:
        return f"Make at least {needed:,} runs, {needed - report.trials:,} more."
    columns = report.maxima[["max_neighbours", "mean_neighbours"]]
    if report.independent == 1 and report.trials > 1 and (columns.nunique() == 1).all():
        return f"Nothing changes from {report.trial} to {report.trial}: record while the robots move."
    factor = needed / report.independent
    more = math.ceil(report.trials * (factor - 1))
    said = (
        f"At this rate it takes {factor:.3g} times the record, {report.recorded * factor:.4g} instead of "
        f"{report.recorded:.4g}: {more:,} more {report.trial}s"
    )
    if report.shorter is None:
        return f"{said}; no shorter window gives enough independent ones."
    return f"{said}. Windows of at most {report.shorter:g} would do as it is, but state the risk for so short a time."


def rounded_up(value: float) -> float:
    """Return a positive number with three digits, not smaller than it is."""
    unit = 10.0 ** (math.floor(math.log10(value)) - 2)
    return float(f"{math.ceil(value / unit * (1 - 1e-12)) * unit:.3g}")
