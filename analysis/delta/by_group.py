"""δ of each group and of each team: what their robots have met in every run, and the table that follows."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, NamedTuple

import pandas as pd

from teamsight.agents.teammates import of_team
from teamsight.analysis.stats import exceedance

if TYPE_CHECKING:
    from teamsight.agents.world import World


class GroupDegrees(NamedTuple):
    """What a group has met in one run.

    Attributes
    ----------
    group, team : str
        Names of the group and of its team.
    robots : int
        Largest number of robots in the team, at the times when they were counted.
    max_neighbours : int
        Largest number of neighbours of any robot of the group.
    """

    group: str
    team: str
    robots: int
    max_neighbours: int = 0


def note_sizes(sizes: dict[str, GroupDegrees], world: World, team: str | None) -> None:
    """Add the present groups of a team, or of all, and raise the sizes of teams that have grown."""
    groups = of_team(world.groups, team)
    members = dict[str, int]()
    for group in groups:
        members[str(group.team)] = members.get(str(group.team), 0) + len(group)
    for group in groups:
        robots = max(members[str(group.team)], sizes[group.name].robots if group.name in sizes else 0)
        sizes[group.name] = GroupDegrees(group.name, str(group.team), robots)


def with_maxima(
    sizes: Mapping[str, GroupDegrees], maxima: Mapping[tuple[str, str], int], team: str | None
) -> tuple[GroupDegrees, ...]:
    """Return the groups of a team, or of all, with their largest numbers of neighbours."""
    # A group that has come and left between two counts is in the maxima only.
    found = {name: GroupDegrees(name, of, 0) for name, of in maxima if team in (None, of)} | dict(sizes)
    return tuple(one._replace(max_neighbours=maxima.get((name, one.team), 0)) for name, one in found.items())


def group_maxima(found: Iterable[Sequence[GroupDegrees]], seeds: Sequence[int]) -> pd.DataFrame | None:
    """Return one row for each run and group: run, seed, group, team, robots, max_neighbours; None for a single group.

    Parameters
    ----------
    found : iterable of sequence of GroupDegrees
        The groups of each run. A group that is not in all runs has no neighbours in the others.
    seeds : sequence of int
        Seed of each run.
    """
    rows = [
        (run, seed, one.group, one.team, max(one.robots, one.max_neighbours + 1), one.max_neighbours)
        for run, (seed, groups) in enumerate(zip(seeds, found, strict=True))
        for one in groups
    ]
    table = pd.DataFrame(rows, columns=["run", "seed", "group", "team", "robots", "max_neighbours"])
    return table if table["group"].nunique() > 1 else None


def group_table(maxima: pd.DataFrame, trials: int, risk: float, confidence: float) -> pd.DataFrame:
    """Return δ of each group, and of each team if there are several.

    Parameters
    ----------
    maxima : DataFrame
        From `group_maxima`.
    trials : int
        Number of runs.
    risk, confidence : float
        See `choose_delta`. The risk is that of any robot of the group, or of the team, during a run.

    Returns
    -------
    DataFrame
        One row each: kind ("group" or "team"), name, team, robots (N of the team), largest, delta, probability (of
        exceeding it), low, high (its bounds), delta_safe.
    """
    kinds = ["group"] + ["team"] * (maxima["team"].nunique() > 1)
    return pd.DataFrame([row for kind in kinds for row in _rows(maxima, kind, trials, risk, confidence)])


def _rows(
    maxima: pd.DataFrame, kind: str, trials: int, risk: float, confidence: float
) -> Iterable[dict[str, str | int | float]]:
    for name, rows in maxima.groupby(kind, sort=False):
        largest = rows.groupby("run")["max_neighbours"].max().reindex(range(trials), fill_value=0)
        curve = exceedance.curve(largest, int(rows["robots"].max()), confidence=confidence)
        delta = exceedance.smallest_delta(curve, "probability", risk)
        chosen = curve.iloc[delta]
        yield {
            "kind": kind,
            "name": str(name),
            "team": str(rows["team"].iloc[0]),
            "robots": int(rows["robots"].max()),
            "largest": int(largest.max()),
            "delta": delta,
            "probability": float(chosen["probability"]),
            "low": float(chosen["low"]),
            "high": float(chosen["high"]),
            "delta_safe": exceedance.smallest_delta(curve, "high", risk),
        }
