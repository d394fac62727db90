"""Verdicts on claims as a table and in a sentence."""

from __future__ import annotations

from collections.abc import Sequence

from teamsight.analysis.plot import markdown
from teamsight.analysis.stats.verdicts import FAILS, HOLDS, UNDECIDED, Verdict


def verdict_table(found: Sequence[Verdict], measured: str = "measured") -> str:
    """Return a table of Markdown with a row for each claim.

    Parameters
    ----------
    found : sequence of Verdict
        The verdicts.
    measured : str
        Title of the column of what was measured.
    """
    return markdown.table(["claim", "source", measured, "verdict"], [list(one) for one in found])


def counts(found: Sequence[Verdict]) -> str:
    """Return in one sentence how many claims hold, do not hold, and are undecided."""
    held, failed, left = (sum(one.verdict == name for one in found) for name in (HOLDS, FAILS, UNDECIDED))
    return f"Of {len(found)} claims {held} hold, {failed} do not hold, {left} are undecided."
