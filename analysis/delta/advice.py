"""The answer of a report: the δ that the trials support, and what would be sufficient if they are too few."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from teamsight.analysis.delta.estimate import DeltaEstimate


# Fewer independent trials than this say nothing about how much trials differ.
_SEVERAL = 2.0


def trials_phrase(report: DeltaEstimate) -> str:
    """Return the number of trials, and the number of independent ones if there are fewer of these."""
    text = f"{report.trials:,} {report.trial}{'s' * (report.trials != 1)}"
    if report.trial == "run":
        return text
    return f"{text} (equivalent to {report.independent:.1f} independent ones)"


def trial_phrase(report: DeltaEstimate) -> str:
    """Return a description of one trial."""
    if report.source == "simulation":
        return f"a run of {report.length:g} steps"
    if report.trial == "window":
        return f"a window of {report.length:g}"
    return f"a whole {report.trial} (of about {report.length:g})"


def answer(report: DeltaEstimate) -> str:
    """Return the one δ that the trials support, and its risk."""
    trial, share = f"A trial is {trial_phrase(report)}.", f"{100 * report.risk:g} %"
    if report.independent < _SEVERAL:
        what = "simulation" if report.recorded is None else "record"
        return (
            f"This {what} is one observation, {trials_phrase(report)}: its largest number of neighbours is "
            f"{report.largest}, which says little about others."
        )
    if report.cautions:
        return (
            f"δ = {report.delta} (point estimate), if the record is right: exceeded in at most {share} of the trials. "
            f"{trial}"
        )
    sure = f"with {report.confidence:.0%} confidence"
    if not report.supported:
        return f"{_supported(report, sure)} {trial}"
    lower = f" The point estimate is δ = {report.delta}." * (report.delta != report.delta_safe)
    return f"δ = {report.delta_safe} {sure}: exceeded in at most {share} of the trials. {trial}{lower}"


def _supported(report: DeltaEstimate, sure: str) -> str:
    """Return the δ that too few trials support, with its risk: the largest number found, or one less than N − 1."""
    most, delta = report.robots - 1, report.supported_delta
    if most < 1:
        return "A single robot has no neighbours: δ = 0 cannot be exceeded."
    of_these = f"the smallest that so few {report.trial}s support {sure}"
    if delta < most:
        outside = f" Outside of them {report.largest} was found." * (report.largest > delta)
        return f"δ = {delta} for a risk of {rounded_up(report.supported_risk):g}, {of_these}.{outside}"
    row = report.exceedance.iloc[most - 1]
    met = f"in {int(row['exceeding']):,} of them some robot had all N − 1 = {most} teammates as neighbours"
    if report.delta_low == most:
        return f"δ = {most}, which cannot be exceeded: {met}, which is too often for δ = {most - 1}."
    return f"δ = {most - 1} for a risk of {rounded_up(row['high']):g}, {of_these}: {met}."


def advice(report: DeltaEstimate) -> list[str]:
    """Return how many trials the stated risk needs."""
    if report.delta_low == report.robots - 1 > 0:
        return []
    what = "runs" if report.trial == "run" else f"independent {report.trial}s"
    return [
        f"These {trials_phrase(report)} cannot support a risk of {report.risk:g} with {report.confidence:.0%} "
        f"confidence: it needs {report.trials_needed:,} {what}, none of which exceeds δ.",
        _cure(report),
    ]


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
