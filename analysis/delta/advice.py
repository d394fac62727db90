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


def supported_bound(report: DeltaEstimate) -> str:
    """Return the largest number of neighbours in too few trials, and which risk they support; "" if it is N − 1."""
    delta, what = report.supported_delta, "runs" if report.trial == "run" else f"independent {report.trial}s"
    if delta >= report.robots - 1:
        return ""
    return (
        f"δ = {delta} for a risk of {rounded_up(report.supported_risk):g}, the smallest that so few {report.trial}s "
        f"support with {report.confidence:.0%} confidence; a risk of {report.risk:g} needs {report.trials_needed:,} "
        f"{what}."
    )


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
    if delta < most:
        outside = f"; outside of them {report.largest} was found" * (report.largest > delta)
        return (
            f"None of them exceeds δ = {delta}{outside}. Only δ = N − 1 = {most} cannot be exceeded."
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
        return _cure_of_equal_trials(report)
    factor = needed / report.independent
    more = math.ceil(report.trials * (factor - 1))
    frames = "" if report.frame is None else f", about {report.recorded * (factor - 1) / report.frame:,.0f} more frames"
    text = (
        f"At this rate the record must be {factor:.3g} times as long, {report.recorded * factor:.4g} instead of "
        f"{report.recorded:.4g}: {more:,} more {report.trial}s{frames}"
    )
    if report.shorter is None:
        return f"{text}; no shorter window gives enough independent ones."
    return f"{text}. For windows of at most {report.shorter:g} this record is long enough."


def _cure_of_equal_trials(report: DeltaEstimate) -> str:
    same = f"All {report.trial}s are the same"
    if not report.is_moving:
        return f"{same}: record while the robots move."
    return (
        f"{same}, so nothing shows that they are independent, and they count as one: record runs that start afresh, "
        "and mark them by a column run."
    )


def rounded_up(value: float) -> float:
    """Return a positive number rounded up to three digits."""
    unit = 10.0 ** (math.floor(math.log10(value)) - 2)
    return float(f"{math.ceil(value / unit * (1 - 1e-12)) * unit:.3g}")
