"""Verdicts in words."""

from __future__ import annotations

import math

from teamsight.analysis.stats.paired import Interval
from teamsight.analysis.stats.verdicts import UNDECIDED, above, interval_text


def test_an_interval_is_shown_with_its_signs() -> None:
    assert interval_text(Interval(1.0, -0.5, 2.5), "steps") == "+1.0 steps (−0.5 to +2.5)"
    # That of a single value says nothing.
    assert interval_text(Interval(1.0, -math.inf, math.inf), "%") == "+1.0 %"


def test_what_is_not_known_is_said_and_decides_nothing() -> None:
    unknown = Interval(math.nan, -math.inf, math.inf)
    assert interval_text(unknown, "steps") == "not known"
    assert above(unknown) == UNDECIDED
