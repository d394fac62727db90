"""Measuring: CPU time, interleaved, and the rows of the table that comes out."""

from __future__ import annotations

import statistics
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass


@dataclass(frozen=True)
class Row:
    """One line of the table.

    Attributes
    ----------
    name, unit : str
        What was measured, and in what.
    value : float
        The median over the rounds.
    spread : tuple of float
        The least and the greatest of the rounds.
    least, most : float, optional
        The goal: the value is to be at least or at most this. None of both: for information.
    aim : float, optional
        What to hope for beyond the goal.
    """

    name: str
    unit: str
    value: float
    spread: tuple[float, float] | None = None
    least: float | None = None
    most: float | None = None
    aim: float | None = None

    @property
    def is_met(self) -> bool | None:
        """Whether the goal is met; None where there is none."""
        if self.least is None and self.most is None:
            return None
        return (self.least is None or self.value >= self.least) and (self.most is None or self.value <= self.most)

    @property
    def goal(self) -> str:
        """The goal in words."""
        words = [f"≥ {self.least:g}"] if self.least is not None else []
        words += [f"≤ {self.most:g}"] if self.most is not None else []
        return ", ".join(words) + (f" (aim {self.aim:g})" if self.aim is not None else "")


def cpu_seconds(action: Callable[[], object]) -> float:
    """Return the CPU time of this process that an action takes."""
    begin = time.process_time()
    action()
    return time.process_time() - begin


def interleave(contenders: dict[str, Callable[[], float]], rounds: int) -> dict[str, list[float]]:
    """Measure all contenders in turn, round after round, so that what disturbs the machine disturbs them alike.

    Parameters
    ----------
    contenders : dict
        For each name what does a piece of its work and returns the CPU time of one unit of it.
    rounds : int
        How often.
    """
    taken: dict[str, list[float]] = {name: [] for name in contenders}
    for _ in range(rounds):
        for name, work in contenders.items():
            taken[name].append(work())
    return taken


def ratio(name: str, above: Sequence[float], below: Sequence[float], **goal: float) -> Row:
    """Return the median of the ratios of each round."""
    ratios = [a / b for a, b in zip(above, below, strict=True)]
    return Row(name, "times", statistics.median(ratios), (min(ratios), max(ratios)), **goal)


def median(name: str, unit: str, values: Sequence[float], **goal: float) -> Row:
    """Return the median of the rounds."""
    return Row(name, unit, statistics.median(values), (min(values), max(values)), **goal)
