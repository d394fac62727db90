"""The objective of a task: a metric, and whether more of it is better."""

from __future__ import annotations

import math
from typing import Literal, NamedTuple

from teamsight.core import checks

#: Whether more or less of a metric is better.
Better = Literal["more", "less"]


class Objective(NamedTuple):
    """What a team is to achieve.

    Attributes
    ----------
    metric : str
        The name of a metric of the task.
    better : "more" or "less"
        Whether more or less of it is better.

    Notes
    -----
    A duration, of which less is better, is infinite if what was to happen did not happen during the run. Analyses then
    count the length of the run (a *censored* run), so that its mean is the restricted mean duration, and give the share
    of such runs.
    """

    metric: str
    better: Better = "more"

    @property
    def sign(self) -> float:
        """1 if more is better, −1 if less is."""
        return 1.0 if self.better == "more" else -1.0

    def counted(self, value: float, steps: int) -> float:
        """Return the value that enters means: that of a censored run of this length is `steps`."""
        return float(steps) if self.is_censored(value) else value

    def is_censored(self, value: float) -> bool:
        """Return whether what was to happen did not happen during the run."""
        return self.better == "less" and value == math.inf

    def checked(self, name: str, value: object) -> float:
        """Return what a metric returned as a float.

        Raises
        ------
        TypeError
            If it is no number.
        ValueError
            If it is NaN, or infinite without being a duration.
        """
        what = f"the metric {name!r} of the task returned {checks.shown(value)}"
        try:
            found = checks.number(name, value) if value != math.inf else math.inf
        except (TypeError, ValueError):
            cure = "return a finite number, or math.inf for a duration that did not end during the run"
            raise type(_error(value))(f"{what}: is no number; {cure}") from None
        if found == math.inf and name == self.metric and self.better == "more":
            raise ValueError(f"{what}: more of it is better, so it must be finite; return a finite number")
        return found


def _error(value: object) -> Exception:
    """Return an error of the kind that fits what is no finite number."""
    return ValueError() if isinstance(value, float) else TypeError()
