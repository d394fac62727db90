"""The interface of claims, and the statistics that their rules share."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial
from typing import NamedTuple, TypeAlias

import numpy as np
import pandas as pd

#: One row a run, by name of the experiment.
Tables: TypeAlias = Mapping[str, pd.DataFrame]

#: The arena radii between which the paper finds that awareness matters.
PREFERRED = (2.0, 6.0)
#: Largest violation [standard errors] allowed in the worst cell, or pair of neighbouring cells, of a surface. With 3,
#: noise alone would usually violate one of the 500 pairs of a flat surface; see docs/claims.md.
CHANCE = 4.5
# Distances are finite, and those of claims that differ are above 1.
_LARGE, _LEAST = 1e9, 1e-6


class Verdict(NamedTuple):
    """The result of applying a claim's rule.

    Attributes
    ----------
    holds : bool or None
        Whether the claim holds; None if it is not decidable.
    measured : str
        What was measured, in words: the key number, and what belongs to it after a semicolon.
    distance : float
        Distance of the measurement from the paper's figure, in tolerances of the rule; up to 1 the claim holds.
    beside : tuple of str
        What is reported beside it and decides nothing.
    is_trivial : bool
        Whether a random walk holds under the same rule.
    share : float or None
        Share of further root seeds under which the claim holds, if it is near its limit.
    """

    holds: bool | None
    measured: str
    distance: float
    beside: tuple[str, ...] = ()
    is_trivial: bool = False
    share: float | None = None

    @property
    def key(self) -> str:
        """The key number of what was measured."""
        return self.measured.partition(";")[0]


#: What was measured, in words, and its distance from each part of a rule, in tolerances.
Finding: TypeAlias = tuple[str, *tuple[float, ...]]
#: Takes the table of each experiment that a claim reads, and returns what it finds there.
Decide: TypeAlias = Callable[..., Finding]


class Remark(NamedTuple):
    """A further measurement, which decides nothing.

    Attributes
    ----------
    needs : tuple of str
        Names of the experiments that it reads.
    say : callable
        Takes their tables in this order and returns what was measured, in words.
    """

    needs: tuple[str, ...]
    say: Callable[..., str]


@dataclass(frozen=True)
class Claim:
    """A statement of the paper that simulation can check.

    Parameters
    ----------
    where : str
        Section and figure of the paper.
    statement : str
        The claim in words.
    figure : str
        The number that the paper gives, or its word where it gives none.
    rule : str
        The statistic and the tolerance by which `decide` decides. Empty if nothing that is measured could contradict
        the claim: it is not decidable.
    needs : tuple of str
        Names of the experiments that `decide` reads.
    decide : callable
        Takes the tables of these experiments in this order. Returns what was measured, in words, and for each part of
        the rule the distance in tolerances; up to 1 the part holds. Without a rule there is no distance.
    trivial : tuple of str
        Names of experiments to which the rule is applied as well, in the order of `needs`, with a random walk in the
        place of the policy. A rule that holds there says little. Empty where a random walk is not comparable.
    remark : Remark, optional
        What is measured beside.
    by_construction : bool
        Whether it holds because the code does what the claim says, whatever is simulated.
    tuned : tuple of str
        Options of policies whose values the preset has because the claim holds with them.
    """

    where: str
    statement: str
    figure: str
    rule: str
    needs: tuple[str, ...]
    decide: Decide
    trivial: tuple[str, ...] = ()
    remark: Remark | None = None
    by_construction: bool = False
    tuned: tuple[str, ...] = ()

    def reads(self, *, beside: bool) -> set[str]:
        """Return the names of the experiments that decide, and of those that are reported beside."""
        further = (*self.trivial, *(self.remark.needs if self.remark else ())) if beside else ()
        return {*self.needs, *further}

    def judge(self, tables: Tables, *, beside: bool = False) -> Verdict:
        """Return the verdict on tables by name of the experiment. All parts of the rule must hold.

        Parameters
        ----------
        tables : mapping of str to DataFrame
            One row a run.
        beside : bool
            Also report what a random walk gives under the same rule, and the remark.
        """
        holds, measured, distance = self._apply(tables, self.needs)
        found, is_trivial = [], False
        if beside and self.remark:
            found.append(self.remark.say(*(tables[name] for name in self.remark.needs)))
        if beside and self.trivial:
            as_well, walked, _ = self._apply(tables, self.trivial)
            is_trivial = bool(as_well)
            found.append(f"a random walk {'holds' if as_well else 'differs'}: {walked}")
        return Verdict(holds, measured, distance, tuple(found), is_trivial)

    def is_near(self, tables: Tables, runs: int) -> bool:
        """Return whether the claim is near its limit: the verdict is another if one run of each cell is left out.

        Parameters
        ----------
        tables : mapping of str to DataFrame
            One row a run.
        runs : int
            Runs of each cell. Of an experiment with more of them, the same share is left out. Of fewer than three, one
            is too large a part: no claim is near its limit then.
        """
        if runs < 3 or not (self.rule and self.needs):
            return False
        holds, *_ = self._apply(tables, self.needs)
        fewer = (
            {name: tables[name][tables[name]["replicate"] % runs != left_out] for name in self.needs}
            for left_out in range(runs)
        )
        return any(self._apply(one, self.needs)[0] != holds for one in fewer)

    def _apply(self, tables: Tables, names: tuple[str, ...]) -> tuple[bool | None, str, float]:
        measured, *distances = self.decide(*(tables[name] for name in names))
        worst = max(distances, default=0.0)
        return worst <= 1.0 if self.rule else None, measured, min(worst, _LARGE)


def claim(
    *,
    where: str,
    statement: str,
    figure: str,
    rule: str,
    needs: tuple[str, ...] = (),
    trivial: tuple[str, ...] = (),
    remark: Remark | None = None,
    by_construction: bool = False,
    tuned: tuple[str, ...] = (),
) -> Callable[[Decide], Claim]:
    """Return a decorator that turns the function which decides on a claim into the `Claim`."""
    return partial(
        Claim, where, statement, figure, rule, needs, trivial=trivial, remark=remark, by_construction=by_construction,
        tuned=tuned,
    )  # fmt: skip


def within(value: float, target: float, tolerance: float) -> float:
    """Return the distance of `value` from `target`, in tolerances."""
    return abs(value - target) / tolerance


def at_most(value: float, limit: float) -> float:
    """Return value / limit, at least 0, when `value` is at most `limit`, else 1 plus the relative excess."""
    return max(0.0, value / limit) if value <= limit else 1.0 + max(_LEAST, (value - limit) / limit)


def at_least(value: float, limit: float) -> float:
    """Return 0 when `value` is at least `limit`, else 1 plus the relative shortfall."""
    return 0.0 if value >= limit else 1.0 + max(_LEAST, (limit - value) / max(abs(limit), 1.0))


def above(value: float, limit: float) -> float:
    """Return 0 when `value` is above `limit`, else 1 plus the relative shortfall."""
    return 0.0 if value > limit else 1.0 + max(_LEAST, (limit - value) / max(abs(limit), 1.0))


def pooled(se: pd.DataFrame) -> pd.DataFrame:
    """Return the standard error of each cell, pooled with those of the cells around it.

    The standard error of five runs is uncertain: in some of 270 cells it is far too small. Pooled over 3 × 3 cells it
    has 36 degrees of freedom. With a single run the spread is unknown, and the standard error infinite.
    """
    variance = se.to_numpy() ** 2
    padded = np.pad(variance, 1, constant_values=np.nan)
    rows, columns = variance.shape
    near = [padded[down : down + rows, right : right + columns] for down in range(3) for right in range(3)]
    known = np.isfinite(near)
    total = np.where(known, near, 0.0).sum(axis=0)
    with np.errstate(divide="ignore", invalid="ignore"):
        mean = np.where(known.any(axis=0), total / known.sum(axis=0), np.inf)
    return pd.DataFrame(np.sqrt(mean), index=se.index, columns=se.columns)


class Peak(NamedTuple):
    """The largest value of a grid, and its cell."""

    value: float
    robots: int
    radius: float

    @property
    def cell(self) -> str:
        """The cell in words."""
        return f"N = {self.robots}, R = {self.radius:g}"


def peak(grid: pd.DataFrame) -> Peak:
    """Return the largest value of `grid`; the first of equals, by team size and then by radius."""
    values = grid.to_numpy(dtype=float)
    row, column = divmod(int(np.argmax(values)), values.shape[1])
    return Peak(float(values[row, column]), int(np.asarray(grid.index)[row]), float(np.asarray(grid.columns)[column]))


def average(grid: pd.DataFrame) -> float:
    """Return the mean over all cells."""
    return float(grid.to_numpy(dtype=float).mean())


def part(grid: pd.DataFrame, robots: tuple[int, int] = (1, 30), radius: tuple[float, float] = (1, 9)) -> pd.DataFrame:
    """Return the cells within the limits, by default those of the paper's grid, both ends included.

    Raises
    ------
    ValueError
        If the grid has no such cell: the rule cannot be applied.
    """
    found = grid.loc[grid.index.to_series().between(*robots), grid.columns.to_series().between(*radius)]
    if found.empty:
        raise ValueError(f"no cell with {robots[0]}..{robots[1]} robots and radius {radius[0]:g}..{radius[1]:g}")
    return found
