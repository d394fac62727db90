"""δ, and the gain of awareness, against the number of hops: the tables and the figure of docs/hops.md.

The runs are those of ``examples/hops.toml``; ``python examples/hops.py`` makes them. ``python -m
teamsight.analysis.papers.hops docs/hops.parquet docs/ceilings.parquet`` prints the table of ceilings.
"""

from __future__ import annotations

import sys
from typing import TYPE_CHECKING, Any

import numpy as np

from teamsight.analysis.ceilings import CEILING, share_text, standings
from teamsight.analysis.plot import markdown
from teamsight.analysis.plot.kinds import draw_means, panels
from teamsight.analysis.plot.style import COLOURS, FAINT, INK, minus
from teamsight.analysis.stats.paired import Interval, interval_of
from teamsight.analysis.stats.verdicts import plus_minus

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.figure import Figure

#: Teams whose score is the share of observed targets [%]; that of others is the steps until all is done.
OBSERVE = ("a-cmommt", "b-cmommt", "centroid")
#: Robots, targets and radius of the teams that observe.
CELL = (20, 15, 5.0)
#: Teams that read nothing of teammates, whose gains must be 0.
CONTROLS = ("centroid", "forage, ignoring")
#: The kinds of reports by number of hops, from 0 on; others have all hops too.
HOPS = ("0", "1", "2", "4", "all")
#: Gains of teams that read of teammates: 4 teams, 2 ranges and 6 kinds of reports. A gain counts if its interval at
#: this level, which holds for all at once (Bonferroni), excludes 0. The 24 of the two teams with a short sight, which
#: were decided upon later, are judged at the same level.
COMPARISONS = 48
LEVEL = 1 - 0.05 / COMPARISONS
#: The risk of δ: the share of runs in which some robot knows more teammates at once.
RISK = 0.05
# The ceiling of all that radio can bring.
_REACHABLE = "sharing"


def points(runs: pd.DataFrame) -> pd.DataFrame:
    """Return what was found, a row for each team, number of neighbours and kind of reports.

    Parameters
    ----------
    runs : DataFrame
        The runs of the study: team, neighbours, reports, replicate, score, has_ended, delta, known.

    Returns
    -------
    DataFrame
        team, neighbours, reports; score (mean); gain, low, high (over "0" hops, paired, positive where it is better,
        95 % interval); counts (see `LEVEL`); more, more_low, more_high (the same over "1" hop); delta (for `RISK`),
        largest (of all runs), known (mean number of teammates in a percept), ended (share of runs), runs.
    """
    import pandas as pd

    found = []
    for (team, neighbours), part in runs.groupby(["team", "neighbours"], sort=False):
        wide = part.pivot(index="replicate", columns="reports", values="score").sort_index()
        sign = 1.0 if team in OBSERVE else -1.0
        for reports, rows in part.groupby("reports", sort=False):
            gain, more = (sign * (wide[reports] - wide[base]).to_numpy(float) for base in HOPS[:2])
            wide_one = interval_of(gain, LEVEL)
            values = {"team": team, "neighbours": neighbours, "reports": reports, "score": rows["score"].mean()}
            values |= dict(zip(("gain", "low", "high"), interval_of(gain), strict=True))
            values |= {"counts": wide_one.low > 0 or wide_one.high < 0}
            values |= dict(zip(("more", "more_low", "more_high"), interval_of(more), strict=True))
            values |= {"delta": int(np.quantile(rows["delta"], 1 - RISK, method="inverted_cdf"))}
            values |= {"largest": int(rows["delta"].max()), "known": rows["known"].mean()}
            found.append(values | {"ended": rows["has_ended"].mean(), "runs": len(rows)})
    return pd.DataFrame(found)


def tables(found: pd.DataFrame) -> dict[str, str]:
    """Return the Markdown tables of the page by what they show: "gain", "δ" and "known"."""
    kinds = [*dict.fromkeys(found["reports"])]
    written: dict[str, Any] = {
        "gain": lambda row: _gain(row) if row["reports"] != HOPS[0] else f"{row['score']:.1f}",
        "δ": lambda row: str(row["delta"]),
        "known": lambda row: f"{row['known']:.1f}",
    }
    shown = {}
    for name, write in written.items():
        titles = ["team", "neighbours", *kinds, *(["all − 1"] * (name == "gain"))]
        rows = []
        for (team, neighbours), part in found.groupby(["team", "neighbours"], sort=False):
            by = {row["reports"]: row for row in part.to_dict("records")}
            cells = [write(by[kind]) for kind in kinds]
            if name == "gain":
                cells.append(minus(plus_minus(by["all"]["more"], by["all"]["more_high"], "+.1f", ".1f")))
            rows.append([str(team), f"{neighbours:g}", *cells])
        shown[name] = markdown.table(titles, rows, align="l" + "r" * (len(titles) - 1))
    return shown


