"""Advice when there are too few trials for the risk: what they support, and what would be sufficient."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from teamsight.analysis.delta.estimate import DeltaEstimate


def trials_phrase(report: DeltaEstimate) -> str:
    """Return the number of trials, and the number of independent ones if there are fewer of these."""
    text = f"{report.trials:,} {report.trial}{'s' * (report.trials != 1)}"
    if report.trial == "run":
        return text
    return f"{text} (equivalent to {report.independent:.1f} independent ones)"


def advice(report: DeltaEstimate) -> list[str]:
    """Return which risk the trials support, and how many trials the stated risk needs."""
    most = report.robots - 1
    if report.delta_low == most > 0:
        row = report.exceedance.iloc[most - 1]
        return [
            f"In {int(row['exceeding']):,} of them some robot had all N − 1 = {most} teammates as neighbours, "
            f"which is too often for δ = {most - 1}. Only δ = {most} remains, which cannot be exceeded."
        ]
    return [
        f"These {trials_phrase(report)} cannot support a risk of {report.risk:g} with {report.confidence:.0%} "
        f"confidence: at least {report.trials_needed:,} independent ones are needed, none of which exceeds δ.",
        _supported(report),
        _cure(report),
    ]


def _supported(report: DeltaEstimate) -> str:
    most, delta = report.robots - 1, report.supported_delta
    stated = rounded_up(report.supported_risk)
    if delta < most:
        outside = f"; outside of them {report.largest} was found" * (report.largest > delta)
        return (
            f"They support a risk of {stated:g} for δ = {delta}, the largest number of neighbours in any of "
            f"them{outside}. Only δ = N − 1 = {most} cannot be exceeded."
        )
    if most < 1:
        return "A single robot has no neighbours: δ = 0 cannot be exceeded."
    row = report.exceedance.iloc[most - 1]
    return (
        f"In {int(row['exceeding']):,} of them some robot had all N − 1 = {most} teammates as neighbours; "
        f"they support a risk of {rounded_up(row['high']):g} for δ = {most - 1}."
    )


def _cure(report: DeltaEstimate) -> str:
    needed = report.trials_needed
    if report.recorded is None:
        return f"Simulate at least {needed:,} runs, {needed - report.trials:,} more."
    columns = report.maxima[["max_neighbours", "mean_neighbours"]]
    if report.independent == 1 and report.trials > 1 and (columns.nunique() == 1).all():
        return f"All {report.trial}s are the same: record while the robots move."
    factor = needed / report.independent
    more = math.ceil(report.trials * (factor - 1))
    text = (
        f"At this rate the record must be {factor:.3g} times as long, {report.recorded * factor:.4g} instead of "
        f"{report.recorded:.4g}: {more:,} more {report.trial}s"
    )
    if report.shorter is None:
        return f"{text}; no shorter window gives enough independent ones."
    return f"{text}. For windows of at most {report.shorter:g} this record is long enough."


def rounded_up(value: float) -> float:
    """Return a positive number rounded up to three digits."""
    unit = 10.0 ** (math.floor(math.log10(value)) - 2)
    return float(f"{math.ceil(value / unit * (1 - 1e-12)) * unit:.3g}")