def _gain(row: Any) -> str:
    star = "\\*" if row["counts"] else ""
    return minus(plus_minus(row["gain"], row["high"], "+.1f", ".1f")) + star


def ceilings(possible: pd.DataFrame) -> dict[str, Interval]:
    """Return what teams that know more than robots observe in the cell of `CELL` [%], from the table of ceilings."""
    robots, targets, radius = CELL
    cell = possible[(possible[["robots", "targets", "radius"]] == [robots, targets, radius]).all(axis=1)]
    return {one.team: one.observed for one in standings(cell) if one.team in (_REACHABLE, CEILING, "teleport")}


def ceiling_table(found: pd.DataFrame, possible: pd.DataFrame) -> str:
    """Return the ceilings beside the share of the way to them that reports over all hops go, as Markdown.

    Worlds are others than those of the ceilings. So the ends of an interval of the share combine those of the gain with
    those of the ceiling.
    """
    teams = [team for team in OBSERVE if team not in CONTROLS]
    every = found[found["team"].isin(teams) & (found["reports"] == HOPS[-1])].to_dict("records")
    none = found[found["reports"] == HOPS[0]].set_index(["team", "neighbours"])["score"]
    rows = []
    for name, ceiling in ceilings(possible).items():
        cells = [f"`{name}`", f"{ceiling.mean:.1f} ({ceiling.low:.1f} to {ceiling.high:.1f})"]
        for row in every:
            ways = [end - none[row["team"], row["neighbours"]] for end in (ceiling.mean, ceiling.high, ceiling.low)]
            shares = [row[end] / way for end, way in zip(("gain", "low", "high"), ways, strict=True)]
            cells.append(share_text(Interval(*shares)))
        rows.append(cells)
    heads = [f"{row['team']}, {row['neighbours']:g}" for row in every]
    return markdown.table(["team", "observed [%]", *heads], rows, align="l" + "r" * (1 + len(heads)))


def draw(found: pd.DataFrame, possible: pd.DataFrame) -> Figure:
    """Return the figure: for each team that reads of teammates the gain, and δ, against the hops, and the ceilings."""
    teams = [team for team in dict.fromkeys(found["team"]) if team not in CONTROLS]
    kinds = [*dict.fromkeys(found["reports"])]
    read = found[found["team"].isin(teams)]
    one, most = (read[read["reports"] == hops] for hops in (HOPS[1], HOPS[-1]))
    units = ["points" if team in OBSERVE else "steps saved" for team in teams]
    (late, lossy), reachable = kinds[len(HOPS) :], ceilings(possible)[_REACHABLE].mean
    figure, shown = panels(
        f"From one hop to all, δ grows from {_range(one['delta'])} to {_range(most['delta'])}; hops beyond the first "
        f"pay in {(most['more_low'] > 0).sum()} of {len(most)} cases",
        f"{int(found['runs'].min())} runs each; gain over no awareness, paired, with 95 % intervals; δ for a risk of "
        f"{RISK:g}. Colours: neighbours of a robot in a random placement. Late: {late}; lossy: {lossy}. Dash-dotted: "
        "if all that some robot senses were shared",
        [*teams, *("" for _ in teams)], y=[*(f"gain  [{unit}]" for unit in units), *("δ" for _ in teams)],
        x="hops", columns=len(teams), size=(2.5, 2.4), sharex="col",
    )  # fmt: skip
    for column, team in enumerate(teams):
        above, below = shown[column], shown[len(teams) + column]
        above.axhline(0.0, color=FAINT, linewidth=1.0)
        if team in OBSERVE:
            none = found[(found["team"] == team) & (found["reports"] == HOPS[0])]["score"].mean()
            above.axhline(reachable - none, color=INK, linestyle="-.", linewidth=1.0)
        for number, (neighbours, part) in enumerate(found[found["team"] == team].groupby("neighbours", sort=False)):
            rows, colour = part.set_index("reports").loc[kinds].reset_index(), COLOURS[1 + number]
            at = np.arange(len(kinds)) + 0.12 * (number - 0.5)
            gains = [Interval(row["gain"], row["low"], row["high"]) for row in rows.to_dict("records")]
            for places, line in ((slice(0, len(HOPS)), "-"), (slice(len(HOPS), None), "")):
                label = f"{neighbours:g}" if line else ""
                draw_means(above, at[places], gains[places], colour, label, as_bars=True, linestyle=line)
                below.plot(at[places], rows["delta"][places], color=colour, marker="o", markersize=4, linestyle=line)
        below.set_xticks(range(len(kinds)), [*HOPS, "late", "lossy"], fontsize=8)
        below.set_ylim(0, 20)
        below.set_yticks(range(0, 21, 5))
    shown[0].legend(frameon=False, title="neighbours")
    return figure


def _range(values: pd.Series) -> str:
    return f"{values.min()}–{values.max()}"


if __name__ == "__main__":
    import pandas as pd

    print(ceiling_table(*map(pd.read_parquet, sys.argv[1:])))
